#!/usr/bin/env bash
# Checks the systemd units. They must pass systemd-analyze verify, with programs that exist, and
# have an exposure of at most 2.5 in systemd-analyze security. A unit must not set a key that the
# common drop-in sets, because systemd reads the drop-in later.
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

# keys FILE: lists the keys that FILE sets, except list keys, which accumulate.
keys() { sed -n 's/^\([A-Z][A-Za-z]*\)=.*/\1/p' "$1" | grep -vE '^(Documentation|After|RestrictAddressFamilies)$' | sort -u; }
common=$folder/perdure-.service.d/common.conf
for unit in "$folder"/perdure-*.service; do
  twice=$(comm -12 <(keys "$unit") <(keys "$common"))
  [ -z "$twice" ] || { echo "$(basename "$unit") sets $twice in vain: common.conf, read after it, sets it too"; exit 1; }
done
grep -q '^ProtectKernelTunables=false' "$folder"/perdure-capture.service.d/*.conf ||
  { echo "capture may not write /sys, where IIO has its rates, triggers and buffers"; exit 1; }
