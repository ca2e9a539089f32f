"""ONNX operators in numpy. They fold constants, evaluate a file's own decoding, and provide
reference outputs for OpenCV. Each takes the inputs (None if omitted), the attributes and the opset,
and returns a list of outputs."""

import functools
import math

import numpy as np

OPS = {}


def op(*names):
    def register(function):
        OPS.update({name: function for name in names})
        return function
    return register


def elementwise(name, function):
    OPS[name] = lambda x, a, v: [function(*x)]


def sigmoid(x):
    return (0.5 * (1 + np.tanh(0.5 * x))).astype(x.dtype)


def softmax(x, axis):
    e = np.exp(x - x.max(axis, keepdims=True))
    return e / e.sum(axis, keepdims=True)


def divide(a, b):
    return a / b if a.dtype.kind == "f" else (np.sign(a) * np.sign(b) * (abs(a) // abs(b))).astype(a.dtype)


erf = np.vectorize(math.erf, otypes=[np.float32])
for _name, _function in {
        "Add": np.add, "Sub": np.subtract, "Mul": np.multiply, "Div": divide,
        "Pow": lambda a, b: np.power(a, b.astype(a.dtype)).astype(a.dtype), "Exp": np.exp, "Log": np.log,
        "Sqrt": np.sqrt, "Neg": np.negative, "Abs": np.abs, "Floor": np.floor, "Ceil": np.ceil,
        "Tanh": np.tanh, "Sin": np.sin, "Cos": np.cos, "Erf": erf, "Relu": lambda x: np.maximum(x, 0),
        "Reciprocal": lambda x: (1 / x).astype(x.dtype), "Sigmoid": sigmoid, "Identity": lambda x: x,
        "Mish": lambda x: (x * np.tanh(np.logaddexp(x, 0))).astype(x.dtype),
        "Softplus": lambda x: np.logaddexp(x, 0).astype(x.dtype),
        "PRelu": lambda x, s: np.where(x < 0, x * s, x),
        "HardSwish": lambda x: x * np.clip(x / x.dtype.type(6) + x.dtype.type(0.5), 0, 1),
        "Equal": np.equal, "Greater": np.greater, "Less": np.less, "Not": np.logical_not,
        "And": np.logical_and, "Or": np.logical_or, "GreaterOrEqual": np.greater_equal, "Where": np.where,
        "Mod": np.mod, "MatMul": np.matmul, "Shape": lambda x: np.array(x.shape, np.int64),
        "Range": lambda a, b, c: np.arange(a, b, c, dtype=a.dtype)}.items():
    elementwise(_name, _function)
for _name, _function in {"Max": np.maximum, "Min": np.minimum}.items():
    OPS[_name] = lambda x, a, v, f=_function: [functools.reduce(f, x)]


def axes_of(x, a, where=1):
    """Axes from the attribute, or from an input in newer opsets."""
    if len(x) > where and x[where] is not None:
        return tuple(int(i) for i in np.atleast_1d(x[where]))
    return tuple(a["axes"]) if "axes" in a else None


def reduce(x, a, v, name):
    function = {"Mean": np.mean, "Sum": np.sum, "Max": np.max, "Min": np.min}[name[6:]]
    return [function(x[0], axis=axes_of(x, a), keepdims=bool(a.get("keepdims", 1))).astype(x[0].dtype)]


for _name in ("ReduceMean", "ReduceSum", "ReduceMax", "ReduceMin"):
    OPS[_name] = lambda x, a, v, n=_name: reduce(x, a, v, n)


@op("Softmax")
def softmax_op(x, a, v):
    if v >= 13:
        return [softmax(x[0], a.get("axis", -1)).astype(x[0].dtype)]
    axis = a.get("axis", 1) % x[0].ndim
    flat = x[0].reshape(int(np.prod(x[0].shape[:axis])), -1)
    return [softmax(flat, 1).reshape(x[0].shape).astype(x[0].dtype)]


@op("LeakyRelu")
def leaky(x, a, v):
    return [np.where(x[0] < 0, x[0] * np.float32(a.get("alpha", 0.01)), x[0])]


@op("Elu")
def elu(x, a, v):
    return [np.where(x[0] < 0, np.float32(a.get("alpha", 1.0)) * (np.exp(np.minimum(x[0], 0)) - 1),
                     x[0]).astype(x[0].dtype)]


@op("HardSigmoid")
def hard_sigmoid(x, a, v):
    return [np.clip(x[0] * np.float32(a.get("alpha", 0.2)) + np.float32(a.get("beta", 0.5)), 0, 1)]


@op("Clip")
def clip(x, a, v):
    low = x[1] if len(x) > 1 and x[1] is not None else a.get("min", -np.inf)
    high = x[2] if len(x) > 2 and x[2] is not None else a.get("max", np.inf)
    return [np.clip(x[0], low, high).astype(x[0].dtype)]


@op("Cast")
def cast(x, a, v):
    import onnx
    return [x[0].astype(onnx.mapping.TENSOR_TYPE_TO_NP_TYPE[a["to"]])]


@op("Dropout")
def dropout(x, a, v):
    return [x[0]]


@op("Constant")
def constant(x, a, v):
    for key, kind in (("value", None), ("value_float", np.float32), ("value_floats", np.float32),
                      ("value_int", np.int64), ("value_ints", np.int64)):
        if key in a:
            return [np.asarray(a[key], kind)]
    raise KeyError("Constant without a value")


@op("ConstantOfShape")
def constant_of_shape(x, a, v):
    value = np.asarray(a.get("value", np.zeros(1, np.float32)))
    return [np.full(tuple(int(i) for i in x[0]), value.ravel()[0], value.dtype)]


@op("Reshape")
def reshape(x, a, v):
    shape = [x[0].shape[i] if n == 0 and not a.get("allowzero", 0) else int(n) for i, n in enumerate(x[1])]
    return [x[0].reshape(shape)]


@op("Flatten")
def flatten(x, a, v):
    axis = a.get("axis", 1)
    return [x[0].reshape(int(np.prod(x[0].shape[:axis])), -1)]


@op("Squeeze")
def squeeze(x, a, v):
    return [np.squeeze(x[0], axes_of(x, a))]


@op("Unsqueeze")
def unsqueeze(x, a, v):
    axes = axes_of(x, a)
    rank = x[0].ndim + len(axes)
    y = x[0]
    for axis in sorted(i % rank for i in axes):
        y = np.expand_dims(y, axis)
    return [y]


@op("Transpose")
def transpose(x, a, v):
    return [np.ascontiguousarray(np.transpose(x[0], a.get("perm")))]


@op("Concat")
def concat(x, a, v):
    return [np.concatenate(x, a["axis"])]


@op("Split")
def split(x, a, v):
    axis = a.get("axis", 0)
    sizes = x[1] if len(x) > 1 and x[1] is not None else a.get("split")
    if sizes is None:
        raise KeyError("Split without sizes")
    return np.split(x[0], np.cumsum(sizes)[:-1], axis)


@op("Slice")
def slice_op(x, a, v):
    if len(x) == 1:
        starts, ends, axes, steps = a["starts"], a["ends"], a.get("axes"), None
    else:
        starts, ends = x[1], x[2]
        axes = x[3] if len(x) > 3 else None
        steps = x[4] if len(x) > 4 else None
    axes = range(len(starts)) if axes is None else axes
    steps = [1] * len(starts) if steps is None else steps
    index = [slice(None)] * x[0].ndim
    for start, end, axis, step in zip(starts, ends, axes, steps):
        start, end, step = int(start), int(end), int(step)
        if step < 0 and end <= -x[0].shape[axis] - 1:
            end = None
        index[axis] = slice(start, end, step)
    return [x[0][tuple(index)]]


@op("Gather")
def gather(x, a, v):
    return [np.take(x[0], x[1], axis=a.get("axis", 0))]


@op("GatherElements")
def gather_elements(x, a, v):
    return [np.take_along_axis(x[0], x[1], a.get("axis", 0))]


@op("ScatterND")
def scatter_nd(x, a, v):
    y = x[0].copy()
    y[tuple(np.moveaxis(x[1], -1, 0))] = x[2]
    return [y]


@op("Expand")
def expand(x, a, v):
    return [x[0] * np.ones(tuple(int(i) for i in x[1]), x[0].dtype)]


@op("Tile")
def tile(x, a, v):
    return [np.tile(x[0], x[1])]


@op("ArgMax")
def argmax(x, a, v):
    y = x[0].argmax(a.get("axis", 0))
    return [np.expand_dims(y, a.get("axis", 0)) if a.get("keepdims", 1) else y]


@op("Gemm")
def gemm(x, a, v):
    left = x[0].T if a.get("transA", 0) else x[0]
    right = x[1].T if a.get("transB", 0) else x[1]
    y = np.float32(a.get("alpha", 1.0)) * (left @ right)
    return [y + np.float32(a.get("beta", 1.0)) * x[2] if len(x) > 2 and x[2] is not None else y]


@op("BatchNormalization")
def batch_norm(x, a, v):
    shape = (1, -1) + (1,) * (x[0].ndim - 2)
    data, scale, bias, mean, var = x[0], *(p.reshape(shape) for p in x[1:5])
    return [((data - mean) / np.sqrt(var + np.float32(a.get("epsilon", 1e-5))) * scale + bias).astype(data.dtype)]


@op("InstanceNormalization")
def instance_norm(x, a, v):
    axes = tuple(range(2, x[0].ndim))
    shape = (1, -1) + (1,) * (x[0].ndim - 2)
    mean, var = x[0].mean(axes, keepdims=True), x[0].var(axes, keepdims=True)
    y = (x[0] - mean) / np.sqrt(var + np.float32(a.get("epsilon", 1e-5)))
    return [(y * x[1].reshape(shape) + x[2].reshape(shape)).astype(x[0].dtype)]


@op("LayerNormalization")
def layer_norm(x, a, v):
    axis = a.get("axis", -1) % x[0].ndim
    axes = tuple(range(axis, x[0].ndim))
    mean, var = x[0].mean(axes, keepdims=True), x[0].var(axes, keepdims=True)
    y = (x[0] - mean) / np.sqrt(var + np.float32(a.get("epsilon", 1e-5))) * x[1]
    return [(y + x[2] if len(x) > 2 and x[2] is not None else y).astype(x[0].dtype)]


def spatial_pads(a, sizes, kernel, strides, dilations):
    """[(before, after)] of each spatial axis."""
    how = a.get("auto_pad", "NOTSET")
    n = len(sizes)
    if how in ("NOTSET", "VALID"):
        pads = a.get("pads", [0] * 2 * n) if how == "NOTSET" else [0] * 2 * n
        return [(pads[i], pads[i + n]) for i in range(n)]
    found = []
    for size, k, s, d in zip(sizes, kernel, strides, dilations):
        total = max((-(-size // s) - 1) * s + (k - 1) * d + 1 - size, 0)
        small, large = total // 2, total - total // 2
        found.append((small, large) if how == "SAME_UPPER" else (large, small))
    return found


def windows(x, kernel, strides, dilations, pads, fill, ceil=False):
    """(N, C, rows, columns, kh, kw) views of a padded image."""
    (top, bottom), (left, right) = pads
    if ceil:  # windows may extend beyond the last pad by less than a stride
        bottom, right = bottom + strides[0] - 1, right + strides[1] - 1
    x = np.pad(x, ((0, 0), (0, 0), (top, bottom), (left, right)), constant_values=fill)
    reach = [(k - 1) * d + 1 for k, d in zip(kernel, dilations)]
    view = np.lib.stride_tricks.sliding_window_view(x, reach, axis=(2, 3))
    return view[:, :, ::strides[0], ::strides[1], ::dilations[0], ::dilations[1]]


@op("Conv")
def conv(x, a, v):
    data, weight = x[0], x[1]
    kernel = weight.shape[2:]
    strides, dilations = a.get("strides", [1, 1]), a.get("dilations", [1, 1])
    pads = spatial_pads(a, data.shape[2:], kernel, strides, dilations)
    view = windows(data, kernel, strides, dilations, pads, 0)
    groups = a.get("group", 1)
    n, channels, rows, columns = view.shape[:4]
    taps = kernel[0] * kernel[1]
    if groups == channels == weight.shape[0]:
        y = np.zeros((n, channels, rows, columns), np.float32)
        for i in range(kernel[0]):
            for j in range(kernel[1]):
                y += view[..., i, j] * weight[None, :, 0, i, j, None, None]
    else:
        parts = []
        for g in range(groups):
            c, o = channels // groups, weight.shape[0] // groups
            block = view[:, g * c:(g + 1) * c].transpose(0, 1, 4, 5, 2, 3).reshape(n, c * taps, rows * columns)
            parts.append(np.matmul(weight[g * o:(g + 1) * o].reshape(o, -1), block))
        y = np.concatenate(parts, 1).reshape(n, -1, rows, columns)
    return [y + x[2].reshape(1, -1, 1, 1) if len(x) > 2 and x[2] is not None else y]


def pooling(x, a, fill):
    kernel = a["kernel_shape"]
    strides, dilations = a.get("strides", [1, 1]), a.get("dilations", [1, 1])
    pads = spatial_pads(a, x[0].shape[2:], kernel, strides, dilations)
    return windows(x[0], kernel, strides, dilations, pads, fill, bool(a.get("ceil_mode", 0)))


@op("MaxPool")
def max_pool(x, a, v):
    return [pooling(x, a, -np.inf).max((4, 5))]


@op("AveragePool")
def average_pool(x, a, v):
    total = pooling(x, a, 0).sum((4, 5))
    inside = pooling([np.ones_like(x[0])], a, 1 if a.get("count_include_pad", 0) else 0).sum((4, 5))
    return [(total / inside).astype(np.float32)]


@op("GlobalAveragePool")
def global_average_pool(x, a, v):
    return [x[0].mean(tuple(range(2, x[0].ndim)), keepdims=True)]


@op("Pad")
def pad(x, a, v):
    mode = a.get("mode", "constant")
    pads = x[1] if len(x) > 1 else a["pads"]
    n = x[0].ndim
    around = [(int(pads[i]), int(pads[i + n])) for i in range(n)]
    if mode != "constant":
        return [np.pad(x[0], around, mode=mode)]
    value = x[2] if len(x) > 2 and x[2] is not None else a.get("value", 0)
    return [np.pad(x[0], around, constant_values=value)]


@op("DepthToSpace")
def depth_to_space(x, a, v):
    n, c, h, w = x[0].shape
    b = a["blocksize"]
    if a.get("mode", "DCR") == "DCR":
        y = x[0].reshape(n, b, b, c // b ** 2, h, w).transpose(0, 3, 4, 1, 5, 2)
    else:
        y = x[0].reshape(n, c // b ** 2, b, b, h, w).transpose(0, 1, 4, 2, 5, 3)
    return [y.reshape(n, c // b ** 2, h * b, w * b)]


@op("Resize", "Upsample")
def resize(x, a, v):
    """Nearest and linear resizing of the last two axes, in the three usual conventions."""
    data = x[0]
    scales = x[1] if len(x) == 2 else (x[2] if len(x) > 2 else None)
    sizes = x[3] if len(x) > 3 else None
    out = [int(i) for i in sizes] if sizes is not None else \
        [int(math.floor(n * float(s))) for n, s in zip(data.shape, scales)]
    ways = a.get("coordinate_transformation_mode", "asymmetric" if len(x) == 2 else "half_pixel")
    for axis in (2, 3):
        scale = out[axis] / data.shape[axis] if scales is None or not np.size(scales) else float(scales[axis])
        if ways == "asymmetric":
            at = np.arange(out[axis]) / scale
        elif ways == "align_corners":
            at = np.arange(out[axis]) * (data.shape[axis] - 1) / max(out[axis] - 1, 1)
        elif ways in ("half_pixel", "pytorch_half_pixel"):
            at = (np.arange(out[axis]) + 0.5) / scale - 0.5
        else:
            raise KeyError(ways)
        last = data.shape[axis] - 1
        if a.get("mode", "nearest") == "nearest":
            rounding = a.get("nearest_mode", "floor" if len(x) == 2 else "round_prefer_floor")
            near = {"floor": np.floor, "ceil": np.ceil, "round_prefer_ceil": lambda t: np.floor(t + 0.5),
                    "round_prefer_floor": lambda t: np.ceil(t - 0.5)}[rounding](at)
            data = np.take(data, np.clip(near, 0, last).astype(int), axis)
        elif a["mode"] == "linear":
            at = np.clip(at, 0, last)
            low = np.floor(at).astype(int)
            share = (at - low).astype(np.float32).reshape((-1, 1) if axis == 2 else (-1,))
            high = np.minimum(low + 1, last)
            data = np.take(data, low, axis) * (1 - share) + np.take(data, high, axis) * share
        else:
            raise KeyError(a["mode"])
    return [data.astype(x[0].dtype)]
