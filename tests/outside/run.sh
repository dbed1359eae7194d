#!/bin/bash
# usage: tests/outside/run.sh BIN_DIR CHECK...
# Checks the contract with clients of others, by hand; tests/outside/README.md says how to install
# them. BIN_DIR has partiemc, partiemc-server and surface_files. Each CHECK prints its log and ends with "CHECK: good".
# `grpcurl`: reflection, a unary call with a token over TLS, refusals.
# `python`: protocol_client.py, compiled by grpcio-tools of PyPI, streams the dam break.
# `go`: a client generated for Go streams the dam break.
# `ghz`: 10,000 unary calls, beside the figures of `partiemc load`.
# `numpy`: the Python package with NumPy, trimesh and PyVista of PyPI.
# `splashsurf`: the calls of pysplashsurf and of this project in client/python/README.md.
# `gltf`: readers of npm decode the GLB files of --compress-glb.
# `kubernetes`: kustomize and kubeconform on docker/kubernetes.
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
  words=${words//$bin\//}
  printf '\n$%s\n' "${words//${token:-no token}/TOKEN}"
  "$@" 2>&1 | sed "s/$address/ADDRESS/g"
  return "${PIPESTATUS[0]}"
}

# Prints module and version of a program of Go.
version_of() { go version -m "$(command -v "$1")" | sed -n -E 's,^\tmod\t(.*)\t.*,\1,p'; }

check_grpcurl() {
  version_of grpcurl
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

# The same number of particles and of callers in both.
check_ghz() {
  local particles=2000 callers=8
  version_of ghz
  # Text format of protobuf: every byte as an octal escape.
  python3 - "$particles" >"$work/frame.txt" <<'PYTHON'
import struct, sys
count = int(sys.argv[1])
positions = struct.pack(f"<{2 * count}f", *(float(n) for k in range(count) for n in (k % 50, k // 50)))
print('parameters { spacing: 1 } frame { position_format: POSITION_FORMAT_FLOAT32_2 positions: "%s" }'
      % "".join(f"\\{byte:03o}" for byte in positions))
PYTHON
  protoc -I"$root/proto" --encode=partiemc.v1.ReconstructFrameRequest partiemc/v1/reconstruction.proto \
    <"$work/frame.txt" >"$work/frame.bin"
  start
  # By reflection: the parser of ghz refuses `optional` in a .proto of proto3.
  show ghz --insecure --call partiemc.v1.ReconstructionService.ReconstructFrame \
    --binary-file "$work/frame.bin" --total 10000 --concurrency "$callers" --connections "$callers" \
    --format json "$address" >"$work/ghz"
  show "$bin/partiemc" load --server "$address" --streams "$callers" --particles "$particles" --rate 0 --no-ids \
    --seconds 10 --json --quiet >"$work/load"
  grep -h '^\$' "$work/ghz" "$work/load"
  python3 - "$work/ghz" "$work/load" <<'PYTHON'
import json, os, sys
ghz, load = (json.loads("\n".join(open(path).read().split("\n")[2:])) for path in sys.argv[1:])
assert ghz["statusCodeDistribution"] == {"OK": 10000}, ghz["statusCodeDistribution"]
assert load["refused"] == 0, load
of_ghz = {one["percentage"]: one["latency"] / 1e6 for one in ghz["latencyDistribution"]}
print("load average %.1f" % os.getloadavg()[0])
print(f"{'':14}{'per second':>12}{'p50 ms':>10}{'p90 ms':>10}{'p99 ms':>10}")
for name, rate, times in (("ghz", ghz["rps"], [of_ghz[p] for p in (50, 90, 99)]),
                          ("partiemc load", load["frames"] / load["seconds"],
                           [load["answers"][f"p{p}_ms"] for p in (50, 90, 99)])):
    print(f"{name:14}{rate:12.0f}" + "".join(f"{time:10.2f}" for time in times))
PYTHON
  stop
}

# Requires: JSON schemas of Kubernetes for kubeconform. $KUBERNETES_SCHEMAS names another place than
# kubeconform's default.
check_kubernetes() {
  version_of kustomize
  version_of kubeconform
  local overlay check=(kubeconform -strict -summary -schema-location "${KUBERNETES_SCHEMAS:-default}")
  for overlay in base production; do
    printf '\n$ kustomize build docker/kubernetes/%s | kubeconform -strict -summary\n' "$overlay"
    kustomize build "$root/docker/kubernetes/$overlay" >"$work/$overlay.yaml"
    "${check[@]}" "$work/$overlay.yaml"
  done
  sed 's/containerPort:/containrPort:/' "$work/base.yaml" >"$work/misspelled.yaml"
  printf '\n$ the base with "containrPort"\n'
  ! "${check[@]}" "$work/misspelled.yaml" >"$work/refused" || fail "a misspelled field is valid"
  grep '^Summary' "$work/refused"
}

# Requires: numpy, trimesh and pyvista in the Python of $PYTHON, of the version that the package in
# BIN_DIR/../python was built for.
check_numpy() {
  local python=${PYTHON:-python3}
  local package
  package=$(cd "$bin/../python" && pwd)
  "$python" -c 'import numpy, trimesh, pyvista
for module in (numpy, trimesh, pyvista): print(module.__name__, module.__version__)'
  export PYTHONPATH=$package PYTHONDONTWRITEBYTECODE=1
  local name
  for name in reconstruct surfaces; do
    PARTIEMC_SOURCE_DIR=$root PARTIEMC_PYTHON_DIR=$package PARTIEMC_PROGRAM=$bin/partiemc \
      PARTIEMC_SERVER_PROGRAM=$bin/partiemc-server \
      "$python" "$root/tests/client/python/test_$name.py" 2>&1 | grep -E '^(Ran|OK|FAIL|ERROR)' |
      sed 's/ in .*//'
  done
  "$python" - <<'PYTHON'
import numpy, partiemc, pyvista, trimesh
axis = numpy.arange(-12.0, 13.0)
ball = numpy.stack(numpy.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
ball = ball[(ball ** 2).sum(axis=1) < 140]
surface = partiemc.reconstruct(ball, output="surface", spacing=1).surface
of_trimesh = trimesh.Trimesh(surface.points, surface.triangles, vertex_normals=surface.normals, process=False)
of_pyvista = pyvista.PolyData.from_regular_faces(surface.points, surface.triangles)
assert of_trimesh.is_watertight and of_trimesh.is_winding_consistent and of_pyvista.is_manifold
for volume in (of_trimesh.volume, of_pyvista.volume, len(ball)):
    assert abs(volume - surface.volume[0]) < .002 * volume, (volume, surface.volume)
print(f"{len(surface.triangles)} triangles, volume {surface.volume[0]:.1f} in all three")
PYTHON
}

# Requires: pysplashsurf in the Python of $PYTHON, as check_numpy.
check_splashsurf() {
  PYTHONPATH=$(cd "$bin/../python" && pwd) "${PYTHON:-python3}" - "$root/client/python/README.md" <<'PYTHON'
import sys
import numpy, partiemc, pysplashsurf

blocks = [text.split("```")[0] for text in open(sys.argv[1]).read().split("```python\n")[1:]]
script = next(block for block in blocks if "pysplashsurf" in block)
axis = numpy.arange(-16.0, 17.0)
nodes = numpy.stack(numpy.meshgrid(axis, axis, axis), -1).reshape(-1, 3)
nodes = nodes[(nodes ** 2).sum(axis=1) < 14.3 ** 2]
positions = .01 * nodes + numpy.random.default_rng(1).uniform(-.001, .001, nodes.shape)
density = 1000 + positions[:, 2]
exec(script)
for name, points, triangles, normals, values in (
        ("pysplashsurf", mesh.mesh.vertices, mesh.mesh.triangles, *map(mesh.point_attributes.get, ("normals", "density"))),
        ("partiemc", result.surface.points, result.surface.triangles, result.surface.normals, result.attributes["density"])):
    assert normals.shape == points.shape and values.shape == points.shape[:1]
    a, b, c = points[triangles.astype(int)].transpose(1, 0, 2)
    volume = (a * numpy.cross(b, c)).sum() / 6 / (len(positions) * .01 ** 3)
    print(f"{name}: {len(positions)} particles, {len(triangles)} triangles, {volume:.3f} of their volume")
    assert abs(volume - 1) < .05
PYTHON
}

check_gltf() {
  mkdir "$work/gltf"
  cp "$root/tests/outside/gltf/main.mjs" "$work/gltf"
  (cd "$work/gltf" &&
    npm install --no-audit --no-fund @gltf-transform/core @gltf-transform/extensions meshoptimizer gltf-validator &&
    npm ls) >"$work/log" 2>&1 || fail "$(cat "$work/log")"
  sed -n 's/^[├└]── //p' "$work/log"
  local replay=("$bin/partiemc" replay "$root/client/recordings/dam_break.pemc" --local --quiet --format glb)
  "${replay[@]}" --output-dir "$work/plain" --attributes velocity
  "${replay[@]}" --output-dir "$work/packed" --attributes velocity --compress-glb
  node "$work/gltf/main.mjs" "$work/plain" "$work/packed"
  "$bin/surface_files" "$work/surfaces"
  mkdir "$work/plain_surfaces"
  cp "$work/surfaces/"*.glb "$work/plain_surfaces"
  node "$work/gltf/main.mjs" "$work/plain_surfaces" "$work/surfaces/packed"
}

for check in "$@"; do
  "check_$check"
  echo "$check: good"
done
