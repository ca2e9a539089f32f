"""Scores detections against ground truth: AP50, recall, calibration error, azimuth. Needs only
numpy."""

import csv
import math

import numpy as np

from .settings import CLASSES

SIZES = {"small": (10, 24), "medium": (24, 64), "large": (64, 1e9)}  # √area in px


def overlaps(a, b):
    """IoU of each of `a` with each of `b`."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    common = np.clip(high - low, 0, None).prod(2)
    areas = (a[:, 2:] - a[:, :2]).prod(1)[:, None] + (b[:, 2:] - b[:, :2]).prod(1)[None]
    return common / np.maximum(areas - common, 1e-9)


def read_detections(file, clutter_rate):
    """For each frame: boxes, calibrated log-odds (n, K) against the background, azimuth and its
    sigma.

    The activations of the file include logit(c), which is subtracted (see the service's README).
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
    """Soft-max over background (0) and classes: (n, K), without the background column."""
    z = np.concatenate([np.zeros((len(odds), 1)), odds / temperature + shift], 1)
    z = np.exp(z - z.max(1, keepdims=True))
    return (z / z.sum(1, keepdims=True))[:, 1:]


def sizes_of(boxes):
    return np.sqrt(np.clip(boxes[:, 2:] - boxes[:, :2], 0, None).prod(1))


def match(boxes, scores, truth, wanted, minimum=0.5):
    """Matches greedily by decreasing score. Returns the index of the true object for each box. The
    index is -1 for a false alarm, and -2 if the box covers an object that does not count."""
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
    """The largest share of `box` that a single one of `others` covers."""
    low, high = np.maximum(box[:2], others[:, :2]), np.minimum(box[2:], others[:, 2:])
    return (np.clip(high - low, 0, None).prod(1) / max((box[2:] - box[:2]).prod(), 1e-9)).max()


def average_precision(scores, hits, count):
    """Area under the precision envelope over recall."""
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
    """AP50 of class k. True objects of another size, or with the flag "ignored", do not count."""
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
    """Counts the true objects of class k in the size range: those that any box finds with IoU 0.5,
    and all."""
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
    """Absolute errors in radians, and errors divided by sigma, of matched detections of class k."""
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
    """Log-odds (n, K) and true class of each emitted box; 0 is clutter, k + 1 is class k.

    A box has an object's class if their IoU is at least 0.5 and no box with a higher score matched
    the object. Boxes on ignored objects are omitted.
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


CLEAR = 0.8  # least probability of the best class; half-hidden objects have different errors
LARGE = 40.0  # pixels of the input; in smaller boxes, pixel quantisation dominates
FULL = 12.0  # least size in pixels; the median suppresses quantisation


def matches(frames, at_least=0.0):
    """(detections, truth, i, j) for each box i that is the best match of object j and whose best
    class has at least this probability."""
    for detections, truth in frames:
        if not len(detections["boxes"]) or not len(truth["boxes"]):
            continue
        got = match(detections["boxes"], detections["p"].max(1), truth["boxes"], ~truth["ignored"])
        for i in np.flatnonzero((got >= 0) & (detections["p"].max(1) > at_least)):
            yield detections, truth, i, got[i]


def side_errors(frames):
    """Errors of the sides of large boxes, relative to their size, for clear best matches."""
    errors = []
    for detections, truth, i, j in matches(frames, CLEAR):
        box = truth["boxes"][j]
        sides = np.array([box[2] - box[0], box[3] - box[1]])
        error = (detections["boxes"][i] - box) / np.tile(sides, 2)
        free = np.array([box[0] > 1, box[1] > 1, box[2] < 319, box[3] < 239])
        errors.extend(error[free & np.tile(sides > LARGE, 2)])
    return np.array(errors)


def side_insets(frames, cls):
    """Median insets of the sides within the outline, relative to its width and height: (x1, y1, x2,
    y2). Uses clear matches of one class that are completely visible; zeros if there are few."""
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
    """Errors of the sides divided by their estimated spread, for all matched boxes; sides at the
    image border are omitted."""
    ratios = []
    for detections, truth, i, j in matches(frames):
        box = truth["boxes"][j]
        ratio = (detections["boxes"][i] - box) / detections["sigmas"][i]
        free = np.array([box[0] > 1, box[1] > 1, box[2] < 319, box[3] < 239])
        ratios.extend(ratio[free & np.isfinite(ratio)])
    return np.array(ratios)
