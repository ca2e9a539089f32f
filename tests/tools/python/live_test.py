"""Tests on a running bus: values against `perdure echo`, Ctrl-C, the map against `perdure map`,
a network in Python with the real semantic filter, a closed bus."""

import json
import os
import shutil
import signal
import sys
import threading
import time
import unittest
import warnings

import support
from support import Child, Drive, perdure_tool, same

support.own_network()
import numpy as np  # noqa: E402
import perdure  # noqa: E402


def setUpModule():
    global drive
    drive = Drive()


def tearDownModule():
    drive.remove()


def script(text):
    """Starts a Python program with unbuffered output."""
    return (sys.executable, "-u", "-c", text)


class Topics(unittest.TestCase):
    def test_a_subscriber_gets_what_echo_prints_and_the_recording_holds(self):
        recorded = [m for _, _, m in perdure.read(drive.mcap, "objects")]
        live, printed = {}, []
        with perdure.subscribe("objects") as heard, Child(
            support.BIN / "perdure", "echo", "objects", "--count", 30
        ) as echo, Child(
            support.BIN / "perdure", "play", drive.mcap, "--topics", "objects",
            "--rate", 3, "--loop", "--wait", 5,
        ):  # fmt: skip
            reads = threading.Thread(target=lambda: printed.extend(support.lines_of(echo.end(60))))
            reads.start()
            while reads.is_alive():
                if (message := heard.next(0.1)) is not None:
                    live[message.stamp.sequence] = message
        self.assertEqual(len(printed), 30)
        both = [p for p in printed if p["stamp"]["sequence"] in live]
        self.assertGreater(len(both), 10)
        for value in both:
            same(self, live[value["stamp"]["sequence"]], value)
        for message in live.values():
            self.assertEqual(message, recorded[message.stamp.sequence])
        last = max(live.values(), key=len)
        self.assertEqual(last.mean.shape, (len(last), 7))
        self.assertEqual(last.covariance.shape, (len(last), 7, 7))
        for o in last:
            self.assertAlmostEqual(o.pmf.sum(), 1, places=6)
            self.assertEqual(len(o.class_names), len(o.pmf))

    def test_an_image_lies_where_it_came_and_cannot_be_written_to(self):
        sent = perdure.Frame(camera="cam0", width=5, height=3, encoding="bgr8")
        sent.pixels = np.arange(45, dtype=np.uint8).reshape(3, 5, 3)
        with perdure.subscribe("frame/cam0", timeout=10) as frames:
            out = perdure.publisher("frame/cam0")
            self.assertTrue(out.wait_for_reader(10))
            out.write(sent)
            came = next(frames)
        self.assertTrue(np.array_equal(came.image, sent.pixels))
        self.assertIs(came.image, came.pixels)
        self.assertFalse(came.pixels.flags.owndata)
        with self.assertRaises(ValueError):
            came.pixels[0, 0] = 1

    def test_what_is_disposed_is_told_where_it_is_asked_for(self):
        tile = perdure.MapTile(x=3, y=4, instance=1)
        with perdure.subscribe("map", timeout=10, gone=True, vehicle="other") as tiles:
            out = perdure.publisher("map", vehicle="other")
            self.assertTrue(out.wait_for_reader(10))
            out.write(tile)
            self.assertEqual(next(tiles), tile)
            out.dispose(tile)
            gone = next(tiles)
        self.assertIsInstance(gone, perdure.Gone)
        self.assertEqual((gone.message.x, gone.message.y), (3, 4))

    def test_silence_says_why(self):
        with self.assertRaisesRegex(perdure.Silence, "nobody writes landmarks .*vehicle nobody"):
            next(perdure.subscribe("landmarks", timeout=0.1, vehicle="nobody"))

    def test_another_interface_in_the_same_process_is_refused(self):
        perdure.subscribe("objects").close()
        with self.assertRaisesRegex(perdure.Error, "opens a domain once a process"):
            perdure.subscribe("objects", interface="eth7")
        with self.assertRaisesRegex(perdure.Error, "interface eth7|once a process"):
            perdure.subscribe("objects", interface="eth7", domain=91)  # or PERDURE_DOMAIN


class Waiting(unittest.TestCase):
    def ends_by_ctrl_c(self, text):
        with Child(*script(text)) as waits:
            self.assertEqual(waits.line(), "waits\n")
            time.sleep(0.3)
            begin = time.monotonic()
            waits.process.send_signal(signal.SIGINT)
            waits.process.wait(timeout=10)
            took = time.monotonic() - begin
            said = waits.end()
        self.assertIn("KeyboardInterrupt at ", said)
        at = float(said.split("KeyboardInterrupt at ")[1].split()[0])
        self.assertLess(at - begin, 0.2)
        self.assertLess(took, 2)

    CAUGHT = """
    print("waits")
    for m in {}: pass
except KeyboardInterrupt:
    print("KeyboardInterrupt at", time.monotonic())
"""

    def test_ctrl_c_ends_a_subscription(self):
        self.ends_by_ctrl_c(
            'import perdure, time\ntry:\n    s = perdure.subscribe("objects")'
            + self.CAUGHT.format("s")
        )

    def test_ctrl_c_ends_a_service(self):
        self.ends_by_ctrl_c(
            "import perdure, time\nclass D:\n    classes = ['a']\n    def detect(self, image): pass\n"
            "try:" + self.CAUGHT.format("perdure.publish(D()) or []")
        )

    def test_other_threads_run_while_one_waits(self):
        with perdure.subscribe("objects", vehicle="nobody") as silent:
            counted, end = 0, threading.Event()

            def wait():
                silent.next(0.5)
                end.set()

            threading.Thread(target=wait).start()
            while not end.is_set():
                counted += 1
                time.sleep(0.001)
        self.assertGreater(counted, 50)

    def test_closing_ends_the_wait_of_another_thread(self):
        waits = perdure.subscribe("objects", vehicle="nobody")
        closer = threading.Timer(0.1, waits.close)
        closer.start()
        self.assertEqual(list(waits), [])
        closer.join()

    def test_two_threads_do_not_wait_for_one_subscription(self):
        with perdure.subscribe("objects", vehicle="nobody") as waits:
            first = threading.Thread(target=waits.next, args=(1.0,))
            first.start()
            time.sleep(0.2)
            with self.assertRaisesRegex(perdure.Error, "make one for each thread"):
                waits.next(0.1)
            first.join()


class Maps(unittest.TestCase):
    def expect(self, objects, *arguments):
        asked = json.loads(perdure_tool("map", *arguments, "--json"))["objects"]
        self.assertEqual([o.id for o in objects], [o["id"] for o in asked])
        self.assertTrue(asked)
        for o, value in zip(objects, asked):
            self.assertEqual(o.class_name, value["class"])
            np.testing.assert_array_equal(o.mean, value["mean"])
            np.testing.assert_array_equal(o.covariance, value["covariance"])
        return asked

    def check(self, map_, *source):
        self.expect(map_.objects(), "list", *source)
        self.expect(map_.by_class("car"), "query", "--class", "car", *source)
        self.expect(map_.near((30, 0, 0), 9), "query", "--radius", 30, 0, 0, 9, *source)
        self.expect(
            map_.in_box((36, 9, 5), (20, -9, -5)), "query", "--box", 36, 9, 5, 20, -9, -5, *source
        )

    def test_a_file_is_answered_as_perdure_map_answers(self):
        map_ = perdure.Map(drive.map)
        self.check(map_, "--db", drive.map)
        stored = perdure.Map(drive.map, frame="W")
        self.expect(stored.objects(), "list", "--db", drive.map, "--frame", "W")
        best = map_.belief(map_.objects()[0].id)
        self.assertGreater(len(best.why.existence), 3)
        self.assertIsNone(map_.get(1 << 40))
        with self.assertRaisesRegex(KeyError, "no object 7777"):
            map_[7777]
        some = map_.objects()[0]
        self.assertTrue(some.id in map_ and some in map_ and 7777 not in map_)
        with self.assertWarnsRegex(UserWarning, "no 'cars'; its classes are: .*car"):
            self.assertEqual(map_.by_class("cars"), [])
        with self.assertRaisesRegex(perdure.Refused, "at least 0 m, not -1"):
            map_.near((0, 0, 0), radius=-1)
        with self.assertRaisesRegex(perdure.Refused, "3 numbers each"):
            map_.in_box((0, 0), (1, 1, 1))

    def check_corrections(self, map_):
        some, other = map_.objects()[:2]
        said = map_.correct(some.id, not_there=True, nats=3.0, author="Ada")
        self.assertEqual((said.kind, said.object, said.author), ("not_there", some.id, "Ada"))
        odds = lambda o: np.log(o.existence / (1 - o.existence))  # noqa: E731
        self.assertAlmostEqual(odds(map_[some.id]), odds(some) - 3.0, places=6)
        self.assertEqual([c.id for c in map_.corrections()], [said.id])
        self.assertTrue(map_.withdraw(said.id).withdrawn)
        self.assertEqual(map_[some.id], some)
        joined = map_.correct(other.id, same_as=some.id)
        self.assertEqual((joined.kind, joined.nats), ("same", 10.0))
        self.assertNotIn(max(some.id, other.id), map_)
        map_.withdraw(joined.id)
        self.assertEqual(map_.objects()[:2], [some, other])
        with self.assertRaisesRegex(perdure.Refused, "no object 7777"):
            map_.correct(7777, class_name="car")
        with self.assertRaisesRegex(perdure.Refused, "give one of"):
            map_.correct(some.id, not_there=True, class_name="car")

    def test_a_file_is_corrected_and_the_correction_is_taken_back(self):
        copy = drive.folder / "corrected.sqlite"
        shutil.copy(drive.map, copy)
        self.check_corrections(perdure.Map(copy))

    def test_poses_are_ranked_as_perdure_map_look_ranks_them(self):
        map_ = perdure.Map(drive.map)
        poses = [(0, 0, 0, 0), (0, 0, 0, np.pi)]
        ranked = map_.look(poses, rig=drive.mcap, after_s=600)
        asked = json.loads(perdure_tool(
            "map", "look", drive.map, "--rig", drive.mcap, "--pose", 0, 0, 0, 0, "--after", 600,
            "--json",
        ))["prospects"]  # fmt: skip
        self.assertEqual(len(ranked), 2)
        self.assertAlmostEqual(ranked[0]["views"][0]["yaw"], 0)
        self.assertGreater(ranked[0]["bits"]["existence"], ranked[1]["bits"]["existence"])
        self.assertAlmostEqual(
            ranked[0]["bits"]["existence"], asked[0]["bits"]["existence"], places=6
        )
        route = map_.look(poses, rig=drive.mcap, route=True, by=("existence",))
        self.assertEqual(len(route), 1)
        self.assertEqual(len(route[0]["views"]), 2)
        with self.assertRaisesRegex(perdure.Refused, r"shape \(N, 4\), not \(3,\)"):
            map_.look([0, 0, 0], rig=drive.mcap)
        with self.assertRaisesRegex(perdure.Unusable, "nothing.yaml"):
            map_.look(poses, rig="nothing.yaml")
        with self.assertRaisesRegex(perdure.Refused, "the map's file"):
            perdure.Map().look(poses, rig=drive.mcap)

    def test_the_running_map_store_is_answered_as_perdure_map_answers(self):
        copy = drive.folder / "live.sqlite"
        shutil.copy(drive.map, copy)
        with Child(
            support.BIN / "perdure-map-store", "--set", f"store.path={copy}",
            "--set", "bus.vehicle=mapped",
        ):  # fmt: skip
            map_ = perdure.Map(vehicle="mapped", patience_s=20)
            self.expect(map_.by_class("car"), "query", "--class", "car", "--vehicle", "mapped")
            self.assertEqual([o.id for o in map_.near((30, 0, 0), 9)], [
                o.id for o in perdure.Map(drive.map).near((30, 0, 0), 9)
            ])  # fmt: skip
            self.check_corrections(map_)
            with self.assertRaisesRegex(perdure.Unusable, "is in use by another program"):
                perdure.Map(copy).withdraw(1)
        with self.assertRaisesRegex(perdure.Unavailable, "no map store answers within 0.2 s"):
            perdure.Map(vehicle="nobody", patience_s=0.2).objects()


FROM_RECORDING = """
import perdure, sys
recorded = {m.stamp.sequence: m for _, _, m in perdure.read(sys.argv[1], "detections")}
model = next(iter(perdure.read(sys.argv[1], "model"))).message
class Network:
    classes = model.classes
    name = "from a recording"
    box_sigma = model.box_sigma
    def detect(self, image):
        if image[0, 1]: raise RuntimeError("a bad picture")
        return recorded[int(image[0, 0])].detections
perdure.publish(Network(), longest_s=2.0, vehicle="driven")
"""


# From frame 30 on, this network reports no boxes by itself, and only answers the filter's
# predictions.
LOOKS = FROM_RECORDING.replace(
    "        return recorded",
    """        self.number = int(image[0, 0])
        if self.number >= 30: return []
        return recorded""",
).replace(
    "perdure.publish",
    """    def look(self, image, expected):
        assert all(p.class_name in self.classes and p.object_id for p in expected)
        return [NATS] * len(expected)
perdure.publish""",
)


class Network(unittest.TestCase):
    def frames(self, spoiled):
        """Sends images whose first pixel is the frame's number. Before the next image, it sends
        the odometry of the previous one."""
        writers = {
            t: perdure.publisher(t, vehicle="driven")
            for t in ("frame/cam0", "odometry", "calibration")
        }
        calibration = next(iter(perdure.read(drive.mcap, "calibration"))).message
        writers["calibration"].write(calibration)
        camera = calibration.cameras[0]
        for writer in (writers["frame/cam0"], writers["odometry"]):
            self.assertTrue(writer.wait_for_reader(20))
        pixels = np.zeros((camera.height, camera.width), np.uint8)
        for _, _, pose in perdure.read(drive.mcap, "odometry"):
            pixels[0, :2] = pose.stamp.sequence, pose.stamp.sequence in spoiled
            writers["frame/cam0"].write(
                perdure.Frame(
                    stamp=pose.stamp, camera=camera.name, width=camera.width,
                    height=camera.height, pixels=pixels,
                )
            )  # fmt: skip
            yield pose
            writers["odometry"].write(pose)

    @staticmethod
    def take(heard, came):
        for topic, messages in came.items():
            while (message := heard[topic].next(0)) is not None:
                messages.append(message)

    def test_it_drives_the_semantic_filter(self):
        heard = {
            t: perdure.subscribe(t, vehicle="driven", timeout=20)
            for t in ("health", "objects", "detections")
        }
        with Child(
            support.BIN / "perdure-semantic-filter", "--config",
            support.SOURCE / "config/semantic_filter.yaml", "--set", "bus.vehicle=driven",
        ), Child(*script(FROM_RECORDING), drive.mcap) as network:  # fmt: skip
            model = next(perdure.subscribe("model", vehicle="driven", timeout=20))
            self.assertEqual(model.name, "from a recording")
            came = {topic: [] for topic in heard}
            for pose in self.frames(spoiled=range(20, 25)):
                if pose.stamp.sequence not in range(20, 25):
                    came["detections"].append(next(heard["detections"]))
                time.sleep(0.02)
                self.take(heard, came)
            while not any(f.stamp.sequence == pose.stamp.sequence for f in came["objects"]):
                came["objects"].append(next(heard["objects"]))
            while not any(h.reasons.get("detect_failed") for h in came["health"]):
                came["health"].append(next(heard["health"]))
            network.process.terminate()
            self.assertIn("RuntimeError: a bad picture", network.end())
        self.assertEqual(network.process.returncode, 0)
        recorded = {m.stamp.sequence: m for _, _, m in perdure.read(drive.mcap, "detections")}
        self.assertEqual(len(came["detections"]), 55)
        for found in came["detections"]:
            self.assertEqual(found.detections, recorded[found.stamp.sequence].detections)
        objects = [o for frame in came["objects"] for o in frame]
        self.assertIn("car", {o.class_name for o in objects if o.existence > 0.9})
        states = [h for h in came["health"] if h.process == "inference"]
        self.assertTrue(any(h.frames_out > 0 for h in states))

    def run_looking(self, nats):
        """Returns the detections from frame 30 on, and the objects of the last frame by id."""
        heard = {
            t: perdure.subscribe(t, vehicle="driven", timeout=20)
            for t in ("detections", "objects")
        }
        with Child(
            support.BIN / "perdure-semantic-filter", "--config",
            support.SOURCE / "config/semantic_filter.yaml", "--set", "bus.vehicle=driven",
        ), Child(*script(LOOKS.replace("NATS", str(nats))), drive.mcap) as network:  # fmt: skip
            next(perdure.subscribe("model", vehicle="driven", timeout=20))
            for subscription in heard.values():
                self.assertTrue(subscription.wait_for_writer(20))
            later, last = [], None
            for pose in self.frames(spoiled=()):
                found = next(heard["detections"])
                if found.stamp.sequence >= 30:
                    later.append(found)
                # The filter's predictions for the previous frame must arrive before the next one.
                # Messages sent before filter and network are matched are lost.
                begins = pose.stamp.sequence < 5
                while pose.stamp.sequence > 0 and (
                    last is None or last.stamp.sequence < pose.stamp.sequence - 1
                ):
                    came = heard["objects"].next(1 if begins else 20)
                    if came is None and begins:
                        break
                    self.assertIsNotNone(came, "objects stopped")
                    last = came
            while last is None or last.stamp.sequence < pose.stamp.sequence:
                last = next(heard["objects"])
            network.process.terminate()
            said = network.end()
        self.assertEqual(network.process.returncode, 0, said)
        return later, {o.id: o for o in last}

    def test_it_answers_where_the_filter_expects_objects(self):
        recorded = {m.stamp.sequence: m for _, _, m in perdure.read(drive.mcap, "detections")}
        kept, gone = self.run_looking(1.5), self.run_looking(-1.5)
        answers = [(f, d) for f in kept[0] for d in f.detections]
        self.assertGreater(len(answers), 20)
        near = 0
        for found, answer in answers:
            self.assertTrue(answer.primed)
            self.assertGreater(answer.primed_for, 0)
            np.testing.assert_allclose(answer.activations, [0] + [1.5] * (len(answer.activations) - 1))
            boxes = [d.box for d in recorded[found.stamp.sequence].detections if not d.primed]
            near += any(perdure.service._overlaps(answer.box[None], b[None])[0, 0] > 0.5 for b in boxes)
        self.assertGreater(near, 0.25 * len(answers), "answers are where the objects are")
        # Objects with positive answers remain; objects with negative answers lose existence.
        # The median, because an id may be a second one of an object in one of the runs.
        asked = {d.primed_for for _, d in answers} & {d.primed_for for f in gone[0] for d in f.detections}
        asked &= kept[1].keys() & gone[1].keys()
        self.assertGreater(len(asked), 2)
        gain = {i: kept[1][i].existence - gone[1][i].existence for i in asked}
        self.assertGreater(np.median(list(gain.values())), 0.1, gain)

    def test_answers_of_a_wrong_shape_are_refused(self):
        asked = [perdure.Prediction(object_id=3, class_name="lamp")]
        asked[0].box = (1, 2, 5, 9)
        answers = perdure.service._answers_of
        for said, pattern in (
            ([1, 2], r"shape \(1,\), one for each prediction, not \(2,\)"),
            (([1], [[1, 2]]), r"boxes of shape \(1, 4\), not \(1, 2\)"),
        ):
            with self.assertRaisesRegex(perdure.Refused, pattern):
                answers(said, asked, 2)
        self.assertEqual(answers([np.nan], asked, 2), [])
        (cut,) = answers(([-80.0], [[2, 2, 6, 9]]), asked, 2)
        self.assertEqual(cut.activations.tolist(), [0, -5, -5])
        self.assertEqual(cut.box.tolist(), [2, 2, 6, 9])

    def test_predictions_of_another_frame_are_not_used(self):
        stamp = lambda t: perdure.FrameStamp(source=4, time_ns=t)  # noqa: E731
        frame = perdure.Frame(stamp=stamp(10**9), camera="cam0", width=100, height=50)
        moves = perdure.Prediction(object_id=3, class_name="car", velocity_x2=50.0)
        moves.box = (60, 10, 90, 40)
        unknown = perdure.Prediction(object_id=4, class_name="boat")
        unknown.box = moves.box
        outside = perdure.Prediction(object_id=5, class_name="car")
        outside.box = (-30, 10, -5, 40)
        expected = perdure.service._expected_in
        said = perdure.Predictions(
            stamp=stamp(10**9 - 4 * 10**8), camera="cam0", predictions=[moves, unknown, outside]
        )
        (one,) = expected(said, frame, ["car"])
        self.assertEqual(one.box.tolist(), [60, 10, 100, 40], "moved on, and its part inside")
        self.assertEqual(moves.box.tolist(), [60, 10, 90, 40])
        for stale in (
            perdure.Predictions(stamp=stamp(10**9 + 1), camera="cam0"),
            perdure.Predictions(stamp=stamp(4 * 10**8), camera="cam0"),
            perdure.Predictions(stamp=stamp(10**9), camera="cam1"),
            perdure.Predictions(stamp=perdure.FrameStamp(source=5, time_ns=10**9), camera="cam0"),
        ):
            with self.assertRaises(LookupError):
                expected(stale, frame, ["car"])
        met = perdure.Detection(activations=[0, 1])
        met.box = (58, 11, 99, 40)
        self.assertEqual(perdure.service._unmet([one], [met]), [])
        self.assertEqual(perdure.service._unmet([one], []), [one])

    def test_a_service_that_never_works_ends_with_the_reason(self):
        for returns, pattern in (
            ("(np.zeros((2, 3)), np.zeros((2, 2)))", r"boxes of shape \(N, 4\), not \(2, 3\)"),
            ("(np.zeros((2, 4)), np.zeros((2, 9)))", r"K \+ 1\), here \(2, 2\), not \(2, 9\)"),
            ("[1]", r"list of perdure.Detection, .* \[0\] is a int"),
            ("[perdure.Detection(box=(5, 5, 1, 9), activations=[0, 1])]", "out_of_range of .*box"),
        ):
            found = self.failure_of(returns)
            self.assertRegex(found, pattern)
        with self.assertRaisesRegex(perdure.Refused, "has `classes`"):
            perdure.publish(object())

    @staticmethod
    def failure_of(returns):
        detector = type(
            "D", (), {"classes": ["lamp"], "detect": lambda self, image: eval(returns)}
        )()
        out = perdure.publisher("frame/cam0", vehicle="bad")
        frame = perdure.Frame(camera="cam0", width=8, height=8, pixels=np.zeros((8, 8), np.uint8))

        def feed():
            out.wait_for_reader(10)
            out.write(frame)

        feeder = threading.Thread(target=feed)
        feeder.start()
        try:
            perdure.publish(detector, vehicle="bad")
        except perdure.Refused as error:
            return str(error)
        finally:
            feeder.join()
        return "nothing"


class ClosedBus(unittest.TestCase):
    def test_who_has_an_identity_reads_and_may_not_write(self):
        folder = drive.folder / "security"
        perdure_tool("security", "init", "--dir", folder)
        perdure_tool("security", "add", "subscriber", "subscriber", "--dir", folder)
        perdure_tool("security", "add", "player", "player", "--dir", folder)
        yaml = drive.folder / "bus.yaml"
        yaml.write_text(f"bus:\n  security: {folder}\n")
        environment = {**os.environ, "PERDURE_BUS": str(yaml)}
        with Child(
            support.BIN / "perdure", "play", drive.mcap, "--topics", "objects", "--loop",
            env=environment,
        ):  # fmt: skip
            with Child(
                *script(
                    "import perdure\n"
                    "print(len(next(perdure.subscribe('objects', timeout=20))) >= 0)\n"
                    "try: perdure.publisher('detections')\n"
                    "except perdure.Error as e: print(e)\n"
                    "try: perdure.subscribe('objects', identity='operator')\n"
                    "except perdure.Error as e: print(e)\n"
                ),
                env=environment,
            ) as reader:
                said = reader.end(40)
            self.assertRegex(said, r"True\n.*may not make a writer of detections.*\n.*the identity subscriber .*alone")
            with self.assertRaises(perdure.Silence):
                next(perdure.subscribe("objects", timeout=1.0))


if __name__ == "__main__":
    warnings.simplefilter("error", category=UserWarning)
    support.main()
