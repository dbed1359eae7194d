#!/bin/bash
# usage: tests/consumer/run.sh BUILD_DIR COMPONENT...
# Installs the project as built in BUILD_DIR under a temporary prefix, builds this consumer against
# it and runs its programs; then configures one that has PartiEMC as a folder. With `client`, the installed server is started for them.
set -euo pipefail
build=$(cd "$1" && pwd)
shift
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
components=("$@")

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

cmake --install "$build" --prefix "$work/prefix" >/dev/null
cmake -S "$here" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$work/prefix" \
  -DCONSUMER_COMPONENTS="$(IFS=';'; echo "${components[*]}")" >/dev/null
cmake --build "$work/build"
"$work/build/outline"
cmake -S "$here/subproject" -B "$work/subproject" -G Ninja >/dev/null

if [[ " ${components[*]} " == *" client "* ]]; then
  address=unix:$work/server.sock
  "$work/prefix/bin/partiemc-server" --address "$address" &
  server=$!
  for ((attempt = 0; attempt < 100; ++attempt)); do
    "$work/prefix/bin/partiemc-server" --address "$address" --health-check 2>/dev/null && break
    kill -0 "$server"
    sleep 0.1
  done
  "$work/build/stream" "$address"
fi
