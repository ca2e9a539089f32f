"""Files with one operator each, as exporters write them, repaired for OpenCV 4.6. The expected
results come from numpy alone.

    operator_cases.py FOLDER     writes FOLDER/<name>.onnx, <name>.f32 and input.f32
"""

import sys
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper
from perdure_model.graph import Graph
from perdure_model.opencv import Repair

F = np.float32
RANDOM = np.random.default_rng(0)
IMAGE = RANDOM.uniform(0, 1, (1, 3, 32, 32)).astype(F)
WEIGHT = RANDOM.normal(0, 0.2, (8, 3, 4, 4)).astype(F)
PATCHES = IMAGE.reshape(1, 3, 8, 4, 8, 4).transpose(0, 2, 4, 1, 3, 5).reshape(64, 48)
FEATURES = (PATCHES @ WEIGHT.reshape(8, 48).T).T.reshape(1, 8, 8, 8)  # the value of the tensor "f"
CASES = {}


def node(kind, inputs, outputs, **attributes):
    return helper.make_node(kind, inputs.split(), outputs.split(), **attributes)


def case(name, nodes, constants, expected, opset=12):
    CASES[name] = (nodes, constants, np.asarray(expected, F), opset)


def softmax(x, axis):
    e = np.exp(x - x.max(axis, keepdims=True))
    return e / e.sum(axis, keepdims=True)


def elementwise():
    positive = np.abs(FEATURES) + 1
    rows = positive.mean((2, 3), keepdims=True)
    plane = positive.mean(1, keepdims=True)
    absolute = [node("Abs", "f", "a"), node("Add", "a one", "p")]
    shapes = {"number": (), "one": (1,), "channels": (1, 8, 1, 1), "channels3": (8, 1, 1), "plane": (1, 1, 8, 8),
              "columns": (8,),
              "columns4": (1, 1, 1, 8), "rows": (1, 1, 8, 1), "all": (1, 8, 8, 8), "all3": (8, 8, 8)}
    for kind, function in {"Add": np.add, "Sub": np.subtract, "Mul": np.multiply, "Div": np.divide}.items():
        for shape_name, shape in shapes.items():
            k = np.asarray(RANDOM.uniform(1, 3, shape), F)
            constants = {"k": k, "one": F(1)}
            case(f"{kind}_{shape_name}", [*absolute, node(kind, "p k", "out")], constants, function(positive, k))
            case(f"{kind}_{shape_name}_first", [*absolute, node(kind, "k p", "out")], constants, function(k, positive))
        # OpenCV merges operators that directly follow a convolution.
        k = RANDOM.uniform(1, 3, (1, 1, 8, 8)).astype(F)
        case(f"{kind}_behind_a_convolution", [node(kind, "f k", "out")], {"k": k}, function(FEATURES, k))
        for what, other, make in (("rows", rows, node("GlobalAveragePool", "p", "g")),
                                  ("plane", plane, node("ReduceMean", "p", "g", axes=[1], keepdims=1))):
            case(f"{kind}_by_its_{what}", [*absolute, make, node(kind, "p g", "out")], {"one": F(1)},
                 function(positive, other))
            case(f"{kind}_by_its_{what}_first", [*absolute, make, node(kind, "g p", "out")], {"one": F(1)},
                 function(other, positive))


def constants_behind_identity():
    k, w = RANDOM.normal(size=(1, 8, 1, 1)).astype(F), RANDOM.normal(size=(8, 8, 1, 1)).astype(F)
    b = RANDOM.normal(size=8).astype(F)
    convolved = np.einsum("oi,bihw->bohw", w[:, :, 0, 0], FEATURES)
    case("identity_of_a_constant", [node("Identity", "k", "k2"), node("Mul", "f k2", "out")], {"k": k}, FEATURES * k)
    case("identity_of_a_weight", [node("Identity", "w", "w2"), node("Conv", "f w2", "out")], {"w": w}, convolved)
    case("identity_of_a_bias", [node("Identity", "b", "b2"), node("Conv", "f w b2", "out")], {"w": w, "b": b},
         convolved + b[:, None, None])


def shapes():
    two, sizes = np.array([2]), np.array([2, 6])
    case("split_input", [node("Split", "f s", "a b", axis=1), node("Relu", "b", "out")], {"s": sizes},
         np.maximum(FEATURES[:, 2:], 0), 13)
    case("split_attribute", [node("Split", "f", "a b", axis=1, split=[2, 6]), node("Relu", "b", "out")], {},
         np.maximum(FEATURES[:, 2:], 0))
    case("squeeze_input", [node("Unsqueeze", "f i", "u"), node("Squeeze", "u i", "s"), node("Relu", "s", "out")],
         {"i": two}, np.maximum(FEATURES, 0), 13)
    case("reduce_sum_13", [node("ReduceSum", "f i", "out", keepdims=1)], {"i": two}, FEATURES.sum(2, keepdims=True), 13)
    for kind, function in {"Mean": np.mean, "Max": np.max, "Min": np.min}.items():
        case(f"reduce_{kind.lower()}_18", [node(f"Reduce{kind}", "f i", "out", keepdims=1)], {"i": two},
             function(FEATURES, axis=2, keepdims=True), 18)
    case("split_18", [node("Split", "f", "a b", axis=1, num_outputs=2), node("Relu", "b", "out")], {},
         np.maximum(FEATURES[:, 4:], 0), 18)
    case("unsqueeze_input", [node("Unsqueeze", "f i", "u"), node("Relu", "u", "out")], {"i": two},
         np.maximum(FEATURES, 0)[:, :, None], 13)
    case("gather_several", [node("Gather", "f i", "out", axis=1)], {"i": np.array([0, 5, 2])}, FEATURES[:, [0, 5, 2]])
    case("slice_steps", [node("Slice", "f b e a s", "out")],
         {"b": np.array([1]), "e": np.array([2**62]), "a": np.array([3]), "s": two}, FEATURES[..., 1::2])
    shuffled = FEATURES.reshape(1, 2, 4, 8, 8).transpose(0, 2, 1, 3, 4).reshape(1, 8, 8, 8)
    case("shuffle",
         [node("Reshape", "f s", "r"), node("Transpose", "r", "t", perm=[0, 2, 1, 3, 4]),
          node("Reshape", "t q", "out")],
         {"s": np.array([1, 2, 4, 8, 8]), "q": np.array([0, -1, 8, 8])}, shuffled)
    case("pad", [node("Pad", "f p", "out")], {"p": np.array([0, 0, 1, 1, 0, 0, 1, 1])},
         np.pad(FEATURES, ((0, 0), (0, 0), (1, 1), (1, 1))))
    up = FEATURES.repeat(2, 2).repeat(2, 3)
    way = dict(mode="nearest", nearest_mode="floor", coordinate_transformation_mode="asymmetric")
    empty = {"none": np.array([], F)}
    case("resize_scales", [node("Resize", "f none s", "out", **way)], {**empty, "s": np.array([1, 1, 2, 2], F)}, up)
    case("resize_sizes", [node("Resize", "f none none s", "out", **way)], {**empty, "s": np.array([1, 8, 16, 16])}, up)


def activations():
    f = FEATURES
    case("clip", [node("Clip", "f l h", "out")], {"l": F(0), "h": F(0.5)}, np.clip(f, 0, 0.5))
    case("clip_below", [node("Clip", "f l", "out")], {"l": F(-0.1)}, np.maximum(f, F(-0.1)))
    case("max_number", [node("Max", "f l", "out")], {"l": F(0.1)}, np.maximum(f, F(0.1)))
    case("min_number", [node("Min", "l f", "out")], {"l": F(0.1)}, np.minimum(f, F(0.1)))
    case("leaky_default", [node("LeakyRelu", "f", "out")], {}, np.where(f < 0, f * 0.01, f))
    case("hard_sigmoid_default", [node("HardSigmoid", "f", "out")], {}, np.clip(0.2 * f + 0.5, 0, 1))
    case("hard_swish", [node("HardSwish", "f", "out")], {}, f * np.clip(f / 6 + 0.5, 0, 1), 14)
    case("silu", [node("Sigmoid", "f", "s"), node("Mul", "f s", "out")], {}, f / (1 + np.exp(-f)))
    case("mish", [node("Softplus", "f", "s"), node("Tanh", "s", "t"), node("Mul", "f t", "out")], {},
         f * np.tanh(np.log1p(np.exp(f))))
    case("softmax_13_default", [node("Softmax", "f", "out")], {}, softmax(f, -1), 13)
    case("softmax_13_channels", [node("Softmax", "f", "out", axis=1)], {}, softmax(f, 1), 13)
    case("softmax_12_default", [node("Softmax", "f", "out")], {}, softmax(f.reshape(1, -1), 1).reshape(f.shape))
    case("softmax_12_last", [node("Softmax", "f", "out", axis=3)], {}, softmax(f, 3))
    case("power", [node("Pow", "f k", "out")], {"k": F(2)}, f**2)
    chains = {"power": ("Pow", F(2), lambda x: x**2), "factor": ("Mul", F(3), lambda x: x * 3),
              "summand": ("Add", F(0.5), lambda x: x + F(0.5))}
    for first, (kind, k, function) in chains.items():
        for then, (kind2, k2, function2) in chains.items():
            case(f"{first}_then_{then}", [node(kind, "f k", "x"), node(kind2, "x k2", "out")], {"k": k, "k2": k2},
                 function2(function(f)))
    g, b = RANDOM.uniform(0.5, 2, 8).astype(F), RANDOM.normal(size=8).astype(F)
    m = (f - f.mean((2, 3), keepdims=True)) / np.sqrt(f.var((2, 3), keepdims=True) + 1e-5)
    case("instance_norm_default", [node("InstanceNormalization", "f g b", "out")], {"g": g, "b": b},
         m * g[:, None, None] + b[:, None, None])
    v = RANDOM.uniform(0.5, 2, 8).astype(F)
    normal = (f - b[:, None, None]) / np.sqrt(v[:, None, None] + 1e-5) * g[:, None, None] + b[:, None, None]
    case("batch_norm_default", [node("BatchNormalization", "f g b b v", "out")], {"g": g, "b": b, "v": v}, normal)


def products():
    cells = FEATURES.reshape(1, 8, 64)
    turned = cells.transpose(0, 2, 1)
    begin = [node("Reshape", "f s", "r"), node("Transpose", "r", "t", perm=[0, 2, 1])]
    s, m, b = np.array([1, 8, 64]), RANDOM.normal(size=(8, 5)).astype(F), RANDOM.normal(size=5).astype(F)
    case("linear", [*begin, node("MatMul", "t m", "p"), node("Add", "b p", "out")], {"s": s, "m": m, "b": b},
         turned @ m + b)
    left = RANDOM.normal(size=(3, 64)).astype(F)
    case("constant_on_the_left", [*begin, node("MatMul", "m t", "out")], {"s": s, "m": left}, left @ turned)
    attention = softmax(turned @ cells, -1) @ turned
    case("attention",
         [*begin, node("MatMul", "t r", "p"), node("Softmax", "p", "q", axis=2),
          node("MatMul", "q t", "out")], {"s": s}, attention)
    heads = FEATURES.reshape(4, 2, 64)
    batched = RANDOM.normal(size=(4, 3, 2)).astype(F)
    case("constants_by_heads", [node("Reshape", "f s", "r"), node("MatMul", "m r", "out")],
         {"s": np.array([4, 2, 64]), "m": batched}, batched @ heads)
    mean, g = turned.mean(-1, keepdims=True), RANDOM.normal(size=8).astype(F)
    centred = turned - mean
    normal = centred / np.sqrt((centred**2).mean(-1, keepdims=True) + F(1e-5)) * g + g
    layer = [node("ReduceMean", "t", "mu", axes=[-1], keepdims=1), node("Sub", "t mu", "d"), node("Pow", "d two", "d2"),
             node("ReduceMean", "d2", "v", axes=[-1], keepdims=1), node("Add", "v eps", "ve"), node("Sqrt", "ve", "sd"),
             node("Div", "d sd", "q"), node("Mul", "q g", "gq"), node("Add", "gq g", "out")]
    case("layer_norm_17", [*begin, node("LayerNormalization", "t g g", "out", epsilon=1e-5)], {"s": s, "g": g}, normal,
         17)
    case("layer_norm_17_without_bias", [*begin, node("LayerNormalization", "t g", "out", axis=2)], {"s": s, "g": g},
         normal - g, 17)
    case("layer_norm", [*begin, *layer], {"s": s, "two": F(2), "eps": F(1e-5), "g": g}, normal)


def write(folder, name):
    nodes, constants, expected, opset = CASES[name]
    nodes = [helper.make_node("Conv", ["images", "weight"], ["f"], kernel_shape=[4, 4], strides=[4, 4]), *nodes]
    initialisers = [numpy_helper.from_array(np.asarray(v), k) for k, v in {"weight": WEIGHT, **constants}.items()]
    graph = helper.make_graph(nodes, name, [helper.make_tensor_value_info("images", TensorProto.FLOAT, IMAGE.shape)],
                              [helper.make_tensor_value_info("out", TensorProto.FLOAT, expected.shape)], initialisers)
    path = folder / f"{name}.onnx"
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)]), str(path))
    repaired = Graph.load(path)
    repaired.fix_input(path, None)
    repaired.fold()
    repaired.keep(["out"])
    Repair(repaired).run()
    repaired.keep(["out"])
    onnx.save(repaired.to_model(), str(path))
    np.ascontiguousarray(expected, F).tofile(folder / f"{name}.f32")


if __name__ == "__main__":
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for build in (elementwise, constants_behind_identity, shapes, activations, products):
        build()
    IMAGE.tofile(out / "input.f32")
    for each in CASES:
        write(out, each)
