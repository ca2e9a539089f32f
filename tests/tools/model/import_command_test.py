#!/usr/bin/python3
"""Tests the program `perdure model import`: its files, its exit statuses, and the remaining
files after a failure."""

import os
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from importing import NAMES, Importing
import numpy as np
import onnx
import tiny_networks as tiny
import tiny_queries
from onnx import TensorProto, numpy_helper


@unittest.skipUnless("PERDURE_BIN" in os.environ, "run by ctest")
class Command(Importing):
    def perdure(self, *words, folder=None):
        done = subprocess.run([os.environ["PERDURE_BIN"] + "/perdure", "model", *map(str, words)], capture_output=True,
                              text=True, cwd=folder)
        return done.returncode, done.stdout + done.stderr

    def test_it_writes_network_description_and_drawing(self):
        path = self.made(tiny.yolov8)
        status, told = self.perdure("import", path, "--image", path.parent / "picture.ppm", "--out",
                                    self.folder / "out")
        self.assertEqual(status, 0, told)
        self.assertIn("OpenCV      answers as the file says", told)
        self.assertIn("perdure-inference --set model.path=", told)
        self.assertEqual(sorted(p.name for p in (self.folder / "out").iterdir()),
                         ["net.perdure.onnx", "net.perdure.onnx.model.json", "net.perdure.png"])
        drawn = self.folder / "again.png"
        status, told = self.perdure("look", self.folder / "out/net.perdure.onnx", "--image",
                                    path.parent / "picture.ppm", "--out", drawn)
        self.assertEqual(status, 0, told)
        self.assertTrue(drawn.exists())

    def test_without_a_folder_the_files_lie_beside_the_network(self):
        folder = self.made(tiny.yolox).parent
        status, told = self.perdure("import", "net.onnx", NAMES, "--no-check", folder=folder)
        self.assertEqual(status, 0, told)
        self.assertIn("written     net.perdure.onnx, net.perdure.onnx.model.json\n", told)
        self.assertEqual(sorted(p.name for p in folder.glob("*net.perdure*")),
                         ["net.perdure.onnx", "net.perdure.onnx.model.json", "net.perdure.png"])

    def test_what_opencv_does_not_have_is_for_onnx_runtime_where_the_program_has_it(self):
        path = self.made(tiny_queries.rtdetr_chosen)
        status, told = self.perdure("import", path, NAMES, "--image", path.parent / "picture.ppm")
        if status != 0:
            self.assertIn("a Perdure that was built with ONNX Runtime (Debian 13)", told)
            return
        self.assertIn("ONNX Runtime answers as the file says", told)
        self.assertLess(told.count("\n"), 40, "Debian's library complains of a thousand operators")

    def test_statuses_say_what_kind_of_fault_it_is(self):
        self.assertEqual(self.perdure("import", self.folder / "none.onnx", NAMES)[0], 69)
        self.assertEqual(self.perdure("import", self.made(tiny.yolox))[0], 64)
        self.assertEqual(self.perdure("import")[0], 64)
        self.assertEqual(self.perdure("import", self.folder / "yolox/net.onnx", "--classes=car")[0], 78)
        self.assertEqual(self.perdure("import", self.folder / "yolox/net.onnx", NAMES, "--image", "/nowhere.jpg")[0],
                         69)
        status, told = self.perdure("--help")
        self.assertEqual(status, 0)
        self.assertIn("perdure model import yolov8n.onnx --image street.jpg", told)

    def test_files_take_their_places_together(self):
        """A mount makes one file irreplaceable; the previous network must be restored."""
        path = self.made(tiny.yolox)
        importing = f"{os.environ['PERDURE_BIN']}/perdure model import {path} {NAMES} --out {{disk}}"
        done = self.on_a_small_disk(2000, f"""{importing} --pad 100 >&2 || exit 98
            cd {{disk}} && echo >> net.perdure.onnx && sha256sum * > {self.folder}/sums && cd -
            mount --bind {path} {{disk}}/net.perdure.onnx.model.json || exit 99
            {importing} >&2; echo status $? >&2; umount {{disk}}/net.perdure.onnx.model.json
            ls -A {{disk}}; cd {{disk}} && sha256sum --quiet -c {self.folder}/sums""")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("disk/net.perdure.onnx.model.json cannot be written (Device or resource busy); give", done.stderr)
        self.assertIn("status 69\n", done.stderr)
        self.assertTrue(done.stdout.endswith("net.perdure.onnx\nnet.perdure.onnx.model.json\nnet.perdure.png\n"),
                        done.stdout)

    def test_what_is_wrong_is_one_sentence(self):
        path = self.made(tiny.yolox)
        text = self.folder / "text.onnx"
        text.write_text("this is a text\nof two lines\n")
        picture = path.parent / "picture.ppm"
        for words, wanted in ((["import", path, NAMES, "--family", "foo"], 64), (["import", text, NAMES], 65),
                              (["import", path, NAMES, "--size", "abc"], 64),
                              (["look", path, "--image", picture, "--out", self.folder / "noext"], 64)):
            status, told = self.perdure(*words)
            self.assertEqual(status, wanted, told)
            self.assertEqual(told.count("\n"), 1, told)
            self.assertTrue(told.startswith("perdure"), told)

    def test_output_that_nobody_takes_is_74(self):
        path = self.made(tiny.yolox)
        with open("/dev/full", "w") as full:
            done = subprocess.run([os.environ["PERDURE_BIN"] + "/perdure", "model", "import", path, NAMES],
                                  stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 74, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn("standard output cannot be written whole", done.stderr)

    def test_what_nobody_can_run_leaves_nothing_behind(self):
        path = self.made(tiny.yolox)
        model = onnx.shape_inference.infer_shapes(onnx.load(str(path)))  # shapes cannot be inferred later
        next(n for n in model.graph.node if n.op_type == "Relu").op_type = "Unheard"
        onnx.save(model, str(path))
        status, told = self.perdure("import", path, NAMES, "--out", self.folder / "out")
        self.assertEqual(status, 78, told)
        self.assertIn("OpenCV does not take its operator Unheard", told)
        self.assertIn(f"{self.folder}/out/net.perdure.onnx", told)
        self.assertFalse((self.folder / "out").exists())

    def contents(self, folder):
        return {p.name: p.read_bytes() for p in folder.iterdir()}

    def test_a_network_that_was_there_outlives_every_import_that_fails(self):
        out = self.folder / "out"
        path = self.made(tiny.yolox)
        status, told = self.perdure("import", path, NAMES, "--out", out)
        self.assertEqual(status, 0, told)
        description = out / "net.perdure.onnx.model.json"
        description.write_text(description.read_text().replace('"temperature": 1.0', '"temperature": 1.5'))
        before = self.contents(out)
        model = onnx.load(str(path))
        for weights in model.graph.initializer:
            if weights.data_type == TensorProto.FLOAT:
                weights.CopyFrom(numpy_helper.from_array(numpy_helper.to_array(weights) * np.float32(np.nan),
                                                         weights.name))
        (self.folder / "nan").mkdir()
        onnx.save(model, str(self.folder / "nan/net.onnx"))
        for failing in ([path, NAMES, "--no-check", "--scale", "0"], [path, NAMES, "--pad", "300"],
                        [path, "--classes=car"], [self.folder / "nan/net.onnx", NAMES],
                        [path, NAMES, "--image", "/nowhere.jpg"]):
            status, told = self.perdure("import", *failing, "--out", out)
            self.assertNotEqual(status, 0, told)
            self.assertTrue(self.contents(out) == before, failing)
        (self.folder / "taken/net.perdure.onnx.model.json").mkdir(parents=True)
        status, told = self.perdure("import", path, NAMES, "--out", self.folder / "taken")
        self.assertEqual(status, 69, told)
        self.assertEqual([p.name for p in (self.folder / "taken").iterdir()], ["net.perdure.onnx.model.json"])
        self.assertEqual(self.perdure("import", path, NAMES, "--out", out)[0], 0)
        self.assertNotIn("1.5", description.read_text())

    def files_of(self, path):
        status, told = self.perdure("import", path, NAMES, "--out", self.folder / "sized")
        self.assertEqual(status, 0, told)
        return sorted((self.folder / "sized").iterdir())

    def on_a_small_disk(self, blocks, command):
        """Runs `command` on a small file system that it fills, and returns its output; {disk} is
        the folder."""
        disk = self.folder / "disk"
        disk.mkdir(exist_ok=True)
        script = f"mount -t tmpfs -o size={blocks}k small {disk} || exit 99\n{command.format(disk=disk)}\n"
        done = subprocess.run(["unshare", "--map-root-user", "--mount", "sh", "-c", script], capture_output=True,
                              text=True)
        if done.returncode == 99 or "unshare" in done.stderr:
            self.skipTest("no right to mount a small disk")
        return done

    def test_a_full_disk_is_74_and_leaves_what_was_there(self):
        path = self.made(tiny.yolox)
        importing = f"{os.environ['PERDURE_BIN']}/perdure model import {path} {NAMES} --out {{disk}}"
        parts = [4 * -(-p.stat().st_size // 4096) for p in self.files_of(path)]
        for left in (8, parts[0], sum(parts[:2])):  # kB; the network, then another file, is too large
            done = self.on_a_small_disk(2000, f"""{importing} >&2 || exit 98
                cd {{disk}} && sha256sum * > {self.folder}/sums && cd -
                dd if=/dev/zero of={{disk}}/ballast bs=4k 2>/dev/null; truncate -s -{left}k {{disk}}/ballast
                {importing} >&2; echo status $? >&2
                rm {{disk}}/ballast; ls -A {{disk}}; cd {{disk}} && sha256sum --quiet -c {self.folder}/sums""")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("status 74\n", done.stderr)
            self.assertIn("free space", done.stderr)
            self.assertIn("net.perdure", done.stderr)
            self.assertTrue(done.stdout.endswith("net.perdure.onnx\nnet.perdure.onnx.model.json\nnet.perdure.png\n"),
                            done.stdout)


if __name__ == "__main__":
    unittest.main()
