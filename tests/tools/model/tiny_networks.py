"""Tiny networks of random weights in the forms that exporters write. Each has its expected answer
to one picture, computed here from the families' published rules and without Perdure's code.

    tiny_networks.py FOLDER     writes FOLDER/<name>/net.onnx, picture.ppm, arguments, expected.csv
"""

import sys
from pathlib import Path

import numpy as np
from onnx import TensorProto
from tiny_net import CHANNELS, NAMES, SIZE, K, Net, sigmoid, softmax

CLASSES = "--classes=" + ",".join(NAMES)
UNIT = dict(scale=(1 / 255,) * 3, rgb=True)


def grid(cells):
    gy, gx = np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    return np.stack([gx, gy], -1).astype(np.float32)


def logit(p):
    return np.log(p) - np.log1p(-p)


def centre_rows(xywh, odds):
    half = xywh[:, 2:] / 2
    return np.concatenate([xywh[:, :2] - half, xywh[:, :2] + half, odds], 1)


# -- YOLOv5, YOLOv7 -----------------------------------------------------------------------------------

ANCHORS = {8: [[4, 6], [7, 5], [11, 9]], 16: [[12, 20], [21, 17], [25, 31]], 32: [[30, 44], [41, 38], [60, 57]]}


def anchored(net, decode, implicit=False):
    """Adds heads of three levels; `decode(net, raw, stride)` adds the file's own decoding of one
    level."""
    rows, outputs = [], []
    for stride, anchors in ANCHORS.items():
        raw = net.head(net.level(stride), 3 * (5 + K))
        if implicit:  # YOLOv7 multiplies each channel before the decoding
            factor = 1 + net.normal(1, 3 * (5 + K), 1, 1, spread=0.2)
            value = net.values[raw] * factor
            raw = net.node("Mul", [raw, factor])
            net.values[raw] = value
        cells = SIZE // stride
        value = sigmoid(net.values[raw]).reshape(3, 5 + K, cells, cells).transpose(0, 2, 3, 1)
        for a, anchor in enumerate(anchors):
            p = value[a]
            xy = (2 * p[..., :2] - 0.5 + grid(cells)) * stride
            wh = (2 * p[..., 2:4]) ** 2 * np.array(anchor)
            rows.append(centre_rows(np.concatenate([xy, wh], -1).reshape(-1, 4),
                                    logit(p[..., 4:5] * p[..., 5:]).reshape(-1, K)))
        outputs.append(decode(net, raw, stride))
    return np.concatenate(rows), outputs


def rows_of_anchors(net, raw, stride):
    cells = SIZE // stride
    shaped = net.node("Reshape", [raw, np.array([1, 3, 5 + K, cells, cells])])
    return net.node("Transpose", [shaped], perm=[0, 1, 3, 4, 2])


def yolov5_decode(net, raw, stride):
    p = net.node("Sigmoid", [rows_of_anchors(net, raw, stride)])
    xy, wh, rest = net.node("Split", [p], 3, axis=4, split=[2, 2, 1 + K])
    cells = SIZE // stride
    xy = net.node("Mul",
                  [net.node("Add", [net.node("Mul", [xy, np.float32(2)]), (grid(cells) - 0.5)[None, None]]),
                   np.float32(stride)])
    anchors = np.broadcast_to(np.array(ANCHORS[stride], np.float32).reshape(1, 3, 1, 1, 2), (1, 3, cells, cells, 2))
    wh = net.node("Mul",
                  [net.node("Pow", [net.node("Mul", [wh, np.float32(2)]), np.float32(2)]),
                   np.ascontiguousarray(anchors)])
    return net.node("Reshape", [net.node("Concat", [xy, wh, rest], axis=4), np.array([1, -1, 5 + K])])


def yolov7_decode(net, raw, stride):
    p = net.node("Sigmoid", [rows_of_anchors(net, raw, stride)])
    xy, wh, rest = net.node("Split", [p], 3, axis=4, split=[2, 2, 1 + K])
    cells = SIZE // stride
    xy = net.node("Add",
                  [net.node("Mul", [xy, np.float32(2 * stride)]),
                   (stride * (grid(cells) - 0.5)).astype(np.float32)[None, None]])
    anchors = 4 * np.array(ANCHORS[stride], np.float32).reshape(1, 3, 1, 1, 2)
    wh = net.node("Mul", [net.node("Pow", [wh, np.float32(2)]), anchors])
    return net.node("Reshape", [net.node("Concat", [xy, wh, rest], axis=4), np.array([1, -1, 5 + K])])


def yolov5(folder):
    net = Net(1, **UNIT)
    rows, parts = anchored(net, yolov5_decode)
    net.save(folder, [(net.node("Concat", parts, axis=1), [1, len(rows), 5 + K])], rows, [CLASSES])


def yolov5_heads(folder):
    net = Net(2, **UNIT)
    rows, parts = anchored(net, rows_of_anchors)
    outputs = [(p, [1, 3, SIZE // s, SIZE // s, 5 + K]) for p, s in zip(parts, ANCHORS)]
    anchors = "/".join(",".join(f"{w},{h}" for w, h in level) for level in ANCHORS.values())
    net.save(folder, outputs, rows, [CLASSES, "--anchors=" + anchors])


def yolov7(folder):
    net = Net(3, **UNIT)
    rows, parts = anchored(net, yolov7_decode, implicit=True)
    net.save(folder, [(net.node("Concat", parts, axis=1), [1, len(rows), 5 + K])], rows, [CLASSES, "--family=yolov7"])


def yolov5_suppressed(folder):
    """The graph contains the suppression; the import must use the tensors before it."""
    net = Net(4, **UNIT)
    rows, parts = anchored(net, yolov5_decode)
    whole = net.node("Concat", parts, axis=1)
    boxes, objectness, classes = net.node("Split", [whole], 3, axis=2, split=[4, 1, K])
    scores = net.node("Transpose", [net.node("Mul", [objectness, classes])], perm=[0, 2, 1])
    chosen = net.node("NonMaxSuppression",
                      [boxes, scores, np.array([10]), np.array([0.5], np.float32), np.array([0.2], np.float32)])
    net.save(folder, [], rows, [CLASSES], [(chosen, TensorProto.INT64)])


# -- YOLOv8 -------------------------------------------------------------------------------------------

def yolov8_rows(box, classes, stride):
    cells = SIZE // stride
    d = (softmax(box.reshape(4, 16, cells, cells), 1) * np.arange(16).reshape(1, 16, 1, 1)).sum(1) * stride
    at = (grid(cells) + 0.5) * stride
    rows = [at[..., 0] - d[0], at[..., 1] - d[1], at[..., 0] + d[2], at[..., 1] + d[3],
            *classes.reshape(K, cells, cells)]
    return np.stack(rows, -1).reshape(-1, 4 + K)


def yolov8_heads(net):
    rows, heads = [], []
    for stride in (8, 16, 32):
        features = net.level(stride)
        box, classes = net.head(features, 64), net.head(features, K)
        rows.append(yolov8_rows(net.values[box], net.values[classes], stride))
        heads.append((box, classes, stride))
    return np.concatenate(rows), heads


def yolov8_decode(net, heads):
    joined = [net.node("Reshape", [net.node("Concat", [b, c], axis=1), np.array([1, 64 + K, -1])]) for b, c, _ in heads]
    box, classes = net.node("Split", [net.node("Concat", joined, axis=2)], 2, axis=1, split=[64, K])
    count = sum((SIZE // s) ** 2 for _, _, s in heads)
    bins = net.node("Transpose", [net.node("Reshape", [box, np.array([1, 4, 16, count])])], perm=[0, 3, 1, 2])
    shares = net.node("Transpose", [net.node("Softmax", [bins], axis=3)], perm=[0, 3, 2, 1])
    mean = net.node("Conv", [shares, np.arange(16, dtype=np.float32).reshape(1, 16, 1, 1)], kernel_shape=[1, 1])
    distance = net.node("Reshape", [mean, np.array([1, 4, count])])
    low, high = net.node("Split", [distance], 2, axis=1, split=[2, 2])
    points = np.concatenate([(grid(SIZE // s) + 0.5).reshape(-1, 2) for _, _, s in heads]).T[None].astype(np.float32)
    strides = np.concatenate([np.full((SIZE // s) ** 2, s, np.float32) for _, _, s in heads])[None, None]
    low, high = net.node("Sub", [points, low]), net.node("Add", [points, high])
    centre = net.node("Div", [net.node("Add", [low, high]), np.float32(2)])
    box = net.node("Mul", [net.node("Concat", [centre, net.node("Sub", [high, low])], axis=1), strides])
    return net.node("Concat", [box, net.node("Sigmoid", [classes])], axis=1), count


def yolov8(folder):
    """The file contains the class names, as Ultralytics writes them."""
    net = Net(5, **UNIT)
    rows, heads = yolov8_heads(net)
    whole, count = yolov8_decode(net, heads)
    names = "{0: 'car', 1: 'person', 2: 'dog'}"
    net.save(folder, [(whole, [1, 4 + K, count])], rows, [], metadata=[("names", names)])


def yolov8_masks(folder):
    """Mask coefficients follow the classes, and the masks have their own output."""
    net = Net(15, **UNIT)
    rows, heads = yolov8_heads(net)
    features = [n.input[0] for n in net.nodes if n.output[0] in [box for box, _, _ in heads]]
    masks = [net.node("Reshape", [net.head(f, 32), np.array([1, 32, -1])]) for f in features]
    prototypes = net.head(features[0], 32)
    whole, count = yolov8_decode(net, heads)
    whole = net.node("Concat", [whole, net.node("Concat", masks, axis=2)], axis=1)
    net.save(folder, [(whole, [1, 36 + K, count]), (prototypes, [1, 32, 8, 8])], rows, [CLASSES])


def yolov8_open_size(folder):
    """The size is open: the graph computes shapes by Shape, Gather and Concat."""
    net = Net(6, **UNIT)
    rows, heads = yolov8_heads(net)
    outputs = []
    for box, classes, _ in heads:
        joined = net.node("Concat", [box, classes], axis=1)
        batch = net.node("Gather", [net.node("Shape", [joined]), np.array(0)], axis=0)
        shape = net.node("Concat", [net.node("Unsqueeze", [batch], axes=[0]), np.array([64 + K]), np.array([-1])],
                         axis=0)
        outputs.append(net.node("Reshape", [joined, shape]))
    net.input_shape = ["batch", 3, "height", "width"]
    net.save(folder, [(net.node("Concat", outputs, axis=2), ["batch", 64 + K, "cells"])], rows,
             [CLASSES, f"--size={SIZE}x{SIZE}"])


def yolov8_whole(folder):
    """The heads are not convolutions: boxes are used as they are, and the last sigmoid is
    removed."""
    net = Net(7, **UNIT)
    features = net.level(8)
    flat = net.node("Reshape", [features, np.array([1, CHANNELS, -1])])
    value = net.values[features].reshape(CHANNELS, -1)
    box_weight, class_weight = np.abs(net.normal(4, CHANNELS, spread=3.0)), net.normal(K, CHANNELS, spread=2.0)
    boxes, classes = net.node("MatMul", [box_weight, flat]), net.node("MatMul", [class_weight, flat])
    whole = net.node("Concat", [boxes, net.node("Sigmoid", [classes])], axis=1)
    rows = centre_rows((box_weight.astype(np.float64) @ value).T, (class_weight.astype(np.float64) @ value).T)
    net.save(folder, [(whole, [1, 4 + K, len(rows)])], rows, [CLASSES, "--family=yolov8"])


# -- YOLOX, NanoDet ----------------------------------------------------------------------------------

def yolox_network(folder, seed, decoded):
    net = Net(seed)
    rows, parts = [], []
    for stride in (8, 16, 32):
        features, cells = net.level(stride), SIZE // stride
        box, objectness, classes = net.head(features, 4, 0.4), net.head(features, 1), net.head(features, K)
        b, o, c = (net.values[n][0] for n in (box, objectness, classes))
        xy = (b[:2].transpose(1, 2, 0) + grid(cells)) * stride
        wh = np.exp(b[2:].transpose(1, 2, 0)) * stride
        rows.append(centre_rows(np.concatenate([xy, wh], -1).reshape(-1, 4),
                                logit(sigmoid(o) * sigmoid(c)).reshape(K, -1).T))
        whole = net.node("Concat", [box, net.node("Sigmoid", [objectness]), net.node("Sigmoid", [classes])], axis=1)
        parts.append(net.node("Reshape", [whole, np.array([1, 5 + K, -1])]))
    rows = np.concatenate(rows)
    out = net.node("Transpose", [net.node("Concat", parts, axis=2)], perm=[0, 2, 1])
    if decoded:
        points = np.concatenate([grid(SIZE // s).reshape(-1, 2) for s in (8, 16, 32)])[None].astype(np.float32)
        strides = np.concatenate([np.full((SIZE // s) ** 2, s, np.float32) for s in (8, 16, 32)])[None, :, None]
        xy, wh, rest = net.node("Split", [out], 3, axis=2, split=[2, 2, 1 + K])
        xy = net.node("Mul", [net.node("Add", [xy, points]), strides])
        wh = net.node("Mul", [net.node("Exp", [wh]), strides])
        out = net.node("Concat", [xy, wh, rest], axis=2)
    net.save(folder, [(out, [1, len(rows), 5 + K])], rows, [CLASSES])


def yolox(folder):
    yolox_network(folder, 8, False)


def yolox_decoded(folder):
    yolox_network(folder, 9, True)


def nanodet(folder):
    net = Net(10, mean=(103.53, 116.28, 123.675), scale=(1 / 57.375, 1 / 57.12, 1 / 58.395))
    rows, parts = [], []
    for stride in (8, 16, 32, 64):
        cells = SIZE // stride
        raw = net.head(net.level(stride), K + 32)
        value = net.values[raw][0]
        d = (softmax(value[K:].reshape(4, 8, cells, cells), 1) * np.arange(8).reshape(1, 8, 1, 1)).sum(1) * stride
        at = grid(cells) * stride
        rows.append(np.stack([at[..., 0] - d[0], at[..., 1] - d[1], at[..., 0] + d[2], at[..., 1] + d[3], *value[:K]],
                             -1).reshape(-1, 4 + K))
        classes, sides = net.node("Split", [raw], 2, axis=1, split=[K, 32])
        parts.append(net.node("Flatten", [net.node("Concat", [net.node("Sigmoid", [classes]), sides], axis=1)], axis=2))
        shape = np.array([1, K + 32, cells * cells])
        parts[-1] = net.node("Reshape", [parts[-1], shape])
    rows = np.concatenate(rows)
    out = net.node("Transpose", [net.node("Concat", parts, axis=2)], perm=[0, 2, 1])
    net.save(folder, [(out, [1, len(rows), K + 32])], rows, [CLASSES])


# -- SSD, DETR ----------------------------------------------------------------------------------------

def ssd_network(folder, seed, decoded):
    net = Net(seed, mean=(127,) * 3, scale=(1 / 128,) * 3, rgb=True)
    boxes, scores, b_values, s_values = [], [], [], []
    for stride, count in ((8, 2), (16, 4)):
        features = net.level(stride)
        for channels, names, values in ((4, boxes, b_values), (K + 1, scores, s_values)):
            raw = net.head(features, count * channels)
            turned = net.node("Transpose", [raw], perm=[0, 2, 3, 1])
            names.append(net.node("Reshape", [turned, np.array([1, -1, channels])]))
            values.append(net.values[raw].transpose(0, 2, 3, 1).reshape(-1, channels))
    t, o = np.concatenate(b_values), np.concatenate(s_values)
    priors = np.concatenate([net.random.uniform(0.1, 0.9, (len(t), 2)), net.random.uniform(0.1, 0.4, (len(t), 2))],
                            1).round(5).astype(np.float32)
    centre = priors[:, :2] + 0.1 * t[:, :2] * priors[:, 2:]
    size = priors[:, 2:] * np.exp(0.2 * t[:, 2:])
    rows = centre_rows(np.concatenate([centre, size], 1) * SIZE, o[:, 1:] - o[:, :1])
    box, score = net.node("Concat", boxes, axis=1), net.node("Concat", scores, axis=1)
    arguments = [CLASSES]
    if decoded:
        score = net.node("Softmax", [score], axis=2)
        low, high = net.node("Split", [box], 2, axis=2, split=[2, 2])
        scaled = net.node("Mul", [net.node("Mul", [low, np.float32(0.1)]), priors[None, :, 2:]])
        c = net.node("Add", [scaled, priors[None, :, :2]])
        half = net.node("Mul",
                        [net.node("Mul",
                                  [net.node("Exp", [net.node("Mul", [high, np.float32(0.2)])]),
                                   priors[None, :, 2:]]), np.float32(0.5)])
        box = net.node("Concat", [net.node("Sub", [c, half]), net.node("Add", [c, half])], axis=2)
    else:
        folder.mkdir(parents=True, exist_ok=True)
        np.savetxt(folder / "priors.txt", priors, fmt="%.9g")
        arguments += [f"--priors={folder / 'priors.txt'}", f"--boxes={box}"]
    net.save(folder, [(score, [1, len(t), K + 1]), (box, [1, len(t), 4])], rows, arguments)


def ssd(folder):
    ssd_network(folder, 11, True)


def ssd_offsets(folder):
    ssd_network(folder, 12, False)


def attention(net, queries):
    """Adds queries with attention to cells: (name, value) of (1, queries, CHANNELS)."""
    features = net.level(16)
    keys = net.node("Reshape", [features, np.array([1, CHANNELS, -1])])
    value = net.values[features].reshape(CHANNELS, -1)
    wanted = net.normal(queries, CHANNELS, spread=0.6)
    similar = net.node("MatMul", [wanted[None], keys])
    share = net.node("Softmax", [similar], axis=2)
    seen = net.node("MatMul", [share, net.node("Transpose", [keys], perm=[0, 2, 1])])
    name = net.node("Add", [seen, net.constant(wanted)])
    return name, softmax(wanted.astype(np.float64) @ value, 1) @ value.T + wanted


def detr_parts(net, queries, columns):
    """Adds boxes after a sigmoid and raw scores; returns their names and values."""
    name, value = attention(net, queries)
    w_box, w_class, b_class = net.normal(CHANNELS, 4, spread=0.5), net.normal(CHANNELS, columns), net.normal(columns)
    boxes = net.node("Sigmoid", [net.node("MatMul", [name, w_box])])
    scores = net.node("Add", [net.node("MatMul", [name, w_class]), b_class])
    return boxes, scores, sigmoid(value @ w_box), value @ w_class + b_class


IMAGENET = dict(mean=(123.675, 116.28, 103.53), scale=(1 / 58.395, 1 / 57.12, 1 / 57.375), rgb=True)


def detr(folder):
    net = Net(13, **IMAGENET)
    boxes, scores, b, o = detr_parts(net, 12, K + 1)
    net.save(folder, [(scores, [1, 12, K + 1]), (boxes, [1, 12, 4])], centre_rows(b * SIZE, o[:, :K] - o[:, K:]),
             [CLASSES])


def detr_sigmoids(folder):
    """RT-DETR's form: one output, a sigmoid for each class, no background."""
    net = Net(14, **IMAGENET)
    boxes, scores, b, o = detr_parts(net, 12, K)
    whole = net.node("Concat", [boxes, net.node("Sigmoid", [scores])], axis=2)
    net.save(folder, [(whole, [1, 12, 4 + K])], centre_rows(b * SIZE, o), [CLASSES])


def later():
    """Later families are in separate files, which import this one."""
    import tiny_networks_later
    import tiny_queries
    return *tiny_networks_later.ALL, *tiny_queries.ALL


ALL = (yolov5, yolov5_heads, yolov7, yolov5_suppressed, yolov8, yolov8_masks, yolov8_open_size, yolov8_whole, yolox,
       yolox_decoded, nanodet,
       ssd, ssd_offsets, detr, detr_sigmoids)

if __name__ == "__main__":
    for make in (*ALL, *later()):
        make(Path(sys.argv[1]) / make.__name__)
