#!/usr/bin/env python3
"""Counts parked cars by street: parked_cars.py map.sqlite streets.json

streets.json names lines in metres of the map's frame M: {"High Street": [[0, 0], [80, 2]], …}.
A car is parked at the nearest street, if that is within 10 m.
"""
import collections
import json
import sys

import numpy as np
import perdure

FARTHEST_M = 10.0
VEHICLES = ("car", "van", "truck", "bus")


def distance(place, line):
    """Distance from a point to a polyline, m."""
    line = np.asarray(line, float)
    from_, along = line[:-1], np.diff(line, axis=0)
    share = ((place - from_) * along).sum(1) / np.maximum((along**2).sum(1), 1e-12)
    nearest = from_ + np.clip(share, 0, 1)[:, None] * along
    return np.linalg.norm(place - nearest, axis=1).min()


def main(map_file, streets_file):
    map_ = perdure.Map(map_file)
    with open(streets_file, encoding="utf-8") as file:
        streets = json.load(file)
    parked = collections.Counter()
    for name in VEHICLES:
        for car in map_.by_class(name):
            if car.existence < 0.5 or map_.belief(car.id).moving > 0.5:
                continue
            far = {street: distance(car.position[:2], line) for street, line in streets.items()}
            street = min(far, key=far.get)
            parked[street if far[street] < FARTHEST_M else "elsewhere"] += 1
    for street, n in sorted(parked.items()):
        print(f"{street}: {n}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
