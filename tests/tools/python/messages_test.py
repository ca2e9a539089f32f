"""Tests messages: classes, values both ways against C++, invalid input, recordings."""

import ast
import io
import pathlib
import pickle
import struct
import tempfile
import time
import unittest
import warnings

import support
from support import Child, same

support.own_network()
import numpy as np  # noqa: E402
import perdure  # noqa: E402
from perdure.messages import SCHEMA  # noqa: E402


def camera_names():
    return [name + "cam0" if name.endswith("/") else name for name in perdure.topics()]


class EveryTopic(unittest.TestCase):
    def test_values_are_those_of_cpp_both_ways(self):
        """C++ writes one message of each topic, Python reads and rewrites them, C++ reads them."""
        with perdure.subscribe(*camera_names(), timeout=20) as heard:
            with Child(support.PEER, "write", 7) as writer, Child(support.PEER, "read") as reader:
                self.assertEqual(reader.line(), "ready\n")
                came = dict(next(heard) for _ in camera_names())
                written = {m["topic"]: m["value"] for m in support.lines_of(writer.end())}
                self.assertEqual(set(came), set(written))
                back = {t: perdure.publisher(t, vehicle="back", strength=3) for t in came}
                for topic, message in came.items():
                    self.assertEqual(type(message).__name__, perdure.topics().get(topic, "Frame"))
                    same(self, message, written[topic], topic)
                    self.assertTrue(back[topic].wait_for_reader(20), topic)
                time.sleep(0.3)  # predictions are best effort: both ends must be matched
                for topic, message in came.items():
                    back[topic].write(message)
                read = {m["topic"]: m["value"] for m in support.lines_of(reader.end())}
                self.assertEqual(read, written)
        self.assertEqual(reader.process.returncode, 0)

    def test_every_class_says_its_fields_and_is_equal_to_its_copy(self):
        for name in SCHEMA:
            made = getattr(perdure, name)()
            self.assertEqual(made, pickle.loads(pickle.dumps(made)), name)
            self.assertTrue(repr(made).startswith(name + "("))
            for field in made._fields:
                self.assertIn(f"\n{field}: ", type(made).__doc__)

    def test_a_frame_of_objects_is_a_sequence(self):
        frame = perdure.Objects(objects=[perdure.ObjectBelief(id=4), perdure.ObjectBelief(id=7)])
        self.assertEqual([frame[0].id, frame[-1].id, len(frame)], [4, 7, 2])
        self.assertRegex(perdure.__version__, r"^\d+\.\d+")

    def test_type_hints_are_those_of_the_messages(self):
        stubs = support.run(support.PYTHON, support.SOURCE / "tools/python/stubs.py", "--check")
        self.assertIn("up to date", stubs)
        for stub in (support.SOURCE / "tools/python/perdure").glob("*.pyi"):
            ast.parse(stub.read_text())


class ByHand(unittest.TestCase):
    def test_defaults_are_those_of_cpp_and_unknown_names_are_told(self):
        detection = perdure.Detection(box=(1, 2, 3, 4))
        self.assertEqual(detection.azimuth_sigma, 0.35)
        self.assertEqual(detection.box.tolist(), [1, 2, 3, 4])
        with self.assertRaisesRegex(TypeError, "Detection has no boks; it has x1, "):
            perdure.Detection(boks=1)

    def test_arrays_of_two_messages_are_not_shared(self):
        one, other = perdure.ClassBelief(), perdure.ClassBelief()
        one.mean[0] = 5
        self.assertEqual(other.mean[0], 0)

    def refused(self, pattern, message, topic="objects"):
        with self.assertRaisesRegex(perdure.Refused, pattern):
            perdure.publisher(topic, strength=1).write(message)

    def test_what_no_reader_takes_is_refused_with_its_field(self):
        car = perdure.ClassBelief(name="car", probability=1.0, covariance=np.eye(7))
        made = lambda **values: perdure.Objects(  # noqa: E731
            objects=[perdure.ObjectBelief(**{"id": 3, "classes": [car], **values})]
        )
        perdure.publisher("objects").write(made())
        self.refused(r"objects\[0\].existence", made(existence=1.5))
        self.refused(r"objects\[0\].existence must be a number, not str", made(existence="x"))
        self.refused(r"objects\[0\].velocity must have shape \(3,\), not \(2,\)", made(velocity=[1, 2]))
        self.refused(r"bad_probabilities of objects\[0\].classes", made(classes=[]))
        self.refused(r"objects\[0\].classes\[0\] must be a perdure.ClassBelief, not int", made(classes=[1]))
        self.refused(r"objects\[0\].id must be from 0 to 18446744073709551615, not -1", made(id=-1))
        self.refused(r"visibility must be one of visible, partial, occluded", made(visibility="hid"))
        self.refused("the message must be a perdure.Objects, not Event", perdure.Event())
        wide = perdure.Frame(camera="cam0", width=4, height=2, pixels=np.zeros((4, 2), np.uint8))
        self.refused(
            r"pixels must have shape \(2, 4\), \(height, width\), not \(4, 2\)", wide, "frame/cam0"
        )

    def test_of_an_unknown_topic_the_known_ones_are_told(self):
        for ask in (perdure.subscribe, perdure.publisher):
            with self.assertRaisesRegex(perdure.UnknownTopic, "no topic object; the topics are .*objects"):
                ask("object")

    def test_a_pose_takes_points_as_its_matrix_does(self):
        pose = perdure.Pose(q_xyzw=np.array([0, 0, np.sin(0.3), np.cos(0.3)]), p=np.array([1, 2, 3.0]))
        point = np.array([4.0, 5, 6])
        np.testing.assert_allclose(pose @ point, (pose.matrix @ [4, 5, 6, 1])[:3])
        np.testing.assert_allclose(pose.rotation[:2, 0], [np.cos(0.6), np.sin(0.6)])


def record(op, content):
    return bytes([op]) + struct.pack("<Q", len(content)) + content


def text(words):
    return struct.pack("<I", len(words)) + words.encode()


def tiny_mcap(type_name, data):
    """Returns the smallest MCAP file with one message."""
    file = io.BytesIO()
    file.write(b"\x89MCAP0\r\n" + record(1, text("") + text("test")))
    file.write(record(3, struct.pack("<H", 1) + text(type_name) + text("omgidl") + text("")))
    file.write(record(4, struct.pack("<HH", 1, 1) + text("perdure/ego/objects") + text("cdr") + text("")))
    file.write(record(5, struct.pack("<HIQQ", 1, 0, 1, 1) + data))
    file.write(record(15, struct.pack("<I", 0)) + record(2, bytes(20)) + b"\x89MCAP0\r\n")
    return file.getvalue()


class Recordings(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name) / "x.mcap"

    def tearDown(self):
        self.folder.cleanup()

    def test_another_version_is_told(self):
        self.path.write_bytes(tiny_mcap("perdure::msg::Things", bytes(64)))
        with self.assertRaisesRegex(perdure.OtherVersion, "recorded as perdure::msg::Things"):
            list(perdure.read(self.path))
        self.path.write_bytes(tiny_mcap("perdure::msg::Objects", b"\x00\x09\x00\x00" + b"\xff" * 60))
        with self.assertRaisesRegex(perdure.OtherVersion, "objects: malformed_cdr"):
            list(perdure.read(self.path))

    def test_no_file_no_recording_and_a_cut_one(self):
        with self.assertRaisesRegex(perdure.Missing, "there is no recording .*perdure record"):
            perdure.read(self.path)
        self.path.write_text("no recording")
        with self.assertRaisesRegex(perdure.Unusable, "is no MCAP file"):
            perdure.read(self.path)

    def test_no_map_and_a_newer_map(self):
        import sqlite3

        with self.assertRaisesRegex(perdure.Missing, "there is no map"):
            perdure.Map(self.path)
        self.path.write_text("no map, but long enough to be taken for something else")
        with self.assertRaisesRegex(perdure.Unusable, "not a database"):
            perdure.Map(self.path).objects()
        newer = self.path.with_suffix(".sqlite")
        with sqlite3.connect(newer) as made:
            made.execute("PRAGMA application_id=0x50455244")
            made.execute("PRAGMA user_version=99")
            made.execute("CREATE TABLE object(id)")
        with self.assertRaisesRegex(perdure.Unusable, "newer|99"):
            perdure.Map(newer).objects()


if __name__ == "__main__":
    warnings.simplefilter("error")
    support.main()
