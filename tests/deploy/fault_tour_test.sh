#!/usr/bin/env bash
# Injects faults under systemd in a booted root with the packages. `perdure status` must show each
# fault within two seconds. The services must recover or degrade as documented. No object of the map
# may be lost.
. "$(dirname "$0")/vehicle.sh"

# Makes a drive without camera images from 12 to 15 s, and without IMU samples from 20 to 23 s.
make_gaps() {
  [ -e "$work/gaps/objects_truth.json" ] && return
  rm -rf "$work/gaps.new"
  cp -al "$drive" "$work/gaps.new"
  cut_out() { # SENSOR FROM UNTIL, in seconds of the drive
    local file=$work/gaps.new/mav0/$1/data.csv
    awk -F, -v from="$2" -v until="$3" 'NR == 2 {first = $1} NR < 2 || ($1 - first) / 1e9 < from || ($1 - first) / 1e9 > until' \
      "$file" > "$file.cut"
    mv "$file.cut" "$file"
  }
  cut_out cam0 12 15
  cut_out imu0 20 23
  mv "$work/gaps.new" "$work/gaps"
}

now_ms() { echo $(($(date +%s%N) / 1000000)); }
# written_down NAME COMMAND: runs the command in the container and logs its output; each line begins
# with its time of arrival in ms.
written_down() {
  inside systemd-run --quiet --unit="$1" --property="StandardOutput=file:/var/log/$1" --property=StandardError=null \
    bash -c "$2 | while IFS= read -r line; do echo \"\$((\$(date +%s%N) / 1000000)) \$line\"; done"
}
status_log=$root/var/log/status odometry_log=$root/var/log/odometry

# seen_since MS PATTERN: waits up to six seconds for a matching status line after MS; sets `took` to
# the delay in ms.
seen_since() {
  local end=$(($1 + 6000)) at
  while true; do
    at=$(awk -v since="$1" '$1 >= since' "$status_log" | grep -E -m 1 "$2" | cut -d' ' -f1 || true)
    if [ -n "$at" ]; then took=$((at - $1)); return; fi
    [ "$(now_ms)" -lt "$end" ] || return 1
    sleep .1
  done
}
must_be_seen() { # FAULT MS PATTERN
  if ! seen_since "$2" "$3"; then
    fail "$1: not seen in status; last: $(tail -n 1 "$status_log" | cut -c1-3000)"
  elif [ "$took" -le 2000 ]; then ok "$1: seen in status after $took ms"
  else fail "$1: seen in status only after $took ms"; fi
}
well() { inside perdure status --seconds 1.5 > "$work/status.now" 2>&1; }
must_be_well() { # FAULT SECONDS
  local from
  from=$(now_ms)
  until well; do
    [ $(($(now_ms) - from)) -lt $(($2 * 1000)) ] || { fail "$1: not well after $2 s:"; cat "$work/status.now"; return; }
  done
  ok "$1: well again"
}
objects() { inside perdure map list 2> /dev/null | awk '$1 ~ /^[0-9]+$/ {print $1}' | sort; }
remember() { objects > "$work/objects.before"; }
must_keep() { # FAULT
  objects > "$work/objects.after"
  local ended lost
  # An object that an event reports as merged or gone is not lost.
  ended=$(inside timeout 2 perdure echo events 2> /dev/null | grep -E '"event":"(merged|gone)"' | grep -oE '"object_id":[0-9]+' | grep -oE '[0-9]+' | sort -u || true)
  lost=$(comm -23 "$work/objects.before" "$work/objects.after" | comm -23 - <(echo "$ended" | sort))
  [ -z "$lost" ] && ok "$1: all $(wc -l < "$work/objects.before") objects are there" || fail "$1: lost objects $lost"
}
# fresh DRIVE: restarts all services with an empty map, and waits until they are healthy.
fresh() {
  inside systemctl stop perdure.target 'perdure-*.service' # stopping only the target would not wait for the services
  inside sh -c 'rm -f /var/lib/perdure/*'
  inside sed -i "s|^  path: \S*  *#|  path: $1 #|" /etc/perdure/capture.yaml
  inside systemctl start perdure.target
  until_well=$(now_ms)
  until well; do
    [ $(($(now_ms) - until_well)) -lt 15000 ] || { fail "it does not get well:"; cat "$work/status.now"; return; }
  done
  remember
}

build_packages
make_base
make_drive
make_gaps
install_packages "/packages/perdure-services_*.deb /packages/perdure-tools_*.deb /packages/perdure-models_*.deb iceoryx libfaketime"
boot --bind-ro="$work/gaps:/gaps"
say "it is booted"
inside sed -i 's|^  path: ""  *#|  path: /drive #|' /etc/perdure/capture.yaml
# A separate file system, which the test can fill.
inside mount -t tmpfs -o size=1500M,mode=0750 none /var/lib/perdure
inside chown perdure:perdure /var/lib/perdure
written_down status "perdure status --watch --json"

fresh /drive
for service in vio inference semantic_filter map_store; do
  remember
  at=$(now_ms)
  inside kill -KILL "$(pid_of $service)"
  must_be_seen "kill -9 of $service" "$at" "\"name\":\"$service\",\"level\":\"(degraded|failed)\""
done
must_be_well "kill -9" 10
must_keep "kill -9"

fresh /drive
at=$(now_ms)
inside kill -STOP "$(pid_of semantic_filter)"
must_be_seen "SIGSTOP of semantic_filter" "$at" '"name":"semantic_filter","level":"failed"'
must_be_well "SIGSTOP" 12
must_keep "SIGSTOP"

fresh /drive
at=$(now_ms)
inside sh -c 'fallocate -l 1490M /var/lib/perdure/ballast || true; dd if=/dev/zero of=/var/lib/perdure/ballast2 bs=4k 2> /dev/null || true'
must_be_seen "disk full" "$at" '"name":"disk /var/lib/perdure","level":"failed"'
seen_since "$at" '"(disk_full|state_not_written|run_state_unwritable)":' && ok "disk full: counted after $took ms" || fail "disk full: nobody counts it"
inside rm /var/lib/perdure/ballast /var/lib/perdure/ballast2
must_be_well "disk full" 10
must_keep "disk full"

# Sets only the services' wall clock five seconds ahead; the test must not change the machine's own
# clock.
inside mkdir -p /etc/systemd/system/perdure-.service.d
inside sh -c 'printf "[Service]\nEnvironment=LD_PRELOAD=$(dpkg -L libfaketime | grep -m 1 /libfaketime.so.1) FAKETIME_TIMESTAMP_FILE=/run/faketime FAKETIME_CACHE_DURATION=1 FAKETIME_DONT_FAKE_MONOTONIC=1\n" > /etc/systemd/system/perdure-.service.d/clock.conf'
inside sh -c 'echo +0 > /run/faketime'
inside systemctl daemon-reload
fresh /drive
at=$(now_ms)
inside sh -c 'echo +5 > /run/faketime'
must_be_seen "clock stepped by 5 s" "$((at + 1000))" '"name":"clock","level":"degraded"' # the file is read once a second
seen_since "$at" '"name":"objects","level":"failed"' && fail "clock stepped: objects stop"
must_keep "clock stepped"
inside rm -r /etc/systemd/system/perdure-.service.d
inside systemctl daemon-reload

# RouDi is killed and restarted. Services that start in between send images over the network
# interface.
for service in capture vio inference semantic_filter map_store; do
  inside sh -c "printf 'bus:\n  shared_memory_mb: 8\n' >> /etc/perdure/$service.yaml"
done
inside systemctl enable --quiet --now iox-roudi
fresh /drive
grep -q 'images go through shared memory' "$work/status.now" && ok "images go through shared memory" || fail "no shared memory: $(cat "$work/status.now")"
at=$(now_ms)
inside systemctl kill --kill-who=main --signal=KILL iox-roudi
must_be_seen "RouDi killed" "$at" '"level":"degraded"[^}]*RouDi'
sleep 2
inside systemctl is-active --quiet iox-roudi && ok "RouDi killed: it is back" || fail "RouDi stays away"
awk -v since="$at" '$1 >= since' "$status_log" | grep -q '"name":"objects","level":"failed"' && fail "RouDi killed: objects stop" || ok "RouDi killed: objects go on"
must_keep "RouDi killed"
for service in capture vio inference semantic_filter map_store; do
  inside sed -i '/^bus:$/,$d' "/etc/perdure/$service.yaml"
done
inside systemctl disable --quiet --now iox-roudi

# Sensors that fail and return.
fresh /gaps
written_down odometry "perdure echo odometry"
sleep 22
# gap N: prints the time of the last odometry before its N-th gap of more than a second.
gap() { awk -v n="$1" '$1 ~ /^[0-9]+$/ && before && $1 - before > 1000 && ++k == n {print before; exit} {before = $1}' "$odometry_log"; }
at=$(gap 1)
if [ -n "$at" ]; then
  must_be_seen "camera gone" "$at" '"name":"(frame/cam0|odometry)","level":"failed"'
else
  fail "camera gone: odometry goes on"
fi
at=$(gap 2)
if [ -n "$at" ]; then must_be_seen "IMU gone" "$at" '"name":"imu","level":"failed"'; else fail "IMU gone: odometry goes on"; fi
must_be_well "camera and IMU back" 8
must_keep "camera and IMU gone"

inside systemctl poweroff > /dev/null 2>&1 || true
wait "$nspawn" || true
exit "$failed"
