#!/bin/bash
# usage: tests/proto/buf.sh BUF
# Checks the public contract with `buf`: its lint, and compatibility with the released contract
# (proto/released). Then plants violations, which buf must find.
set -euo pipefail
buf=$(realpath "$1")
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/proto
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

lint() { (cd "$1" && "$buf" lint); }
breaking() { (cd "$1" && "$buf" breaking --against "$here/released/reconstruction.binpb"); }

lint "$here"
breaking "$here"

# planted CHECK SED: expects that the contract with one changed line is refused.
planted() {
  local tree=$work/planted
  rm -rf "$tree"
  cp -r "$here" "$tree"
  sed -i -E "$2" "$tree/partiemc/v1/reconstruction.proto"
  if cmp -s "$here/partiemc/v1/reconstruction.proto" "$tree/partiemc/v1/reconstruction.proto"; then
    echo "buf.sh: '$2' changes nothing" >&2
    exit 1
  fi
  if "$1" "$tree" >/dev/null; then
    echo "buf.sh: buf finds nothing wrong with '$2'" >&2
    exit 1
  fi
}
planted lint 's/\bdouble kernel_radius\b/double kernelRadius/'
planted breaking 's/(double kernel_radius = )[0-9]+/\1999/'
planted breaking 's/\bdouble kernel_radius\b/float kernel_radius/'
planted breaking '/double kernel_radius = /d'
echo "buf: nothing to complain of, and planted violations are found"
