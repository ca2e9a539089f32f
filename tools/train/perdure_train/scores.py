"""Detections against truth: AP50, recall, calibration error, azimuth. Only numpy."""

import csv
import math

import numpy as np

from .settings import CLASSES

SIZES = {"small": (10, 24), "medium": (24, 64), "large": (64, 1e9)}  # square root of the area, px


def overlaps(a, b):
    """IoU of each of `a` with each of `b`."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    common = np.clip(high - low, 0, None).prod(2)
    areas = (a[:, 2:] - a[:, :2]).prod(1)[:, None] + (b[:, 2:] - b[:, :2]).prod(1)[None]
    return common / np.maximum(areas - common, 1e-9)


def read_detections(file, clutter_rate):
    """By frame: boxes, calibrated log-odds (n, K) against the background, azimuth and its sigma.

    The activations of the file hold logit(c), which is taken out again (the service's README).
    """
    frames = {}
    prior = math.log(clutter_rate / (1 - clutter_rate))
    sides = ("x1", "y1", "x2", "y2")
    with open(file, newline="") as stream:
        for row in csv.DictReader(stream):
            known = row["azimuth"] != ""
            frames.setdefault(int(row["frame"]), []).append((
                [float(row[side]) for side in sides],
                [float(row["logit:" + name]) - prior for name in CLASSES],
                [float(row["azimuth"]), float(row["sigma_azimuth"])] if known else [math.nan] * 2,
                [float(row["sigma_" + side] or math.nan) for side in sides],
            ))
    return {
        frame: {"boxes": np.array([r[0] for r in rows]), "odds": np.array([r[1] for r in rows]),
                "azimuths": np.array([r[2] for r in rows]), "sigmas": np.array([r[3] for r in rows])}
        for frame, rows in frames.items()
    }


EMPTY = {"boxes": np.zeros((0, 4)), "odds": np.zeros((0, len(CLASSES))), "azimuths": np.zeros((0, 2)),
         "sigmas": np.zeros((0, 4))}


def probabilities(odds, temperature=1.0, shift=0.0):
    """Soft-max over background (0) and classes: (n, K), without the background's."""
    z = np.concatenate([np.zeros((len(odds), 1)), odds / temperature + shift], 1)
    z = np.exp(z - z.max(1, keepdims=True))
    return (z / z.sum(1, keepdims=True))[:, 1:]


def sizes_of(boxes):
    return np.sqrt(np.clip(boxes[:, 2:] - boxes[:, :2], 0, None).prod(1))


def match(boxes, scores, truth, wanted, minimum=0.5):
    """Greedily by falling score: the index of the truth that each box takes, -1 for a false alarm,
    -2 where it lies on something that is not counted."""
    result = np.full(len(boxes), -1)
    if len(boxes) == 0 or len(truth) == 0:
        return result
    iou = overlaps(boxes, truth)
    taken = np.zeros(len(truth), bool)
    for i in np.argsort(-scores, kind="stable"):
        free = np.where(wanted & ~taken, iou[i], 0)
        j = int(free.argmax())
        if free[j] >= minimum:
            taken[j] = True
            result[i] = j
        elif (~wanted).any() and iou[i][~wanted].max() >= minimum:
            result[i] = -2
        elif (~wanted).any() and covered(boxes[i], truth[~wanted]) >= 0.7:
            result[i] = -2
    return result


def covered(box, others):
    """The largest share of `box` that lies in one of `others`."""
    low, high = np.maximum(box[:2], others[:, :2]), np.minimum(box[2:], others[:, 2:])
    return (np.clip(high - low, 0, None).prod(1) / max((box[2:] - box[:2]).prod(), 1e-9)).max()


def average_precision(scores, hits, count):
    """Area under the precision's envelope over recall."""
    if count == 0:
        return math.nan
    order = np.argsort(-scores, kind="stable")
    hits = hits[order]
    recall = np.cumsum(hits) / count
    precision = np.cumsum(hits) / np.arange(1, len(hits) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    steps = np.diff(np.concatenate([[0.0], recall]))
    return float((steps * envelope).sum())


def class_average_precision(frames, k, sizes=(0, 1e9)):
    """AP50 of class k; truths of another size or class ignored flag are not counted."""
    scores, hits, count = [], [], 0
    for detections, truth in frames:
        chosen = truth["classes"] == k
        boxes = truth["boxes"][chosen]
        size = sizes_of(boxes)
        wanted = ~truth["ignored"][chosen] & (size >= sizes[0]) & (size < sizes[1])
        count += int(wanted.sum())
        p = detections["p"][:, k]
        used = p > 0.002
        got = match(detections["boxes"][used], p[used], boxes, wanted)
        own = sizes_of(detections["boxes"][used])
        outside = (got == -1) & ((own < sizes[0]) | (own >= sizes[1]))
        keep = (got != -2) & ~outside
        scores.append(p[used][keep])
        hits.append(got[keep] >= 0)
    return average_precision(np.concatenate(scores), np.concatenate(hits), count), count


def recall(frames, k, minimum, largest=1e9):
    """Found and counted truths of class k with size in the range, by any box of IoU 0.5."""
    found = count = 0
    for detections, truth in frames:
        size = sizes_of(truth["boxes"])
        wanted = (truth["classes"] == k) & ~truth["ignored"] & (size >= minimum) & (size < largest)
        count += int(wanted.sum())
        if wanted.any() and len(detections["boxes"]):
            iou = overlaps(truth["boxes"][wanted], detections["boxes"])
            found += int((iou.max(1) >= 0.5).sum())
    return found, count


def azimuth_errors(frames, k):
    """Absolute errors in radians, and errors over their sigmas, of matched detections of class k."""
    errors, ratios = [], []
    for detections, truth in frames:
        best = detections["p"].argmax(1) == k if len(detections["p"]) else np.zeros(0, bool)
        used = best & np.isfinite(detections["azimuths"][:, 0])
        chosen = (truth["classes"] == k) & ~truth["ignored"]
        got = match(detections["boxes"][used], detections["p"][used, k], truth["boxes"][chosen],
                    np.ones(int(chosen.sum()), bool))
        for i in np.flatnonzero(got >= 0):
            angle, sigma = detections["azimuths"][used][i]
            error = math.remainder(angle - truth["azimuths"][chosen][got[i]], 2 * math.pi)
            errors.append(abs(error))
            ratios.append(error / sigma)
    return np.array(errors), np.array(ratios)


def outcomes(frames):
    """Of every emitted box: log-odds (n, K) and the true class, 0 clutter, k + 1 class k.

    A box is of an object's class where they overlap by half or more and no better-scored box
    has taken it; what lies on something ignored is left out.
    """
    odds, labels = [], []
    for detections, truth in frames:
        if not len(detections["boxes"]):
            continue
        best = detections["p"].max(1)
        got = match(detections["boxes"], best, truth["boxes"], ~truth["ignored"])
        keep = got != -2
        label = np.where(got >= 0, truth["classes"][np.maximum(got, 0)] + 1 if len(truth["classes"])
                         else 0, 0)
        odds.append(detections["odds"][keep])
        labels.append(label[keep])
    return np.concatenate(odds), np.concatenate(labels)


def calibration_error(p, labels, bins=15):
    """Expected calibration error of the best class's probability over all emitted boxes."""
    best = p.argmax(1)
    confidence, right = p[np.arange(len(p)), best], labels == best + 1
    index = np.minimum((confidence * bins).astype(int), bins - 1)
    error = 0.0
    for b in range(bins):
        chosen = index == b
        if chosen.any():
            error += chosen.mean() * abs(confidence[chosen].mean() - right[chosen].mean())
    return float(error)


CLEAR = 0.8  # probability of the best class; what is half hidden has other errors
LARGE = 40.0  # pixels of the input; of smaller ones the pixel is the larger error
FULL = 12.0  # pixels: a median over many does not mind them


def matches(frames, at_least=0.0):
    """(detections, truth, i, j) of each box i that is object j's best answer, of those whose best
    class has this probability."""
    for detections, truth in frames:
        if not len(detections["boxes"]) or not len(truth["boxes"]):
            continue
        got = match(detections["boxes"], detections["p"].max(1), truth["boxes"], ~truth["ignored"])
        for i in np.flatnonzero((got >= 0) & (detections["p"].max(1) > at_least)):
            yield detections, truth, i, got[i]


def side_errors(frames):
    """Errors of sides relative to the box's size, where that is large, of clear best matches."""
    errors = []
    for detections, truth, i, j in matches(frames, CLEAR):
        box = truth["boxes"][j]
        sides = np.array([box[2] - box[0], box[3] - box[1]])
        error = (detections["boxes"][i] - box) / np.tile(sides, 2)
        free = np.array([box[0] > 1, box[1] > 1, box[2] < 319, box[3] < 239])
        errors.extend(error[free & np.tile(sides > LARGE, 2)])
    return np.array(errors)


def side_insets(frames, cls):
    """How far the sides lie inside the outline, in its widths and heights: medians (x1, y1, x2, y2)
    over the clear matches of one class that are wholly in sight; zeros where those are few."""
    insets = []
    for detections, truth, i, j in matches(frames, CLEAR):
        outline = truth["boxes"][j]
        sides = np.array([outline[2] - outline[0], outline[3] - outline[1]] * 2)
        whole = np.isfinite(truth["hulls"][j]).all()
        if truth["classes"][j] != cls or not whole or not sides.min() > FULL:
            continue
        insets.append((detections["boxes"][i] - outline) / sides * [1, 1, -1, -1])
    return np.median(insets, 0) if len(insets) >= 20 else np.zeros(4)


def side_ratios(frames):
    """Errors of sides over what the network says of them, of all matched boxes; those at the
    border of the image are left out."""
    ratios = []
    for detections, truth, i, j in matches(frames):
        box = truth["boxes"][j]
        ratio = (detections["boxes"][i] - box) / detections["sigmas"][i]
        free = np.array([box[0] > 1, box[1] > 1, box[2] < 319, box[3] < 239])
        ratios.extend(ratio[free & np.isfinite(ratio)])
    return np.array(ratios)
