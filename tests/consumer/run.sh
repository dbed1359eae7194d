#!/bin/bash
# usage: tests/consumer/run.sh BUILD_DIR COMPONENT...
# Installs the project as built in BUILD_DIR under a temporary prefix. Builds this consumer against it
# by CMake and by pkg-config, and runs its programs. Then configures one that has PartiEMC as a folder.
# With `client`, the installed server is started for them. With `c`, the examples in C and Fortran are
# built by the command lines in their first comments.
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

has() { [[ " ${components[*]} " == *" $1 "* ]]; }

# built_by_cmake FOLDER COMPONENT...
built_by_cmake() {
  cmake -S "$here" -B "$work/$1" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_PREFIX_PATH="$work/prefix" -DCONSUMER_COMPONENTS="$(IFS=';'; echo "${*:2}")" >/dev/null
  cmake --build "$work/$1"
}

# built_by_comment SOURCE: runs the line of its first comment that calls pkg-config.
built_by_comment() {
  local line
  line=$(sed -n -E '1,10s/^[ !*]+([a-z]+ .*\$\(pkg-config .*)$/\1/p' "$1")
  [[ -n $line ]] || { echo "$1 shows no link line" >&2; return 1; }
  cp "$1" "$work/pkg-config/"
  (cd "$work/pkg-config" && eval "$line")
}

cmake --install "$build" --prefix "$work/prefix" >/dev/null
mkdir "$work/pkg-config"
PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name partiemc-core.pc)")
LD_LIBRARY_PATH=$(dirname "$PKG_CONFIG_PATH")
export PKG_CONFIG_PATH LD_LIBRARY_PATH

built_by_cmake build "${components[@]}"
"$work/build/outline"
# shellcheck disable=SC2046
c++ -std=c++20 "$here/outline.cc" $(pkg-config --cflags --libs partiemc-core) -o "$work/pkg-config/outline"
"$work/pkg-config/outline"
cmake -S "$here/subproject" -B "$work/subproject" -G Ninja >/dev/null

if has c; then
  built_by_cmake c_alone c
  c=$here/../../client/c
  built_by_comment "$c/example.c"
  for example in "$work"/{c_alone,pkg-config}/example; do
    "$example" "$work/picture.svg" | tee "$example.out"
    (($(wc -l <"$example.out") == 5))
  done
  if command -v gfortran >/dev/null; then
    built_by_comment "$c/example.f90"
    (($("$work/pkg-config/example_fortran" | tee /dev/stderr | wc -l) == 5))
    built_by_comment "$c/surface.f90"
    (($("$work/pkg-config/surface_fortran" "$work/bodies.obj" | tee /dev/stderr | wc -l) == 5))
  fi
fi

if has client; then
  address=unix:$work/server.sock
  "$work/prefix/bin/partiemc-server" --address "$address" &
  server=$!
  for ((attempt = 0; attempt < 100; ++attempt)); do
    "$work/prefix/bin/partiemc-server" --address "$address" --health-check 2>/dev/null && break
    kill -0 "$server"
    sleep 0.1
  done
  "$work/build/stream" "$address"
  # shellcheck disable=SC2046
  c++ -std=c++20 "$here/stream.cc" $(pkg-config --cflags --libs partiemc-client) -o "$work/pkg-config/stream"
  "$work/pkg-config/stream" "$address"
fi
