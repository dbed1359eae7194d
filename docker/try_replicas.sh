#!/bin/bash
# Starts the services of compose.replicas.yaml on loopback from Debian's packages, without a
# container engine: three replicas, NATS, haproxy, Prometheus with its dashboard, and a replay.
# Checks that each replica and the dashboard show the stream, and that a drain of one replica keeps
# it visible; then stops everything. With --stay it prints all addresses and runs until Ctrl-C. Uses
# the programs in PATH or in the folder PARTIEMC_BIN.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
  echo "try_replicas.sh: $*" >&2
  tail -n 3 "$work"/*.log >&2 2>/dev/null || true
  exit 1
}
docker/install.sh replicas
readonly bin=${PARTIEMC_BIN:-$(dirname "$(command -v partiemc-server || echo build/release/bin/none)")}
readonly server=$bin/partiemc-server client=$bin/partiemc
work=$(mktemp -d)
readonly work
[[ -x $server && -x $client ]] || fail "no programs in $bin: build them, or name their folder by PARTIEMC_BIN"

pids=()
cleanup() {
  ((${#pids[@]} == 0)) || kill "${pids[@]}" 2>/dev/null || true
  wait
  rm -rf "$work"
}
trap cleanup EXIT
start() {
  local name=$1
  shift
  "$@" >"$work/$name.log" 2>&1 &
  pids+=($!)
}
# until_true SECONDS WHAT COMMAND...
until_true() {
  local seconds=$1 what=$2 attempt
  shift 2
  for ((attempt = 0; attempt < 10 * seconds; ++attempt)); do
    "$@" >/dev/null 2>&1 && return
    sleep 0.1
  done
  fail "$what"
}
free_port() {
  /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}
is_file() { [[ -s $1 ]]; }

nats=$(free_port) proxy=$(free_port) prometheus=$(free_port)
PATH=$PATH:/usr/sbin
start nats nats-server -a 127.0.0.1 -p "$nats"

# The configuration files, with these ports in place of names.
cp docker/replicas/haproxy.cfg docker/replicas/prometheus.yml "$work"
sed -i "s/bind :50051/bind 127.0.0.1:$proxy/" "$work/haproxy.cfg"
addresses=()
for k in 1 2 3; do
  metrics=$(free_port)
  web=$(free_port)
  start "server-$k" "$server" --address 127.0.0.1:0 --port-file "$work/address-$k" \
    --metrics "127.0.0.1:$metrics" --web "127.0.0.1:$web" --web-root "$work" \
    --nats "nats://127.0.0.1:$nats" --drain-delay 1
  until_true 10 "replica $k does not come up" is_file "$work/address-$k"
  addresses+=("$(<"$work/address-$k")")
  sed -i "s/server-$k:50051\(.*\) port 8080/${addresses[-1]}\1 port $web/" "$work/haproxy.cfg"
  sed -i "s/server-$k:9464/127.0.0.1:$metrics/" "$work/prometheus.yml"
done
first_server=${pids[1]}
start haproxy haproxy -db -f "$work/haproxy.cfg"
start prometheus prometheus --config.file="$work/prometheus.yml" --storage.tsdb.path="$work/tsdb" \
  --web.listen-address="127.0.0.1:$prometheus" --web.console.templates="$PWD/docker/replicas/consoles"
until_true 10 "nobody answers at the proxy" "$client" info --server "127.0.0.1:$proxy"
start replay "$client" replay client/recordings/dam_break.pemc --server "127.0.0.1:$proxy" \
  --name dam-break --rate 30 --loop --quiet

watch() { "$client" watch dam-break --server "$1" --mode every --frames 15 --quiet; }
for address in "${addresses[@]}"; do
  until_true 10 "the replica at $address shows no stream" watch "$address"
  echo "the replica at $address shows the stream"
done
dashboard=http://127.0.0.1:$prometheus/consoles/partiemc.html
has_all() { (($(curl -fsS "$dashboard" | grep -c '>connected<') == 3)); }
until_true 20 "the dashboard lacks a replica" has_all
shows_frames() { curl -fsS "http://127.0.0.1:$prometheus/api/v1/query" \
  --data-urlencode 'query=sum(partiemc_frames_total) > 30' | grep -q '"value"'; }
until_true 20 "Prometheus counts no frames" shows_frames
echo "the dashboard has three replicas and counts their frames"

if [[ ${1:-} == --stay ]]; then
  echo "replicas: ${addresses[*]}; all of them: 127.0.0.1:$proxy; dashboard: $dashboard; Ctrl-C ends it"
  wait
fi

"$client" watch dam-break --server "${addresses[2]},127.0.0.1:$proxy" --frames 150 --quiet &
watcher=$!
kill -TERM "$first_server"
code=0
wait "$first_server" || code=$?
((code == 0)) || fail "a replica that drains left with $code"
wait "$watcher" || fail "the watcher saw the replica go"
watch "127.0.0.1:$proxy" || fail "the stream is not at the replicas that are left"
echo "one replica has drained, and nobody has missed the stream"
echo "try_replicas.sh: passed"
