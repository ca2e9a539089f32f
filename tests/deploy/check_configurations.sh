#!/usr/bin/env bash
# Checks that each service accepts its configuration file, and exits with 78 for an invalid one.
set -euo pipefail
cd "$PERDURE_SOURCE"
for service in capture vio inference semantic-filter map-store gateway ros2; do
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
# bus.yaml holds the settings of all processes. It is read together with a service's own settings,
# which take precedence. Services and commands reject an invalid bus.yaml.
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cp config/vio.yaml "$folder"
printf 'bus:\n  vehicle: cart\n  domain: 7\n' > "$folder/bus.yaml"
printed=$("$PERDURE_BIN/perdure-vio" --config "$folder/vio.yaml" --set bus.domain=8 --print-config)
grep -q 'vehicle: "\?cart' <<< "$printed" || { echo "bus.yaml is not read: $printed"; exit 1; }
grep -q 'domain: 8' <<< "$printed" || { echo "--set does not go before bus.yaml: $printed"; exit 1; }
printf 'bus:\n  vehicel: cart\n' > "$folder/bus.yaml"
for command in "perdure-vio --config $folder/vio.yaml --check-config" "perdure topics --seconds 0.1"; do
  status=0
  out=$(PERDURE_BUS="$folder/bus.yaml" "$PERDURE_BIN"/$command 2>&1) || status=$?
  [ "$status" -eq 78 ] && grep -q 'bus.yaml:2:3' <<< "$out" ||
    { echo "$command with a wrong bus.yaml: $status, $out"; exit 1; }
done
