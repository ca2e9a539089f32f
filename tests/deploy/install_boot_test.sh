#!/usr/bin/env bash
# Tests the packages in a bare Debian root: installation, boot, start, kill, purge.
. "$(dirname "$0")/vehicle.sh"

build_packages
errors=$(lintian --fail-on error "$packages"/perdure*.deb 2>&1) || fail "lintian: $errors"
ok "lintian has no errors ($(grep -c ^W: <<< "$errors" || true) warnings)"
make_base
make_drive
say "the root is made"
install_packages "/packages/perdure-services_*.deb /packages/perdure-tools_*.deb /packages/perdure-models_*.deb iceoryx"
say "the packages are installed"

boot
say "it is booted"
inside perdure-capture --config /etc/perdure/capture.yaml --set dataset.path=/drive --check-config ||
  fail "the installed configuration is refused"
inside systemctl start perdure-capture > "$work/refused.log" 2>&1 && fail "capture starts without a drive"
[ "$(show capture ExecMainStatus)" = 78 ] && ok "capture without a drive stays down with 78" ||
  fail "capture without a drive: $(show capture ExecMainStatus)"
inside sed -i 's|^  path: ""  *#|  path: /drive #|' /etc/perdure/capture.yaml

inside perdure pipeline --data /drive --odometry truth --detections simulated --seconds 3 --quiet \
  --out /tmp/pipeline > "$work/pipeline.log" 2>&1 && inside test -s /tmp/pipeline/objects_final.csv &&
  ok "perdure pipeline finds the installed configuration" || fail "perdure pipeline: $(cat "$work/pipeline.log")"

# Objects must appear within ten seconds of the start.
inside systemctl reset-failed
start=$(($(date +%s%N) / 1000000))
inside systemctl start perdure.target
say "the target is active"
if inside timeout 20 sh -c 'perdure echo objects | grep -m 1 "\"id\""' > "$work/objects.json"; then
  took=$(($(date +%s%N) / 1000000 - start))
  [ "$took" -le 10000 ] && ok "objects $took ms after systemctl start" || fail "objects only after $took ms"
else
  fail "no objects in 20 s"
  inside journalctl --no-pager -n 60 -u 'perdure-*' || true
fi

# Checks the settings of the units at run time.
policy() { inside cat "/proc/$(pid_of "$1")/stat" | awk '{print $41, $40}'; } # policy, priority
[ "$(policy capture)" = "2 10" ] && [ "$(policy vio)" = "2 5" ] && ok "capture and vio run with real-time priority" ||
  fail "scheduling of capture $(policy capture), of vio $(policy vio)"
for service in capture vio inference semantic_filter map_store; do
  user=$(inside stat -c %U "/proc/$(pid_of $service)")
  caps=$(inside sed -n 's/^CapEff:\s*//p;s/^NoNewPrivs:\s*//p' "/proc/$(pid_of $service)/status" | tr '\n' ' ')
  [ "$user $caps" = "perdure 0000000000000000 1 " ] || fail "$service runs as $user with $caps"
done
ok "all run as perdure, without capabilities"
inside mkdir -p /etc/systemd/system/perdure-vio.service.d
inside sh -c 'printf "[Service]\nCPUAffinity=1\n" > /etc/systemd/system/perdure-vio.service.d/core.conf'
inside systemctl daemon-reload
inside systemctl restart perdure-vio
allowed=$(inside sed -n 's/^Cpus_allowed_list:\s*//p' "/proc/$(pid_of vio)/status")
[ "$allowed" = 1 ] && ok "CPUAffinity=1 holds vio on core 1" || fail "vio runs on $allowed"

for service in capture vio inference semantic_filter map_store; do
  pid=$(pid_of $service)
  inside kill -KILL "$pid"
  within 10 active_with_other_pid $service "$pid" && ok "$service is back $took ms after kill -9" || fail "$service is not back"
done
for service in vio inference map_store; do
  pid=$(pid_of $service)
  inside kill -STOP "$pid"
  within 20 active_with_other_pid $service "$pid" && ok "$service is back $took ms after SIGSTOP" || fail "$service stays stopped"
done
watchdogs=$(inside journalctl --no-pager -u 'perdure-*' | grep -c 'Watchdog timeout' || true)
[ "$watchdogs" -eq 3 ] && ok "the watchdog says so three times" || fail "$watchdogs watchdog timeouts in the journal"
inside timeout 20 sh -c 'perdure echo objects | grep -m 1 "\"id\""' > "$work/objects.json" && ok "objects go on" || fail "no objects any more"
inside perdure status || say "status: $?"

# An upgrade restarts the running services.
pid=$(pid_of vio)
inside sh -c 'dpkg -i /packages/perdure-services_*.deb' > "$work/upgrade.log" 2>&1 || { tail "$work/upgrade.log"; fail "dpkg -i"; }
within 10 active_with_other_pid vio "$pid" && ok "an upgrade restarts vio" || fail "after an upgrade vio is $(show vio ActiveState)"

# A purge stops the services and keeps the data.
inside rm -r /etc/systemd/system/perdure-vio.service.d
inside sh -c 'DEBIAN_FRONTEND=noninteractive apt-get -q -y purge "perdure-*"' > "$work/purge.log" 2>&1 || { tail "$work/purge.log"; fail "purge"; }
inside systemctl list-units --all 'perdure*' --no-legend | grep . && fail "units are left"
inside sh -c 'cat /proc/[0-9]*/comm' | grep perdure && fail "processes are left"
left=$(inside find / -xdev \( -path /proc -o -path /packages -o -path /drive -o -path '/var/cache/apt/*' -o -path /sys \) -prune -o -name '*perdure*' -print | sort)
inside test -s /var/lib/perdure/map.sqlite || fail "the map is gone"
expected="/var/lib/perdure"
[ "$left" = "$expected" ] && ok "purge leaves $left alone" || fail "purge leaves: $left"
inside systemctl poweroff > /dev/null 2>&1 || true
wait "$nspawn" || true
exit "$failed"
