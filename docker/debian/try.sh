#!/bin/bash
# Installs the Debian packages and the wheel in DIR on this system, tests each and removes them. For
# a bare root, as made by tests/bare_root.sh packages. Requires root.
set -euo pipefail
packages=$(realpath "$1")
work=$(mktemp -d)

say() { printf 'try.sh: %s\n' "$*"; }
fail() { say "$*" >&2; exit 1; }

say "installing"
apt-get update -qq
DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends \
  "$packages"/{partiemc-server,partiemc,libpartiemc-c1,python3-partiemc}_*.deb >"$work/apt.log" 2>&1 ||
  fail "apt-get: $(tail -n 5 "$work/apt.log")"

say "a server with the packaged configuration, as its own user"
id partiemc
setpriv --reuid partiemc --regid partiemc --clear-groups \
  partiemc-server --config /etc/partiemc/server.toml --web 127.0.0.1:8080 2>"$work/server.log" &
server=$!
for ((k = 0; k < 100; ++k)); do
  partiemc-server --health-check 2>/dev/null && break
  kill -0 "$server" || fail "the server has ended: $(cat "$work/server.log")"
  sleep 0.1
done
partiemc replay /usr/share/partiemc/recordings/dam_break.pemc --frames 0:20 --quiet --stats "$work/remote.csv"
partiemc replay /usr/share/partiemc/recordings/dam_break.pemc --frames 0:20 --quiet --local \
  --stats "$work/local.csv"
digests() { awk -F, 'NR == 1 { for (k = 1; k <= NF; ++k) if ($k ~ /digest/) use[k] } { for (k in use) printf "%s ", $k; print "" }' "$1"; }
[[ $(digests "$work/remote.csv" | wc -l) -eq 21 ]] || fail "not 20 frames"
cmp <(digests "$work/remote.csv") <(digests "$work/local.csv")
python3 - <<'PYTHON'
import urllib.request
page = urllib.request.urlopen("http://127.0.0.1:8080/").read()
assert b"PartiEMC" in page, page[:200]
PYTHON

readonly square='import partiemc
result = partiemc.reconstruct([[x, y] for x in range(10) for y in range(10)], spacing=1)
assert 95 < result.area < 105, result.area
print(partiemc.__file__, result.area)'
say "Python from its package"
python3 -c "$square"
say "C from its library, by Python's ctypes"
python3 -c 'import ctypes; ctypes.CDLL("libpartiemc_c.so.1").partiemc_open'
say "manual pages and completion"
for page in partiemc partiemc-replay partiemc-server; do
  zcat "/usr/share/man/man1/$page.1.gz" | grep -q '^\.SH OPTIONS' || fail "no page of $page"
  [[ $page != *replay ]] || continue
  bash -n "/usr/share/bash-completion/completions/$page"
done
kill "$server"
wait "$server" || fail "the server did not drain: $(cat "$work/server.log")"

say "removing"
apt-get purge -qq -y partiemc-server partiemc libpartiemc-c1 python3-partiemc >>"$work/apt.log" 2>&1
left=$(find /etc /usr /var /opt -iname '*partiemc*' -not -path '/var/log/*' -not -path '/var/cache/*')
[[ -z $left ]] || fail "left behind: $left"

say "the wheel, unpacked beside NumPy"
python3 -m zipfile -e "$packages"/partiemc-*.whl "$work/site"
PYTHONPATH=$work/site python3 -c "$square"
say "all well"
