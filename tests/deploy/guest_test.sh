#!/usr/bin/env bash
# Tests live sensors on a real kernel: a UVC camera and a BMI160 in an emulated guest, with the
# units of capture and vio. The figures are copied by hand into the README of guest/.
# usage: guest_test.sh [--seconds 60] [--unplugs 100] [--mistakes 10] [--unplugs-with-vio 3]
# [--stops 20] [--seed 1]
set -euo pipefail
cd "$PERDURE_SOURCE"
guest=$PERDURE_SOURCE/tests/deploy/guest
cache=${PERDURE_GUEST_CACHE:-$PERDURE_SOURCE/build/guest}
run=$cache/run
seconds=60 unplugs=100 mistakes=10 with_vio=3 stops=20 seed=1
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds=$2 ;;
    --unplugs) unplugs=$2 ;;
    --mistakes) mistakes=$2 ;;
    --unplugs-with-vio) with_vio=$2 ;;
    --stops) stops=$2 ;;
    --seed) seed=$2 ;;
    *) echo "usage: $0 [--seconds N] [--unplugs N] [--mistakes N] [--unplugs-with-vio N] [--stops N] [--seed N]" >&2; exit 64 ;;
  esac
  shift 2
done
skip() { echo "$1: skipped"; exit 77; }
fail() { echo "FAILED: $1"; exit 1; }
[ "$(id -u)" -eq 0 ] || skip "not root, a guest's root cannot be made"
for program in qemu-system-x86_64 debootstrap mke2fs python3; do
  command -v "$program" > /dev/null || skip "$program is not here (deploy/install --guest)"
done
[ -x "$PERDURE_BUILD/tests/guest_listener" ] || skip "guest_listener is not built (the target long_tests)"
. "$guest/boot.sh"

"$guest/make_root.sh" "$cache" || exit $?
rm -rf "$run"
mkdir -p "$run/share"
stage "$run/tree"
make_disk "$run/tree" "$run/disk.img"
printf 'SECONDS_OF_FLOW=%s\nUNPLUGS=%s\nMISTAKES=%s\nUNPLUGS_WITH_VIO=%s\nSTOPS=%s\nSEED=%s\n' "$seconds" "$unplugs" "$mistakes" "$with_vio" "$stops" "$seed" > "$run/share/options"
start_camera
trap 'kill "$camera" 2> /dev/null || true' EXIT
run_guest $((600 + seconds + 30 * (unplugs + mistakes + stops))) || fail "the guest did not end: $(tail -n 5 "$run/serial.log")"
python3 "$guest/judge.py" "$run" --unplugs "$unplugs" --mistakes "$mistakes" --unplugs-with-vio "$with_vio" --stops "$stops"
