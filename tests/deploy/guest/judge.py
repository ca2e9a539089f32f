#!/usr/bin/env python3
"""Judges the files that a guest left in its folder. Prints a line for each claim; exits with 1 if
one fails."""
import argparse
import pathlib
import sys

import claims
from notes import Run


class Report:
    def __init__(self):
        self.failed = False

    def claim(self, holds, text):
        print('ok:    ' if holds else 'FAILED:', text)
        self.failed |= not holds


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('run', type=pathlib.Path)
    parser.add_argument('--unplugs', type=int, required=True)
    parser.add_argument('--mistakes', type=int, required=True)
    parser.add_argument('--unplugs-with-vio', type=int, required=True)
    parser.add_argument('--stops', type=int, required=True)
    options = parser.parse_args()
    run, report = Run(options.run), Report()
    claims.the_guest_is_as_meant(run, report)
    if report.failed:
        return 1
    claims.controls_are_told(run, report)
    claims.flow_is_well(run, report)
    claims.stamps_are_the_kernels(run, report)
    claims.samples_are_mounted(run, report)
    claims.images_are_counted(run, report)
    claims.capture_lives(run, report, options.unplugs)
    claims.images_come_back(run, report)
    claims.mistakes_are_survived(run, report, options.mistakes)
    if options.unplugs_with_vio:
        claims.odometry_goes_on(run, report, options.unplugs_with_vio)
    if options.stops:
        claims.stops_are_quick(run, report, options.stops)
    return int(report.failed)


sys.exit(main())
