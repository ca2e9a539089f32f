#!/usr/bin/python3
"""Tests the messages of `perdure model import` for unsupported files, and its results for
supported ones."""

import io
import sys
import tempfile
import unittest
from contextlib import redirect_stdout
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from importing import NAMES, Importing  # first, because it reports missing packages
import numpy as np
import onnx
import tiny_networks as tiny
import tiny_queries
from onnx import TensorProto, helper
from perdure_model import __main__ as importer
from perdure_model.faults import Fault
from perdure_model.graph import Graph, Node
from perdure_model.numpy_ops import OPS
from perdure_model.opencv import Repair
from perdure_model.quantised import dequantised, to_float


def own_decoding(folder):
    """Writes heads like those of YOLOv5, but with another rule for sizes."""
    def decode(net, raw, stride):
        p = net.node("Sigmoid", [tiny.rows_of_anchors(net, raw, stride)])
        wide = net.node("Mul", [p, np.array([stride] * 2 + [50] * 2 + [1] * (1 + tiny.K), np.float32)])
        return net.node("Reshape", [wide, np.array([1, -1, 5 + tiny.K])])
    net = tiny.Net(20, **tiny.UNIT)
    rows, parts = tiny.anchored(net, decode)
    net.save(folder, [(net.node("Concat", parts, axis=1), [1, len(rows), 5 + tiny.K])], rows, [])


class Files(Importing):
    def test_a_missing_file_and_missing_names_are_69(self):
        message, status = self.refused(self.folder / "none.onnx", NAMES)
        self.assertIn("none.onnx is missing", message)
        self.assertEqual(status, 69)
        message, status = self.refused(self.made(tiny.yolox), "--classes=/nowhere/coco.names")
        self.assertIn("coco.names is missing; give a file with a name a line", message)
        self.assertEqual(status, 69)

    def test_what_is_no_onnx_or_is_cut_off_is_said_to_be(self):
        whole = self.made(tiny.yolov8).read_bytes()
        text = b"this is a text\nof two lines\n"
        for content in (b"", b"hello", text, whole[:10], whole[:len(whole) // 2], whole[:-7]):
            path = self.folder / "part.onnx"
            path.write_bytes(content)
            message, status = self.refused(path, NAMES)
            self.assertIn("not a whole ONNX file", message)
            self.assertEqual(status, 65)

    def test_flipped_bytes_never_end_without_a_sentence(self):
        whole = bytearray(self.made(tiny.yolov5).read_bytes())
        random = np.random.default_rng(3)
        for _ in range(40):
            broken = bytearray(whole)
            for at in random.integers(0, len(broken), 5):
                broken[at] = random.integers(0, 256)
            path = self.folder / "flipped.onnx"
            path.write_bytes(bytes(broken))
            with redirect_stdout(io.StringIO()):
                self.assertIn(self.status_of(path), (0, 64, 65, 69, 78))

    def status_of(self, path):
        before, sys.argv = sys.argv, ["perdure_model", str(path), "--out", str(self.folder / "o.onnx"), NAMES]
        errors, sys.stderr = sys.stderr, io.StringIO()
        try:
            importer.main()
            return 0
        except SystemExit as end:
            return end.code
        finally:
            sys.argv, sys.stderr = before, errors


    def test_what_the_disk_does_not_take_is_74(self):
        path = self.made(tiny.yolox)
        for name in ("out.onnx", "out.onnx.model.json"):
            (self.folder / name).symlink_to("/dev/full")
            with self.assertRaises(Fault) as caught:
                self.run_import(path, NAMES)
            self.assertIn("out.onnx cannot be written whole (No space left on device); free space",
                          str(caught.exception))
            self.assertEqual(caught.exception.status, 74)
            (self.folder / name).unlink()

    def test_a_folder_that_cannot_be_written_is_said(self):
        blocked = self.folder / "file"
        blocked.write_text("")
        with self.assertRaises(Fault) as caught, redirect_stdout(io.StringIO()):
            importer.run(importer.parsed([str(self.made(tiny.yolox)), NAMES, "--out", str(blocked / "out.onnx")]))
        self.assertIn("cannot be written", str(caught.exception))
        self.assertEqual(caught.exception.status, 69)


class Inputs(Importing):
    def convolution(self, shape=(1, 3, 64, 64), kind=TensorProto.FLOAT, more=None):
        """Writes a file with one convolution for each input; `more` adds further inputs."""
        inputs = {"images": (kind, list(shape)), **(more or {})}
        weight = np.zeros((8, 3, 8, 8), np.float32)
        nodes = [helper.make_node("Conv", [name, "w"], [f"{name}_out"], strides=[8, 8]) for name in inputs]
        return self.graph(nodes, {f"{name}_out": None for name in inputs}, {"w": weight}, inputs)

    def test_channels_last_bytes_batches_and_open_sizes_have_their_fixes(self):
        cases = [(dict(shape=(1, 64, 64, 3)), "has its channels last; export with [1,3,height,width]"),
                 (dict(shape=(1, 1, 64, 64)), "has 1 channels"),
                 (dict(kind=TensorProto.UINT8), "is uint8; export with float32"),
                 (dict(shape=(8, 3, 64, 64)), "fixed at 8 images at once; export with batch size 1"),
                 (dict(shape=("n", 3, "h", "w")), "has no fixed size; say --size"),
                 (dict(more={"second": (TensorProto.FLOAT, [1, 3, 8, 8])}), "has 2 inputs that could be an image")]
        for how, words in cases:
            self.assertIn(words, self.refused(self.convolution(**how), NAMES)[0])

    def test_another_size_than_the_fixed_one_is_refused(self):
        self.assertIn("fixed at 64x64; leave --size out",
                      self.refused(self.made(tiny.yolox), NAMES, "--size=320x320")[0])

    def test_a_convolutional_network_takes_another_size(self):
        """Compares with the same weights at that size, computed from the file with an open size."""
        for make in (tiny.yolox, tiny.yolov8, tiny.nanodet):
            path = self.made(make)
            told, description = self.run_import(path, NAMES, "--input=128x64")
            self.assertIn("its input is 128x64; the file was made for 64x64", told)
            self.assertEqual((description["input"]["width"], description["input"]["height"]), (128, 64))
            graph = Graph.load(self.folder / "out.onnx")
            graph.infer_shapes()
            image = np.random.default_rng(3).uniform(-1, 1, (1, 3, 64, 128)).astype(np.float32)
            wide = graph.evaluate({"images": image}, graph.outputs)[0]
            self.run_import(path, NAMES)
            whole = Graph.load(self.folder / "out.onnx")
            for half in (0, 1):  # the networks use separate patches, so that halves are independent
                part = image[:, :, :, 64 * half:64 * (half + 1)]
                for name, value in whole.evaluate({"images": part}, whole.outputs)[0].items():
                    if name in graph.outputs and value.shape[3] * 2 == wide[name].shape[3]:
                        there = np.split(wide[name], 2, axis=3)[half]
                        np.testing.assert_allclose(there, value, atol=1e-4)

    def test_the_cameras_shape_keeps_the_number_of_pixels(self):
        told, status = self.refused(self.made(tiny.yolov8), NAMES, "--input=camera")
        self.assertEqual(status, 64)
        self.assertIn("give one with --image", told)
        told, description = self.run_import(self.made(tiny.yolov8), NAMES, "--input=camera", "--camera=1242x375")
        self.assertEqual((description["input"]["width"], description["input"]["height"]), (128, 32))

    def test_a_size_that_cannot_be_is_refused(self):
        self.assertIn("multiples of 32", self.refused(self.made(tiny.yolov8), NAMES, "--input=100x64")[0])
        self.assertIn("is not WIDTHxHEIGHT", self.refused(self.made(tiny.yolov8), NAMES, "--input=0x64")[0])
        whole = self.refused(self.made(tiny.ssd), NAMES, "--input=128x64")[0]
        self.assertIn("gives whole boxes for an input of 64x64", whole)

    def test_places_that_were_learned_are_not_moved(self):
        """Adds a constant for each cell, which exists only for one size."""
        net = tiny.Net(21, **tiny.UNIT)
        outputs = []
        for stride in (8, 16, 32):
            features = net.level(stride)
            cells = tiny.SIZE // stride
            placed = net.node("Add", [features, net.normal(1, tiny.CHANNELS, cells, cells)])
            net.values[placed] = net.values[features]
            outputs += [(net.head(placed, n), [1, n, cells, cells]) for n in (64, tiny.K)]
        net.save(self.folder / "placed", outputs, [[0] * 7], [])
        self.assertIn("its operator Add is of one size",
                      self.refused(self.folder / "placed/net.onnx", NAMES, "--input=128x64")[0])

    def test_eight_bits_with_a_scale_that_is_computed_are_refused(self):
        nodes = [helper.make_node("ReduceMax", ["images"], ["top"], keepdims=0),
                 helper.make_node("QuantizeLinear", ["images", "top"], ["q"]),
                 helper.make_node("DequantizeLinear", ["q", "top"], ["out"])]
        self.assertIn("import the float network that it was made from",
                      self.refused(self.graph(nodes, {"out": None}, opset=13), NAMES)[0])

    def test_wrong_options_are_usage(self):
        path = self.made(tiny.yolox)
        for wrong, words in (
                ("--size=64", "--size 64: is not WIDTHxHEIGHT in pixels, such as 640x480"),
                ("--size=416X416", "--size 416X416: is not WIDTHxHEIGHT"), ("--size=abc", "--size abc: is not WIDTHx"),
                ("--input=1 x 2", "--input 1 x 2: is not WIDTHxHEIGHT"),
                ("--anchors=1,2,3", "--anchors 1,2,3: are pairs"),
                ("--anchors=1,2/x,4", "--anchors 1,2/x,4: x is not a number"),
                ("--scale=x", "--scale x: x is not a number"),
                ("--mean=1,nan,2", "--mean 1,nan,2: nan is not a number"),
                ("--pad=grey", "--pad grey: grey is not a number"), ("--variances=1", "--variances 1: are two numbers"),
                ("--bins=abc", "--bins abc: is not a whole number above 0"), ("--bins=0", "--bins 0: is not a whole"),
                ("--cell-offset=half", "--cell-offset half: half is not a number"),
                ("--classes=car,,dog", "--classes car,,dog holds an empty name"),
                ("--family=foo", "--family foo: is not known; known are yolov5, yolov7"),
                ("--nonsense=1", "--nonsense=1")):
            message, status = self.refused(path, NAMES, wrong)
            self.assertEqual(status, 64, wrong)
            self.assertIn(words, message)


class Classes(Importing):
    def test_their_number_is_that_of_the_network(self):
        message, _ = self.refused(self.made(tiny.yolox), "--classes=car,person")
        self.assertIn("(yolox) has 3 classes and 2 names were given", message)

    def test_names_in_the_file_are_taken_where_none_are_given(self):
        self.assertEqual(self.run_import(self.made(tiny.yolov8))[1]["classes"], ["car", "person", "dog"])
        self.assertEqual(self.run_import(self.folder / "yolov8/net.onnx", "--classes=A,B,C")[1]["classes"],
                         ["a", "b", "c"])

    def test_a_list_longer_than_a_path_is_a_list(self):
        message, _ = self.refused(self.made(tiny.yolox), "--classes=" + ",".join(f"thing{i}" for i in range(800)))
        self.assertIn("(yolox) has 3 classes and 800 names were given", message)

    def test_without_any_they_are_asked_for(self):
        message, status = self.refused(self.made(tiny.yolox))
        self.assertIn("does not say the names of its 3 classes; give --classes", message)
        self.assertEqual(status, 64)

    def of_file(self, content, network=None):
        (self.folder / "names.txt").write_bytes(content)
        return [network or self.made(tiny.yolox), f"--classes={self.folder / 'names.txt'}"]

    def test_a_file_has_one_a_line(self):
        for content in (b"Car\n\nperson \ndog\n", b"\xef\xbb\xbfcar\r\nperson\r\ndog\r\n", b"car\rperson\rdog"):
            self.assertEqual(self.run_import(*self.of_file(content))[1]["classes"], ["car", "person", "dog"])
        self.assertEqual(self.run_import(*self.of_file("fußgänger\nauto\nstraßen bahn".encode()))[1]["classes"],
                         ["fußgänger", "auto", "straßen bahn"])

    def test_numbers_that_no_class_has_are_told_apart(self):
        self.assertEqual(self.run_import(*self.of_file(b"Car\n\nN/A\nN/A\n"))[1]["classes"],
                         ["car", "n/a-1", "n/a-2"])

    def test_a_name_that_is_there_twice_is_refused(self):
        message, status = self.refused(*self.of_file(b"car\n\nperson\nCar\n"))
        self.assertIn("names.txt: lines 1 and 4 are both car; give each class a name of its own", message)
        self.assertEqual(status, 65)
        message, _ = self.refused(*self.of_file(b"car\nperson\nperson\ncar\ncar\n"))
        self.assertIn("lines 2 and 3 are both person, and 2 more names repeat;", message)
        message, status = self.refused(self.made(tiny.yolox), "--classes=car,dog,car")
        self.assertIn("--classes: the names 1 and 3 are both car", message)
        self.assertEqual(status, 64)

    def test_names_that_a_network_itself_repeats_are_told_apart(self):
        path = self.made(tiny.yolov8)
        model = onnx.load(str(path))
        model.metadata_props[0].value = "{0: 'car', 1: 'car', 2: 'dog'}"
        onnx.save(model, str(path))
        self.assertEqual(self.run_import(path)[1]["classes"], ["car-0", "car-1", "dog"])

    def test_what_is_no_plain_text_in_utf8_is_refused(self):
        names = "car\nfußgänger\ndog\n"
        for content, words in ((names.encode("utf-16"), "names.txt is not UTF-8 but UTF-16"),
                               (names.encode("utf-16-le"), "names.txt is not UTF-8 but UTF-16"),
                               (names.encode("latin-1"), "names.txt:2 is not UTF-8 (byte 0xdf); save the file as"),
                               (b"car\nperson\n\x1b[1mdog\n", "names.txt:3 holds the control character U+001B"),
                               (b"car\tauto\nperson\ndog\n", "names.txt:1 holds the control character U+0009"),
                               (b"\n \n", "names.txt holds no names")):
            message, status = self.refused(*self.of_file(content))
            self.assertIn(words, message)
            self.assertEqual(status, 65, message)


class Families(Importing):
    def test_a_family_that_it_is_not_is_refused(self):
        message, _ = self.refused(self.made(tiny.yolox), NAMES, "--family=yolov8")
        self.assertIn("is not known as yolov8", message)
        self.assertIn("yolo export model=FILE.pt format=onnx opset=12 nms=False", message)

    def test_wrong_anchors_show_against_the_files_own_decoding(self):
        path = self.made(tiny.yolov5)
        wrong = "--anchors=" + "/".join(["1,2,3,4,5,6"] * 3)
        self.assertIn("decodes otherwise than the file itself", self.refused(path, NAMES, wrong, "--family=yolov5")[0])

    def test_heads_that_decode_in_a_way_of_their_own_are_taken_as_exported(self):
        told, described = self.run_import(self.made(own_decoding), NAMES)
        self.assertIn("decode in a way of their own", told)
        self.assertEqual(described["outputs"], {"predictions": "predictions"})
        self.assertTrue(described["activation"]["applied"])

    def test_anchors_come_from_the_file(self):
        _, described = self.run_import(self.made(tiny.yolov7), NAMES)
        self.assertEqual([level["anchors"] for level in described["levels"]],
                         [[[float(n) for n in p] for p in l] for l in tiny.ANCHORS.values()])

    def test_anchors_that_are_not_there_are_said_to_be_assumed(self):
        told, described = self.run_import(self.made(tiny.yolov5_heads), NAMES)
        self.assertIn("its anchors are not in the file: those of yolov5 for COCO were taken", told)
        self.assertEqual(described["levels"][0]["anchors"][0], [10, 13])

    def test_offsets_need_their_priors(self):
        path = self.made(tiny.ssd_offsets)
        boxes = next(a for a in (path.parent / "arguments").read_text().split() if "--boxes" in a)
        self.assertIn("say --priors FILE", self.refused(path, NAMES, boxes)[0])
        (self.folder / "priors.txt").write_text("0 0 1 1\n")
        for content, words in (("0 0 1\n", "does not hold priors"), ("a b c d\n", "cannot be read as priors")):
            (self.folder / "wrong.txt").write_text(content)
            self.assertIn(words, self.refused(path, NAMES, boxes, f"--priors={self.folder / 'wrong.txt'}")[0])
        self.assertEqual(self.refused(path, NAMES, boxes, "--priors=/nowhere.txt")[1], 69)
        self.assertIn("1 priors were given for",
                      self.refused(path, NAMES, boxes, f"--priors={self.folder / 'priors.txt'}")[0])

    def test_rotated_boxes_are_named_and_their_angle_is_no_class(self):
        path = self.made(tiny.yolov8)
        model = onnx.load(str(path))
        helper.set_model_props(model, {"task": "obb", "names": "{0: 'car', 1: 'dog'}"})
        onnx.save(model, str(path))
        message, status = self.refused(path)
        self.assertIn("finds rotated boxes (task obb)", message)
        self.assertEqual(status, 78)
        message, _ = self.refused(self.made(tiny.yolox), "--classes=car,person")
        self.assertIn("is the last one the angle of rotated boxes", message)

    def test_outputs_that_could_both_be_the_boxes_are_asked_about(self):
        self.assertIn("could both be the boxes; say --boxes", self.refused(self.made(tiny.ssd_offsets), NAMES)[0])

    def test_the_projects_own_needs_no_import(self):
        nodes = [helper.make_node("Conv", ["images", f"w{n}"], [n], strides=[8, 8]) for n in ("logits8", "box8")]
        weights = {"wlogits8": np.zeros((4, 3, 8, 8), np.float32), "wbox8": np.zeros((4, 3, 8, 8), np.float32)}
        self.assertIn("project's own family",
                      self.refused(self.graph(nodes, {"logits8": None, "box8": None}, weights), NAMES)[0])

    def test_names_that_the_graph_uses_already_make_way(self):
        path = self.made(tiny.detr)
        model = onnx.load(str(path))
        scores, boxes = (o.name for o in model.graph.output)
        names = {scores: "boxes_of_nothing", boxes: "scores", "images": "boxes"}
        for node in model.graph.node:
            for field in (node.input, node.output):
                field[:] = [names.get(n, n) for n in field]
        for info in [*model.graph.input, *model.graph.output]:
            info.name = names.get(info.name, info.name)
        onnx.save(model, str(path))
        _, described = self.run_import(path, NAMES, "--boxes=scores")
        self.assertEqual(described["outputs"], {"boxes": "boxes", "scores": "scores"})
        made = onnx.load(str(self.folder / "out.onnx"))
        onnx.checker.check_model(made)
        shapes = {o.name: [d.dim_value for d in o.type.tensor_type.shape.dim] for o in made.graph.output}
        self.assertEqual(shapes, {"boxes": [1, 12, 4], "scores": [1, 12, tiny.K + 1]})

    def test_what_the_input_is_may_be_said_otherwise(self):
        _, described = self.run_import(self.made(tiny.yolox), NAMES, "--colour=rgb", "--scale=0.5", "--mean=1,2,3",
                                       "--fit=resize")
        self.assertEqual({k: described["input"][k] for k in ("colour", "scale", "mean", "fit")},
                         {"colour": "rgb", "scale": 0.5, "mean": [1, 2, 3], "fit": "resize"})


class Operators(Importing):
    def whole(self, more, outputs, constants=None, domains=()):
        """Computes boxes and scores by matrix products, so that no heads are found; then adds
        the nodes `more`."""
        weight = np.random.default_rng(1).normal(size=(7, 64)).astype(np.float32)
        nodes = [helper.make_node("AveragePool", ["images"], ["p"], kernel_shape=[8, 8], strides=[8, 8]),
                 helper.make_node("ReduceMean", ["p"], ["m"], axes=[1], keepdims=0),
                 helper.make_node("Reshape", ["m", "flat"], ["f"]), helper.make_node("MatMul", ["f", "w"], ["rows"])]
        constants = {"flat": np.array([1, 8, 8]), "w": weight[:, :8].T.copy(), **(constants or {})}
        return self.graph([*nodes, *more], outputs, constants, domains=domains)

    def test_suppression_inside_is_named_with_the_export_that_works(self):
        more = [helper.make_node("Split", ["rows"], ["boxes", "scores"], axis=2, split=[4, 3]),
                helper.make_node("Transpose", ["scores"], ["turned"], perm=[0, 2, 1]),
                helper.make_node("NonMaxSuppression", ["boxes", "turned"], ["chosen"]),
                helper.make_node("Cast", ["chosen"], ["out"], to=1)]
        message, status = self.refused(self.whole(more, {"out": None}), NAMES, "--family=yolov5")
        self.assertIn("operator NonMaxSuppression", message)
        self.assertIn("python export.py --weights FILE.pt --include onnx --opset 12", message)
        self.assertEqual(status, 78)

    def test_top_k_at_the_end_is_named(self):
        more = [helper.make_node("TopK", ["rows", "k"], ["out", "index"], axis=1)]
        self.assertIn("chooses its boxes itself (operator TopK)",
                      self.refused(self.whole(more, {"out": None}, {"k": np.array([3])}), NAMES)[0])

    def test_an_answer_of_chosen_boxes_is_not_taken_for_one_class_with_objectness(self):
        more = [helper.make_node("Slice", ["rows", "zero", "six", "two"], ["short"]),
                helper.make_node("TopK", ["short", "k"], ["out", "index"], axis=1)]
        path = self.whole(more, {"out": None},
                          {"k": np.array([3]), "zero": np.array([0]), "six": np.array([6]), "two": np.array([2])})
        self.assertIn("operator TopK", self.refused(path, "--classes=car")[0])

    def test_an_operator_inside_that_opencv_has_not_is_named(self):
        more = [helper.make_node("Einsum", ["rows", "rows"], ["e"], equation="bij,bij->bij"),
                helper.make_node("Identity", ["e"], ["out"])]
        message, _ = self.refused(self.whole(more, {"out": [1, 8, 7]}), NAMES, "--family=detr")
        self.assertIn("computes with Einsum inside the network", message)
        self.assertIn("pred_logits", message)

    def test_networks_that_choose_their_queries_want_onnx_runtime(self):
        for make in (tiny_queries.rtdetr, tiny_queries.rtdetr_chosen):
            path = self.made(make)
            (self.folder / "out.onnx").unlink(missing_ok=True)
            message, _ = self.refused(path, NAMES)
            self.assertIn("computes with GatherElements, GridSample, TopK inside the network", message)
            self.assertIn("a Perdure that was built with ONNX Runtime (Debian 13)", message)
            told, keys = self.run_import(path, NAMES, "--onnx-runtime")
            self.assertIn("for ONNX Runtime alone", told)
            self.assertIn("colours from 0 to 1", told)
            self.assertEqual((keys["family"], keys["backend"]), ("detr", "onnxruntime"))
            self.assertEqual(keys["activation"], {"class": "sigmoid", "background": "none"})
            self.assertEqual((keys["input"]["scale"], keys["input"]["mean"]), (1 / 255, [0, 0, 0]))
            written = Graph.load(self.folder / "out.onnx")
            self.assertEqual(list(written.inputs), ["images"])
            self.assertEqual([written.shape(o) for o in written.outputs], [[1, 6, 4], [1, 6, 3]])
            onnx.checker.check_model(str(self.folder / "out.onnx"))

    def test_what_the_user_says_of_the_input_goes_before_what_is_usual(self):
        _, keys = self.run_import(self.made(tiny_queries.rtdetr), NAMES, "--onnx-runtime", "--scale=1", "--mean=1,2,3")
        self.assertEqual((keys["input"]["scale"], keys["input"]["mean"]), (1, [1, 2, 3]))

    def test_a_graph_within_an_operator_is_taken_by_no_runtime(self):
        value = helper.make_tensor_value_info("inner", TensorProto.FLOAT, None)
        same = helper.make_graph([helper.make_node("Identity", ["rows"], ["inner"])], "inner", [], [value])
        more = [helper.make_node("If", ["yes"], ["some"], then_branch=same, else_branch=same),
                helper.make_node("Identity", ["some"], ["out"])]
        path = self.whole(more, {"out": [1, 8, 7]}, {"yes": np.array(True)})
        self.assertIn("computes with If", self.refused(path, NAMES, "--family=detr", "--onnx-runtime")[0])

    def with_another(self, kind, name, make, swap):
        """Writes the network of `make`; replaces the operator that `swap` selects by an unknown
        one."""
        path = self.made(make)
        model = onnx.load(str(path))
        node = swap(model.graph.node)
        node.op_type, node.name = kind, name
        del node.attribute[:]
        onnx.save(model, str(path))
        return path

    def test_a_level_that_an_unknown_operator_hides_is_not_left_out(self):
        """The unknown operator is in the features of one of three levels, or after the heads of
        one level."""
        def relu(nodes):
            return [n for n in nodes if n.op_type == "Relu"][1]

        for name, told in (("/neck/act", "(node /neck/act)"), ("", "(the node that gives t")):
            message, status = self.refused(self.with_another("Unheard", name, tiny.yolox, relu), NAMES)
            self.assertEqual(status, 78)
            self.assertIn(f"has the operator Unheard {told}", message)
            self.assertIn("only 2 of its levels were found; export it again without this operator", message)
            self.assertIn("tools/export_onnx.py", message)
        behind = self.with_another("Unheard", "tail", tiny.yolox,
                                   lambda nodes: next(n for n in nodes if n.op_type == "Reshape"))
        self.assertIn("has the operator Unheard (node tail)", self.refused(behind, NAMES)[0])

    def test_another_runtimes_operators_are_named(self):
        more = [helper.make_node("FusedThing", ["rows"], ["out"], domain="com.example")]
        message, _ = self.refused(self.whole(more, {"out": [1, 8, 7]}, domains=["com.example"]), NAMES, "--family=detr")
        self.assertIn("com.example.FusedThing belong to another runtime", message)

    def test_outputs_of_no_family_are_listed_with_their_shapes(self):
        message, _ = self.refused(self.whole([helper.make_node("Relu", ["rows"], ["out"])], {"out": [1, 8, 7]}),
                                  "--classes=a,b,c,d,e")
        self.assertIn("(out 1x8x7)", message)
        for family in ("yolov5", "yolov7", "yolov8", "yolox", "nanodet", "ssd", "detr"):
            self.assertIn(family, message)


class Computing(unittest.TestCase):
    def test_constants_fold_and_cuts_drop_what_is_not_needed(self):
        with tempfile.TemporaryDirectory() as name:
            tiny.yolov8_open_size(Path(name))
            graph = Graph.load(Path(name) / "net.onnx")
            graph.fix_input("net.onnx", (64, 64))
            graph.fold()
        self.assertNotIn("Shape", {n.kind for n in graph.nodes})
        self.assertEqual(graph.shape(graph.outputs[0]), [1, 64 + tiny.K, 8 * 8 + 4 * 4 + 2 * 2])
        before = len(graph.nodes)
        graph.keep([graph.nodes[0].outputs[0]])
        self.assertEqual([n.kind for n in graph.nodes], ["Conv"])
        self.assertGreater(before, 1)

    def test_what_is_no_constant_is_not_taken_for_one(self):
        """The repair must not change a computed bound, or an operator on integers."""
        nodes = [Node("ReduceMax", ["images"], ["top"], {"keepdims": 0}), Node("Clip", ["images", "", "top"], ["c"]),
                 Node("Shape", ["c"], ["s"]), Node("Div", ["s", "two"], ["half"])]
        inputs = {"images": (TensorProto.FLOAT, [1, 3, 8, 8])}
        graph = Graph(nodes, {"two": np.array([2])}, inputs, ["half", "c"], 12, {})
        graph.infer_shapes()
        self.assertEqual(Repair(graph).run(), {})
        self.assertEqual([n.kind for n in graph.nodes], ["ReduceMax", "Clip", "Shape", "Div"])

    def test_zero_points_by_channel_need_no_scale_by_channel(self):
        weight = np.array([[1, 2], [3, 4], [5, 6]], np.int8)
        np.testing.assert_array_equal(dequantised(weight, np.float32(1), np.array([1, 2], np.int8), -1),
                                      [[0, 0], [2, 2], [4, 4]])
        np.testing.assert_array_equal(dequantised(weight, np.array([2, 1, 1]), np.int8(1), 0), [[0, 2], [2, 3], [4, 5]])
        with self.assertRaisesRegex(Fault, "3 values, which is not the number of channels"):
            dequantised(weight, np.float32(1), np.array([1, 2, 3], np.int8), -1)

    def test_a_computed_bias_of_eight_bits_is_refused(self):
        constants = {"s": np.float32(1), "z": np.uint8(0), "w": np.ones((1, 1, 1, 1), np.uint8)}
        node = Node("QLinearConv", ["images", "s", "z", "w", "s", "z", "s", "z", "computed"], ["y"], {})
        graph = Graph([node], constants, {"images": (TensorProto.UINT8, [1, 1, 4, 4])}, ["y"], 12, {})
        with self.assertRaisesRegex(Fault, "the bias of an operator QLinearConv is computed"):
            to_float(graph)

    def test_pooling_and_resizing_have_the_values_of_the_standard(self):
        x = np.arange(16, dtype=np.float32).reshape(1, 1, 4, 4)
        np.testing.assert_array_equal(OPS["MaxPool"]([x], {"kernel_shape": [2, 2], "strides": [2, 2]}, 12)[0].ravel(),
                                      [5, 7, 13, 15])
        pads = {"kernel_shape": [3, 3], "strides": [2, 2], "pads": [1, 1, 1, 1]}
        self.assertEqual(OPS["AveragePool"]([x], pads, 12)[0].ravel()[0], np.mean([0, 1, 4, 5]))
        self.assertAlmostEqual(float(OPS["AveragePool"]([x], {**pads, "count_include_pad": 1}, 12)[0].ravel()[0]),
                               (0 + 1 + 4 + 5) / 9, places=6)
        row = np.array([0, 10], np.float32).reshape(1, 1, 1, 2)
        linear = {"mode": "linear", "coordinate_transformation_mode": "half_pixel"}
        out = OPS["Resize"]([row, None, np.array([1, 1, 1, 2], np.float32)], linear, 13)[0]
        np.testing.assert_allclose(out.ravel(), [0, 2.5, 7.5, 10])


if __name__ == "__main__":
    unittest.main()
