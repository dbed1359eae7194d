#!/bin/bash
# usage: manual_page.sh FILE.gz PAGE NAME PROGRAM [VERB]
# Writes the manual page PAGE with the one-line description NAME from `PROGRAM [VERB] --help`.
set -euo pipefail
file=$1 page=$2 name=$3 program=$4 verb=${5-}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# help2man names the page after the program it runs.
cat >"$work/$page" <<SCRIPT
#!/bin/bash
[[ \$1 == --version ]] && exec echo "$page $("$program" --version | cut -d " " -f 2)"
exec "$program" $verb "\$@"
SCRIPT
chmod +x "$work/$page"
mkdir -p "$(dirname "$file")"
help2man --no-info --section 1 --name "$name" "$work/$page" | gzip -n9 >"$file.part"
mv "$file.part" "$file"
