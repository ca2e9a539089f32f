#!/bin/bash
# Sets up the IMU: Debian's bmi160 over i2c-stub, with the registers of a chip at rest, and a timer
# trigger. The camera needs no setup.
set -eu
modprobe i2c-stub chip_addr=0x68
modprobe i2c-dev
bus=$(grep -l 'SMBus stub' /sys/bus/i2c/devices/i2c-*/name | sed 's/.*i2c-\([0-9]*\).*/\1/')
set_register() { i2cset -y "$bus" 0x68 "$1" "$2" b; }
set_word() { # REGISTER VALUE
  set_register "$1" $(($2 & 255))
  set_register $(($1 + 1)) $(($2 >> 8 & 255))
}
set_register 0x00 0xd1                              # a BMI160
set_register 0x40 0x28; set_register 0x41 0x03      # acceleration: 100 Hz, 2 g
set_register 0x42 0x28; set_register 0x43 0x00      # rates: 100 Hz, 2000 degrees/s
set_word 0x0c 10; set_word 0x0e -20; set_word 0x10 0
set_word 0x12 512; set_word 0x14 0; set_word 0x16 16384
modprobe -a bmi160_i2c iio-trig-hrtimer perdure_imu # perdure_imu registers the chip
mountpoint -q /sys/kernel/config || mount -t configfs none /sys/kernel/config
mkdir /sys/kernel/config/iio/triggers/hrtimer/timer
udevadm settle
