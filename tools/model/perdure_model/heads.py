"""Finds the heads of a graph: convolutions that only decoding operators separate from the
outputs."""

from dataclasses import dataclass

import numpy as np
import onnx

# Operators of the decoding behind the heads: shapes, activations, arithmetic, selection.
DECODING = {
    "Reshape", "Transpose", "Concat", "Slice", "Split", "Squeeze", "Unsqueeze", "Flatten", "Identity", "Cast", "Expand",
    "Tile", "Gather", "GatherElements", "GatherND", "ScatterND", "Shape", "Range", "ConstantOfShape", "Sigmoid",
    "Softmax", "Tanh", "Mul", "Add", "Sub", "Div", "Pow", "Exp", "Log", "Neg", "Sqrt", "Max", "Min", "Clip", "Where",
    "Equal", "Greater", "Less", "GreaterOrEqual", "LessOrEqual", "Not", "And", "Or", "Mod", "Floor",
    "ReduceMax", "ReduceSum", "ReduceMin", "ArgMax", "TopK", "NonMaxSuppression", "NonZero", "Constant", "Abs", "Round",
    "Ceil", "CumSum"}

# Operators that select boxes inside the network, so that a row of the output has no fixed meaning.
CHOOSING = ("NonMaxSuppression", "TopK", "NonZero", "BatchedNMS_TRT", "BatchedNMSDynamic_TRT", "EfficientNMS_TRT",
            "MultiClassNMS", "If", "Loop", "Scan", "RoiAlign")


@dataclass
class Head:
    name: str
    channels: int
    rows: int
    columns: int


def is_mean_of_bins(graph, node):
    """Returns true for YOLOv8's last convolution: one output, with the weights 0, 1, 2 …"""
    weight = graph.constant(node.inputs[1]) if node.kind == "Conv" and len(node.inputs) > 1 else None
    return weight is not None and weight.shape[0] == 1 and weight.size > 1 and \
        np.array_equal(weight.ravel(), np.arange(weight.size))


def is_decoding(graph, node):
    return node.kind in DECODING or node.kind in CHOOSING or bool(node.domain) or is_mean_of_bins(graph, node)


def advanced(graph, name, consumers):
    """Returns the tensor after the factors and summands for each channel that follow a convolution
    (YOLOv7's implicit knowledge)."""
    channels = graph.shape(name)
    while channels and name not in graph.outputs and len(consumers.get(name, [])) == 1:
        node = consumers[name][0]
        others = [graph.constant(i) for i in node.inputs if i != name]
        if node.kind not in ("Mul", "Add") or others[0] is None or len(others) != 1:
            break
        shape = [1] * (4 - others[0].ndim) + list(others[0].shape)
        if shape != [1, channels[1], 1, 1]:
            break
        name = node.outputs[0]
    return name


def find_heads(graph):
    """Returns ([Head] in the order of their concatenation in the outputs, the names of other
    tensors at which decoding starts)."""
    producers, consumers = graph.producers(), graph.consumers()
    heads, others, seen = [], [], set()
    todo = list(reversed(graph.outputs))
    while todo:
        name = todo.pop()
        if name in seen or name == "" or name in graph.constants:
            continue
        seen.add(name)
        node = producers.get(name)
        if node is None:
            others.append(name)
        elif is_decoding(graph, node):
            todo += reversed(node.inputs)
        elif node.kind == "Conv" and graph.shape(name) is not None:
            shape, last = graph.shape(name), advanced(graph, name, consumers)
            if last not in [h.name for h in heads]:
                heads.append(Head(last, shape[1], shape[2], shape[3]))
        else:
            others.append(name)
    return heads, others


def is_unknown(node):
    return bool(node.domain) or not onnx.defs.has(node.kind)


def hides_heads(graph, others):
    """Returns the first operator that hides a head, because its output shape or its function is
    unknown. Returns None if `others`, from find_heads(), hide no heads."""
    producers = graph.producers()
    behind = [producers[name] for name in others if name in producers]
    for node in graph.ancestors([n.outputs[0] for n in behind if n.kind == "Conv" and graph.shape(n.outputs[0]) is None]):
        inputs_known = all(i == "" or graph.shape(i) is not None for i in node.inputs)
        if inputs_known and any(o and graph.shape(o) is None for o in node.outputs):
            return node
    return next((n for n in behind if is_unknown(n)), None)


def levels_of(heads):
    """Groups heads by resolution. The groups are in the order of their first heads."""
    levels = {}
    for head in heads:
        levels.setdefault((head.rows, head.columns), []).append(head)
    return list(levels.values())


def choosing_operators(graph):
    return sorted({n.kind for n in graph.nodes if n.kind in CHOOSING})


def decoding_nodes(graph, heads):
    """Returns the nodes between the heads and the outputs."""
    return graph.ancestors(graph.outputs, {h.name for h in heads})
