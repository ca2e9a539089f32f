#!/usr/bin/env bash
# Checks that the package perdure-gateway is complete: program, unit, configuration and page, run
# from the installed locations. On a closed bus the gateway reads all topics; it writes only queries
# and its health.
set -euo pipefail
folder=$(mktemp -d)
gateway=
trap '[ -z "$gateway" ] || kill "$gateway"; rm -r "$folder"' EXIT
fail() { echo "$*"; exit 1; }

DESTDIR=$folder/root cmake --install "$PERDURE_BUILD" --component gateway --prefix /usr > /dev/null
root=$folder/root
unit=$(find "$root" -name 'perdure-gateway.service')
config=$(find "$root" -path '*/perdure/gateway.yaml')
[ -n "$unit" ] && [ -n "$config" ] || fail "no unit or no gateway.yaml is installed"
[ "$(find "$root" -type f -perm -u+x ! -name '*.gz' -path '*/bin/*' | wc -l)" -eq 1 ] ||
  fail "it holds other programs than its own"
program=$(sed -n 's|^ExecStart=\(\S*\) .*|\1|p' "$unit")
[ -x "$root$program" ] || fail "the unit starts $program, which is not installed"
grep -q -- '--config /etc/perdure/gateway.yaml' "$unit" || fail "the unit reads another configuration"
"$root$program" --config "$config" --check-config

# The installed gateway finds its page, and stops on SIGTERM.
: > "$folder/log"  # creates the file before the loop below reads it
PERDURE_DOMAIN=57 "$root$program" --config "$config" --port 0 > "$folder/log" 2>&1 &
gateway=$!
for ((i = 0; i < 200; ++i)); do
  port=$(sed -n 's|.*http://127\.0\.0\.1:\([0-9]*\)/.*|\1|p' "$folder/log")
  [ -z "$port" ] || break
  kill -0 "$gateway" 2> /dev/null || break
  sleep 0.1
done
[ -n "$port" ] || fail "it does not start: $(cat "$folder/log")"
ask() { # PATH
  exec 3<> "/dev/tcp/127.0.0.1/$port"
  printf 'GET %s HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n' "$1" >&3
  tr -d '\0' <&3
  exec 3>&-
}
ask /healthz | grep -q '^HTTP/1.1 200' || fail "/healthz: $(ask /healthz)"
ask /metrics | grep -q '^perdure_gateway_clients 0' || fail "/metrics: $(ask /metrics)"
if [ -e "$PERDURE_BUILD/share/perdure/viewer/index.html" ]; then
  ask / | grep -q '<title>Perdure</title>' || fail "the installed page is not found"
  ask /foxglove_layout.json | grep -q '"3D!perdure"' || fail "the layout for Foxglove is not served"
fi
kill "$gateway"
status=0
wait "$gateway" || status=$?
gateway=
[ "$status" -eq 0 ] || fail "it ended with $status: $(cat "$folder/log")"

"$PERDURE_BIN/perdure" security init --dir "$folder/security" --vehicle ego > /dev/null
grep -q 'BindReadOnlyPaths=-/etc/perdure/security/gateway$' "$unit" || fail "the unit does not see its identity"
writes=$(grep -o '<publish>.*</publish>' "$folder/security/gateway/permissions.p7s" |
  grep -o '<topic>[^<]*' | sed 's|<topic>||' | sort | tr '\n' ' ')
[ "$writes" = "perdure/ego/health perdure/ego/map/correct perdure/ego/map/query " ] || fail "on a closed bus it may write $writes"
