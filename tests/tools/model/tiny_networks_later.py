"""Tiny networks of later families, and of eight bits, like those of tiny_networks.py."""

import numpy as np
import tiny_networks as tiny
from onnx import TensorProto, helper, numpy_helper
from tiny_net import SIZE, K, Net, sigmoid, softmax
from tiny_networks import CLASSES, UNIT, grid, logit

STRIDES = (8, 16, 32)
COUNT = sum((SIZE // s) ** 2 for s in STRIDES)
NORMALISED = dict(mean=(103.53, 116.28, 123.675), scale=(1 / 57.375, 1 / 57.12, 1 / 58.395))


def chosen(net, whole, count, most=20):
    """Adds the end of end-to-end exports: the best cells with boxes, scores and classes,
    [1,most,6]."""
    rows = net.node("Transpose", [whole], perm=[0, 2, 1])
    boxes, scores = net.node("Split", [rows], 2, axis=2, split=[4, K])
    best = net.node("ReduceMax", [scores], axes=[2], keepdims=0)
    _, at = net.node("TopK", [best, np.array([most])], 2, axis=1)
    at = net.node("Unsqueeze", [at], axes=[2])
    boxes = net.node("GatherElements", [boxes, net.node("Tile", [at, np.array([1, 1, 4])])], axis=1)
    scores = net.node("GatherElements", [scores, net.node("Tile", [at, np.array([1, 1, K])])], axis=1)
    flat = net.node("Flatten", [scores], axis=1)
    top, index = net.node("TopK", [flat, np.array([most])], 2, axis=1)
    classes = net.node("Mod", [index, np.array(K)])
    row = net.node("Unsqueeze", [net.node("Div", [index, np.array(K)])], axes=[2])
    boxes = net.node("GatherElements", [boxes, net.node("Tile", [row, np.array([1, 1, 4])])], axis=1)
    parts = [boxes, net.node("Unsqueeze", [top], axes=[2]),
             net.node("Unsqueeze", [net.node("Cast", [classes], to=TensorProto.FLOAT)], axes=[2])]
    return net.node("Concat", parts, axis=2)


def named(net, heads, branch):
    """Gives the weights of these heads the names of Ultralytics' files."""
    for box, classes, stride in heads:
        for role, output in (("cv2", box), ("cv3", classes)):
            node = next(n for n in net.nodes if output in n.output)
            weight = next(c for c in net.constants if c.name == node.input[1])
            weight.name = node.input[1] = f"model.23.{branch}{role}.{stride}.2.weight"


def yolov10(folder):
    """End-to-end: the file has only its one-to-one branch, and selects the best cells."""
    net = Net(30, **UNIT)
    rows, heads = tiny.yolov8_heads(net)
    named(net, heads, "one2one_")
    whole, count = tiny.yolov8_decode(net, heads)
    net.save(folder, [(chosen(net, whole, count), [1, 20, 6])], rows, [CLASSES])


def yolov10_both(folder):
    """The file has the outputs of both branches; the dense branch is expected."""
    net = Net(31, **UNIT)
    rows, heads = tiny.yolov8_heads(net)
    single = []
    for box, _, stride in heads:
        features = next(n.input[0] for n in net.nodes if box in n.output)
        single.append((net.head(features, 64), net.head(features, K), stride))
    named(net, heads, "")
    named(net, single, "one2one_")
    (one, count), (two, _) = tiny.yolov8_decode(net, single), tiny.yolov8_decode(net, heads)
    net.save(folder, [(one, [1, 4 + K, count]), (two, [1, 4 + K, count])], rows, [CLASSES])


def distances(seed, offset, exponents, **unit):
    """Returns (net, rows, [(box, classes, distances, stride)]) of heads with four distances for
    each cell."""
    net = Net(seed, **unit)
    rows, heads = [], []
    for stride in STRIDES:
        features = net.level(stride)
        classes, box = net.head(features, K), net.head(features, 4, 0.4)
        value, after = net.values[box][0], box
        if exponents:
            value, after = np.exp(value), net.node("Exp", [box])
        d, at = value * stride, (grid(SIZE // stride) + offset) * stride
        level = [at[..., 0] - d[0], at[..., 1] - d[1], at[..., 0] + d[2], at[..., 1] + d[3], *net.values[classes][0]]
        rows.append(np.stack(level, -1).reshape(-1, 4 + K))
        heads.append((box, classes, after, stride))
    rows = np.concatenate(rows)
    good = (rows[:, 2] > rows[:, 0]) & (rows[:, 3] > rows[:, 1])  # a valid box has positive sides
    return net, rows[good], heads


def points(offset):
    return np.concatenate([(grid(SIZE // s) + offset).reshape(-1, 2) for s in STRIDES]).astype(np.float32)


def strides():
    return np.concatenate([np.full((SIZE // s) ** 2, s, np.float32) for s in STRIDES])


def yolo26(folder):
    """Without bins: the head gives the four distances; corners, end-to-end."""
    net, rows, heads = distances(32, 0.5, False, **UNIT)
    flat = [(net.node("Reshape", [b, np.array([1, 4, -1])]), net.node("Reshape", [c, np.array([1, K, -1])]))
            for b, c, _, _ in heads]
    box, classes = (net.node("Concat", [f[i] for f in flat], axis=2) for i in (0, 1))
    low, high = net.node("Split", [box], 2, axis=1, split=[2, 2])
    low, high = net.node("Sub", [points(0.5).T[None], low]), net.node("Add", [points(0.5).T[None], high])
    box = net.node("Mul", [net.node("Concat", [low, high], axis=1), strides()[None, None]])
    whole = net.node("Concat", [box, net.node("Sigmoid", [classes])], axis=1)
    net.save(folder, [(chosen(net, whole, COUNT), [1, 20, 6])], rows, [CLASSES])


def rtmdet(folder):
    """The raw outputs: distances from a cell's corner in pixels, level by level."""
    net, rows, heads = distances(33, 0.0, True, **NORMALISED)
    outputs = [(c, [1, K, SIZE // s, SIZE // s]) for _, c, _, s in heads]
    outputs += [(net.node("Mul", [after, np.float32(s)]), [1, 4, SIZE // s, SIZE // s]) for _, _, after, s in heads]
    net.save(folder, outputs, rows, [CLASSES, "--family=rtmdet"])


def rtmdet_suppressed(folder):
    """With its suppression: boxes and scores are separate before it; linear distances."""
    net, rows, heads = distances(34, 0.0, False, **NORMALISED)
    turned = [[net.node("Reshape", [net.node("Transpose", [t], perm=[0, 2, 3, 1]), np.array([1, -1, n])])
               for t, n in ((b, 4), (c, K))] for b, c, _, _ in heads]
    box, classes = (net.node("Concat", [t[i] for t in turned], axis=1) for i in (0, 1))
    box = net.node("Mul", [box, strides()[None, :, None]])
    low, high = net.node("Split", [box], 2, axis=2, split=[2, 2])
    at = points(0.0)[None] * strides()[None, :, None]
    box = net.node("Concat", [net.node("Sub", [at, low]), net.node("Add", [at, high])], axis=2)
    scores = net.node("Transpose", [net.node("Sigmoid", [classes])], perm=[0, 2, 1])
    kept = net.node("NonMaxSuppression",
                    [box, scores, np.array([10]), np.array([0.5], np.float32), np.array([0.2], np.float32)])
    net.save(folder, [], rows, [CLASSES], [(kept, TensorProto.INT64)])


def picodet_heads(seed):
    net = Net(seed, mean=(123.675, 116.28, 103.53), scale=(1 / 58.395, 1 / 57.12, 1 / 57.375), rgb=True)
    net.opset = 11  # this version has no HardSwish, but files use it
    rows, outputs = [], []
    for stride in (8, 16, 32, 64):
        cells, features = SIZE // stride, net.level(stride)
        value = net.values[features]
        features = net.node("HardSwish", [features])
        net.values[features] = value * np.clip(value / 6 + 0.5, 0, 1)
        raw = net.head(features, K + 32)
        value = net.values[raw][0]
        d = (softmax(value[K:].reshape(4, 8, cells, cells), 1) * np.arange(8).reshape(1, 8, 1, 1)).sum(1) * stride
        at = (grid(cells) + 0.5) * stride
        rows.append(np.stack([at[..., 0] - d[0], at[..., 1] - d[1], at[..., 0] + d[2], at[..., 1] + d[3], *value[:K]],
                             -1).reshape(-1, 4 + K))
        classes, sides = net.node("Split", [raw], 2, axis=1, split=[K, 32])
        for part, n in ((net.node("Sigmoid", [classes]), K), (sides, 32)):
            flat = net.node("Reshape", [part, np.array([1, n, cells * cells])])
            outputs.append((net.node("Transpose", [flat], perm=[0, 2, 1]), [1, cells * cells, n]))
    return net, np.concatenate(rows), outputs[::2] + outputs[1::2]


def picodet(folder):
    net, rows, outputs = picodet_heads(35)
    net.save(folder, outputs, rows, [CLASSES])


def picodet_leftovers(folder):
    """Constants among the inputs, with and without their values (as left by a folding tool)."""
    import onnx
    net, rows, outputs = picodet_heads(36)
    net.save(folder, outputs, rows, [CLASSES])
    model = onnx.load(str(folder / "net.onnx"))
    for constant in model.graph.initializer:
        model.graph.input.append(helper.make_tensor_value_info(constant.name, constant.data_type, constant.dims))
    for name in ("Constant_0", "Reshape_1"):
        model.graph.input.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 1, 4, 4]))
    onnx.save(model, str(folder / "net.onnx"))


FASTEST_ANCHORS = {16: [[6, 9], [19, 25], [28, 40]], 32: [[33, 29], [45, 60], [57, 51]]}


def yolo_fastestv2(folder):
    """Boxes and objectness of three anchors, with one common soft-max of the classes."""
    net = Net(37, scale=(1 / 255,) * 3)
    rows, outputs = [], []
    for stride, anchors in FASTEST_ANCHORS.items():
        cells, features = SIZE // stride, net.level(stride)
        box, objectness, classes = net.head(features, 12), net.head(features, 3), net.head(features, K)
        b, o, c = (net.values[n][0] for n in (box, objectness, classes))
        share = softmax(c, 0)
        for a, anchor in enumerate(anchors):
            t = sigmoid(b[4 * a:4 * a + 4]).transpose(1, 2, 0)
            xy, wh = (2 * t[..., :2] - 0.5 + grid(cells)) * stride, (2 * t[..., 2:]) ** 2 * np.array(anchor)
            odds = logit(sigmoid(o[a]) * share).reshape(K, -1).T
            rows.append(tiny.centre_rows(np.concatenate([xy, wh], -1).reshape(-1, 4), odds))
        parts = [net.node("Sigmoid", [box]), net.node("Sigmoid", [objectness]),
                 net.node("Softmax", [net.node("Transpose", [classes], perm=[0, 2, 3, 1])], axis=3)]
        parts[2] = net.node("Transpose", [parts[2]], perm=[0, 3, 1, 2])
        joined = net.node("Concat", parts, axis=1)
        outputs.append((net.node("Transpose", [joined], perm=[0, 2, 3, 1]), [1, cells, cells, 15 + K]))
    anchors = "/".join(",".join(f"{w},{h}" for w, h in level) for level in FASTEST_ANCHORS.values())
    net.save(folder, outputs, np.concatenate(rows), [CLASSES, "--anchors=" + anchors])


# -- eight bits ---------------------------------------------------------------------------------------

def eight_bits(weight):
    """Returns (integers, scale of each first channel) with integers·scale close to the weight."""
    scale = np.abs(weight).reshape(len(weight), -1).max(1) / 127
    shape = (-1,) + (1,) * (weight.ndim - 1)
    return np.round(weight / scale.reshape(shape)).astype(np.int8), scale.astype(np.float32)


class Quantising(Net):
    """A Net that writes convolutions with eight-bit weights. Its expected answers are computed
    with the rounded weights."""

    def __init__(self, seed, way, **unit):
        super().__init__(seed, **unit)
        self.way = way

    def normal(self, *shape, spread=1.0):
        value = super().normal(*shape, spread=spread)
        if len(shape) != 4:
            return value
        bits, scale = eight_bits(value)
        return (bits * scale.reshape(-1, 1, 1, 1)).astype(np.float32)

    def pair(self, name, scale, zero):
        """Adds quantisation to unsigned eight bits and back."""
        bits = super().node("QuantizeLinear", [name, np.float32(scale), np.uint8(zero)])
        return super().node("DequantizeLinear", [bits, np.float32(scale), np.uint8(zero)])

    def node(self, kind, inputs, count=1, **attributes):
        if kind == "Relu" and self.way != "dynamic":  # quantisers remove it: unsigned numbers begin at zero
            if self.way == "qlinear":
                return super().node("DequantizeLinear", [self.bits, np.float32(1), np.uint8(0)])
            return self.pair(inputs[0], 1.0, 0)
        if kind != "Conv" or attributes["kernel_shape"] == [1, 1] and len(inputs) == 2:
            return super().node(kind, inputs, count, **attributes)
        name, weight, *bias = inputs
        bits, scale = eight_bits(weight)
        if self.way == "qdq":
            name = self.pair(name, 0.1, 7)
            weight = super().node("DequantizeLinear", [bits, scale, np.zeros(len(scale), np.int8)], axis=0)
            return super().node(kind, [name, weight, *bias], **attributes)
        if self.way == "qlinear":
            x = super().node("QuantizeLinear", [name, np.float32(0.1), np.uint8(3)])
            zero = 0 if not bias else 128
            whole = [np.round(b / (0.1 * scale)).astype(np.int32) for b in bias]
            self.rounded = [w * np.float32(0.1) * scale for w in whole]
            self.bits = super().node("QLinearConv", [x, np.float32(0.1), np.uint8(3), bits, scale,
                                                     np.zeros(len(scale), np.int8), np.float32(1), np.uint8(zero),
                                                     *whole], **attributes)
            return super().node("DequantizeLinear", [self.bits, np.float32(1), np.uint8(zero)])
        x, x_scale, x_zero = super().node("DynamicQuantizeLinear", [name], 3)
        whole = super().node("ConvInteger", [x, bits, x_zero, np.int8(0)], **attributes)
        real = super().node("Cast", [whole], to=TensorProto.FLOAT)
        factor = super().node("Mul", [x_scale, scale.reshape(1, -1, 1, 1)])
        real = super().node("Mul", [real, factor])
        return super().node("Add", [real, bias[0].reshape(1, -1, 1, 1)]) if bias else real

    def head(self, features, channels, spread=0.8):
        name = super().head(features, channels, spread)
        if self.way == "qlinear":  # the bias is rounded as well
            given = next(c for c in reversed(self.biases))
            self.values[name] = self.values[name] + (self.rounded[0] - given).reshape(1, -1, 1, 1)
        return name

    def constant(self, value):
        return super().constant(value)


class QuantisingLinear(Quantising):
    """Stores the biases of the heads."""

    def __init__(self, seed, **unit):
        self.biases = []
        super().__init__(seed, "qlinear", **unit)

    def normal(self, *shape, spread=1.0):
        value = super().normal(*shape, spread=spread)
        if len(shape) == 1:
            self.biases.append(value)
        return value


def in_eight_bits(net, folder):
    net.opset = 13
    rows, heads = tiny.yolov8_heads(net)
    # The decoding of the dense head is omitted, because the float networks test it.
    outputs = [(o, [1, n, SIZE // s, SIZE // s]) for b, c, s in heads for o, n in ((b, 64), (c, K))]
    net.save(folder, outputs, rows, [CLASSES])


def yolov8_qdq(folder):
    in_eight_bits(Quantising(40, "qdq", **UNIT), folder)


def yolov8_dynamic(folder):
    in_eight_bits(Quantising(41, "dynamic", **UNIT), folder)


def yolov8_qlinear(folder):
    in_eight_bits(QuantisingLinear(42, **UNIT), folder)


ALL = (yolov10, yolov10_both, yolo26, rtmdet, rtmdet_suppressed, picodet, picodet_leftovers, yolo_fastestv2,
       yolov8_qdq, yolov8_dynamic, yolov8_qlinear)
