"""Support for the tests of tools/python: a separate network, programs, a recorded drive."""

import ctypes
import fcntl
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import numpy  # noqa: F401
except ImportError:
    print("Debian's python3-numpy is not installed")
    sys.exit(77)

BIN = pathlib.Path(os.environ["PERDURE_BIN"])
SOURCE = pathlib.Path(os.environ["PERDURE_SOURCE"])
BUILD = pathlib.Path(os.environ["PERDURE_BUILD"])
PEER = os.environ["PERDURE_PYTHON_PEER"]
PYTHON = sys.executable
_leases = []


def own_network():
    """Python version of isolateNetwork() of tests/common/bus; call it before perdure is
    imported."""
    os.environ.pop("CYCLONEDDS_URI", None)
    os.environ.pop("PERDURE_BUS", None)
    new_user, new_net = 0x10000000, 0x40000000
    libc = ctypes.CDLL(None, use_errno=True)
    alone = libc.unshare(new_net) == 0 or libc.unshare(new_user | new_net) == 0
    if alone and subprocess.call(["ip", "link", "set", "lo", "up"]) == 0:
        return
    for domain in range(100, 200):
        lock = open(f"/tmp/perdure-test-domain-{domain}.lock", "w")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            continue
        _leases.append(lock)
        os.environ["PERDURE_DOMAIN"] = str(domain)
        return
    raise RuntimeError("none of the domains 100 to 199 is free for a test")


def run(*command, **options):
    """Runs a command and returns its output; raises an error with the whole output on failure."""
    done = subprocess.run(
        [str(c) for c in command], capture_output=True, text=True, timeout=90, **options
    )
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


def perdure_tool(*arguments):
    return run(BIN / "perdure", *arguments)


class Child:
    """A program that runs beside the test; killed at the end of the scope."""

    def __init__(self, *command, **options):
        options.setdefault("stderr", subprocess.STDOUT)
        self.process = subprocess.Popen(
            [str(c) for c in command], stdout=subprocess.PIPE, text=True, **options
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def line(self):
        return self.process.stdout.readline()

    def end(self, seconds=30):
        """Waits for the program to end by itself; returns its remaining output."""
        output, _ = self.process.communicate(timeout=seconds)
        return output


def eventually(so, seconds=20):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if so():
            return True
        time.sleep(0.02)
    return False


class Drive:
    """Six seconds of the simulated street, and the pipeline's results."""

    def __init__(self):
        """Copies the drive that ctest has made (PERDURE_PYTHON_DRIVE), or makes it."""
        made = os.environ.get("PERDURE_PYTHON_DRIVE")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="perdure-python-"))
        if made:
            shutil.copytree(made, self.folder / "out")
        else:
            self.make()
        self.mcap = self.folder / "out/run.mcap"
        self.map = self.folder / "out/map.sqlite"

    def make(self):
        perdure_tool(
            "simulate", "--scene", "street", "--seconds", 6, "--rate", 10, "--size", "160x120",
            "--no-images", "--quiet", "--out", self.folder / "street",
        )  # fmt: skip
        perdure_tool(
            "pipeline", "--data", self.folder / "street", "--odometry", "truth", "--detections",
            "simulated", "--record", "--quiet", "--out", self.folder / "out",
        )  # fmt: skip

    def remove(self):
        shutil.rmtree(self.folder)


def lines_of(text):
    return [json.loads(line) for line in text.splitlines() if line.startswith("{")]


def same(test, message, value, path=""):
    """Compares a Python message with C++'s printed form of it (common/wire/json.h)."""
    import numpy as np
    import perdure
    from perdure.messages import SCHEMA

    if isinstance(message, perdure.Message):
        fields = {f[0]: f for f in SCHEMA[type(message).__name__]}
        for name, expected in value.items():
            if name == "bytes" and "pixels" in fields:
                test.assertEqual(message.pixels.size, expected, path)
                continue
            found = getattr(message, name)
            if fields[name][1] == "choice" and isinstance(expected, int):
                expected = fields[name][4][expected]
            same(test, found, expected, f"{path}.{name}")
        return
    if isinstance(message, np.ndarray):
        if isinstance(value, str):
            value = list(bytes.fromhex(value))
        test.assertTrue(
            np.array_equal(message, np.array(value, message.dtype).reshape(message.shape)),
            f"{path}: {message} {value}",
        )
    elif isinstance(message, list):
        test.assertEqual(len(message), len(value), path)
        for i, (one, other) in enumerate(zip(message, value)):
            same(test, one, other, f"{path}[{i}]")
    else:
        test.assertEqual(message, value, path)


main = unittest.main

if __name__ == "__main__":  # for the other tests: support.py FOLDER
    drive = Drive()
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    shutil.copytree(drive.folder / "out", sys.argv[1])
    drive.remove()
