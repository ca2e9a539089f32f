"""Converts 8-bit networks to float: networks with QuantizeLinear and DequantizeLinear around each
operator (QDQ), with quantisation at run time (DynamicQuantizeLinear with ConvInteger and
MatMulInteger), and with QLinearConv and QLinearMatMul."""

import numpy as np
from onnx import TensorProto

from .faults import Fault
from .graph import Node

# A quantiser removes the Relu after these; a quantisation with zero as lower limit replaces it.
LINEAR = ("Conv", "ConvTranspose", "Gemm", "MatMul", "Add", "BatchNormalization")


def dequantised(value, scale, zero, axis):
    """Returns (value - zero)·scale. If there are several scales, they are for the channels along
    `axis`."""
    value = np.asarray(value).astype(np.float32)
    scale = np.asarray(scale, np.float32)
    zero = np.zeros_like(scale) if zero is None else np.asarray(zero).astype(np.float32)

    def along(part):
        if part.size == 1:
            return part.reshape(())
        if value.ndim == 0 or part.size != value.shape[axis % value.ndim]:
            raise Fault(f"a scale or zero point has {part.size} values, which is not the number of channels of its "
                        f"tensor (of the shape {list(value.shape)}); import the float network that it was made from")
        shape = [1] * value.ndim
        shape[axis % value.ndim] = part.size
        return part.reshape(shape)

    scale, zero = along(scale), along(zero)
    return ((value - zero) * scale).astype(np.float32)


class Floats:
    def __init__(self, graph):
        self.graph, self.constants = graph, graph.constants
        self.same = {}   # {tensor of integers, or derived from them: the original float tensor}
        self.nodes, self.kinds, self.sums = [], {}, set()
        self.count = 0

    def real(self, name):
        return self.same.get(name, name)

    def emit(self, kind, inputs, output, attributes=None):
        self.nodes.append(Node(kind, inputs, [output], attributes))
        self.kinds[output] = kind
        self.graph.types[output] = TensorProto.FLOAT
        return output

    def constant(self, value, name):
        self.constants[name] = np.asarray(value)
        return name

    def fixed(self, node, index):
        """Returns a constant input; None if it is omitted."""
        if len(node.inputs) <= index or node.inputs[index] == "":
            return None
        value = self.constants.get(node.inputs[index])
        if value is None:
            raise Fault(f"the {('scale', 'zero point')[index > 1]} of an operator {node.kind} is computed inside the "
                        "network, which cannot be taken apart to float; import the float network that it was made from")
        return value

    def alias(self, output, source):
        if output in self.graph.outputs:
            self.emit("Identity", [source], output)
        else:
            self.same[output] = source

    def limited(self, output, source, scale, zero):
        """Adds the effect of a quantisation without rounding: values below zero are clipped if the
        range starts at zero."""
        zero = np.zeros((), np.uint8) if zero is None else np.asarray(zero)
        begins = zero.size == 1 and int(zero.ravel()[0]) == np.iinfo(zero.dtype).min
        if not begins or self.kinds.get(source) not in LINEAR:
            return self.alias(output, source)
        steps = int(np.iinfo(zero.dtype).max) - int(zero.ravel()[0])
        high = np.float32(steps * np.float32(np.asarray(scale).ravel()[0]))
        bounds = [self.constant(np.float32(0), f"{output}_low"), self.constant(high, f"{output}_high")]
        if self.graph.opset >= 11:
            self.emit("Clip", [source, *bounds], output)
        else:
            self.emit("Clip", [source], output, {"min": 0.0, "max": float(high)})

    def weight(self, node, index, zero, axis, scale=None):
        """Returns a quantised constant of `node` as float, or the float tensor if it is
        computed."""
        name = node.inputs[index]
        if name not in self.constants:
            return self.real(name)
        value = dequantised(self.constants[name], np.float32(1) if scale is None else scale, zero, axis)
        return self.constant(value, f"{name}_float{self.count}")

    def integer(self, node, kind):
        """Converts ConvInteger or MatMulInteger. The scales are factors behind them."""
        zero = self.constants.get(node.inputs[3]) if len(node.inputs) > 3 and node.inputs[3] else None
        weight = self.weight(node, 1, zero, 0 if kind == "Conv" else -1)
        if kind == "Conv" and weight not in self.constants:
            raise Fault("the weights of an operator ConvInteger are computed inside the network; import the float "
                        "network that it was made from")
        first = self.weight(node, 0, self.constants.get(node.inputs[2]) if len(node.inputs) > 2 else None, 0)
        self.emit(kind, [first, weight], node.outputs[0], node.attributes)
        self.sums.add(node.outputs[0])

    def linear(self, node, kind):
        """Converts QLinearConv or QLinearMatMul. Inputs: x, its scale and zero, w, its scale and
        zero, scale and zero of the output, and bias."""
        x_scale, w_scale, w_zero = self.fixed(node, 1), self.fixed(node, 4), self.fixed(node, 5)
        axis = 0 if kind == "Conv" else -1
        inputs = [self.weight(node, 0, self.fixed(node, 2), 0, x_scale), self.weight(node, 3, w_zero, axis, w_scale)]
        if len(node.inputs) > 8 and node.inputs[8]:
            if node.inputs[8] not in self.constants:
                raise Fault("the bias of an operator QLinearConv is computed inside the network, which cannot be "
                            "taken apart to float; import the float network that it was made from")
            bias = self.constants[node.inputs[8]].astype(np.float32) * np.float32(x_scale) * np.ravel(w_scale)
            inputs.append(self.constant(bias.astype(np.float32), f"{node.inputs[8]}_float{self.count}"))
        out = self.emit(kind, inputs, f"{node.outputs[0]}_float", node.attributes)
        self.limited(node.outputs[0], out, self.fixed(node, 6), self.fixed(node, 7))

    def take(self, node):
        """Converts `node` to float. Returns True if it used integers."""
        if node.domain:
            return False
        if node.kind == "DequantizeLinear":
            source = node.inputs[0]
            if source in self.constants and self.constants[source].dtype.kind in "iu":
                value = dequantised(self.constants[source], self.fixed(node, 1), self.fixed(node, 2),
                                    node.attributes.get("axis", 1))
                self.constant(value, f"{node.outputs[0]}_float")
                source = f"{node.outputs[0]}_float"
            self.alias(node.outputs[0], self.real(source))
        elif node.kind == "QuantizeLinear":
            self.limited(node.outputs[0], self.real(node.inputs[0]), self.fixed(node, 1), self.fixed(node, 2))
        elif node.kind == "DynamicQuantizeLinear":
            self.alias(node.outputs[0], self.real(node.inputs[0]))
            self.constant(np.float32(1), node.outputs[1])
            self.constant(np.uint8(0), node.outputs[2])
        elif node.kind in ("ConvInteger", "MatMulInteger"):
            self.integer(node, node.kind[:-len("Integer")])
        elif node.kind in ("QLinearConv", "QLinearMatMul"):
            self.linear(node, node.kind[len("QLinear"):])
        elif node.kind == "Cast" and self.real(node.inputs[0]) in self.sums:
            self.alias(node.outputs[0], self.real(node.inputs[0]))
        else:
            return False
        self.count += 1
        return True


QUANTISED = ("DequantizeLinear", "QuantizeLinear", "DynamicQuantizeLinear", "ConvInteger", "MatMulInteger",
             "QLinearConv", "QLinearMatMul")


def to_float(graph):
    """Converts the graph to float. Returns a description of the conversions for people ("" if there
    were none)."""
    found = sorted({n.kind for n in graph.nodes if n.kind in QUANTISED and not n.domain})
    if not found:
        return ""
    floats = Floats(graph)
    for node in graph.nodes:
        node.inputs = [floats.real(i) for i in node.inputs]
        if not floats.take(node):
            floats.nodes.append(node)
            for output in node.outputs:
                floats.kinds[output] = node.kind
    graph.nodes = floats.nodes
    for kept in (graph.types, graph.shapes):  # removes entries of removed tensors
        for name in floats.same:
            kept.pop(name, None)
    return f"its eight-bit operators ({', '.join(found)}) were taken apart to float: it is as fast as the float network"
