#!/usr/bin/env bash
# Makes a Debian root of this machine's release for the guest, its kernel, and the modules that
# Debian's kernel lacks: FOLDER/{root.img,vmlinuz,initrd}. Does nothing if the inputs are unchanged.
# Exits with 77 if a requirement is missing.
# usage: make_root.sh FOLDER
set -euo pipefail
here=$(dirname "$(realpath "$0")")
source=$(realpath "$here/../../..")
folder=$1
. "$here/../mirror.sh"
mkdir -p "$folder"
folder=$(realpath "$folder")
skip() { echo "$1: skipped"; exit 77; }
[ -n "$mirror" ] || skip "apt's sources have no mirror of Debian; PERDURE_MIRROR names one"

mapfile -t runtime < <("$source/deploy/install" --list --runtime)
packages=(systemd systemd-sysv udev kmod initramfs-tools zstd procps python3-minimal
  i2c-tools libcamera-ipa v4l-utils libasan8 libubsan1 "${runtime[@]}")
version=$(apt-cache depends linux-headers-amd64 2> /dev/null |
  sed -n 's/.*Depends: linux-headers-\([0-9].*\)/\1/p' | head -n 1)
series=$(cut -d. -f1,2 <<< "$version")
release=$(. /etc/os-release && echo "${VERSION_CODENAME:-bookworm}")
made_of=$({ echo "$version ${packages[*]}"; cat "$0" "$here"/kernel/*; } | sha256sum)
[ ! -e "$folder/root.img" ] || [ "$(cat "$folder/made_of" 2> /dev/null)" != "$made_of" ] || exit 0

[ -n "$version" ] && [ -d "/usr/src/linux-headers-$version" ] && [ -e "/usr/src/linux-source-$series.tar.xz" ] ||
  skip "the kernel's headers or its source are not here (deploy/install --guest)"

# Sources of IIO's timer trigger, from Debian's kernel.
modules=$folder/modules
rm -rf "$modules"
mkdir -p "$modules"
tar -C "$modules" -xf "/usr/src/linux-source-$series.tar.xz" --strip-components=3 --wildcards \
  '*/drivers/iio/industrialio-configfs.c' '*/drivers/iio/industrialio-sw-trigger.c' '*/drivers/iio/trigger/iio-trig-hrtimer.c'
mv "$modules"/trigger/*.c "$modules"
cp "$here"/kernel/* "$modules"
make -C "/usr/src/linux-headers-$version" M="$modules" modules > "$folder/modules.log" 2>&1 ||
  { tail -n 20 "$folder/modules.log"; exit 1; }

root=$folder/root
rm -rf "$root"
trap 'rm -rf "$root"' EXIT
debootstrap --variant=minbase --include=ca-certificates "$release" "$root" "$mirror" > "$folder/root.log" 2>&1 ||
  skip "debootstrap cannot make a root ($(tail -n 1 "$folder/root.log"))"
debian_sources "$release" > "$root/etc/apt/sources.list"
cp /etc/resolv.conf "$root/etc/"
printf 'path-exclude=/usr/share/%s/*\n' doc man locale > "$root/etc/dpkg/dpkg.cfg.d/small"
printf '#!/bin/sh\nexit 101\n' > "$root/usr/sbin/policy-rc.d"
chmod +x "$root/usr/sbin/policy-rc.d"
inside() { DEBIAN_FRONTEND=noninteractive LC_ALL=C chroot "$root" "$@" >> "$folder/root.log" 2>&1; }
inside apt-get -q update || skip "apt-get update fails in the root"
mkdir -p "$root/etc/initramfs-tools/conf.d"
# The initial RAM disk holds only the modules that reach the root, because its unpacking is slow in
# the emulator.
echo 'MODULES=list' > "$root/etc/initramfs-tools/conf.d/small"
printf '%s\n' virtio_pci virtio_blk ext4 crc32c_generic > "$root/etc/initramfs-tools/modules"
inside apt-get -q -y install --no-install-recommends initramfs-tools &&
  printf '%s\n' virtio_pci virtio_blk ext4 crc32c_generic > "$root/etc/initramfs-tools/modules" &&
  inside apt-get -q -y install --no-install-recommends "linux-image-$version" "${packages[@]}" ||
  { tail -n 20 "$folder/root.log"; exit 1; }
mkdir -p "$root/lib/modules/$version/extra"
cp "$modules"/*.ko "$root/lib/modules/$version/extra/"
inside depmod "$version"
cp "$root/boot/vmlinuz-$version" "$folder/vmlinuz"
cp "$root/boot/initrd.img-$version" "$folder/initrd"

# The first process copies the tested files over the root and then becomes systemd.
cat > "$root/sbin/guest-init" <<'TEXT'
#!/bin/sh
mount -o remount,rw / && mount -o ro /dev/vdb /mnt && cp -a /mnt/. / && umount /mnt && systemd-sysusers
exec /lib/systemd/systemd
TEXT
chmod +x "$root/sbin/guest-init"

rm -rf "$root"/var/lib/apt/lists/* "$root"/var/cache/apt/* "$root"/boot/* "$root/etc/resolv.conf"
mke2fs -q -t ext4 -F -d "$root" "$folder/root.img.new" 3G
mv "$folder/root.img.new" "$folder/root.img"
echo "$made_of" > "$folder/made_of"
