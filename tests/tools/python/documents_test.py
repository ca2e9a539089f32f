"""Tests the documented code: the blocks of the README and the examples, also in their installed
form."""

import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import support
from support import Child, Drive

support.own_network()
import numpy as np  # noqa: E402
import perdure  # noqa: E402

HERE = support.SOURCE / "tools/python"


class Player(threading.Thread):
    """Plays the drive repeatedly, and grey images with a bright rectangle."""

    def __init__(self):
        super().__init__()
        self.end = threading.Event()

    def run(self):
        frames = perdure.publisher("frame/cam0")
        image = np.zeros((20, 30), np.uint8)
        image[5:9, 10:16] = 255
        sent = perdure.Frame(camera="cam0", width=30, height=20, pixels=image)
        with Child(support.BIN / "perdure", "play", drive.mcap, "--loop", "--topics", "objects",
                   "events", "odometry"):  # fmt: skip
            while not self.end.wait(0.05):
                sent.stamp.sequence += 1
                frames.write(sent)


def setUpModule():
    global drive, player
    drive = Drive()
    player = Player()
    player.start()


def tearDownModule():
    player.end.set()
    player.join()
    drive.remove()


class Readme(unittest.TestCase):
    def test_it_is_short(self):
        self.assertLessEqual(len((HERE / "README.md").read_text().split()), 1000)

    def test_its_blocks_run(self):
        blocks = re.findall(r"```python\n(.*?)```", (HERE / "README.md").read_text(), re.S)
        self.assertEqual(len(blocks), 5)
        detections = perdure.subscribe("detections", timeout=20)
        for block in blocks:
            with self.subTest(block.splitlines()[2]):
                self.run_block(block, detections)

    def run_block(self, block, detections):
        with Child(sys.executable, "-u", "-c", block, cwd=drive.mcap.parent) as child:
            serves = "perdure.publish(" in block
            if serves:
                found = next(detections)
                self.assertEqual(found.detections[0].box.tolist(), [10, 5, 16, 9])
            else:
                self.assertNotIn("Traceback", child.line())
            if serves or "subscribe" in block:
                child.process.send_signal(signal.SIGINT)
                self.assertIn("KeyboardInterrupt", child.end())
            else:
                self.assertNotIn("Traceback", child.end())
                self.assertEqual(child.process.returncode, 0)


class Examples(unittest.TestCase):
    def test_parked_cars_are_counted_by_street(self):
        streets = drive.folder / "streets.json"
        streets.write_text(json.dumps({"Left": [[0, 4], [80, 4]], "Right": [[0, -4], [80, -4]]}))
        counted = support.run(sys.executable, HERE / "examples/parked_cars.py", drive.map, streets)
        found = {line.split(": ")[0]: int(line.split(": ")[1]) for line in counted.splitlines()}
        map_ = perdure.Map(drive.map)
        cars = [o for n in ("car", "van", "truck", "bus") for o in map_.by_class(n)]
        parked = [o for o in cars if o.existence >= 0.5 and map_.belief(o.id).moving <= 0.5]
        self.assertGreater(len(parked), 4)
        left = sum(o.position[1] > 0 for o in parked)
        self.assertEqual(found, {"Left": left, "Right": len(parked) - left})

    def test_a_map_is_drawn_or_it_says_what_is_missing(self):
        out = drive.folder / "map.png"
        example = HERE / "examples/plot_map.py"
        hidden = "import sys; sys.modules['matplotlib'] = None; exec(open(sys.argv[0]).read())"
        done = subprocess.run(
            [sys.executable, "-c", f"import sys; sys.argv[0] = {str(example)!r}; {hidden}", drive.map],
            capture_output=True, text=True,
        )  # fmt: skip
        self.assertEqual(done.returncode, 1)
        self.assertIn("apt install python3-matplotlib", done.stderr)
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            return
        support.run(sys.executable, example, drive.map, out)
        self.assertTrue(out.read_bytes().startswith(b"\x89PNG"))

    def test_the_detector_finds_cones(self):
        sys.path.insert(0, str(HERE / "examples"))
        import own_detector

        image = np.full((60, 80, 3), 90, np.uint8)
        image[20:40, 10:20] = image[25:45, 50:62] = (20, 90, 230)
        boxes = [d.box.tolist() for d in own_detector.Cones().detect(image)]
        self.assertEqual(boxes, [[10, 20, 20, 40], [50, 25, 62, 45]])
        self.assertEqual(own_detector.Cones().detect(image[:, :, 0]), [])
        # Two expected cones: half of one is visible, and none is at the other place.
        expected = [perdure.Prediction(class_name="cone") for _ in range(2)]
        expected[0].box, expected[1].box = (5, 20, 15, 40), (60, 5, 75, 20)
        nats = own_detector.Cones().look(image, expected)
        self.assertGreater(nats[0], 1)
        self.assertLess(nats[1], -1)
        self.assertTrue(np.isnan(own_detector.Cones().look(image[:, :, 0], expected)).all())


class Installed(unittest.TestCase):
    def test_it_is_imported_from_dist_packages(self):
        with tempfile.TemporaryDirectory() as root:
            support.run(
                "cmake", "--install", support.BUILD, "--component", "python", "--prefix", "/usr",
                env={**os.environ, "DESTDIR": root},
            )  # fmt: skip
            place = pathlib.Path(root) / "usr/lib/python3/dist-packages"
            self.assertFalse(any(p.is_symlink() for p in place.rglob("*")))
            names = {p.name for p in (place / "perdure").iterdir()}
            self.assertLessEqual({"__init__.py", "__init__.pyi", "py.typed", "bus.pyi"}, names)
            said = support.run(
                sys.executable, "-c",
                "import perdure; print(perdure.__file__); print(len(perdure.Map('map.sqlite')))",
                cwd=drive.map.parent, env={**os.environ, "PYTHONPATH": str(place)},
            ).split()  # fmt: skip
            self.assertEqual(said, [str(place / "perdure/__init__.py"), str(len(perdure.Map(drive.map)))])


if __name__ == "__main__":
    support.main()
