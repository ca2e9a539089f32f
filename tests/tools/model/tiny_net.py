"""Builds a small network: its ONNX graph, and the values of its tensors for one picture."""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

SIZE, CHANNELS, NAMES = 64, 8, ["car", "person", "dog"]
K = len(NAMES)
FLOAT = TensorProto.FLOAT


def sigmoid(x):
    return 1 / (1 + np.exp(-x.astype(np.float64)))


def softmax(x, axis=-1):
    e = np.exp(x.astype(np.float64) - x.max(axis, keepdims=True))
    return e / e.sum(axis, keepdims=True)


class Net:
    """Builds a graph, and computes the value of each tensor for the picture."""

    def __init__(self, seed, mean=(0, 0, 0), scale=(1, 1, 1), rgb=False):
        self.random = np.random.default_rng(seed)
        self.picture = self.random.integers(0, 256, (SIZE, SIZE, 3), dtype=np.uint8)  # red, green, blue
        pixels = self.picture.astype(np.float32) if rgb else self.picture[:, :, ::-1].astype(np.float32)
        blob = (pixels - np.array(mean, np.float32)) * np.array(scale, np.float32)
        self.nodes, self.constants, self.values = [], [], {"images": blob.transpose(2, 0, 1)[None]}
        self.input_shape = [1, 3, SIZE, SIZE]
        self.more_inputs = []  # (name, type, shape), not used by the heads
        self.opset = 12

    def constant(self, value):
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value), name))
        return name

    def node(self, kind, inputs, count=1, **attributes):
        inputs = [i if isinstance(i, str) else self.constant(i) for i in inputs]
        outputs = [f"t{len(self.nodes)}_{i}" for i in range(count)]
        self.nodes.append(helper.make_node(kind, inputs, outputs, **attributes))
        return outputs[0] if count == 1 else outputs

    def normal(self, *shape, spread=1.0):
        return self.random.normal(0, spread, shape).astype(np.float32)

    def level(self, stride):
        """Adds features of one resolution: weighted patches of the picture, with known values."""
        blob = self.values["images"]
        cells = SIZE // stride
        patches = blob.reshape(3, cells, stride, cells, stride).transpose(1, 3, 0, 2, 4).reshape(cells * cells, -1)
        spread = 1.0 / max(1e-6, float(np.abs(patches).mean()) * np.sqrt(patches.shape[1]))
        weight = self.normal(CHANNELS, 3, stride, stride, spread=spread)
        name = self.node("Conv", ["images", weight], kernel_shape=[stride, stride], strides=[stride, stride])
        value = (patches.astype(np.float64) @ weight.reshape(CHANNELS, -1).T).T.reshape(1, CHANNELS, cells, cells)
        out = self.node("Relu", [name])
        self.values[out] = np.maximum(value, 0)
        return out

    def head(self, features, channels, spread=0.8):
        weight, bias = self.normal(channels, CHANNELS, 1, 1, spread=spread), self.normal(channels, spread=0.5)
        name = self.node("Conv", [features, weight, bias], kernel_shape=[1, 1])
        value = np.einsum("oi,bihw->bohw", weight[:, :, 0, 0].astype(np.float64), self.values[features])
        self.values[name] = value + bias.reshape(1, -1, 1, 1)
        return name

    def save(self, folder, outputs, rows, arguments, free_outputs=(), metadata=()):
        """Writes the files. `outputs`: (tensor, shape). `rows`: x1 y1 x2 y2 and the log-odds of
        each class."""
        folder.mkdir(parents=True, exist_ok=True)
        infos = [helper.make_tensor_value_info(n, FLOAT, s) for n, s in outputs]
        infos += [helper.make_tensor_value_info(n, t, None) for n, t in free_outputs]
        graph = helper.make_graph(self.nodes, "tiny",
                                  [helper.make_tensor_value_info(*what) for what in
                                   (("images", FLOAT, self.input_shape), *self.more_inputs)], infos, self.constants)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", self.opset)])
        model.ir_version = 7
        helper.set_model_props(model, dict(metadata))
        onnx.save(model, str(folder / "net.onnx"))
        (folder / "picture.ppm").write_bytes(b"P6 %d %d 255\n" % (SIZE, SIZE) + self.picture.tobytes())
        (folder / "arguments").write_text("\n".join(arguments) + "\n")
        np.savetxt(folder / "expected.csv", np.asarray(rows), delimiter=" ", fmt="%.9g")
