#!/bin/bash
# Demo for a fresh clone on Debian 12: installs missing packages, builds, starts a server and
# replays the bundled recordings through it. The results are in build/demo. Then plays the
# recordings in a loop for a browser, until Ctrl-C.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly build=build/release-demo
readonly output=build/demo
readonly recording=client/recordings/dam_break.pemc
readonly drops=client/recordings/colliding_drops.pemc

fail() {
  echo "demo.sh: $*" >&2
  exit 1
}

browser=true
case ${1:-} in
  '') ;;
  --no-browser) browser=false ;;
  -h | --help)
    echo "usage: client/demo.sh [--no-browser]"
    echo "Installs missing Debian packages, builds in $build, replays the bundled recordings"
    echo "through a server and writes the results to $output. Then plays them in a loop for a"
    echo "browser at the printed addresses, until Ctrl-C."
    echo "  --no-browser  end after the replay, without the page and the packages that build it"
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
server= players=
stop() {
  local process
  for process in $players $server; do
    kill "$process" 2>/dev/null || true
    wait "$process" 2>/dev/null || true
  done
  server= players=
}
cleanup() {
  local code=$?
  trap - EXIT
  stop
  rm -rf "$work"
  exit "$code"
}
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# The server writes the addresses that it got to files once it serves.
start_server() {
  "$build/bin/partiemc-server" --address 127.0.0.1:0 --port-file "$work/address" "$@" \
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

# The page needs npm, and npm its registry: where there is none, everything else works.
build_page() {
  docker/install.sh viewer && cmake --build "$build" --target partiemc_viewer
}

# loop RECORDING NAME [FLAG...]: streams a recording in the background.
loop() {
  "$build/bin/partiemc" replay "$1" --name "$2" "${@:3}" --server "$address" --loop \
    --echo-particles --quiet >>"$work/player.log" 2>&1 &
  players+=" $!"
}

# Until Ctrl-C.
play() {
  loop "$recording" dam-break --rate 25
  loop "$drops" drops --rate 12 --surface --coordinates compact
  echo
  echo "The dam break and the drops play, until Ctrl-C:"
  echo "  http://$(<"$work/web")/#stream=dam-break"
  echo "  http://$(<"$work/web")/#stream=drops"
  # Ends with the first of the two.
  # shellcheck disable=SC2086
  wait -n $players || {
    cat "$work/player.log" >&2
    fail "the replay ended; its words are above"
  }
}

echo "== 1 of 3: packages (those of docker/packages/demo.txt that are missing)"
docker/install.sh demo

echo
echo "== 2 of 3: build in $build (some minutes for the first time)"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPARTIEMC_TESTS=OFF \
  -DPARTIEMC_VTK=OFF -DPARTIEMC_HDF5=OFF -DPARTIEMC_VIEWER="$browser" \
  >"$work/cmake.log" 2>&1 || {
  cat "$work/cmake.log" >&2
  fail "CMake could not configure the build; its words are above"
}
cmake --build "$build" -j "$(build_jobs)" --target partiemc partiemc-server ||
  fail "the build failed; the first error above says where"
if $browser && ! build_page; then
  echo "demo.sh: the page for the browser could not be built (its words are above): left out" >&2
  browser=false
fi

echo
if $browser; then
  start_server --web 127.0.0.1:0 --web-port-file "$work/web"
else
  start_server
fi
address=$(<"$work/address")
echo "== 3 of 3: $recording through the server at $address"
rm -rf "$output"
"$build/bin/partiemc" replay "$recording" --server "$address" --check \
  --output-dir "$output/frames" --format geojson,svg,obj \
  --stats "$output/statistics.csv" --report "$output/report.html"
echo
echo "$drops, as closed surfaces:"
"$build/bin/partiemc" replay "$drops" --server "$address" --surface --check \
  --output-dir "$output/surfaces" --format ply,svg

echo
echo "The results are in $PWD/$output:"
echo "  report.html       the whole replay to look at: open it in a browser"
echo "  statistics.csv    numbers of every frame"
echo "  frames/           GeoJSON, SVG and OBJ of every frame"
echo "  surfaces/         PLY of the drops, for ParaView, Blender or MeshLab, and pictures (SVG)"
! $browser || play
