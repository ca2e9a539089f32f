"""Repairs a graph for OpenCV 4.6: replaces operators that OpenCV cannot load, or computes wrongly
without an error. Each rule was found by a comparison of single operators with numpy; the cases are
in tests/tools/model."""

import numpy as np

from .graph import Node

DEFAULTS = {"InstanceNormalization": {"epsilon": 1e-5}}


class Repair:
    """Rewrites the graph node by node; `done` counts the changes by a short description."""

    def __init__(self, graph):
        self.graph, self.done, self.count = graph, {}, 0
        self.nodes = []
        self.shape, self.constant = graph.shape, graph.constant

    def run(self):
        for node in self.graph.nodes:
            rule = getattr(self, "on_" + node.kind.lower(), None) if not node.domain else None
            for key, value in DEFAULTS.get(node.kind, {}).items():
                node.attributes.setdefault(key, value)
            if rule is None or not rule(node):
                self.nodes.append(node)
        self.graph.nodes = self.nodes
        self.graph.infer_shapes()
        return self.done

    # -- helpers ------------------------------------------------------------------------------

    def note(self, what):
        self.done[what] = self.done.get(what, 0) + 1
        return True

    def fresh(self):
        self.count += 1
        return f"repair_{self.count}"

    def emit(self, kind, inputs, outputs=None, **attributes):
        """Adds a node. `inputs` are names, or arrays that become constants. Returns the output's
        name."""
        names = []
        for value in inputs:
            if not isinstance(value, str):
                name = self.fresh()
                self.graph.constants[name] = np.asarray(value)
                value = name
            names.append(value)
        outputs = outputs or [self.fresh()]
        self.nodes.append(Node(kind, names, outputs, attributes))
        return outputs[0]

    # -- one method for each operator; True: it was replaced ----------------------------------------

    def on_squeeze(self, node):
        shape = self.shape(node.outputs[0])
        if len(node.inputs) < 2 or shape is None:
            return False
        self.emit("Reshape", [node.inputs[0], np.array(shape, np.int64)], node.outputs)
        return self.note("Squeeze with axes as an input")

    def on_softmax(self, node):
        shape, newer = self.shape(node.outputs[0]), self.graph.opset >= 13
        if shape is None:
            return False
        axis = node.attributes.get("axis", -1 if newer else 1) % len(shape)
        if not newer and axis != len(shape) - 1:  # Softmax covers all axes from this one on
            flat = self.emit("Reshape", [node.inputs[0], np.array([int(np.prod(shape[:axis])), -1], np.int64)])
            self.emit("Reshape", [self.emit("Softmax", [flat], axis=1), np.array(shape, np.int64)], node.outputs)
            return self.note("Softmax over several axes")
        if node.attributes.get("axis") != axis:
            node.attributes["axis"] = axis
            self.note("Softmax without its axis")
        return False

    def on_clip(self, node):
        if len(node.inputs) < 2:
            return False
        names = (node.inputs + ["", ""])[1:3]
        if any(n and self.constant(n) is None for n in names):
            return False
        low, high = (float(self.constant(n)) if n else None for n in names)
        self.emit("Clip", node.inputs[:1], node.outputs, min=-3.4e38 if low is None else low,
                 max=3.4e38 if high is None else high)
        return self.note("Clip with bounds as inputs")

    def on_split(self, node):
        sizes = self.constant(node.inputs[1]) if len(node.inputs) > 1 else node.attributes.get("split")
        shape, axis = self.shape(node.inputs[0]), node.attributes.get("axis", 0)
        if sizes is None and shape is not None:
            count = len(node.outputs)
            each = -(-shape[axis] // count)
            sizes = [min(each, shape[axis] - i * each) for i in range(count)]
        if sizes is None or shape is None:
            return False
        begin = 0
        for size, output in zip(sizes, node.outputs):
            self.slice_of(node.inputs[0], axis % len(shape), begin, begin + int(size), [output])
            begin += int(size)
        return self.note("Split")

    def slice_of(self, name, axis, begin, end, outputs=None, step=1):
        parts = [np.array([v], np.int64) for v in (begin, end, axis, step)]
        return self.emit("Slice", [name, *parts], outputs)

    def on_gather(self, node):
        indices, shape = self.constant(node.inputs[1]), self.shape(node.inputs[0])
        if indices is None or shape is None or indices.ndim != 1 or indices.size < 2:
            return False
        axis = node.attributes.get("axis", 0) % len(shape)
        parts = [self.slice_of(node.inputs[0], axis, int(i) % shape[axis], int(i) % shape[axis] + 1) for i in indices]
        self.emit("Concat", parts, node.outputs, axis=axis)
        return self.note("Gather of several")

    def reduce_axes(self, node):
        if len(node.inputs) > 1 and self.constant(node.inputs[1]) is not None:
            node.attributes["axes"] = [int(i) for i in self.constant(node.inputs[1])]
            node.inputs = node.inputs[:1]
            self.note(f"{node.kind} with axes as an input")
        return False

    on_reducemean = on_reducesum = on_reducemax = on_reducemin = reduce_axes

    def on_max(self, node):
        return self.bound(node, "min")

    def on_min(self, node):
        return self.bound(node, "max")

    def bound(self, node, key):
        """Replaces Max or Min with a scalar."""
        if len(node.inputs) != 2:
            return False
        variable = [i for i in node.inputs if self.constant(i) is None]
        fixed = [self.constant(i) for i in node.inputs if self.constant(i) is not None]
        if len(variable) != 1 or fixed[0].size != 1:
            return False
        bounds = {"min": -3.4e38, "max": 3.4e38, key: float(fixed[0].ravel()[0])}
        self.emit("Clip", variable, node.outputs, **bounds)
        return self.note(f"{node.kind} with a constant")

    def on_matmul(self, node):
        """Transforms C·X to (Xᵀ·Cᵀ)ᵀ, because OpenCV needs a two-dimensional constant on the
        right."""
        left, right = self.constant(node.inputs[0]), self.constant(node.inputs[1])
        variable = self.shape(node.inputs[1] if left is not None else node.inputs[0])
        fixed = right if left is None else left
        if fixed is None or variable is None or fixed.ndim < 2 or (left is None and fixed.ndim == 2):
            return False
        batch = fixed.shape[:-2]
        if max(batch, default=1) != int(np.prod(batch)) or len(variable) != max(fixed.ndim, 3) or \
                (fixed.ndim > 2 and list(batch) != variable[:-2]):
            return False
        swap = [*range(len(variable) - 2), len(variable) - 1, len(variable) - 2]
        if left is None:
            self.product(node.inputs[0], fixed, node.outputs)
        else:
            turned = self.emit("Transpose", [node.inputs[1]], perm=swap)
            self.emit("Transpose", [self.product(turned, np.swapaxes(fixed, -1, -2))], node.outputs, perm=swap)
        return self.note("MatMul with a constant")

    def product(self, name, fixed, outputs=None):
        """Multiplies a variable by a constant of at least two dimensions, also if the constant is a
        stack of matrices."""
        parts = np.ascontiguousarray(fixed.reshape(-1, *fixed.shape[-2:]))
        if len(parts) == 1:
            return self.emit("MatMul", [name, parts[0]], outputs)
        axis = int(np.argmax(fixed.shape[:-2]))
        products = [self.emit("MatMul", [self.slice_of(name, axis, i, i + 1), part]) for i, part in enumerate(parts)]
        return self.emit("Concat", products, outputs, axis=axis)

    def on_layernormalization(self, node):
        """Replaces a normalisation over the last axis. Means are products with ones, so that they
        have the shape of the input."""
        shape = self.shape(node.inputs[0])
        if shape is None or len(shape) < 3 or node.attributes.get("axis", -1) not in (-1, len(shape) - 1):
            return False
        mean = np.full((shape[-1], shape[-1]), 1 / shape[-1], np.float32)
        epsilon = np.float32(node.attributes.get("epsilon", 1e-5))
        centred = self.emit("Sub", [node.inputs[0], self.emit("MatMul", [node.inputs[0], mean])])
        variance = self.emit("MatMul", [self.emit("Mul", [centred, centred]), mean])
        scale = self.emit("Pow", [self.emit("Add", [variance, epsilon]), np.float32(-0.5)])
        result = self.emit("Mul", [centred, scale])
        last = len(node.inputs) - 1
        for i, (kind, factor) in enumerate(zip(("Mul", "Add"), node.inputs[1:])):
            outputs = node.outputs[:1] if i == last - 1 else [self.fresh()]
            self.broadcast(kind, result, factor, shape, outputs)
            result = outputs[0]
        return self.note("LayerNormalization")

    def on_conv(self, node):
        weight = self.shape(node.inputs[1])
        if weight is not None:
            node.attributes.setdefault("kernel_shape", weight[2:])
        return False

    # -- elementwise operators -----------------------------------------------------------------------

    def binary(self, node):
        shape, (a, b) = self.shape(node.outputs[0]), node.inputs
        fixed = [self.constant(i) for i in node.inputs if self.constant(i) is not None]
        if shape is None or any(value.dtype.kind != "f" for value in fixed):
            return False
        kind = node.kind
        if kind == "Div":  # a quotient times a factor becomes a product with the power
            divisor = self.constant(b)
            if divisor is not None and divisor.all():
                b = self.as_constant(1 / divisor)
            elif self.constant(a) is None and self.shape(a) == self.shape(b) == shape:
                return False
            else:
                b = self.power(b)
                if self.constant(a) is not None:  # OpenCV merges a scalar and a power wrongly
                    a = self.as_constant(np.broadcast_to(self.constant(a), shape))
            kind = "Mul"
            self.note("Div")
        if kind == "Sub" and self.constant(b) is not None:
            b, kind = self.as_constant(-self.constant(b)), "Add"
        elif kind == "Sub" and (self.constant(a) is not None or self.shape(b) != shape):
            b, kind = self.like(b, self.emit("Mul", [b, np.float32(-1)])), "Add"
        if self.constant(a) is not None and kind != "Sub":
            a, b = b, a
        if kind == node.kind and [a, b] == node.inputs and self.is_fine(a, b, shape):
            return False
        self.broadcast(kind, a, b, shape, node.outputs)
        return True

    on_add = on_sub = on_mul = on_div = binary

    def as_constant(self, value):
        name = self.fresh()
        self.graph.constants[name] = np.asarray(value, np.float32)
        return name

    def power(self, name):
        return self.like(name, self.emit("Pow", [name, np.float32(-1)]))

    def like(self, name, result):
        self.graph.shapes[result] = self.shape(name)
        return result

    def is_fine(self, a, b, shape):
        """Returns true if OpenCV is correct: for a scalar, one value for each channel, or equal
        shapes."""
        value = self.constant(b)
        if value is not None:
            return value.size == 1 or self.is_channels(value.shape, shape)
        given = self.shape(b)
        return self.shape(a) == shape and (given == shape or len(given or []) == 4 and self.is_channels(given, shape))

    @staticmethod
    def is_channels(value, shape):
        full = [1] * (len(shape) - len(value)) + list(value)
        return len(shape) == 4 and full == [1, shape[1], 1, 1]

    def broadcast(self, kind, a, b, shape, outputs):
        a_shape, b_shape = self.shape(a) or shape, self.shape(b) or shape
        if a_shape != shape and self.constant(a) is None:
            if b_shape == shape and self.constant(b) is None and kind != "Sub":
                a, b, a_shape, b_shape = b, a, b_shape, a_shape
            else:
                a = self.widen(a, a_shape, shape)
        value = self.constant(b)
        if value is not None and value.size != 1 and not self.is_channels(value.shape, shape):
            if list(value.shape) != list(shape):
                self.note("constants that were to be broadcast")
            full = np.broadcast_to(value, shape)
            # Reshapes, because OpenCV takes factors after a convolution as one value for each
            # channel. Only tensors with a leading 1 are multiplied elementwise.
            flat = shape if shape[0] == 1 else [1, int(np.prod(shape))]
            a = self.emit("Reshape", [a, np.array(flat, np.int64)])
            if flat != shape:
                result = self.emit(kind, [a, self.as_constant(full.reshape(flat))])
                return self.emit("Reshape", [result, np.array(shape, np.int64)], outputs)
            b = self.as_constant(full)
        elif value is None and b_shape != shape and not (kind in ("Mul", "Add") and self.is_channels(b_shape, shape)):
            b = self.widen(b, b_shape, shape)
        self.emit(kind, [a, b], outputs)

    def widen(self, name, given, shape):
        """Expands a variable to a larger shape by products with ones, one for each axis."""
        given = [1] * (len(shape) - len(given)) + list(given)
        if given != list(self.shape(name) or given):
            name = self.emit("Reshape", [name, np.array(given, np.int64)])
        self.note("variables that were to be broadcast")
        if len(shape) == 4 and given[1] == 1 and shape[1] > 1:
            name = self.emit("Conv", [name, np.ones((shape[1], 1, 1, 1), np.float32)], kernel_shape=[1, 1])
            given[1] = shape[1]
        if len(shape) == 3 and given[2] == 1 and shape[2] > 1:
            name = self.emit("MatMul", [name, np.ones((1, shape[2]), np.float32)])
            given[2] = shape[2]
        for axis in range(len(shape)):
            if given[axis] != shape[axis]:
                name = self.emit("Concat", [name] * shape[axis], axis=axis)
        return name
