#!/usr/bin/env bash
# The systemd units are sound: systemd-analyze verify, with programs that exist here; and closed:
# systemd-analyze security, 2.5 at most.
set -euo pipefail
command -v systemd-analyze > /dev/null || { echo "no systemd-analyze here: skipped"; exit 77; }
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cp -r "$PERDURE_SOURCE"/deploy/systemd/. "$folder"
for unit in "$folder"/*.service; do
  program=$(sed -n 's|^ExecStart=/usr/bin/\(perdure-\S*\).*|\1|p' "$unit")
  if [ -n "$program" ] && [ ! -x "$PERDURE_BIN/$program" ]; then
    echo "$unit starts $program, which is not built"
    exit 1
  fi
  sed -i 's|^ExecStart=\S*|ExecStart=/bin/true|' "$unit"
done
out=$(systemd-analyze verify --man=no "$folder"/*.service "$folder"/*.target 2>&1) || { echo "$out"; exit 1; }
if [ -n "$out" ]; then echo "$out"; exit 1; fi
for unit in "$folder"/*.service; do
  if ! out=$(systemd-analyze security --offline=true --threshold=25 "$unit" 2>&1); then
    echo "$(basename "$unit") is too open: $out"
    exit 1
  fi
done
