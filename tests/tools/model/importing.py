"""Support for tests of `perdure model import`: a folder, small networks, and the import in this
process."""

import io
import json
import sys
import tempfile
import unittest
from contextlib import redirect_stdout
from pathlib import Path

try:
    import numpy as np
    import onnx
    from onnx import TensorProto, helper, numpy_helper
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (deploy/install --build)")
    sys.exit(77)

from perdure_model import __main__ as importer
from perdure_model.faults import Fault

NAMES = "--classes=car,person,dog"


class Importing(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def made(self, make):
        make(self.folder / make.__name__)
        return self.folder / make.__name__ / "net.onnx"

    def graph(self, nodes, outputs, constants=None, inputs=None, opset=12, domains=()):
        """Writes a file with `nodes`; `outputs`: {name: shape}; `inputs`: {name: (type, shape)}."""
        inputs = inputs or {"images": (TensorProto.FLOAT, [1, 3, 64, 64])}
        graph = helper.make_graph(
            nodes, "g", [helper.make_tensor_value_info(n, t, s) for n, (t, s) in inputs.items()],
            [helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in outputs.items()],
            [numpy_helper.from_array(np.asarray(v), k) for k, v in (constants or {}).items()])
        model = helper.make_model(graph,
                                  opset_imports=[helper.make_opsetid("", opset),
                                                 *(helper.make_opsetid(d, 1) for d in domains)])
        path = self.folder / "g.onnx"
        onnx.save(model, str(path))
        return path

    def run_import(self, path, *arguments):
        """Returns (printed text, model.json)."""
        out = self.folder / "out.onnx"
        told = io.StringIO()
        with redirect_stdout(told):
            importer.run(importer.parsed([str(path), "--out", str(out), *arguments]))
        return told.getvalue(), json.loads((self.folder / "out.onnx.model.json").read_text())

    def refused(self, path, *arguments):
        with self.assertRaises(Fault) as caught:
            self.run_import(path, *arguments)
        self.assertFalse((self.folder / "out.onnx").exists())
        return str(caught.exception), caught.exception.status
