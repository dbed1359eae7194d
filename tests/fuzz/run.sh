#!/bin/bash
# Attacks every target in turn with libFuzzer and prints the number of inputs. Fails at the first
# finding and prints its path.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 1

usage() {
  cat <<'USAGE'
usage: tests/fuzz/run.sh [--seconds N | --executions N] [--keep] [TARGET...]
  --seconds N      N seconds in total, divided equally between the targets (default 60)
  --executions N   rounds of 30 seconds for each target until N executions in total
  --keep           afterwards, add small inputs that reach new code to tests/fuzz/corpus
Build first: cmake --preset asan && cmake --build build/asan --target partiemc_fuzz. Inputs that were
found stay in build/asan/learned, where a later run continues. Prints the seed of each run.
USAGE
}

readonly program=build/asan/bin/partiemc_fuzz corpus=tests/fuzz/corpus
readonly learned=build/asan/learned findings=build/asan/findings
readonly round_seconds=30
# Maximum sizes of inputs. Targets that make frames from a few bytes get small inputs, which are fast
# and find nearly the same. Kept inputs are few and small, because the repository stores them.
readonly large_bytes=1048576 small_bytes=2048 kept_bytes=400 kept_files=60
readonly small_targets=' checkpoint expressions frames relay_peers sections state surfaces watch_requests '

seconds=60
executions=0
keep=false
targets=()
while (($#)); do
  case $1 in
    --seconds) seconds=$2; shift ;;
    --executions) executions=$2; shift ;;
    --keep) keep=true ;;
    -h | --help) usage; exit 0 ;;
    -*) usage >&2; exit 2 ;;
    *) targets+=("$1") ;;
  esac
  shift
done
if [[ ! -x $program ]]; then
  usage >&2
  exit 2
fi
((${#targets[@]})) || mapfile -t targets < <("$program" 2>/dev/null)

declare -A counts
sum=0

# attack TARGET SECONDS: adds its executions to counts and sum.
attack() {
  local target=$1 log executed seed=$((RANDOM * 32768 + RANDOM + 1)) max_bytes=$large_bytes
  [[ $small_targets == *" $target "* ]] && max_bytes=$small_bytes
  # VTK's readers leak memory for damaged files.
  local leaks=1
  [[ $target == vtk ]] && leaks=0
  log=$(mktemp)
  mkdir -p "$learned/$target" "$findings" "$corpus/$target"
  if ! ASAN_OPTIONS=detect_leaks=$leaks "$program" --target="$target" -max_total_time="$2" \
    -max_len=$max_bytes -seed=$seed -timeout=30 -rss_limit_mb=3000 -detect_leaks=$leaks \
    -print_final_stats=1 -artifact_prefix="$findings/$target-" \
    "$learned/$target" "$corpus/$target" >"$log" 2>&1; then
    tail -n 60 "$log"
    rm -f "$log"
    echo "FOUND in $target (-seed=$seed): fix it, then keep the input under a descriptive name:"
    echo "$program --target=$target $findings/$target-..., cp ... $corpus/$target/NAME"
    exit 1
  fi
  executed=$(awk '/^stat::number_of_executed_units:/ { print $2 }' "$log")
  rm -f "$log"
  counts[$target]=$((${counts[$target]:-0} + executed))
  sum=$((sum + executed))
}

if ((executions > 0)); then
  while ((sum < executions)); do
    for target in "${targets[@]}"; do attack "$target" $round_seconds; done
    echo "$sum executions so far" >&2
  done
else
  for target in "${targets[@]}"; do
    attack "$target" $(((seconds + ${#targets[@]} - 1) / ${#targets[@]}))
  done
fi

if $keep; then
  for target in "${targets[@]}"; do
    small=$(mktemp -d)
    merged=$(mktemp -d)
    find "$learned/$target" -type f -size -$((kept_bytes + 1))c -exec cp -t "$small" {} +
    "$program" --target="$target" -merge=1 "$merged" "$corpus/$target" "$small" >/dev/null 2>&1
    for file in $(ls -S -r "$merged"); do
      (($(ls "$corpus/$target" | wc -l) < kept_files)) || break
      [[ $(find "$merged/$file" -size -$((kept_bytes + 1))c) ]] || continue
      cp "$merged/$file" "$corpus/$target/"
    done
    rm -rf "$small" "$merged"
  done
fi

printf '%-16s %12s\n' target executions
for target in "${targets[@]}"; do printf '%-16s %12d\n' "$target" "${counts[$target]}"; done
printf '%-16s %12d\n' sum "$sum"
