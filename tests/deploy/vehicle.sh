# Sourced by tests that boot Debian with the packages. Makes and boots a root, and gives functions
# to run commands in it. Needs root, systemd-nspawn, debootstrap and, the first time, Debian's
# mirror; exits with 77 (skipped) without them.
set -euo pipefail
cd "$PERDURE_SOURCE"

work=$PERDURE_SOURCE/build/vehicle
packages=$PERDURE_SOURCE/build/packages
drive=$work/drive
root=$work/root
. tests/deploy/mirror.sh
failed=0

skip() { echo "$1: skipped"; exit 77; }
say() { printf '%8.2f  %s\n' "$(($(date +%s%N) / 1000000 - began))e-3" "$1"; }
fail() { say "FAILED: $1"; failed=1; }
ok() { say "ok: $1"; }

[ "$(id -u)" -eq 0 ] || skip "not root, a container cannot be booted"
for program in systemd-nspawn debootstrap dpkg-buildpackage dh; do
  command -v "$program" > /dev/null || skip "$program is not here (deploy/install --package)"
done
began=$(($(date +%s%N) / 1000000))

# A mount namespace, so that nspawn's mounts do not remain if this script is killed.
if [ -z "${PERDURE_VEHICLE_NAMESPACE:-}" ]; then
  export PERDURE_VEHICLE_NAMESPACE=yes
  exec unshare --mount --propagation private "$0" "$@"
fi
mkdir -p "$work/archives/partial"

# PERDURE_KEEP_PACKAGES=yes uses existing packages.
build_packages() {
  [ "${PERDURE_KEEP_PACKAGES:-}" = yes ] && compgen -G "$packages/perdure-services_*.deb" > /dev/null && return
  deploy/package > "$work/package.log" 2>&1 || { tail -n 30 "$work/package.log"; fail "deploy/package"; exit 1; }
}

# The root has this machine's release, like the packages.
release=$(. /etc/os-release && echo "${VERSION_CODENAME:-bookworm}")
make_base() {
  [ -e "$work/base/etc/debian_version" ] && return
  [ -n "$mirror" ] || skip "apt's sources have no mirror of Debian; PERDURE_MIRROR names one"
  rm -rf "$work/base.new"
  debootstrap --variant=minbase --include=systemd,systemd-sysv,dbus,udev,procps,iproute2 \
    "$release" "$work/base.new" "$mirror" > "$work/debootstrap.log" 2>&1 ||
    skip "debootstrap cannot make a root ($(tail -n 1 "$work/debootstrap.log"))"
  mv "$work/base.new" "$work/base"
}

make_drive() {
  [ -e "$drive/objects_truth.json" ] && return
  "$PERDURE_BIN/perdure" simulate --scene street --seed 1 --seconds 30 --encoding jpeg --quiet \
    --out "$drive"
}

# in_root COMMAND …: runs a command in the root without booting it, with this machine's network.
in_root() {
  systemd-nspawn --quiet --register=no --keep-unit -D "$root" --bind-ro="$packages:/packages" \
    --bind="$work/archives:/var/cache/apt/archives" --setenv=DEBIAN_FRONTEND=noninteractive "$@"
}

install_packages() {
  rm -rf "$root"
  cp -a --reflink=auto "$work/base" "$root"
  in_root apt-get -q update > "$work/apt.log" 2>&1 || skip "apt-get update fails in the root"
  in_root sh -c "apt-get -q -y install --no-install-recommends $1" >> "$work/apt.log" 2>&1 ||
    { tail -n 20 "$work/apt.log"; fail "apt-get install"; exit 1; }
}

boot() {
  systemd-nspawn --quiet --register=no --keep-unit -b -D "$root" --private-network \
    --bind-ro="$drive:/drive" --bind-ro="$packages:/packages" "$@" > "$work/boot.log" 2>&1 < /dev/null &
  nspawn=$!
  trap 'kill -KILL "$nspawn" 2> /dev/null || true' EXIT
  for _ in $(seq 300); do
    leader=$(pgrep -P "$nspawn" | head -n 1 || true)
    [ -n "$leader" ] && inside systemctl is-system-running 2> /dev/null | grep -qE 'running|degraded' && return
    kill -0 "$nspawn" 2> /dev/null || skip "systemd-nspawn does not boot here ($(tail -n 1 "$work/boot.log"))"
    sleep .1
  done
  skip "systemd does not come up in the container"
}

# inside COMMAND …: runs a command in the booted root.
inside() { nsenter -t "$leader" -m -u -i -n -p -- "$@"; }
unit_of() { echo "perdure-${1//_/-}.service"; }
pid_of() { inside systemctl show -P MainPID "$(unit_of "$1")"; }
show() { inside systemctl show -P "$2" "$(unit_of "$1")"; }

# within SECONDS COMMAND …: repeats the command until it succeeds; sets `took` to the time in ms.
within() {
  local end=$(($(date +%s%N) / 1000000 + $1 * 1000)) start
  start=$(($(date +%s%N) / 1000000))
  shift
  until "$@" > /dev/null 2>&1; do
    [ $(($(date +%s%N) / 1000000)) -lt "$end" ] || return 1
    sleep .05
  done
  took=$(($(date +%s%N) / 1000000 - start))
}
active_with_other_pid() {
  [ "$(show "$1" ActiveState)" = active ] && [ "$(pid_of "$1")" != "$2" ]
}
