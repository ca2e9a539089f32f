#!/usr/bin/env bash
# Checks that the package perdure-ros2 is complete: program, unit and configuration, run from the
# installed locations. On a closed bus the bridge reads topics and writes only its health.
set -euo pipefail
folder=$(mktemp -d)
bridge=
trap '[ -z "$bridge" ] || kill "$bridge"; rm -r "$folder"' EXIT
fail() { echo "$*"; exit 1; }

DESTDIR=$folder/root cmake --install "$PERDURE_BUILD" --component ros2 --prefix /usr > /dev/null
root=$folder/root
unit=$(find "$root" -name 'perdure-ros2.service')
config=$(find "$root" -path '*/perdure/ros2.yaml')
[ -n "$unit" ] && [ -n "$config" ] || fail "no unit or no ros2.yaml is installed"
[ "$(find "$root" -type f -perm -u+x -path '*/bin/*' | wc -l)" -eq 1 ] ||
  fail "it holds other programs than its own"
program=$(sed -n 's|^ExecStart=\(\S*\) .*|\1|p' "$unit")
[ -x "$root$program" ] || fail "the unit starts $program, which is not installed"
grep -q -- '--config /etc/perdure/ros2.yaml' "$unit" || fail "the unit reads another configuration"
"$root$program" --config "$config" --check-config

# The installed bridge runs, `perdure status` lists it, and it stops on SIGTERM.
export PERDURE_DOMAIN=58
"$root$program" --config "$config" > "$folder/log" 2>&1 &
bridge=$!
for ((i = 0; i < 100; ++i)); do
  "$PERDURE_BIN/perdure" status > "$folder/status" 2>&1 || true
  ! grep -q ' ros2  ' "$folder/status" || break
  kill -0 "$bridge" 2> /dev/null || break
done
grep -q ' ros2  ' "$folder/status" || fail "status does not know it: $(cat "$folder/status" "$folder/log")"
kill "$bridge"
status=0
wait "$bridge" || status=$?
bridge=
[ "$status" -eq 0 ] || fail "it ended with $status: $(cat "$folder/log")"

"$PERDURE_BIN/perdure" security init --dir "$folder/security" --vehicle ego > /dev/null
grep -q 'BindReadOnlyPaths=-/etc/perdure/security/ros2$' "$unit" || fail "the unit does not see its identity"
writes=$(grep -o '<publish>.*</publish>' "$folder/security/ros2/permissions.p7s" |
  grep -o '<topic>[^<]*' | sed 's|<topic>||' | sort | tr '\n' ' ')
[ "$writes" = "perdure/ego/health " ] || fail "on a closed bus it may write $writes"
