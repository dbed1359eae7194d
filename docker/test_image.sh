#!/bin/bash
# Builds the image from the Dockerfile without a container engine and tries it: the server answers
# its health check and a replay, in the clear and as compose.tls.yaml has it, runs as a non-root
# user, and leaves within 5 s of SIGTERM with exit code 0. Needs root; installs the packages of the
# set `image` where they are missing. The base system is kept in build/image; every container and
# image is removed at the end.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
  echo "test_image.sh: $*" >&2
  exit 1
}
(($(id -u) == 0)) || fail "making a root file system takes root"
docker/install.sh image

readonly work=$PWD/build/image
readonly base=$work/bookworm base_image=docker.io/library/debian:bookworm-slim image=partiemc:test
mkdir -p "$work"
export BUILDAH_ISOLATION=chroot

# A store of our own, so that nobody else's images are touched. Overlay where the kernel and the
# file system have it; vfs copies every layer and takes many times longer.
store=$(mktemp -d "$work/store.XXXXXX")
choose_driver() {
  local driver container
  for driver in overlay vfs; do
    buildah=(buildah --root "$store/$driver" --runroot "$store/run-$driver"
      --storage-driver "$driver")
    if container=$("${buildah[@]}" from scratch 2>/dev/null) &&
      "${buildah[@]}" mount "$container" >/dev/null 2>&1; then
      "${buildah[@]}" rm "$container" >/dev/null
      echo "storage driver: $driver"
      return
    fi
  done
  fail "buildah can use neither overlay nor vfs under $work"
}

unshare_pid=
cleanup() {
  [[ -z $unshare_pid ]] || kill -KILL "$unshare_pid" 2>/dev/null || true
  "${buildah[@]}" rm --all >/dev/null 2>&1 || true
  "${buildah[@]}" rmi --all --force >/dev/null 2>&1 || true
  umount "$store"/*/overlay 2>/dev/null || true
  rm -rf "$store"
}

# The name that the Dockerfile takes its base from, made from Debian's packages.
make_base() {
  if [[ ! -d $base ]]; then
    echo "debootstrap: a minimal Debian 12 in ${base#"$PWD/"}"
    rm -rf "$base.partial"
    debootstrap --variant=minbase bookworm "$base.partial" >"$work/debootstrap.log" 2>&1 ||
      fail "debootstrap failed: $(tail -n 1 "$work/debootstrap.log")"
    mv "$base.partial" "$base"
  fi
  local scratch
  scratch=$("${buildah[@]}" from scratch)
  "${buildah[@]}" copy -q "$scratch" "$base" / >/dev/null
  "${buildah[@]}" config --cmd bash \
    --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$scratch"
  "${buildah[@]}" commit -q --rm "$scratch" "$base_image" >/dev/null
}

build_image() {
  SECONDS=0
  if ! "${buildah[@]}" bud --pull-never --format docker -f docker/Dockerfile -t "$image" . \
    >"$work/build.log" 2>&1; then
    tail -n 40 "$work/build.log" >&2
    fail "the image does not build; the whole output is in ${work#"$PWD/"}/build.log"
  fi
  echo "built in $SECONDS s: $("${buildah[@]}" images --format '{{.Size}}' "$image")"
}

# configured FIELD: what the image says about itself, one value a line.
configured() {
  "${buildah[@]}" inspect --type image --format "$1" "$image" | sed '/^$/d'
}

# What an engine does at `run`: own mounts, processes (the program is number 1 among them) and
# network, the image's environment and user.
start_server() {
  unshare --mount --pid --net --fork --kill-child --mount-proc="$root/proc" \
    bash -c 'ip link set lo up && exec "$@"' bash \
    env -i "${environment[@]}" chroot --userspec="$user:$user" "$root" "${command[@]}" &
  unshare_pid=$!
  for ((attempt = 0; attempt < 300; ++attempt)); do
    kill -0 "$unshare_pid" 2>/dev/null || fail "the server ended before it was healthy"
    server=$(pgrep -P "$unshare_pid") && in_container "${check[@]:1}" 2>/dev/null && return
    sleep 0.1
  done
  fail "the server is not healthy after 30 s"
}

# What an engine does at `exec`.
in_container() {
  nsenter --target "$server" --mount --pid --net \
    env -i "${environment[@]}" chroot --userspec="$user:$user" "$root" "$@"
}

# Sends SIGTERM and wants exit code 0 within 5 s.
stop_server() {
  local begin end code=0
  begin=$(date +%s%N)
  kill -TERM "$server"
  wait "$unshare_pid" || code=$?
  end=$(date +%s%N)
  unshare_pid=
  echo "SIGTERM $1: exit code $code after $(((end - begin) / 1000000)) ms"
  ((code == 0)) || fail "the server left with exit code $code"
  ((end - begin < 5000000000)) || fail "the server took longer than 5 s to leave"
}

replay() {
  in_container partiemc replay /usr/local/share/partiemc/recordings/dam_break.pemc --quiet "$@"
}

# What docker/compose.tls.yaml says of a service: its environment, or its command; one a line.
composed() {
  /usr/bin/python3 - "$@" <<'PYTHON'
import sys, yaml

key, service = sys.argv[1:]
value = yaml.safe_load(open("docker/compose.tls.yaml"))["services"][service][key]
for line in value if key == "command" else (f"{name}={text}" for name, text in value.items()):
    print(line)
PYTHON
}

trap cleanup EXIT
choose_driver
make_base
build_image

container=$("${buildah[@]}" from --pull-never "$image")
root=$("${buildah[@]}" mount "$container")
user=$(configured '{{.Docker.Config.User}}')
lines='{{range .}}{{println .}}{{end}}'
mapfile -t environment < <(configured "{{with .Docker.Config.Env}}$lines{{end}}")
mapfile -t entry_point < <(configured "{{with .Docker.Config.Entrypoint}}$lines{{end}}")
mapfile -t arguments < <(configured "{{with .Docker.Config.Cmd}}$lines{{end}}")
command=("${entry_point[@]}" "${arguments[@]}")
mapfile -t check < <(configured "{{with .Docker.Config.Healthcheck.Test}}$lines{{end}}")
[[ -n $user ]] || fail "the image names no user"
[[ ${check[0]:-} == CMD ]] || fail "the image has no health check"
echo "runs as $user: ${command[*]}; health check: ${check[*]:1}"

if unshare --net env -i "${environment[@]}" chroot --userspec="$user:$user" "$root" \
  "${check[@]:1}" 2>/dev/null; then
  fail "the health check passes without a server"
fi

start_server
echo "healthy"
uid=$(in_container id -u)
[[ $uid != 0 ]] || fail "commands run as root"
[[ $(awk '/^Uid:/ { print $2 $3 $4 $5 }' "/proc/$server/status") == "$uid$uid$uid$uid" ]] ||
  fail "the server does not run as user $uid"
echo "server and commands run as user $uid"
clear=(--server 127.0.0.1:50051)
replay "${clear[@]}" --output-dir /data/frames --format geojson
frames=$(in_container find /data/frames -name '*.geojson' -size +0 | wc -l)
((frames > 0)) || fail "the replay left no frames"
echo "replay: $frames frames"
stop_server "when idle"

start_server
replay "${clear[@]}" --rate 2 >/dev/null 2>&1 &
client=$!
sleep 2
kill -0 "$client" 2>/dev/null || fail "the replay at two frames a second is over too early"
stop_server "under an open stream"
wait "$client" || true

# As docker/compose.tls.yaml has it.
docker/try_tls.sh "$root/tls"
echo "127.0.0.1 server" >>"$root/etc/hosts"
image_environment=("${environment[@]}")
mapfile -t composed < <(composed environment server)
environment=("${image_environment[@]}" "${composed[@]}")
mapfile -t arguments < <(composed command server)
command=("${entry_point[@]}" "${arguments[@]}")
start_server
echo "healthy over TLS"
environment=("${image_environment[@]}")
! replay "${clear[@]}" 2>/dev/null || fail "a server with TLS takes a replay in the clear"
mapfile -t composed < <(composed environment replay)
environment+=("${composed[@]}")
replay --server server:50051
! in_container env -u PARTIEMC_TOKEN_FILE partiemc info --server server:50051 >/dev/null 2>&1 ||
  fail "a server with tokens answers who has none"
echo "replay over TLS, with a token"
stop_server "over TLS"
echo "test_image.sh: passed"
