#!/bin/bash
# Saves a core dump that the kernel passes on standard input.
# usage: keep_core.sh PID NAME
cat > "/share/core.$2.$1"
