#!/bin/bash
# Installs missing packages, builds everything and runs every test. The last line is
# "N passed, N failed", summed over all steps; the exit code is 0 only if nothing failed.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1

readonly default_steps=(layout contract release recordings viewer sanitized threads fuzz core-alone consumer bench)
readonly all_steps=("${default_steps[@]}" includes)

readonly buf_version=1.50.0

usage() {
  cat <<'USAGE'
usage: tests/run.sh [--no-install] [STEP...]
Steps, by default all but the last:
  layout      every source file has the format of .clang-format
  contract    buf lints the .proto and finds no incompatible change (if npm can fetch buf)
  release     the whole project, optimised, and all of its tests
  recordings  replays of the bundled recordings, with checks of the written files (after release)
  viewer      page and report: unit tests by node, both in Chromium (after release)
  sanitized   core, sessions, client streams and the gateway under AddressSanitizer and
              UndefinedBehaviorSanitizer
  threads     core and sessions under ThreadSanitizer
  fuzz        a minute of hostile bytes for every parser (tests/fuzz)
  core-alone  the core without gRPC, Protobuf and VTK, as an installed shared library, and a
              consumer of it
  consumer    tests/consumer finds and uses the installed project (after release)
  bench       no ratio of the benchmark is clearly worse than recorded (tests/bench)
  includes    every source of core, proto, server and client includes the headers it needs: it compiles
              alone, without precompiled headers
Builds are kept in build/, so a second run compiles changed files only.
With CI=true a skipped test or step fails, unless tests/skips.txt names it with its reason.
USAGE
}

install=true
steps=()
for argument in "$@"; do
  case $argument in
    -h | --help) usage; exit 0 ;;
    --no-install) install=false ;;
    *)
      if [[ " ${all_steps[*]} " != *" $argument "* ]]; then
        usage >&2
        exit 2
      fi
      steps+=("$argument")
      ;;
  esac
done
((${#steps[@]})) || steps=("${default_steps[@]}")

passed=0
failed=0
failures=()
details=$(mktemp)  # Output of the failed tests.
trap 'rm -f "$details"' EXIT

# Prints the elapsed seconds and the processor time of ended children.
headline() {
  local ticks
  ticks=$(awk '{ sub(/.*\) /, ""); print $14 + $15 }' /proc/$$/stat)
  printf '\n== %s (%d s, processors %d s)\n' "$1" "$SECONDS" $((ticks / $(getconf CLK_TCK)))
}

record_failure() {
  failed=$((failed + $1))
  failures+=("$2")
  echo "FAILED: $2"
}

# record_skips KIND LOG...: prints the skipped tests (tests/support/skips.py). In continuous integration a
# skipped test fails unless tests/skips.txt names it.
record_skips() {
  local found name reason
  if ! found=$(tests/support/skips.py "$@"); then
    record_failure 1 "skips: tests/support/skips.py $*"
    return
  fi
  while IFS=$'\t' read -r name reason; do
    if [[ -z $name ]]; then
      continue
    elif [[ -n $reason ]]; then
      echo "skipped: $name ($reason)"
    elif [[ ${CI:-} == true ]]; then
      record_failure 1 "skipped: $name (tests/skips.txt does not name it)"
    else
      echo "skipped: $name"
    fi
  done <<<"$found"
}

# check NAME COMMAND...: one test, passed if the command succeeds.
check() {
  local name=$1
  shift
  if "$@"; then
    passed=$((passed + 1))
  else
    record_failure 1 "$name"
    return 1
  fi
}

# The output of each failed test in a CTest log: its result line and the lines after it.
failed_tests() {
  awk '/^ *[0-9]+\/[0-9]+ Test +#[0-9]+: / { shown = /\*\*\*/ && !/\*\*\*Skipped/ }
       /^[0-9]+% tests passed/ { exit }
       shown && !/^ +Start +[0-9]+: / { print substr($0, 1, 500) }' "$1"
}

names_of_failed_tests() {
  failed_tests "$1" | sed -n -E 's|^ *[0-9]+/[0-9]+ Test +#[0-9]+: ([^ ]+) .*|\1|p' | paste -sd ' '
}

# run_ctest NAME DIRECTORY [OPTION...]: runs the tests of a build directory, selected by CTest's
# options, and adds CTest's figures to the sum.
run_ctest() {
  local name=$1 directory=$2 log
  shift 2
  log=$(mktemp)
  ctest --test-dir "$directory" --output-on-failure --no-tests=error -j "$test_jobs" "$@" |
    tee "$log" | sed -u -E '/^ +Start +[0-9]+: /d; s/ \.{3,} */ .. /'
  local summary='^[0-9]+% tests passed, ([0-9]+) tests failed out of ([0-9]+)$'
  if [[ $(grep -E "$summary" "$log") =~ $summary ]]; then
    local bad=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
    passed=$((passed + all - bad - $(grep -c '\*\*\*Skipped' "$log")))
    if ((bad != 0)); then
      failed_tests "$log" >>"$details"
      record_failure "$bad" "$name: $(names_of_failed_tests "$log")"
    fi
    record_skips ctest "$log" "$directory/Testing/Temporary/LastTest.log"
  else
    tail -n 20 "$log" >>"$details"
    record_failure 1 "$name: CTest gave no result"
  fi
  rm -f "$log"
}

# Memory limits the number of jobs: a file that includes gRPC takes more than 1 GB to compile.
build_jobs() {
  local processors memory
  processors=$(nproc)
  memory=$(awk '/^MemAvailable:/ { print int($2 / 1500000) }' /proc/meminfo)
  ((memory >= 1)) || memory=1
  echo $((processors < memory ? processors : memory))
}

step_layout() {
  local files
  mapfile -t files < <(find core proto server client tests -name '*.h' -o -name '*.cc' | sort)
  check "layout: run clang-format-14 -i on the files above" \
    clang-format-14 --dry-run --Werror "${files[@]}"
}

# buf comes from npm, which may be missing or offline. contract_test also compares the contract with
# the released one, without buf.
step_contract() {
  local buf=build/buf/node_modules/.bin/buf
  if [[ ! -x $buf ]]; then
    mkdir -p build/buf
    if ! npm install --prefix build/buf --no-save --ignore-scripts --no-audit --no-fund \
      --fetch-retries=0 --fetch-timeout=30000 "@bufbuild/buf@$buf_version" >build/buf/log 2>&1; then
      echo "npm is not installed or cannot fetch buf (build/buf/log)"
      record_skips step buf
      return
    fi
  fi
  check "contract" tests/proto/buf.sh "$buf"
}

step_release() {
  check "release: configure" cmake --preset release -DPARTIEMC_VTK=ON -DPARTIEMC_HDF5=ON \
    -DPARTIEMC_C=ON -DPARTIEMC_PYTHON=ON &&
    check "release: build" cmake --build build/release -j "$jobs" &&
    run_ctest release build/release
}

step_recordings() {
  check "recordings" /usr/bin/python3 tests/end_to_end/check_recordings.py \
    --partiemc build/release/bin/partiemc
}

# run_node NAME SCRIPT: runs tests by node's runner and adds its figures to the sum.
run_node() {
  local name=$1 log
  log=$(mktemp)
  node "$2" 2>&1 | tee "$log"
  local well bad
  well=$(sed -n -E 's/^[^ ]+ pass ([0-9]+)$/\1/p' "$log")
  bad=$(sed -n -E 's/^[^ ]+ fail ([0-9]+)$/\1/p' "$log")
  if [[ -z $well || -z $bad ]]; then
    tail -n 20 "$log" >>"$details"
    record_failure 1 "$name: node gave no result"
  else
    passed=$((passed + well))
    if ((bad != 0)); then
      sed -n '/failing tests:/,$p' "$log" >>"$details"
      record_failure "$bad" "$name"
    elif ((well == 0)); then
      record_failure 1 "$name: no test was run"
    fi
    record_skips node "$log"
  fi
  rm -f "$log"
}

# Its packages come from npm.
step_viewer() {
  if ! client/viewer/build.sh --packages >build/viewer.log 2>&1; then
    echo "npm is not installed or cannot fetch the viewer's packages (build/viewer.log)"
    record_skips step viewer
    return
  fi
  check "viewer: build" client/viewer/build.sh || return
  run_node "viewer" client/viewer/tests/run.mjs
  PARTIEMC_BIN=build/release/bin run_node "viewer in Chromium" client/viewer/tests/page/run.mjs
}

# Core, server and relay, then the client's background work. Step fuzz uses the same build, so only
# these and the fuzz targets are compiled with sanitizers. Tests that count allocations are left out,
# because they would count the sanitizer's. Left out because they are slow are those that compare
# figures of accuracy, areas, volumes, jitter, costs or sums with brute force, those that follow bodies
# for many frames, and of identities all but the frames that have both ids and velocities. The step
# release runs all of them.
readonly accuracy='Accuracy|contourpy|EqualsBruteForce|NoiseFigures|JitterOf|DoesNotLag|FewTriangles'
readonly measures='AreaOf|AreasOf|ItsVolume|TheirVolume|NotCutGrains|SizesCost'
readonly many_frames='TurmoilOf|Breathing|WrappedBodies|DriftingLayer|WhileTheyCross'
readonly less_known='^With/.*/\(?(Nothing|Ids|Velocities)( |,|$)'
step_sanitized() {
  check "sanitized: configure" cmake --preset asan || return
  local room
  for room in core server relay; do
    check "sanitized: build $room" cmake --build build/asan -j "$jobs" --target "tests/$room/all" &&
      run_ctest "sanitized $room" "build/asan/tests/$room" -LE allocation \
        -E "$accuracy|$measures|$many_frames|$less_known"
  done
  check "sanitized: build client and web" cmake --build build/asan -j "$jobs" \
    --target partiemc_sanitized_tests &&
    run_ctest "sanitized client" build/asan/tests/client/library -L sanitized &&
    run_ctest "sanitized web" build/asan/tests/service -L sanitized
}

step_threads() {
  check "threads: configure" cmake --preset tsan &&
    check "threads: build" cmake --build --preset tsan -j "$jobs" &&
    run_ctest threads build/tsan -L threads
}

step_fuzz() {
  check "fuzz: configure" cmake --preset asan &&
    check "fuzz: build" cmake --build build/asan -j "$jobs" --target partiemc_fuzz &&
    check "fuzz" tests/fuzz/run.sh --seconds 60
}

step_includes() {
  check "includes: configure" cmake -S . -B build/includes -G Ninja -DCMAKE_CXX_COMPILER=clang++-14 \
    -DCMAKE_BUILD_TYPE=Debug -DPARTIEMC_UNITE=OFF -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
    -DPARTIEMC_HDF5=ON -DPARTIEMC_VTK=ON -DPARTIEMC_C=ON -DPARTIEMC_PYTHON=ON &&
    check "includes: headers of messages" cmake --build build/includes -j "$jobs" \
      --target partiemc_proto partiemc_recording_proto partiemc_health_proto partiemc_rpc_proto \
      partiemc_relay_proto &&
    check "includes" tests/architecture/compile_alone.py build/includes
}

step_core-alone() {
  check "core alone: configure" cmake -S . -B build/core-alone -G Ninja \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE=-O0 \
    -DPARTIEMC_SERVICE=OFF -DPARTIEMC_SHARED=ON -DPARTIEMC_TESTS=OFF -DPARTIEMC_UNITE_CORE=ON \
    -DCMAKE_DISABLE_FIND_PACKAGE_gRPC=ON -DCMAKE_DISABLE_FIND_PACKAGE_Protobuf=ON \
    -DCMAKE_DISABLE_FIND_PACKAGE_VTK=ON -DCMAKE_DISABLE_FIND_PACKAGE_spdlog=ON \
    -DCMAKE_DISABLE_FIND_PACKAGE_CLI11=ON &&
    check "core alone: build" cmake --build build/core-alone -j "$jobs" &&
    check "core alone: consumer" tests/consumer/run.sh build/core-alone core
}

step_consumer() { check "consumer" tests/consumer/run.sh build/release core client c; }

step_bench() { check "bench" tests/bench/run.py --quick --check; }

if $install; then
  headline "packages"
  if ! docker/install.sh tests; then
    echo "0 passed, 1 failed"
    exit 1
  fi
fi
jobs=$(build_jobs)
# Twice the processors, because some tests mostly wait.
readonly jobs test_jobs=$((2 * $(nproc)))
for step in "${steps[@]}"; do
  headline "$step"
  "step_$step"
done

# Repeats the failures next to the result.
if [[ -s $details ]]; then
  headline "failed tests"
  head -n 200 "$details"
fi
headline "result"
((failed == 0)) || printf 'FAILED: %s\n' "${failures[@]}"
echo "$passed passed, $failed failed"
((failed == 0))
