#!/usr/bin/env bash
# Runs the steps of a new user in a bare Debian root with its own network: deploy/install, the whole
# build, and the tests that are not labelled long. Takes an hour on two cores the first time. Root
# and build stay in build/clean/RELEASE, so that a later run rebuilds only what changed. Needs root,
# debootstrap and, the first time, Debian's mirror; exits with 77 (skipped) without them.
# usage: clean_root_test.sh RELEASE (bookworm, trixie)
set -euo pipefail
release=$1
cd "$PERDURE_SOURCE"
root=$PERDURE_SOURCE/build/clean/$release
. tests/deploy/mirror.sh
skip() { echo "$1: skipped"; exit 77; }

[ -n "$mirror" ] || skip "apt's sources have no mirror of Debian; PERDURE_MIRROR names one"
[ "$(id -u)" -eq 0 ] || skip "not root, a root cannot be made"
command -v debootstrap > /dev/null || skip "debootstrap is not here (deploy/install --package)"
# A mount namespace, so that no mount remains if this script is killed.
if [ -z "${PERDURE_CLEAN_NAMESPACE:-}" ]; then
  PERDURE_CLEAN_NAMESPACE=yes exec unshare --mount --propagation private "$0" "$@"
fi

if [ ! -e "$root/etc/debian_version" ]; then
  rm -rf "$root" "$root.new"
  mkdir -p "$root.new"
  debootstrap --variant=minbase --include=ca-certificates "$release" "$root.new" "$mirror" > "$root.log" 2>&1 ||
    skip "debootstrap cannot make a root ($(tail -n 1 "$root.log"))"
  debian_sources "$release" > "$root.new/etc/apt/sources.list"
  mv "$root.new" "$root"
fi
cp /etc/resolv.conf "$root/etc/"

# Copies the sources of this checkout, without the files that git ignores.
sources=$root/root/perdure
mkdir -p "$sources"
find "$sources" -mindepth 1 -maxdepth 1 ! -name build -exec rm -rf {} +
git ls-files -z --cached --others --exclude-standard | xargs -0 -I {} find {} -maxdepth 0 -print0 2> /dev/null |
  tar --create --null --files-from=- | tar --extract --directory "$sources"

mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount -t tmpfs tmpfs "$root/dev/shm" # separates RouDi's memory from that of the host
mount --rbind /sys "$root/sys"
inside() { # [--net] COMMAND …
  local alone=()
  if [ "$1" = --net ]; then
    alone=(unshare --net sh -c 'ip link set lo up && exec "$@"' sh)
    shift
  fi
  "${alone[@]}" chroot "$root" env -i HOME=/root LC_ALL=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    sh -c 'cd /root/perdure && exec "$@"' sh "$@"
}
inside deploy/install --build
inside --net tests/run
