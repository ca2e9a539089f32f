#!/usr/bin/python3
"""Converts the weights of a float network to eight bits; each channel has its own scale:

    quantise.py FLOAT.onnx OUT.onnx qdq|dynamic|rounded

rounded: a float network with the rounded weights.
"""

import sys

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper


def main(source, out, way):
    model = onnx.load(source)
    graph = model.graph
    constants = {c.name: c for c in graph.initializer}
    nodes = []
    for node in graph.node:
        weight = constants.get(node.input[1]) if node.op_type == "Conv" else None
        if weight is None:
            nodes.append(node)
            continue
        name, value = node.output[0], numpy_helper.to_array(weight)
        scale = (np.abs(value).reshape(len(value), -1).max(1) / 127 + 1e-12).astype(np.float32)
        bits = np.round(value / scale.reshape(-1, 1, 1, 1)).astype(np.int8)
        if way == "rounded":
            weight.CopyFrom(numpy_helper.from_array(bits * scale.reshape(-1, 1, 1, 1), weight.name))
            nodes.append(node)
            continue
        graph.initializer.extend([numpy_helper.from_array(bits, f"{name}_bits")])
        if way == "qdq":
            zero = numpy_helper.from_array(np.zeros(len(scale), np.int8), f"{name}_zero")
            graph.initializer.extend([numpy_helper.from_array(scale, f"{name}_scale"), zero])
            nodes.append(helper.make_node("DequantizeLinear", [f"{name}_bits", f"{name}_scale", f"{name}_zero"],
                                          [f"{name}_w"], axis=0))
            node.input[1] = f"{name}_w"
            nodes.append(node)
            continue
        graph.initializer.extend([numpy_helper.from_array(scale.reshape(1, -1, 1, 1), f"{name}_scale")])
        x = [f"{name}_{part}" for part in ("x", "x_scale", "x_zero")]
        nodes.append(helper.make_node("DynamicQuantizeLinear", [node.input[0]], x))
        whole = helper.make_node("ConvInteger", [x[0], f"{name}_bits", x[2]], [f"{name}_whole"])
        whole.attribute.extend(node.attribute)
        nodes += [whole, helper.make_node("Cast", [f"{name}_whole"], [f"{name}_real"], to=TensorProto.FLOAT),
                  helper.make_node("Mul", [x[1], f"{name}_scale"], [f"{name}_factor"])]
        last = f"{name}_scaled" if len(node.input) > 2 else name
        nodes.append(helper.make_node("Mul", [f"{name}_real", f"{name}_factor"], [last]))
        if len(node.input) > 2:
            bias = numpy_helper.to_array(constants[node.input[2]]).reshape(1, -1, 1, 1)
            graph.initializer.extend([numpy_helper.from_array(bias, f"{name}_bias")])
            nodes.append(helper.make_node("Add", [last, f"{name}_bias"], [name]))
    del graph.node[:]
    graph.node.extend(nodes)
    model.opset_import[0].version = max(13 if way == "qdq" else 11, model.opset_import[0].version)
    onnx.save(model, out)


if __name__ == "__main__":
    main(*sys.argv[1:])
