#!/bin/bash
# Builds what the benchmark needs (Release) and runs it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

usage() {
  cat <<'USAGE'
usage: tests/bench/run.sh --output DIR [--quick] [--check] [--refresh]
  --output DIR  where bench.md and bench.csv go (default with --check or --refresh: build/bench)
  --quick       fewer repetitions and cases: a minute or two instead of several
  --check       fail where a ratio is clearly worse than tests/bench/expected.csv has it; what is
                found is measured a second time before it is believed
  --refresh     write the ratios of this run into tests/bench/expected.csv
Packages: docker/install.sh bench
USAGE
}

output=
quick=()
check=false
refresh=()
readonly expected=tests/bench/expected.csv
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --output)
      (($# > 1)) || { usage >&2; exit 2; }
      output=$2
      shift
      ;;
    --quick) quick=(--quick) ;;
    --check) check=true ;;
    --refresh) refresh=(--refresh "$expected") ;;
    *) usage >&2; exit 2 ;;
  esac
  shift
done
if [[ -z $output ]]; then
  if ! $check && ((${#refresh[@]} == 0)); then
    usage >&2
    exit 2
  fi
  output=build/bench
fi

echo "bench: building" >&2
log=$(mktemp)
if ! { cmake --preset release -DPARTIEMC_VTK=ON &&
  cmake --build build/release -j "$(nproc)" --target partiemc-bench; } >"$log" 2>&1; then
  cat "$log" >&2
  rm -f "$log"
  echo "bench: cannot build; are the packages there? docker/install.sh bench" >&2
  exit 1
fi
rm -f "$log"

# In the background, so that whatever ends this script ends it too; its servers end with it.
bench=
trap '[[ -z $bench ]] || kill "$bench" 2>/dev/null || true' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP
measure() {
  build/release/bin/partiemc-bench --output "$output" "${quick[@]}" "$@" &
  bench=$!
  local code=0
  wait "$bench" || code=$?
  bench=
  return "$code"
}

readonly worse=3  # What the program returns where a ratio is worse than recorded.
if ! $check; then
  measure "${refresh[@]}"
  exit
fi
code=0
measure --check "$expected" "${refresh[@]}" || code=$?
if ((code == worse)); then
  echo "bench: measuring again" >&2
  code=0
  measure --check "$expected" || code=$?
fi
exit "$code"
