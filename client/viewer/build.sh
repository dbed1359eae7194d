#!/bin/bash
# Builds the page into DIR (default: build/page beside this script), and fetches its packages by npm
# if they are missing. Requires node, npm and protoc: docker/install.sh viewer service.
#   client/viewer/build.sh [--out DIR]
#   client/viewer/build.sh --report       writes client/output/report_page.html, report_space.txt
#   client/viewer/build.sh --packages     only fetches packages
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

for program in node npm protoc; do
  if ! command -v "$program" >/dev/null; then
    echo "build.sh: $program is missing; docker/install.sh viewer service installs it" >&2
    exit 1
  fi
done

# npm leaves a copy of the package list, which shows whether the list has changed.
mark=$here/node_modules/.package-lock.json
if [[ ! -f $mark || $here/package-lock.json -nt $mark ]]; then
  (cd "$here" && npm ci --ignore-scripts --no-audit --no-fund)
  touch "$mark"
fi
[[ ${1:-} != --packages ]] || exit 0
exec node "$here/build.mjs" "$@"
