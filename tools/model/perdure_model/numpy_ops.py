"""ONNX operators in numpy. They fold constants, evaluate the decoding in a file, and give the
reference outputs for OpenCV. OPS[kind] takes the inputs (None if omitted), the attributes and the
opset, and returns a list of outputs."""

import functools
import inspect
import math

import numpy as np
import onnx

OPS = {}


def register(name, function):
    """Registers a function under an operator's name. Its parameters have the names of ONNX, so
    attributes that became inputs in newer opsets need no rule. Attributes without a parameter are
    ignored."""
    own = getattr(function, "__module__", "") == __name__
    spec = inspect.getfullargspec(function if own else lambda: None)

    def run(x, a, v):
        given = {**a, "opset": v}
        known = given if spec.varkw else [*spec.args[len(x):], *spec.kwonlyargs]
        found = function(*x, **{key: given[key] for key in known if key in given})
        return found if isinstance(found, list) else [found]

    OPS[name] = run


def op(*names):
    def registered(function):
        for name in names:
            register(name, function)
        return function
    return registered


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
        "Range": lambda a, b, c: np.arange(a, b, c, dtype=a.dtype),
        "Max": lambda *x: functools.reduce(np.maximum, x), "Min": lambda *x: functools.reduce(np.minimum, x),
        "Dropout": lambda x, *_: x,
        "LeakyRelu": lambda x, alpha=0.01: np.where(x < 0, x * np.float32(alpha), x),
        "Elu": lambda x, alpha=1.0: np.where(x < 0, np.float32(alpha) * (np.exp(np.minimum(x, 0)) - 1),
                                             x).astype(x.dtype),
        "HardSigmoid": lambda x, alpha=0.2, beta=0.5: np.clip(x * np.float32(alpha) + np.float32(beta), 0, 1),
        "Cast": lambda x, to: x.astype(onnx.mapping.TENSOR_TYPE_TO_NP_TYPE[to]),
        "Squeeze": lambda x, axes=None: np.squeeze(x, axes_of(axes)),
        "Transpose": lambda x, perm=None: np.ascontiguousarray(np.transpose(x, perm)),
        "Concat": lambda *x, axis: np.concatenate(x, axis),
        "Split": lambda x, split, *, axis=0: np.split(x, np.cumsum(split)[:-1], axis),
        "Gather": lambda x, indices, axis=0: np.take(x, indices, axis=axis),
        "GatherElements": lambda x, indices, axis=0: np.take_along_axis(x, indices, axis),
        "Expand": lambda x, shape: x * np.ones(tuple(int(i) for i in shape), x.dtype),
        "Tile": np.tile,
        "ArgMax": lambda x, axis=0, keepdims=1: np.expand_dims(x.argmax(axis), axis) if keepdims else x.argmax(axis),
        "MaxPool": lambda x, **window: pooling(x, -np.inf, **window).max((4, 5)),
        "GlobalAveragePool": lambda x: x.mean(tuple(range(2, x.ndim)), keepdims=True)}.items():
    register(_name, _function)
for _name, _function in {"Mean": np.mean, "Sum": np.sum, "Max": np.max, "Min": np.min}.items():
    register(f"Reduce{_name}", lambda x, axes=None, *, keepdims=1, f=_function:
             f(x, axis=axes_of(axes), keepdims=bool(keepdims)).astype(x.dtype))


def axes_of(axes):
    return None if axes is None else tuple(int(i) for i in np.atleast_1d(axes))


@op("Softmax")
def softmax_op(x, *, axis=None, opset):
    if opset >= 13:
        return softmax(x, -1 if axis is None else axis).astype(x.dtype)
    return softmax(flatten(x, (1 if axis is None else axis) % x.ndim), 1).reshape(x.shape).astype(x.dtype)


@op("Clip")
def clip(x, min=None, max=None):
    return np.clip(x, -np.inf if min is None else min, np.inf if max is None else max).astype(x.dtype)


@op("Constant")
def constant(value=None, value_float=None, value_floats=None, value_int=None, value_ints=None):
    if value is not None:
        return np.asarray(value)
    reals = value_floats if value_float is None else value_float
    if reals is not None:
        return np.asarray(reals, np.float32)
    return np.asarray(value_ints if value_int is None else value_int, np.int64)


@op("ConstantOfShape")
def constant_of_shape(shape, value=np.zeros(1, np.float32)):
    value = np.asarray(value)
    return np.full(tuple(int(i) for i in shape), value.ravel()[0], value.dtype)


@op("Reshape")
def reshape(x, shape, *, allowzero=0):
    return x.reshape([x.shape[i] if n == 0 and not allowzero else int(n) for i, n in enumerate(shape)])


@op("Flatten")
def flatten(x, axis=1):
    return x.reshape(int(np.prod(x.shape[:axis])), -1)


@op("Unsqueeze")
def unsqueeze(x, axes):
    axes = axes_of(axes)
    for axis in sorted(i % (x.ndim + len(axes)) for i in axes):
        x = np.expand_dims(x, axis)
    return x


@op("Slice")
def slice_op(x, starts, ends, axes=None, steps=None):
    axes = range(len(starts)) if axes is None else axes
    steps = [1] * len(starts) if steps is None else steps
    index = [slice(None)] * x.ndim
    for start, end, axis, step in zip(starts, ends, axes, steps):
        start, end, step = int(start), int(end), int(step)
        if step < 0 and end <= -x.shape[axis] - 1:
            end = None
        index[axis] = slice(start, end, step)
    return x[tuple(index)]


@op("ScatterND")
def scatter_nd(x, indices, updates):
    y = x.copy()
    y[tuple(np.moveaxis(indices, -1, 0))] = updates
    return y


@op("Gemm")
def gemm(a, b, c=None, *, alpha=1.0, beta=1.0, transA=0, transB=0):
    y = np.float32(alpha) * ((a.T if transA else a) @ (b.T if transB else b))
    return y if c is None else y + np.float32(beta) * c


@op("BatchNormalization")
def batch_norm(x, scale, bias, mean, var, *, epsilon=1e-5):
    shape = (1, -1) + (1,) * (x.ndim - 2)
    scale, bias, mean, var = (p.reshape(shape) for p in (scale, bias, mean, var))
    return ((x - mean) / np.sqrt(var + np.float32(epsilon)) * scale + bias).astype(x.dtype)


def normalised(x, axes, epsilon):
    return (x - x.mean(axes, keepdims=True)) / np.sqrt(x.var(axes, keepdims=True) + np.float32(epsilon))


@op("InstanceNormalization")
def instance_norm(x, scale, bias, *, epsilon=1e-5):
    shape = (1, -1) + (1,) * (x.ndim - 2)
    y = normalised(x, tuple(range(2, x.ndim)), epsilon)
    return (y * scale.reshape(shape) + bias.reshape(shape)).astype(x.dtype)


@op("LayerNormalization")
def layer_norm(x, scale, bias=None, *, axis=-1, epsilon=1e-5):
    y = normalised(x, tuple(range(axis % x.ndim, x.ndim)), epsilon) * scale
    return (y if bias is None else y + bias).astype(x.dtype)


def spatial_pads(sizes, kernel, strides, dilations, auto_pad, pads):
    """Returns the padding [(before, after)] of each spatial axis."""
    if auto_pad in ("NOTSET", "VALID"):
        n = len(sizes)
        return [(pads[i], pads[i + n]) if auto_pad == "NOTSET" else (0, 0) for i in range(n)]
    found = []
    for size, k, s, d in zip(sizes, kernel, strides, dilations):
        total = max((-(-size // s) - 1) * s + (k - 1) * d + 1 - size, 0)
        small, large = total // 2, total - total // 2
        found.append((small, large) if auto_pad == "SAME_UPPER" else (large, small))
    return found


def windows(x, kernel, strides, dilations, pads, fill, ceil=False):
    """Returns the windows of a padded image as a view (N, C, rows, columns, kh, kw)."""
    (top, bottom), (left, right) = pads
    if ceil:  # windows may extend beyond the last pad by less than a stride
        bottom, right = bottom + strides[0] - 1, right + strides[1] - 1
    x = np.pad(x, ((0, 0), (0, 0), (top, bottom), (left, right)), constant_values=fill)
    reach = [(k - 1) * d + 1 for k, d in zip(kernel, dilations)]
    view = np.lib.stride_tricks.sliding_window_view(x, reach, axis=(2, 3))
    return view[:, :, ::strides[0], ::strides[1], ::dilations[0], ::dilations[1]]


@op("Conv")
def conv(data, weight, bias=None, *, strides=(1, 1), dilations=(1, 1), auto_pad="NOTSET", pads=(0,) * 4, group=1):
    kernel = weight.shape[2:]
    pads = spatial_pads(data.shape[2:], kernel, strides, dilations, auto_pad, pads)
    view = windows(data, kernel, strides, dilations, pads, 0)
    n, channels, rows, columns = view.shape[:4]
    taps = kernel[0] * kernel[1]
    if group == channels == weight.shape[0]:
        y = np.zeros((n, channels, rows, columns), np.float32)
        for i in range(kernel[0]):
            for j in range(kernel[1]):
                y += view[..., i, j] * weight[None, :, 0, i, j, None, None]
    else:
        parts = []
        for g in range(group):
            c, o = channels // group, weight.shape[0] // group
            block = view[:, g * c:(g + 1) * c].transpose(0, 1, 4, 5, 2, 3).reshape(n, c * taps, rows * columns)
            parts.append(np.matmul(weight[g * o:(g + 1) * o].reshape(o, -1), block))
        y = np.concatenate(parts, 1).reshape(n, -1, rows, columns)
    return y if bias is None else y + bias.reshape(1, -1, 1, 1)


def pooling(x, fill, *, kernel_shape, strides=(1, 1), dilations=(1, 1), auto_pad="NOTSET", pads=(0,) * 4, ceil_mode=0,
            **_):
    pads = spatial_pads(x.shape[2:], kernel_shape, strides, dilations, auto_pad, pads)
    return windows(x, kernel_shape, strides, dilations, pads, fill, bool(ceil_mode))


@op("AveragePool")
def average_pool(x, *, count_include_pad=0, **window):
    inside = pooling(np.ones_like(x), 1 if count_include_pad else 0, **window).sum((4, 5))
    return (pooling(x, 0, **window).sum((4, 5)) / inside).astype(np.float32)


@op("Pad")
def pad(x, pads, value=None, axes=None, *, mode="constant"):
    if axes is not None:
        raise NotImplementedError("Pad with axes")
    around = [(int(pads[i]), int(pads[i + x.ndim])) for i in range(x.ndim)]
    if mode != "constant":
        return np.pad(x, around, mode=mode)
    return np.pad(x, around, constant_values=0 if value is None else value)


@op("DepthToSpace")
def depth_to_space(x, *, blocksize, mode="DCR"):
    (n, c, h, w), b = x.shape, blocksize
    if mode == "DCR":
        y = x.reshape(n, b, b, c // b ** 2, h, w).transpose(0, 3, 4, 1, 5, 2)
    else:
        y = x.reshape(n, c // b ** 2, b, b, h, w).transpose(0, 1, 4, 2, 5, 3)
    return y.reshape(n, c // b ** 2, h * b, w * b)


@op("Resize", "Upsample")
def resize(x, *more, mode="nearest", coordinate_transformation_mode=None, nearest_mode=None):
    """Resizes the last two axes, nearest or linear, in the three usual conventions. `more` are the
    scales, or a region (not used), the scales and the sizes."""
    older, data = len(more) == 1, x
    scales, sizes = (more[0], None) if older else (*more, None, None, None)[1:3]
    out = [int(i) for i in sizes] if sizes is not None else \
        [int(math.floor(n * float(s))) for n, s in zip(data.shape, scales)]
    ways = coordinate_transformation_mode or ("asymmetric" if older else "half_pixel")
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
        if mode == "nearest":
            rounding = nearest_mode or ("floor" if older else "round_prefer_floor")
            near = {"floor": np.floor, "ceil": np.ceil, "round_prefer_ceil": lambda t: np.floor(t + 0.5),
                    "round_prefer_floor": lambda t: np.ceil(t - 0.5)}[rounding](at)
            data = np.take(data, np.clip(near, 0, last).astype(int), axis)
        elif mode == "linear":
            at = np.clip(at, 0, last)
            low = np.floor(at).astype(int)
            share = (at - low).astype(np.float32).reshape((-1, 1) if axis == 2 else (-1,))
            high = np.minimum(low + 1, last)
            data = np.take(data, low, axis) * (1 - share) + np.take(data, high, axis) * share
        else:
            raise KeyError(mode)
    return data.astype(x.dtype)
