"""Runs the deployed service on simulated folders, and pairs detections with ground truth."""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from . import prepare
from .progress import Progress
from .scores import EMPTY, probabilities, read_detections
from .simulated import read_folder


def _arrays(frame):
    return {
        "boxes": np.array(frame["boxes"], float).reshape(-1, 4),
        "classes": np.array(frame["classes"], int),
        "azimuths": np.array(frame["azimuths"], float),
        "ignored": np.array(frame["ignored"], bool),
        "hulls": np.array(frame["hulls"], float).reshape(-1, 4),
    }


def _detect(program, data, model, threshold, clutter_rate, work):
    file = Path(work) / "detections.csv"
    command = [program, "detect", "--data", str(data), "--model", str(model), "--out", str(file),
               "--threshold", str(threshold), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\nfailed: {done.stderr.strip()}")
    cpu_ms = float(re.search(r"([\d.]+) ms of CPU", done.stdout).group(1))
    return read_detections(file, clutter_rate), cpu_ms


def _folder_of(program, cache, kind, seed, threads):
    """Returns the simulated folder in the cache, which `perdure detect` reads."""
    folder = Path(cache) / f"{kind}-folders" / str(seed)
    prepare.simulate(program, kind, seed, folder, threads)  # returns at once if complete
    return folder


def frames_of(program, cache, kind, scenes, model, clutter_rate, threshold=0.05, threads=2):
    """Returns [(detections, truth)] of all frames in the first scenes of a set, and the median CPU
    time per frame in ms.

    Detections have boxes, odds, azimuths and p, the calibrated probabilities.
    """
    result, times = [], []
    first = prepare.SETS[kind][1]
    progress = Progress(f"{kind} scenes")
    for i in range(scenes):
        folder = _folder_of(program, cache, kind, first + i, threads)
        with tempfile.TemporaryDirectory() as work:
            found, cpu_ms = _detect(program, folder, model, threshold, clutter_rate, work)
        times.append(cpu_ms)
        _, truth = read_folder(folder)
        for frame, true in enumerate(truth):
            detections = dict(found.get(frame, EMPTY))
            detections["p"] = probabilities(detections["odds"])
            result.append((detections, _arrays(true)))
        progress.show((i + 1) / scenes, f"{i + 1} of {scenes}")
    return result, float(np.median(times))
