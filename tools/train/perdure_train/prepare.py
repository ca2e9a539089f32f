"""Pictures for training and tests: runs `perdure simulate` and converts its folders to chunks."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np

from .progress import Progress
from .simulated import read_folder

VIEWS = 40  # views of one random scene
SETS = {  # appearance set and first seed; the sets are disjoint
    "train": ("train", 1000),
    "calibration": ("train", 500_000),
    "test": ("test", 900_000),
}


def find_program(given):
    """Returns the `perdure` command: the given one, or from the newest build, or from the PATH."""
    if given:
        return str(given)
    root = Path(__file__).resolve().parents[3]
    builds = sorted(root.glob("build/*/bin/perdure"), key=lambda p: p.stat().st_mtime)
    found = str(builds[-1]) if builds else shutil.which("perdure")
    if not found:
        raise SystemExit("the perdure command is missing; build it, or give --perdure FILE")
    return found


def simulate(program, kind, seed, folder, threads):
    look_set, _ = SETS[kind]
    command = [program, "simulate", "--scene", "random", "--seed", str(seed), "--look-set", look_set,
               "--seconds", str(VIEWS), "--rate", "1", "--threads", str(threads), "--quiet",
               "--out", str(folder), "--size", "320x240"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\nfailed: {done.stderr.strip()}")


def make_chunk(program, kind, seed, folder, threads):
    """Creates the chunk of one scene; truth.json is written last to mark it as complete."""
    chunk, work = folder / f"{seed}", folder / f"{seed}.part"
    if (chunk / "truth.json").exists():
        return
    shutil.rmtree(work, ignore_errors=True)
    shutil.rmtree(chunk, ignore_errors=True)
    simulate(program, kind, seed, work, threads)
    images, frames = read_folder(work)
    chunk.mkdir(parents=True)
    np.save(chunk / "images.npy", images)
    (chunk / "truth.part").write_text(json.dumps({"frames": frames}))
    (chunk / "truth.part").rename(chunk / "truth.json")
    shutil.rmtree(work)


def prepare(program, cache, kind, count, threads=2):
    """Simulates scenes until a set has at least `count` pictures. Existing pictures are used."""
    folder, first = Path(cache) / kind, SETS[kind][1]
    folder.mkdir(parents=True, exist_ok=True)
    scenes = -(-count // VIEWS)
    progress = Progress(f"pictures for {kind}")
    for i in range(scenes):
        make_chunk(program, kind, first + i, folder, threads)
        progress.show((i + 1) / scenes, f"{(i + 1) * VIEWS} of {scenes * VIEWS}")
    return [folder / f"{first + i}" for i in range(scenes)]
