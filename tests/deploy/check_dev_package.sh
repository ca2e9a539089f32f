#!/usr/bin/env bash
# Checks that the installed development files are complete: the examples, built outside the tree
# with find_package(Perdure), receive objects.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cmake --install "$PERDURE_BUILD" --component dev --prefix "$folder/usr" > /dev/null
[ -s "$folder/usr/share/perdure/idl/objects.idl" ] || { echo "the IDL is not installed"; exit 1; }
cmake -S "$folder/usr/share/doc/perdure-dev/examples" -B "$folder/build" -G Ninja \
  -DCMAKE_PREFIX_PATH="$folder/usr" > "$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
grep -q "Perdure_DIR:PATH=$folder" "$folder/build/CMakeCache.txt" || { echo "another Perdure was found"; exit 1; }
cmake --build "$folder/build" > "$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
PERDURE_TOOL=$PERDURE_BIN/perdure PERDURE_EXAMPLE=$folder/build/subscribe_objects \
  "$PERDURE_BUILD/tests/tools_bus_test" --gtest_filter='*AProgramOfSomebodyElse*' > "$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
grep -q 'PASSED  . 1 test' "$folder/log" || { cat "$folder/log"; exit 1; }
