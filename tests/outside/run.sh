#!/bin/bash
# usage: tests/outside/run.sh BIN_DIR CHECK...
# Checks the contract with clients of others, by hand; tests/outside/README.md says how to install
# them. BIN_DIR has partiemc and partiemc-server. Each CHECK prints its log and ends with "CHECK: good".
# `grpcurl`: reflection, a unary call with a token over TLS, refusals.
# `python`: protocol_client.py, compiled by grpcio-tools of PyPI, streams the dam break.
# `go`: a client generated for Go streams the dam break.
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
  "$bin/partiemc-server" --address localhost:0 --port-file "$work/address" --log-level error "$@" &
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

# Prints a command without its secrets, and runs it.
show() {
  local words=" $* "
  words=${words//$address/ADDRESS}
  words=${words//$work/DIR}
  printf '\n$%s\n' "${words//${token:-no token}/TOKEN}"
  "$@" 2>&1 | sed "s/$address/ADDRESS/g"
  return "${PIPESTATUS[0]}"
}

check_grpcurl() {
  go version -m "$(command -v grpcurl)" | sed -n -E 's,^\tmod\t(.*)\t.*,\1,p'
  "$root/docker/try_tls.sh" "$work/tls"
  token=$(<"$work/tls/tokens")
  start --tls-cert "$work/tls/server.crt" --tls-key "$work/tls/server.key" --token-file "$work/tls/tokens"
  local service=partiemc.v1.ReconstructionService
  local call=(grpcurl -cacert "$work/tls/ca.pem") with_token=(-H "authorization: Bearer $token")
  show "${call[@]}" "${with_token[@]}" "$address" list | tee "$work/list"
  grep -q "^$service\$" "$work/list"
  show "${call[@]}" "${with_token[@]}" "$address" describe "$service" | tee "$work/described"
  (($(grep -c '^  rpc ' "$work/described") == $(grep -c '^  rpc ' "$root/proto/partiemc/v1/reconstruction.proto")))
  show "${call[@]}" "${with_token[@]}" "$address" "$service/GetServerInfo" >"$work/info"
  grep -E '^\$|version"' "$work/info"
  grep -q '"method_version"' "$work/info"
  # 400 particles of spacing 1 have the area 400.
  python3 - >"$work/frame.json" <<'PYTHON'
import base64, json, struct
positions = [float(n) for k in range(400) for n in (k % 20, k // 20)]
print(json.dumps({"parameters": {"spacing": 1, "fill": "FILL_CONFORMING"}, "frame": {
    "positionFormat": "POSITION_FORMAT_FLOAT64_2",
    "positions": base64.b64encode(struct.pack("<800d", *positions)).decode()}}))
PYTHON
  show "${call[@]}" "${with_token[@]}" -d @ "$address" "$service/ReconstructFrame" <"$work/frame.json" \
    >"$work/result"
  grep -E '^\$|^ {4}"(rings|mesh)_digest"|^ {6}"(particles|area)"' "$work/result"
  python3 - "$work/result" <<'PYTHON'
import json, sys
frame = json.loads(open(sys.argv[1]).read().split("\n", 2)[2])["frame"]
assert abs(frame["statistics"]["area"] - 400) < 4, frame["statistics"]
PYTHON
  ! show "${call[@]}" "$address" "$service/GetServerInfo" >"$work/refused" || fail "no token is needed"
  cat "$work/refused"
  grep -q 'code = Unauthenticated .* authorization: absent' "$work/refused"
  ! show grpcurl -plaintext "$address" list || fail "TLS is not needed"
  stop
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
