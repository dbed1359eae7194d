#!/bin/bash
# Builds both images of the Dockerfile without a container engine and runs them like compose.yaml
# and compose.tls.yaml: on read-only roots, without privileges. Checks the health check, a replay of
# the client's image through haproxy, a browser and Prometheus, loopback by default, and exit code 0
# within 5 s of SIGTERM. Requires root; installs the missing packages of the set `image`. haproxy is
# Debian's, not its image. Keeps the base system in build/image, and removes every container and
# image at the end.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
  echo "test_image.sh: $*" >&2
  exit 1
}
(($(id -u) == 0)) || fail "making a root file system requires root"
docker/install.sh image

readonly work=$PWD/build/image
readonly base=$work/bookworm base_image=localhost/bookworm
readonly max_megabytes=160  # Limit of the server's image without its base.
mkdir -p "$work"
export BUILDAH_ISOLATION=chroot

# A separate store, so that other images stay untouched. Overlay if the kernel and the file system
# support it; vfs copies every layer and is many times slower.
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

unshare_pid=''
proxy=''
volume=''
cleanup() {
  [[ -z $proxy ]] || kill -KILL "$proxy" 2>/dev/null || true
  [[ -z $unshare_pid ]] || kill -KILL "$unshare_pid" 2>/dev/null || true
  "${buildah[@]}" rm --all >/dev/null 2>&1 || true
  "${buildah[@]}" rmi --all --force >/dev/null 2>&1 || true
  umount "$store"/*/overlay 2>/dev/null || true
  rm -rf "$store" "$volume"
}

# Replaces the base of the Dockerfile, which would require a registry.
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

build_images() {
  local target options=() began=$SECONDS
  [[ -z ${NODE_EXTRA_CA_CERTS:-} ]] || options=(
    --volume "$NODE_EXTRA_CA_CERTS:/authority.pem:ro"
    --build-arg NODE_EXTRA_CA_CERTS=/authority.pem)
  for target in server client; do
    if ! "${buildah[@]}" bud --pull-never --layers --format docker --build-arg "BASE=$base_image" \
      "${options[@]}" -f docker/Dockerfile --target "$target" -t "partiemc-$target" . \
      >"$work/build.log" 2>&1; then
      tail -n 40 "$work/build.log" >&2
      fail "the image does not build; the whole output is in ${work#"$PWD/"}/build.log"
    fi
  done
  echo "both images built in $((SECONDS - began)) s"
}

# configured IMAGE FIELD: a field of the image's configuration, one value per line.
configured() {
  "${buildah[@]}" inspect --type image --format "$2" "$1" | sed '/^$/d'
}
lines_of() {
  configured "$1" "{{with .Docker.Config.$2}}{{range .}}{{println .}}{{end}}{{end}}"
}

# Creates a container of an image and prints its root file system.
root_of() {
  "${buildah[@]}" mount "$("${buildah[@]}" from --pull-never "$1")"
}

# added_megabytes ROOT: size of an image without its base.
added_megabytes() {
  local all base_alone
  all=$(du -sx --block-size=MB "$1" | cut -d M -f 1)
  base_alone=$(du -sx --block-size=MB "$base" | cut -d M -f 1)
  echo $((all - base_alone))
}

# The environment or command of a service in compose.yaml, with compose.tls.yaml on top if given,
# one value per line.
composed() {
  /usr/bin/python3 - "$@" <<'PYTHON'
import sys, yaml

key, service, *files = sys.argv[1:]
found = {} if key == "environment" else []
for file in files:
    value = yaml.safe_load(open(f"docker/{file}"))["services"][service].get(key)
    if value is not None:
        found = {**found, **value} if key == "environment" else value
for line in found if key == "command" else (f"{name}={text}" for name, text in found.items()):
    print(line)
PYTHON
}

# Emulates an engine's `run` with read_only, cap_drop ALL and no-new-privileges inside of
# namespaces: ROOT with a read-only /proc, VOLUME at /data if given, no capability.
readonly contained='
  root=$1 volume=$2 && shift 2
  mount --rbind "$root" "$root"
  [[ -z $volume ]] || mount --bind "$volume" "$root/data"
  mount -o remount,bind,ro "$root"
  exec env -i "$@"'
# unprivileged ROOT USER: prefix of a command.
unprivileged() {
  words=(chroot "$1" setpriv --reuid="$2" --regid="$2" --clear-groups --no-new-privs
    --bounding-set=-all --inh-caps=-all --ambient-caps=-all)
}

# The program is process 1 of its container.
start_server() {
  local attempt words
  unprivileged "$server_root" "$server_user"
  unshare --mount --pid --net --fork --kill-child --mount-proc="$server_root/proc" \
    bash -c "set -e; ip link set lo up; $contained" bash "$server_root" "" \
    "${server_environment[@]}" "${words[@]}" "${command[@]}" &
  unshare_pid=$!
  for ((attempt = 0; attempt < 300; ++attempt)); do
    kill -0 "$unshare_pid" 2>/dev/null || fail "the server ended before it was healthy"
    server=$(pgrep -P "$unshare_pid") && in_server "${check[@]:1}" 2>/dev/null && return
    sleep 0.1
  done
  fail "the server is not healthy after 30 s"
}

# Emulates an engine's `exec`.
in_server() {
  local words
  unprivileged "$server_root" "$server_user"
  nsenter --target "$server" --mount --pid --net \
    env -i "${server_environment[@]}" "${words[@]}" "$@"
}

# A container of the client's image in the server's network.
run_client() {
  local words
  unprivileged "$client_root" "$client_user"
  nsenter --target "$server" --net unshare --mount --pid --fork --kill-child \
    --mount-proc="$client_root/proc" bash -c "set -e; $contained" bash "$client_root" "$volume" \
    "${client_environment[@]}" "${words[@]}" partiemc "$@"
}

# start_proxy [FILE...]: haproxy in the server's network, with the environment of the proxy of
# these compose files.
start_proxy() {
  local environment attempt
  mapfile -t environment < <(composed environment proxy "$@" |
    sed "s,=/tls/,=$server_root/tls/,; s,^PARTIEMC_PROXY=:50051$,PARTIEMC_PROXY=127.0.0.1:50050,")
  nsenter --target "$server" --net env -i "${environment[@]}" \
    /usr/sbin/haproxy -db -q -f docker/haproxy.cfg &
  proxy=$!
  for ((attempt = 0; attempt < 100; ++attempt)); do
    nsenter --target "$server" --net ss --no-header --listening --tcp 'sport = :50050' |
      grep -q . && return
    sleep 0.1
  done
  fail "haproxy does not listen"
}
stop_proxy() {
  kill -KILL "$proxy"
  wait "$proxy" 2>/dev/null || true
  proxy=
}

# Sends SIGTERM and expects exit code 0 within 5 s.
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
  run_client replay /usr/local/share/partiemc/recordings/dam_break.pemc --quiet "$@"
}

# fetched URL: the server's response to a request from its network.
fetched() {
  nsenter --target "$server" --net /usr/bin/python3 - "$1" <<'PYTHON'
import sys, urllib.request

print(urllib.request.urlopen(sys.argv[1], timeout=5).read().decode())
PYTHON
}

# Expects a read-only root, no capabilities, none to gain, and a user other than root.
check_privileges() {
  local status=/proc/$server/status uid folder
  for folder in /data /tmp; do
    ! in_server touch "$folder/file" 2>/dev/null || fail "the server can write to $folder"
  done
  uid=$(in_server id -u)
  ((uid != 0)) || fail "commands run as root"
  [[ $(awk '/^Uid:/ { print $2 $3 $4 $5 }' "$status") == "$uid$uid$uid$uid" ]] ||
    fail "the server does not run as user $uid"
  [[ $(awk '/^Cap/ && $2 !~ /^0+$/' "$status") == "" ]] || fail "the server has a capability"
  [[ $(awk '/^NoNewPrivs:/ { print $2 }' "$status") == 1 ]] || fail "the server may get privileges"
  echo "runs as user $uid on a read-only root, without capabilities"
}

# check_packages ROOT: compares the list of packages with the image's.
check_packages() {
  local list=$1/usr/local/share/partiemc/packages.tsv
  diff <(cut -f 1 "$list") <(chroot "$1" dpkg-query --show --showformat='${Package}\n') ||
    fail "the list of packages is not that of the image"
}

trap cleanup EXIT
choose_driver
make_base
build_images

server_root=$(root_of partiemc-server) client_root=$(root_of partiemc-client)
server_user=$(configured partiemc-server '{{.Docker.Config.User}}')
client_user=$(configured partiemc-client '{{.Docker.Config.User}}')
mapfile -t image_environment < <(lines_of partiemc-server Env)
mapfile -t client_environment < <(lines_of partiemc-client Env)
mapfile -t command < <(lines_of partiemc-server Entrypoint; lines_of partiemc-server Cmd)
mapfile -t check < <(lines_of partiemc-server Healthcheck.Test)
[[ -n $server_user && -n $client_user ]] || fail "an image names no user"
[[ ${check[0]:-} == CMD ]] || fail "the server's image has no health check"
[[ $(lines_of partiemc-client Entrypoint) == partiemc ]] || fail "the client's image runs no client"
readonly title='{{index .Docker.Config.Labels "org.opencontainers.image.title"}}'
for image in partiemc-server partiemc-client; do
  [[ -n $(configured "$image" "$title") ]] || fail "$image has no title"
done
check_packages "$server_root"
check_packages "$client_root"
megabytes=$(added_megabytes "$server_root")
echo "over the base: server $megabytes MB, client $(added_megabytes "$client_root") MB"
((megabytes <= max_megabytes)) || fail "more than $max_megabytes MB"
echo "server: ${command[*]}; health check: ${check[*]:1}"

# A volume for the client's user, as an engine creates it from the image's /data.
volume=$(mktemp -d "$work/volume.XXXXXX")
chown "$(stat -c %u:%g "$client_root/data")" "$volume"

server_environment=("${image_environment[@]}")
unprivileged "$server_root" "$server_user"
if unshare --net env -i "${server_environment[@]}" "${words[@]}" "${check[@]:1}" 2>/dev/null; then
  fail "the health check passes without a server"
fi
start_server
listens=$(nsenter --target "$server" --net ss --no-header --listening --tcp --numeric)
[[ $(awk '{ print $4 }' <<<"$listens") =~ ^(\[::ffff:127.0.0.1]|127.0.0.1):50051$ ]] ||
  fail "without a setting the server listens elsewhere than on loopback: $listens"
stop_server "by default"

# As in compose.yaml; and on loopback, which it leaves out.
mapfile -t composed < <(composed environment server compose.yaml)
server_environment=("${image_environment[@]}" "${composed[@]}" PARTIEMC_METRICS=127.0.0.1:9464
  PARTIEMC_WEB=127.0.0.1:8080)
# Server and proxy share a network here, so the proxy has another port.
mapfile -t replayed < <(composed command replay compose.yaml | sed 's/proxy:50051/proxy:50050/')
echo "127.0.0.1 server proxy" | tee -a "$server_root/etc/hosts" >>"$client_root/etc/hosts"
start_server
start_proxy compose.yaml
check_privileges
run_client "${replayed[@]}" >/dev/null
stop_proxy
frames=$(find "$volume/frames" -name '*.geojson' -size +0 | wc -l)
counted=$(fetched http://127.0.0.1:9464/metrics | awk '/^partiemc_frames_total/ { print $2 }')
((frames > 0 && frames == counted)) || fail "$frames frames replayed, $counted in the metrics"
[[ -s $volume/report.html && -s $volume/statistics.csv ]] || fail "the replay left no report"
echo "replay: $frames frames, as many in the metrics"
[[ $(fetched http://127.0.0.1:8080/) == *"<title>PartiEMC"* ]] || fail "the page is not served"
stop_server "when idle"

start_server
replay --server server:50051 --rate 2 >/dev/null 2>&1 &
client=$!
sleep 2
kill -0 "$client" 2>/dev/null || fail "the replay at two frames a second is over too early"
stop_server "under an open stream"
wait "$client" || true

# With compose.tls.yaml on top.
docker/try_tls.sh "$server_root/tls"
mkdir -p "$client_root/tls"
cp -a "$server_root"/tls/{ca.pem,tokens} "$client_root/tls"
mapfile -t composed < <(composed environment server compose.yaml compose.tls.yaml)
server_environment=("${image_environment[@]}" "${composed[@]}")
start_server
start_proxy compose.yaml compose.tls.yaml
echo "healthy behind TLS"
! replay --server proxy:50050 2>/dev/null || fail "a proxy with TLS takes a replay in the clear"
mapfile -t composed < <(composed environment replay compose.yaml compose.tls.yaml)
client_environment+=("${composed[@]}")
replay --server proxy:50050
mapfile -t client_environment < <(printf '%s\n' "${client_environment[@]}" |
  grep -v ^PARTIEMC_TOKEN)
refusal=$(run_client info --server proxy:50050 2>&1 >/dev/null) &&
  fail "a server with tokens answers who has none"
[[ $refusal == *"authorization: absent"* ]] || fail "who has no token is told: $refusal"
echo "replay over TLS, with a token"
stop_proxy
stop_server "behind TLS"
echo "test_image.sh: passed in $SECONDS s"
