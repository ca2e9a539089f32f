# Functions of guest_test.sh that prepare the disk with the tested programs, start the camera, and
# run the guest.

# stage FOLDER: fills FOLDER with the files of the package perdure-services at their installed
# paths, and with the guest's job.
stage() {
  local tree=$1
  rm -rf "$tree"
  DESTDIR=$tree cmake --install "$PERDURE_BUILD" --component services --prefix /usr > /dev/null
  # Folders outside the prefix are those of the build's configuration.
  local etc
  etc=$(dirname "$(find "$tree" -name capture.yaml)")
  mkdir -p "$tree/etc/perdure" "$tree/guest" "$tree/etc/systemd/system/multi-user.target.wants"
  [ "$etc" = "$tree/etc/perdure" ] || cp -r "$etc/." "$tree/etc/perdure/"
  rm -rf "$tree/usr/local" "$tree/usr/share/perdure/models" "$tree/usr/share/perdure/config"
  ln -s /etc/perdure "$tree/usr/share/perdure/config"
  sed -i 's|/usr/local/var|/var|' "$tree"/etc/perdure/*.yaml
  sed -i -e 's|^source: dataset|source: libcamera|' -e 's|^rig: ""|rig: /etc/perdure/rig.yaml|' -e 's|rate_hz: 20.0|rate_hz: 10|' -e 's|rate_hz: 200.0|rate_hz: 50|' \
    -e 's|exposure_ms: 0 |exposure_ms: 10 |' -e 's|gain: 0 |gain: 2 |' -e 's|trigger: ""|trigger: timer|' "$tree/etc/perdure/capture.yaml"
  cp "$guest/inside/rig.yaml" "$tree/etc/perdure/"
  cp "$guest"/inside/*.sh "$PERDURE_BUILD/tests/guest_listener" "$tree/guest/"
  cp "${PERDURE_GUEST_CAPTURE:-$tree/usr/bin/perdure-capture}" "$tree/usr/bin/perdure-capture.new"
  mv "$tree/usr/bin/perdure-capture.new" "$tree/usr/bin/perdure-capture"
  strip --strip-debug "$tree"/usr/bin/* "$tree/guest/guest_listener"
  cp "$guest/inside/guest-test.service" "$tree/etc/systemd/system/"
  ln -s ../guest-test.service "$tree/etc/systemd/system/multi-user.target.wants/"
  mkdir -p "$tree/etc/systemd/system/perdure-capture.service.d"
  # The emulator stalls for seconds on a busy machine. The longer watchdog time avoids false alarms.
  # MALLOC_PERTURB_ overwrites freed memory, which exposes its use.
  printf '[Service]\nWatchdogSec=30\nLimitCORE=infinity\nTimeoutStopFailureMode=abort\nTimeoutAbortSec=60\nEnvironment=MALLOC_PERTURB_=165\n' \
    > "$tree/etc/systemd/system/perdure-capture.service.d/core.conf"
}

# make_disk TREE IMAGE: makes a file system of TREE whose root folder belongs to root.
make_disk() { rm -f "$2"; mke2fs -q -t ext4 -F -E root_owner=0:0 -d "$1" "$2" 300M; }

# start_camera and run_guest write their output into the run's folder.
start_camera() {
  python3 "$guest/camera.py" "$run/camera.socket" "$run/share/command" > "$run/camera.log" 2>&1 &
  camera=$!
  for _ in $(seq 100); do [ ! -e "$run/camera.socket" ] || return 0; sleep .1; done
  fail "the camera does not start: $(cat "$run/camera.log")"
}
run_guest() { # LIMIT
  timeout "$1" qemu-system-x86_64 -accel tcg,thread=multi -cpu max -smp 2 -m 1024 -nographic -no-reboot -nic none \
    -kernel "$cache/vmlinuz" -initrd "$cache/initrd" \
    -append "root=/dev/vda rw console=ttyS0 quiet init=/sbin/guest-init mitigations=off systemd.show_status=no systemd.mask=getty@tty1.service systemd.mask=serial-getty@ttyS0.service systemd.mask=e2scrub_reap.service systemd.mask=getty-static.service systemd.mask=systemd-update-utmp-runlevel.service" \
    -drive "file=$cache/root.img,format=raw,if=virtio,snapshot=on" -drive "file=$run/disk.img,format=raw,if=virtio,snapshot=on" \
    -virtfs "local,path=$run/share,mount_tag=share,security_model=none" \
    -chardev "socket,id=camera,path=$run/camera.socket,reconnect=1" -device qemu-xhci,id=usb -device usb-redir,chardev=camera,bus=usb.0 \
    < /dev/null > "$run/serial.log" 2>&1
}
