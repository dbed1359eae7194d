#!/bin/bash
# Installs the missing Debian packages of the given sets. A set is a file packages/SET.txt with one
# package per line; '@OTHER' includes another set, 'PACKAGE ?COMMAND' skips the package if the
# command exists. The demo, CI and the image install by this script.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

fail() {
  echo "install.sh: $*" >&2
  exit 1
}

sets() {
  local file
  for file in "$here"/packages/*.txt; do
    printf '  %-10s%s\n' "$(basename "$file" .txt)" "$(sed -n '1s/^# *//p' "$file")"
  done
}

usage() {
  echo "usage: docker/install.sh [--list] SET..."
  echo "Installs Debian packages by apt-get, as root or through sudo. --list only names them. Sets:"
  sets
}

# Prints the packages of a set, one per line, after the packages of the sets it includes.
packages_of() {
  local file=$here/packages/$1.txt word unless
  [[ -f $file ]] || fail "no package set '$1'; there are: $(sets | awk '{ printf "%s ", $1 }')"
  while read -r word unless; do
    case $word in
      @*) packages_of "${word#@}" ;;
      *) [[ -n $unless ]] && command -v "${unless#\?}" >/dev/null || echo "$word" ;;
    esac
  done < <(sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "$file")
}

list_only=false
chosen=()
for argument in "$@"; do
  case $argument in
    -h | --help) usage; exit 0 ;;
    --list) list_only=true ;;
    -*) usage >&2; exit 2 ;;
    *) chosen+=("$argument") ;;
  esac
done
if ((${#chosen[@]} == 0)); then
  usage >&2
  exit 2
fi

wanted=()
for name in "${chosen[@]}"; do
  list=$(packages_of "$name")
  mapfile -t -O "${#wanted[@]}" wanted <<<"$list"
done
mapfile -t wanted < <(printf '%s\n' "${wanted[@]}" | awk '!seen[$0]++')
if $list_only; then
  printf '%s\n' "${wanted[@]}"
  exit 0
fi

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  fail "this is not a Debian or Ubuntu system (no apt-get); install by other means what" \
    "'docker/install.sh --list ${chosen[*]}' names"
fi

# dpkg-query reports unknown packages on stderr and fails; both are expected here.
installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "${wanted[@]}" 2>/dev/null |
  awk '$2 == "installed" { print $1 }') || true
mapfile -t missing < <(printf '%s\n' "${wanted[@]}" | grep -vxF -f <(printf '%s\n' "$installed"))
if ((${#missing[@]} == 0)); then
  echo "install.sh: ${chosen[*]}: all ${#wanted[@]} packages are installed"
  exit 0
fi
echo "install.sh: ${chosen[*]}: going to install ${#missing[@]} packages and what they depend on:"
printf '%s\n' "${missing[@]}" | paste -sd ' ' | fold -s -w 96 | sed 's/^/  /; s/ *$//'

if (($(id -u) == 0)); then
  as_root=()
elif command -v sudo >/dev/null; then
  as_root=(sudo)
else
  fail "installing takes root, and there is no sudo; let root run: docker/install.sh ${chosen[*]}"
fi

apt_get() {
  # Waits for the lock of another apt, and repeats failed downloads.
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 \
    apt-get -q -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 -o Dpkg::Use-Pty=0 "$@" </dev/null
}

apt_get update ||
  fail "apt-get update failed; the lines above name the source that could not be read"
apt_get install --yes --no-install-recommends "${missing[@]}" ||
  fail "apt-get could not install them; the package lists are those of Debian 12 (bookworm)"
echo "install.sh: ${chosen[*]}: done"
