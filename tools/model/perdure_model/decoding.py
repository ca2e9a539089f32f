"""The decode rules of services/inference in numpy, for the comparison with the decoding in a
file."""

import numpy as np

from .numpy_ops import sigmoid, softmax

YOLOV5_ANCHORS = [[[10, 13], [16, 30], [33, 23]], [[30, 61], [62, 45], [59, 119]], [[116, 90], [156, 198], [373, 326]]]
YOLOV7_ANCHORS = [[[12, 16], [19, 36], [40, 28]], [[36, 75], [76, 55], [72, 146]], [[142, 110], [192, 243], [459, 401]]]
YOLO_FASTESTV2_ANCHORS = [[[12.64, 19.39], [37.88, 51.48], [55.71, 138.31]],
                          [[126.91, 78.23], [131.57, 214.55], [279.92, 258.87]]]


def planes(head):
    """Converts (1, C, H, W) to (cells, C)."""
    return head.reshape(head.shape[1], -1).T


def cells(head):
    rows, columns = head.shape[2:]
    return np.stack([np.tile(np.arange(columns), rows), np.repeat(np.arange(rows), columns)], 1)


def centred(low, high):
    return np.concatenate([(low + high) / 2, high - low], 1)


def yolov5(heads, strides, anchors):
    """Returns rows of centre, size, objectness and classes, in order of levels, anchors and
    cells."""
    rows = []
    for head, stride, level in zip(heads, strides, anchors):
        for part, anchor in zip(np.split(planes(head), len(level), 1), level):
            p = sigmoid(part)
            xy = (p[:, :2] * 2 - 0.5 + cells(head)) * stride
            rows.append(np.concatenate([xy, (p[:, 2:4] * 2) ** 2 * np.array(anchor, np.float32), p[:, 4:]], 1))
    return np.concatenate(rows)


def distances(head, bins, exponents=False):
    if bins == 1:
        return np.exp(planes(head)) if exponents else planes(head)
    p = softmax(planes(head).reshape(-1, 4, bins), 2)
    return (p * np.arange(bins)).sum(2)


def yolov8(heads, strides, bins, offset=0.5, exponents=False):
    """Returns rows of centre, size and classes. `heads` are (box, classes) of each level."""
    rows = []
    for (box, classes), stride in zip(heads, strides):
        d, at = distances(box, bins, exponents), cells(box) + offset
        rows.append(np.concatenate([centred((at - d[:, :2]) * stride, (at + d[:, 2:]) * stride),
                                    sigmoid(planes(classes))], 1))
    return np.concatenate(rows)


def yolox(heads, strides, decoded):
    """Returns rows of box, objectness and classes. `heads` are (box, objectness, classes) of each
    level."""
    rows = []
    for (box, objectness, classes), stride in zip(heads, strides):
        b = planes(box)
        if decoded:
            b = np.concatenate([(b[:, :2] + cells(box)) * stride, np.exp(b[:, 2:]) * stride], 1)
        rows.append(np.concatenate([b, sigmoid(planes(objectness)), sigmoid(planes(classes))], 1))
    return np.concatenate(rows)


def fastestdet(heads):
    box, objectness, classes = (planes(h) for h in heads[0])
    return np.concatenate([sigmoid(objectness), box, softmax(classes, 1)], 1)


def yolo_fastestv2(heads):
    """Returns a row for each cell, as the decoding in such files: sigmoids of boxes and objectness,
    and the soft-max of the classes."""
    box, objectness, classes = (planes(h) for h in heads[0])
    return np.concatenate([sigmoid(box), sigmoid(objectness), softmax(classes, 1)], 1)


def nanodet(heads, classes):
    rows = [planes(h) for h in heads]
    return np.concatenate([np.concatenate([sigmoid(r[:, :classes]), r[:, classes:]], 1) for r in rows])


def as_rows(value, columns):
    """Returns a tensor of shape (1,N,C), (1,C,N), (1,C,H,W) or (1,A,H,W,C) as (N, C); None for
    other shapes."""
    value = np.asarray(value)
    if value.dtype.kind != "f" or value.ndim < 2 or value.shape[0] != 1:
        return None
    if value.shape[-1] == columns and value.ndim < 6:
        return value.reshape(-1, columns)
    return value.reshape(columns, -1).T if value.ndim in (3, 4) and value.shape[1] == columns else None


def corners(rows):
    half = rows[:, 2:4] / 2
    return np.concatenate([rows[:, :2] - half, rows[:, :2] + half, rows[:, 4:]], 1)


def disagreement(mine, values, more=0):
    """Returns the least, over all tensors of the same size, of the largest difference relative to 1
    + the value; None if no tensor has that size. The tensor's boxes may be corners, and it has
    `more` further columns."""
    best = None
    for value in values:
        rows = as_rows(value, mine.shape[1] + more)
        rows = rows if rows is None else rows[:, :mine.shape[1]]
        if rows is None or len(rows) != len(mine):
            continue
        for way in (mine, corners(mine)):
            error = float(np.max(np.abs(rows - way) / (1 + np.abs(rows))))
            best = error if best is None else min(best, error)
    return best
