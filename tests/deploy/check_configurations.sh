#!/usr/bin/env bash
# Every configuration file of a service is accepted by it, and a wrong one is refused with 78.
set -euo pipefail
cd "$PERDURE_SOURCE"
for service in capture vio inference semantic-filter map-store; do
  file=config/${service//-/_}.yaml
  if [ -e "$file" ]; then "$PERDURE_BIN/perdure-$service" --config "$file" --check-config; fi
  wrong=$(mktemp)
  printf 'bus:\n  domian: 3\n  domain: many\nlog:\n  level: loud\n' > "$wrong"
  status=0
  out=$("$PERDURE_BIN/perdure-$service" --config "$wrong" --check-config 2>&1) || status=$?
  rm "$wrong"
  [ "$status" -eq 78 ] || { echo "perdure-$service: $status instead of 78: $out"; exit 1; }
  for place in :2:3: :3:11: :5:10:; do
    grep -q -- "$place" <<< "$out" || { echo "perdure-$service does not name $place: $out"; exit 1; }
  done
done
