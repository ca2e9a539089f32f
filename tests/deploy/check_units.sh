#!/usr/bin/env bash
# The systemd units are sound: systemd-analyze verify, with programs that exist here.
set -euo pipefail
command -v systemd-analyze > /dev/null || { echo "no systemd-analyze here: skipped"; exit 77; }
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
for unit in "$PERDURE_SOURCE"/deploy/systemd/*.service "$PERDURE_SOURCE"/deploy/systemd/*.target; do
  program=$(sed -n 's|^ExecStart=/usr/bin/\(\S*\).*|\1|p' "$unit")
  if [ -n "$program" ] && [ ! -x "$PERDURE_BIN/$program" ]; then
    echo "$unit starts $program, which is not built"
    exit 1
  fi
  sed 's|^ExecStart=\S*|ExecStart=/bin/true|' "$unit" > "$folder/$(basename "$unit")"
done
out=$(systemd-analyze verify --man=no "$folder"/*.service "$folder"/*.target 2>&1) || { echo "$out"; exit 1; }
if [ -n "$out" ]; then echo "$out"; exit 1; fi
