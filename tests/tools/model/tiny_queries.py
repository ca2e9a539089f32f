"""Tiny networks whose decoder selects its queries in the graph, like RT-DETR and D-FINE; see
tiny_networks.py."""

import numpy as np
from onnx import TensorProto
from tiny_net import CHANNELS, SIZE, K, Net, sigmoid, softmax
from tiny_networks import CLASSES, UNIT, centre_rows

QUERIES, STRIDE = 6, 16
CELLS = SIZE // STRIDE


def gathered(net, rows, index, width):
    """Selects rows of (1,N,width) by an index (1,M)."""
    wide = net.node("Tile", [net.node("Unsqueeze", [index, np.array([2])]), np.array([1, 1, width])])
    return net.node("GatherElements", [rows, wide], axis=1)


def sampled(features, points):
    """Interpolates features (C,H,W) at points (x, y) in shares of the sides; zero beyond the
    border."""
    rows = []
    for x, y in points:
        row = np.zeros(len(features))
        left, top = x * CELLS - 0.5, y * CELLS - 0.5
        for j in (int(np.floor(left)), int(np.floor(left)) + 1):
            for i in (int(np.floor(top)), int(np.floor(top)) + 1):
                if 0 <= j < CELLS and 0 <= i < CELLS:
                    row += (1 - abs(left - j)) * (1 - abs(top - i)) * features[:, i, j]
        rows.append(row)
    return np.array(rows)


def decoder(seed):
    """Returns (net, boxes, raw scores, their values). The best cells are the queries. Each query
    attends to the other queries, and to a point of the picture that it computes."""
    net = Net(seed, **UNIT)
    net.opset = 16
    features = net.level(STRIDE)
    values = net.values[features][0]
    cells = net.node("Transpose", [net.node("Reshape", [features, np.array([1, CHANNELS, -1])])], perm=[0, 2, 1])
    rows = values.reshape(CHANNELS, -1).T
    w_first, w_place = net.normal(CHANNELS, K), net.normal(CHANNELS, 4, spread=0.5)
    w_box, w_class, b_class = net.normal(CHANNELS, 4, spread=0.5), net.normal(CHANNELS, K), net.normal(K)

    best = net.node("ReduceMax", [net.node("MatMul", [cells, w_first])], axes=[2], keepdims=0)
    _, index = net.node("TopK", [best, np.array([QUERIES])], 2, axis=1)
    queries = gathered(net, cells, index, CHANNELS)
    asked = rows[np.argsort(-(rows @ w_first).max(1), kind="stable")[:QUERIES]]

    alike = net.node("Softmax", [net.node("MatMul", [queries, net.node("Transpose", [queries], perm=[0, 2, 1])])],
                     axis=2)
    seen = net.node("Add", [queries, net.node("MatMul", [alike, queries])])
    answer = asked + softmax(asked @ asked.T, 1) @ asked

    place = net.node("Sigmoid", [net.node("MatMul", [seen, w_place])])
    point = net.node("Slice", [place, np.array([0]), np.array([2]), np.array([2])])
    to_grid = net.node("Sub", [net.node("Mul", [point, np.float32(2)]), np.float32(1)])
    there = net.node("GridSample", [features, net.node("Unsqueeze", [to_grid, np.array([1])])], mode="bilinear",
                     padding_mode="zeros", align_corners=0)
    there = net.node("Transpose", [net.node("Squeeze", [there, np.array([2])])], perm=[0, 2, 1])
    seen = net.node("Add", [seen, there])
    answer = answer + sampled(values, sigmoid(answer @ w_place)[:, :2])

    boxes = net.node("Sigmoid", [net.node("MatMul", [seen, w_box])])
    scores = net.node("Add", [net.node("MatMul", [seen, w_class]), b_class])
    return net, boxes, scores, sigmoid(answer @ w_box), answer @ w_class + b_class


def rtdetr(folder):
    net, boxes, scores, b, o = decoder(51)
    net.save(folder, [(scores, [1, QUERIES, K]), (boxes, [1, QUERIES, 4])], centre_rows(b * SIZE, o), [CLASSES])


def rtdetr_chosen(folder):
    """The end of the authors' exporters: corners in pixels of the picture, whose size is an
    input, and the best of them."""
    net, boxes, scores, b, o = decoder(52)
    net.more_inputs = [("orig_target_sizes", TensorProto.INT64, [1, 2])]
    x, y, w, h = net.node("Split", [boxes, np.array([1, 1, 1, 1])], 4, axis=2)
    half_w, half_h = (net.node("Mul", [side, np.float32(0.5)]) for side in (w, h))
    corners = net.node("Concat", [net.node("Sub", [x, half_w]), net.node("Sub", [y, half_h]),
                                  net.node("Add", [x, half_w]), net.node("Add", [y, half_h])], axis=2)
    sides = net.node("Tile", [net.node("Cast", ["orig_target_sizes"], to=TensorProto.FLOAT), np.array([1, 2])])
    corners = net.node("Mul", [corners, net.node("Unsqueeze", [sides, np.array([1])])])
    flat = net.node("Flatten", [net.node("Sigmoid", [scores])], axis=1)
    top, index = net.node("TopK", [flat, np.array([4])], 2, axis=1)
    picked = gathered(net, corners, net.node("Div", [index, np.array(K)]), 4)
    labels = net.node("Mod", [index, np.array(K)])
    net.save(folder, [(top, [1, 4]), (picked, [1, 4, 4])], centre_rows(b * SIZE, o), [CLASSES],
             [(labels, TensorProto.INT64)])


ALL = (rtdetr, rtdetr_chosen)
