#!/bin/bash
# Shows PartiEMC at work, from a fresh clone on Debian 12: installs what is missing, builds, starts
# a server and replays the bundled dam break through it. What comes out is left in build/demo.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly build=build/release-demo
readonly output=build/demo
readonly recording=client/recordings/dam_break.pemc

fail() {
  echo "demo.sh: $*" >&2
  exit 1
}

case ${1:-} in
  '') ;;
  -h | --help)
    echo "usage: client/demo.sh"
    echo "Installs the Debian packages that are missing, builds in $build, replays the bundled"
    echo "recording through a server of its own and leaves the results in $output."
    exit 0
    ;;
  *)
    echo "demo.sh: '$1' is no option; see client/demo.sh --help" >&2
    exit 2
    ;;
esac

# A file that includes gRPC takes more than 1 GB to compile: no more jobs than memory allows.
build_jobs() {
  local processors memory
  processors=$(nproc)
  memory=$(awk '/^MemAvailable:/ { print int($2 / 1500000) }' /proc/meminfo)
  ((memory >= 1)) || memory=1
  echo $((processors < memory ? processors : memory))
}

work=$(mktemp -d)
server=
stop_server() {
  if [[ -n $server ]]; then
    kill "$server" 2>/dev/null || true
    wait "$server" 2>/dev/null || true
    server=
  fi
}
cleanup() {
  local code=$?
  trap - EXIT
  stop_server
  rm -rf "$work"
  exit "$code"
}
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# The server writes the address that it got to a file once it serves.
start_server() {
  "$build/bin/partiemc-server" --address 127.0.0.1:0 --port-file "$work/address" \
    >"$work/server.log" 2>&1 &
  server=$!
  local attempt
  for ((attempt = 0; attempt < 300; ++attempt)); do
    [[ ! -s $work/address ]] || return 0
    kill -0 "$server" 2>/dev/null || break
    sleep 0.1
  done
  cat "$work/server.log" >&2
  fail "the server did not start; its log is above"
}

echo "== 1 of 3: packages (those of docker/packages/demo.txt that are missing)"
docker/install.sh demo

echo
echo "== 2 of 3: build in $build (some minutes for the first time)"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPARTIEMC_TESTS=OFF \
  -DPARTIEMC_VTK=OFF -DPARTIEMC_EVALUATION=OFF >"$work/cmake.log" 2>&1 || {
  cat "$work/cmake.log" >&2
  fail "CMake could not configure the build; its words are above"
}
cmake --build "$build" -j "$(build_jobs)" --target partiemc partiemc-server ||
  fail "the build failed; the first error above says where"

echo
start_server
address=$(<"$work/address")
echo "== 3 of 3: $recording through the server at $address"
rm -rf "$output"
"$build/bin/partiemc" replay "$recording" --server "$address" --check \
  --output-dir "$output/frames" --format geojson,svg,obj \
  --stats "$output/statistics.csv" --report "$output/report.html"
stop_server

echo
echo "The results are in $PWD/$output:"
echo "  report.html       the whole replay to look at: open it in a browser"
echo "  statistics.csv    numbers of every frame"
echo "  frames/           GeoJSON, SVG and OBJ of every frame"
