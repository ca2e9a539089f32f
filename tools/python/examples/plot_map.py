#!/usr/bin/env python3
"""Draws a map from above: plot_map.py map.sqlite [map.png]. Needs Matplotlib."""
import sys

import numpy as np
import perdure

try:
    import matplotlib
except ImportError:
    sys.exit("plot_map.py draws with Matplotlib, which is missing: apt install python3-matplotlib")
if len(sys.argv) < 2:
    sys.exit(__doc__)
out = sys.argv[2] if len(sys.argv) > 2 else None
if out:
    matplotlib.use("Agg")  # needs no screen
import matplotlib.pyplot as plt
from matplotlib.patches import Ellipse, Polygon

objects = [o for o in perdure.Map(sys.argv[1]).objects() if o.existence > 0.5]
names = sorted({o.class_name for o in objects})
colours = dict(zip(names, plt.get_cmap("tab10").colors * len(names)))
figure, axes = plt.subplots(figsize=(9, 7))
for o in objects:
    length, width, _ = o.size
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * [length / 2, width / 2]
    turn = np.array([[np.cos(o.yaw), -np.sin(o.yaw)], [np.sin(o.yaw), np.cos(o.yaw)]])
    centre = o.position[:2]
    axes.add_patch(Polygon(centre + corners @ turn.T, color=colours[o.class_name], alpha=0.6))
    variances, axes_of = np.linalg.eigh(o.covariance[:2, :2])
    angle = np.degrees(np.arctan2(axes_of[1, 1], axes_of[0, 1]))
    across, along = 4 * np.sqrt(variances)  # ellipse diameters for 2 sigma
    axes.add_patch(Ellipse(centre, along, across, angle=angle, fill=False, linewidth=0.8))
    axes.annotate(str(o.id), centre, ha="center", va="center", fontsize=7)
for name in names:
    axes.scatter([], [], color=colours[name], marker="s", label=name)
axes.set(xlabel="x of M [m]", ylabel="y of M [m]", aspect="equal")
axes.autoscale_view()
if names:
    axes.legend()
figure.savefig(out, dpi=120, bbox_inches="tight") if out else plt.show()
