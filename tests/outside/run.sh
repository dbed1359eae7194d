#!/bin/bash
# usage: tests/outside/run.sh BIN_DIR CHECK...
# Checks the contract with clients of others, by hand; tests/outside/README.md says how to install
# them. BIN_DIR has partiemc and partiemc-server. Each CHECK prints its log and ends with "CHECK: good":
#   python   protocol_client.py with grpcio-tools of PyPI: streams the dam break
#   go       a client generated for Go streams the dam break
set -euo pipefail
bin=$(cd "$1" && pwd)
shift
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d)
server=
cleanup() {
  if [[ -n $server ]]; then
    kill "$server" 2>/dev/null || true
    wait "$server" || true
  fi
  rm -rf "$work"
}
trap cleanup EXIT
fail() { echo "$*" >&2; exit 1; }

# start FLAG...: a server; its address is $address.
start() {
  "$bin/partiemc-server" --address localhost:0 --port-file "$work/address" --log-level warn "$@" &
  server=$!
  for ((k = 0; k < 100; ++k)); do
    [[ ! -s $work/address ]] || break
    kill -0 "$server"
    sleep 0.1
  done
  address=localhost:$(sed 's/.*://' "$work/address")
}

stop() {
  kill "$server"
  wait "$server" || fail "the server ended with $?"
  server=
  rm -f "$work/address"
}

# Requires: grpcio and grpcio-tools in the Python of $PYTHON.
check_python() {
  local python=${PYTHON:-python3}
  "$python" -c 'import grpc, google.protobuf as p; print("grpcio", grpc.__version__, "protobuf", p.__version__)'
  "$python" "$root/tests/end_to_end/protocol_client.py" --server "$bin/partiemc-server" --frames 75
}

check_go() {
  go version | cut -d' ' -f3
  mkdir -p "$work/go/contract"
  cp "$root/tests/outside/go/main.go" "$work/go"
  protoc -I"$root/proto" --go_out="$work/go/contract" --go-grpc_out="$work/go/contract" \
    --go{,-grpc}_opt=paths=source_relative,Mpartiemc/v1/reconstruction.proto=outside/contract/partiemc/v1 \
    partiemc/v1/reconstruction.proto
  (cd "$work/go" && go mod init outside && go mod tidy && go build -o client .) >"$work/log" 2>&1 ||
    fail "$(cat "$work/log")"
  sed -n -E 's,^\t?(google.golang.org/(grpc|protobuf) .*),\1,p' "$work/go/go.mod"
  start
  zstd -dcq "$root/client/recordings/dam_break.pemc" | "$work/go/client" "$address" | tee "$work/digests" | tail -n 3
  "$bin/partiemc" replay "$root/client/recordings/dam_break.pemc" --local --quiet --stats "$work/local.csv"
  python3 - "$work/local.csv" >"$work/expected" <<'PYTHON'
import csv, sys
for row in csv.DictReader(open(sys.argv[1])):
    print(row["rings_digest"], row["mesh_digest"])
PYTHON
  cmp "$work/digests" "$work/expected"
  echo "$(wc -l <"$work/digests") frames, the digests of replay --local"
  stop
}

for check in "$@"; do
  "check_$check"
  echo "$check: good"
done
