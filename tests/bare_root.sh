#!/bin/bash
# Tries the instructions of README on a bare Debian 12: a root made by debootstrap with git and
# ca-certificates only, and a clone of this repository. Requires root. Keeps the bare system in
# build/bare_root for the next run.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

usage() {
  cat <<'USAGE'
usage: tests/bare_root.sh [--working-tree] [--keep] [TRY...]
  --working-tree  use the working tree, with uncommitted changes, instead of a clone
  --keep          keep the root and print its path
TRY is one of these, each in a separate root; demo and tests by default:
  demo    client/demo.sh --no-browser, twice
  tests   tests/run.sh, then its quickest step again
  core    the core alone, without the packages of the service
  packages  the Debian packages and the wheel: installed, tried, removed (docker/debian/build.sh)
USAGE
}

fail() {
  echo "bare_root.sh: $*" >&2
  exit 1
}

working_tree=false
keep=false
tries=()
for argument in "$@"; do
  case $argument in
    -h | --help) usage; exit 0 ;;
    --working-tree) working_tree=true ;;
    --keep) keep=true ;;
    demo | tests | core | packages) tries+=("$argument") ;;
    *) usage >&2; exit 2 ;;
  esac
done
((${#tries[@]})) || tries=(demo tests)
(($(id -u) == 0)) || fail "making a root file system requires root"
docker/install.sh image

readonly work=$PWD/build/bare_root
readonly base=$work/bookworm
mkdir -p "$work"
if [[ ! -d $base ]]; then
  echo "bare_root.sh: debootstrap makes ${base#"$PWD/"}"
  rm -rf "$base.partial"
  debootstrap --variant=minbase --include=git,ca-certificates bookworm "$base.partial" \
    >"$work/debootstrap.log" 2>&1 || fail "debootstrap: $(tail -n 1 "$work/debootstrap.log")"
  mv "$base.partial" "$base"
fi

root=
cleanup() {
  if $keep && [[ -n $root ]]; then
    echo "bare_root.sh: the root is $root"
  else
    rm -rf "$root"
  fi
  root=
}
trap cleanup EXIT

make_root() {
  root=$(mktemp -d "$work/$1.XXXXXX")
  chmod 755 "$root"
  cp -a --reflink=auto "$base/." "$root"
  cp -L /etc/resolv.conf "$root/etc/resolv.conf"
  if $working_tree; then
    mkdir "$root/partiemc"
    git ls-files -z --cached --others --exclude-standard |
      tar --create --null --files-from - | tar --extract --directory "$root/partiemc"
  else
    git clone -q --no-hardlinks . "$root/partiemc"
  fi
}

# Runs a command in the clone inside the root, with its own mounts and processes, which end with it.
in_root() {
  unshare --mount --pid --fork --kill-child --mount-proc="$root/proc" bash -c '
    root=$1
    shift
    mount -t sysfs -o ro sysfs "$root/sys"
    mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
    mkdir -p "$root/dev/shm"
    mount -t tmpfs tmpfs "$root/dev/shm"
    exec env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
      TERM=dumb chroot "$root" sh -c "cd /partiemc && exec \"\$@\"" sh "$@"
  ' bash "$root" "$@" </dev/null
}

outcomes=()
failed=0
# try NAME COMMAND...: runs the command and stores its outcome for the end.
try() {
  local name=$1 begin=$SECONDS outcome=passed
  shift
  echo "bare_root.sh: $name: $*"
  if ! in_root "$@"; then
    outcome=FAILED
    failed=1
  fi
  outcomes+=("$(printf '%-28s %-7s %5d s' "$name" "$outcome" $((SECONDS - begin)))")
}

for what in "${tries[@]}"; do
  make_root "$what"
  case $what in
    demo)
      try "demo" client/demo.sh --no-browser
      try "demo, again at once" client/demo.sh --no-browser
      try "demo's files" sh -c 'cd build/demo && ls *.html && ls -R | grep -c geojson'
      ;;
    tests)
      try "tests" tests/run.sh
      try "tests, again at once" tests/run.sh layout
      ;;
    core)
      try "packages of the core" docker/install.sh core-tests
      try "no gRPC, Protobuf, VTK" sh -c \
        '! ls -d /usr/include/grpcpp /usr/include/google/protobuf /usr/include/vtk* 2>/dev/null'
      try "core alone" tests/run.sh --no-install core-alone
      ;;
    packages)
      docker/install.sh debian
      docker/debian/build.sh build/debian/packages
      mkdir -p "$root/packages"
      cp build/debian/packages/* "$root/packages"
      try "packages" docker/debian/try.sh /packages
      ;;
  esac
  cleanup
done
printf '%s\n' "" "${outcomes[@]}"
exit $failed
