#!/bin/bash
# The job of the guest. The host judges the files that it leaves in /share. /share/options sets
# SECONDS_OF_FLOW, UNPLUGS, MISTAKES, UNPLUGS_WITH_VIO, STOPS, SEED.
set -u
export PATH=/guest:/usr/sbin:/usr/bin LC_ALL=C.UTF-8
modprobe -a 9p 9pnet_virtio
mkdir -p /share
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 share /share || poweroff -f
. /share/options
notes=/run/notes
mark() { echo "$1 $(cut -d' ' -f1 /proc/uptime)" | tee -a /share/marks; }
tell() { echo "$@" > /share/command; }
keep() {
  cp -f /run/job.log "$notes" /run/udev_events /share/ 2> /dev/null
  cat /sys/kernel/tracing/trace > /share/trace
  journalctl -o short-monotonic --no-pager -u 'perdure-*' > /share/journal
  dmesg > /share/dmesg
}
# until_frames SECONDS: waits for a frame that is newer than /run/told.
until_frames() {
  for ((i = 0; i < 10 * $1; ++i)); do
    [ ! /run/frame -nt /run/told ] || return 0
    [ -d "/proc/$first" ] || return 1
    sleep .1
  done
  return 1
}

echo '|/guest/keep_core.sh %P %e' > /proc/sys/kernel/core_pattern
bash /guest/sensors.sh || mark sensors_failed
mark booted
{
  uname -r
  ls -l /dev/video* /dev/media* /dev/iio*
  id perdure
  echo "mount $(cat /sys/bus/iio/devices/iio:device0/in_mount_matrix)"
  systemd-analyze time; systemd-analyze blame | head -12
} > /share/facts 2>&1

# Records times on CLOCK_MONOTONIC. The kernel's events are: a plug, the opening and the start of
# the camera by capture, an image, and a trigger of a sample. udevadm gives the time at which udev
# reports a node to its listeners.
cd /sys/kernel/tracing || exit
echo mono > trace_clock
echo 16384 > buffer_size_kb
echo 'p:plugged usb_new_device' > kprobe_events
echo 'p:unplugged usb_disconnect' >> kprobe_events
echo 'p:triggered iio_trigger_poll' >> kprobe_events
echo 'p:opened uvcvideo:uvc_v4l2_open' >> kprobe_events
echo 'p:streamed uvcvideo:uvc_start_streaming' >> kprobe_events
for event in kprobes/{plugged,unplugged,triggered,opened,streamed} v4l2/v4l2_dqbuf; do echo 1 > events/$event/enable; done
cd /

udevadm monitor > /run/udev_events &
# The listener must not be later than capture, so that both have priority over the test itself.
chrt --rr 5 guest_listener "$notes" /run/frame & listener=$!
touch /run/told
systemctl start perdure-capture
first=$(systemctl show -P MainPID perdure-capture)
until_frames 60 || mark no_frames
sleep 10
od -c /sys/bus/iio/devices/iio:device0/current_timestamp_clock > /share/clock
v4l2-ctl -d /dev/video0 -C auto_exposure,exposure_time_absolute,gain > /share/controls 2>&1
ps -o user= -p "$first" > /share/user
mark flow
sleep "$SECONDS_OF_FLOW"
mark flow_ends
keep

# The driver loses images while capture is stopped; it marks incomplete images as broken.
kill -STOP "$first"
sleep .9
kill -CONT "$first"
sleep 3
tell truncate 5
sleep 4
mark losses_end
tell silent 3
sleep 2
mark all_counted
keep
echo 0 > /sys/kernel/tracing/events/kprobes/triggered/enable

udev=$(systemctl show -P MainPID systemd-udevd)
udev_stands_still() { kill -STOP "$udev"; (sleep "$1"; kill -CONT "$udev") & } # SECONDS
RANDOM=$SEED
sleep 3
for ((n = 1; n <= UNPLUGS; ++n)); do
  [ -d "/proc/$first" ] || break
  case $((n % 8)) in
    3) tell silent 2; sleep 1.5 ;;              # capture has begun to open it again
    5) tell silent 2; sleep 1.$((RANDOM % 10)) ;;
    1) udev_stands_still 4 ;;                   # capture has given up the camera by then
  esac
  tell unplug 1.$((RANDOM % 10))
  while [ -e /share/command ]; do sleep .1; done
  sleep .5                                      # pending frames arrive
  touch /run/told
  [ $((n % 10)) -ne 0 ] || { mark "reached_$n"; cp -f "$notes" /share/; }
  case $((n % 8)) in
    6) sleep 1.$((RANDOM % 10)) ;;              # the next unplug comes soon: during the opening, or
                                                # before it
    *) until_frames 40 || mark "no_frames_after_$n"; sleep "0.$((RANDOM % 10))" ;;
  esac
done
mark "unplugged_$((n - 1))"
keep

# Odometry must continue after the camera is opened again.
if [ "$UNPLUGS_WITH_VIO" -gt 0 ]; then
  systemctl start perdure-vio
  sleep 20
  mark vio
  for ((n = 1; n <= UNPLUGS_WITH_VIO; ++n)); do
    tell unplug 1.5
    sleep 2
    touch /run/told
    until_frames 40
    sleep 6
  done
  sleep 5
  mark vio_ends
  systemctl show -P NRestarts perdure-vio > /share/restarts_of_vio
  systemctl stop perdure-vio
fi
mark end

# udev reports a present camera as removed. This really happens: udev reports the removal of the
# previous camera late, and both have the same node.
for ((n = 1; n <= MISTAKES; ++n)); do
  [ -d "/proc/$first" ] || break
  [ $((n % 2)) -eq 0 ] || kill -STOP "$first"   # libcamera then finds the removal and new images at
                                                # the same time
  udevadm trigger --settle --action=remove --subsystem-match=media
  sleep .5
  kill -CONT "$first"
  sleep "1.$((RANDOM % 10))"
  touch /run/told
  udevadm trigger --action=add --subsystem-match=media
  until_frames 20 || mark "no_frames_after_mistake_$n"
  sleep "1.$((RANDOM % 10))"
done
mark "mistaken_$((n - 1))"
systemctl show -P NRestarts perdure-capture > /share/restarts
# stop_capture KIND: writes the stop times that systemd measured, and the result.
stop_capture() {
  systemctl stop perdure-capture
  # shellcheck disable=SC2046 # words
  echo "$1" $(for what in ActiveExitTimestampMonotonic InactiveEnterTimestampMonotonic Result ExecMainStatus; do
    systemctl show -P "$what" perdure-capture
  done) >> /share/stops
}
stop_capture while_it_flows
systemctl show -P ExecMainStatus perdure-capture > /share/status
mark stopped
for ((n = 1; n < STOPS; ++n)); do
  touch /run/told
  systemctl start perdure-capture
  first=$(systemctl show -P MainPID perdure-capture)
  until_frames 30 || mark "no_frames_before_stop_$n"
  kind=(while_it_flows as_it_is_unplugged while_it_is_away as_it_comes_back while_it_is_silent while_udev_is_late)
  kind=${kind[n % 6]}
  case $kind in
    while_it_flows) sleep "0.$((RANDOM % 10))" ;;
    while_it_is_silent) tell silent 3; sleep "1.$((RANDOM % 10))" ;;
    as_it_is_unplugged) tell unplug 3; while [ -e /share/command ]; do :; done; sleep "0.0$((RANDOM % 10))" ;;
    while_it_is_away) tell unplug 3; sleep "1.$((RANDOM % 5))" ;;
    while_udev_is_late) udev_stands_still 10; tell unplug 3; sleep "$((RANDOM % 3)).$((RANDOM % 10))" ;;
    as_it_comes_back) tell unplug 1; sleep "1.$((RANDOM % 10))"; sleep "0.$((RANDOM % 10))" ;;
  esac
  stop_capture "$kind"
  kill -CONT "$udev"
  sleep 3
done
kill "$listener"
wait "$listener"
keep
mark done
sync
systemctl poweroff
