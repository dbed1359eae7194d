#!/bin/bash
# Creates the files that docker/compose.tls.yaml mounts. ca.pem: an authority, whose key is deleted.
# server.crt and server.key: a certificate for the hosts `proxy`, `server` and `localhost`, valid for
# 30 days. tokens: one random token, which the client sends and the server knows.
set -euo pipefail

if (($# != 1)) || [[ $1 == -* ]]; then
  echo "usage: docker/try_tls.sh DIRECTORY" >&2
  exit 2
fi
readonly directory=$1 days=30
readonly image_user=10001  # docker/Dockerfile

secrets=$(mktemp -d)
trap 'rm -rf "$secrets"' EXIT
mkdir -p "$directory"
new_key=(openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -noenc)
"${new_key[@]}" -x509 -days "$days" -subj "/CN=partiemc trial authority" \
  -keyout "$secrets/ca.key" -out "$directory/ca.pem" 2>"$secrets/log" &&
  "${new_key[@]}" -subj "/CN=server" -addext "subjectAltName=DNS:proxy,DNS:server,DNS:localhost" \
    -keyout "$directory/server.key" -out "$secrets/server.csr" 2>>"$secrets/log" &&
  openssl x509 -req -in "$secrets/server.csr" -copy_extensions copy -days "$days" \
    -CA "$directory/ca.pem" -CAkey "$secrets/ca.key" -out "$directory/server.crt" \
    2>>"$secrets/log" || {
  cat "$secrets/log" >&2
  exit 1
}
openssl rand -hex 32 >"$directory/tokens"

# Readable by the image's user only, if this script can set the owner.
if (($(id -u) == 0)); then
  chown "$image_user" "$directory"/{server.key,tokens}
  chmod 600 "$directory"/{server.key,tokens}
else
  chmod 644 "$directory"/{server.key,tokens}
  echo "try_tls.sh: everybody on this machine can read the key and the token in $directory" >&2
fi
