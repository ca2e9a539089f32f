#!/usr/bin/env bash
# Checks that the commands of deploy/ report invalid arguments.
set -euo pipefail
cd "$PERDURE_SOURCE"
expect() { # STATUS WORDS COMMAND …
  local wanted=$1 words=$2 status=0 out
  shift 2
  out=$("$@" 2>&1) || status=$?
  if [ "$status" -ne "$wanted" ] || ! grep -qF -- "$words" <<< "$out"; then
    echo "$*: status $status instead of $wanted, or not \"$words\": $out"
    exit 1
  fi
}
expect 64 "--model FILE.onnx" deploy/demo --data a-drive
expect 64 "--model FILE.onnx" deploy/demo --headless --data=a-drive
expect 0 "--data DIR" deploy/demo --help
expect 64 "unknown option '--everything'" deploy/install --everything
expect 0 "--runtime" deploy/install --help
expect 64 "unknown option '--everything'" deploy/package --everything
expect 0 "perdure-{services,tools,gateway,ros2,python,models,dev}" deploy/package --help
for script in deploy/demo deploy/install deploy/package tests/run .ci/run; do bash -n "$script"; done
# libcamera loads its sensor modules at run time. They are not in the program's dependencies, so
# that the list must name them.
grep -qx libcamera-ipa <<< "$(deploy/install --list --runtime)" || {
  echo "deploy/install --runtime installs libcamera without its modules for sensors, libcamera-ipa"
  exit 1
}
