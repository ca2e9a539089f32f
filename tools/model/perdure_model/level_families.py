"""Families identified by their heads: YOLOv5, v7, v8 to v12 and 26, YOLOX, RTMDet, NanoDet,
PicoDet, FastestDet and YOLO-FastestV2."""

import numpy as np

from . import decoding
from .faults import Fault
from .finding import Finding
from .heads import decoding_nodes

AS_THE_FILE = "decodes random heads as the file itself does (within {:.0e})"
AGREES = 2e-3  # largest difference, relative to 1 + the value, in float32


class Levels:
    """The heads of a graph by level, and the results of the decoding in the file for given
    values."""

    def __init__(self, graph, levels, size, request):
        self.graph, self.levels, self.size, self.request = graph, levels, size, request
        self.strides = [round(size[0] / level[0].columns) for level in levels]
        self.nodes = decoding_nodes(graph, [h for level in levels for h in level])
        self.kinds = {n.kind for n in self.nodes}

    def with_values(self, value):
        """Sets each head to `value(shape)` and evaluates the decoding in the file. Returns the
        heads by level, the float tensors that follow, and the operators without an
        implementation."""
        heads = [[value((1, h.channels, h.rows, h.columns)).astype(np.float32) for h in level] for level in self.levels]
        known = {h.name: v for level, values in zip(self.levels, heads) for h, v in zip(level, values)}
        found, stuck = self.graph.evaluate(known)
        for name in known:
            found.pop(name)
        return heads, [v for v in found.values() if v is not None and v.dtype.kind == "f"], stuck

    def random(self):
        generator = np.random.default_rng(7)
        return self.with_values(lambda shape: generator.normal(0, 1, shape))

    def count(self, each):
        return all(len(level) == each for level in self.levels)

    def same_channels(self, index):
        found = {level[index].channels for level in self.levels}
        return found.pop() if len(found) == 1 else None

    def cuts(self, roles):
        """Returns {tensor: name in model.json} and the keys of the levels. `roles` are in the order
        of the heads."""
        names, keys = {}, []
        for level, stride in zip(self.levels, self.strides):
            key = {"stride": stride}
            for head, role in zip(level, roles):
                if role:
                    names[head.name] = key[role] = f"{role}{stride}"
            keys.append(key)
        return names, keys

    def finish(self, finding, mine, random):
        """Compares our decoding, `mine`, with that in the file, and writes the result to
        `finding`."""
        _, values, stuck = random
        if not self.nodes:
            finding.compared = "the file has no decoding of its own to compare with"
            return finding
        finding.disagreement = min((e for m in mine for e in [decoding.disagreement(m, values)] if e is not None),
                                   default=None)
        if finding.disagreement is None:  # boxes without scores suffice if they agree
            boxes = [e for m in mine if m.shape[1] > 4 for e in [decoding.disagreement(m[:, :4], values)]]
            finding.disagreement = min((e for e in boxes if e is not None and e < AGREES), default=None)
        if finding.disagreement is None:
            why = f"its {', '.join(sorted(set(stuck)))} was not computed" if stuck else "it has none for each box"
            finding.compared = f"not compared with the file's own decoding: {why}"
        elif finding.disagreement < AGREES:
            finding.compared = AS_THE_FILE.format(max(finding.disagreement, 1e-7))
        else:
            finding.compared = f"decodes otherwise than the file itself (by {finding.disagreement:.2g})"
        return finding


def yolox(levels):
    """Finds heads for boxes, objectness and classes, in this order or with objectness first
    (FastestDet)."""
    if not levels.count(3):
        return None
    channels = [h.channels for h in levels.levels[0]]
    if channels[:2] not in ([4, 1], [1, 4]) or [levels.same_channels(i) for i in range(3)] != channels:
        return None
    box = channels.index(4)
    roles = ["box", "objectness", "classes"] if box == 0 else ["objectness", "box", "classes"]
    soft = "Softmax" in levels.kinds
    names, keys = levels.cuts(roles)
    found = Finding("fastestdet" if soft else "yolox", channels[2], names,
                    {"activation": {"class": "softmax" if soft else "sigmoid"}, "levels": keys})
    random = levels.random()
    heads = [[level[box], level[1 - box], level[2]] for level in random[0]]
    if soft:
        return levels.finish(found, [decoding.fastestdet(heads)] if len(heads) == 1 else [], random)
    return levels.finish(found, [decoding.yolox(heads, levels.strides, d) for d in (True, False)], random)


def box_and_classes(levels):
    """Returns (index of the box head, index of the class head, channels of each) for levels with
    two heads; otherwise None."""
    first, second = (levels.same_channels(i) for i in (0, 1)) if levels.count(2) else (None, None)
    wanted = len(levels.request.names or [])
    if first is None or second is None:
        return None
    few = (second == 4 and first != 4) or (second == 64 and first not in (4, 64))
    if few or (first == wanted and second % 4 == 0 and second >= 32 and first != 64):
        return 1, 0, second, first
    return 0, 1, first, second


def two_heads(levels, found, alternatives):
    """Describes heads for boxes and classes. Of `alternatives`, {keys of model.json: our decoding},
    takes the one that agrees with the file, or the first one if the file has no decoding."""
    box, classes, _, _ = box_and_classes(levels)
    found.cuts, keys = levels.cuts(["box", "classes"] if box == 0 else ["classes", "box"])
    random = levels.random()
    heads = [[level[box], level[classes]] for level in random[0]]
    best = None
    for said, decode in alternatives:
        tried = Finding(found.family, found.classes, found.cuts, {"activation": {"class": "sigmoid"}, **said,
                                                                 "levels": keys}, list(found.notes))
        levels.finish(tried, [decode(heads)], random)
        if best is None or (tried.disagreement is not None and
                            (best.disagreement is None or tried.disagreement < best.disagreement)):
            best = tried
    return best


def yolov8(levels):
    """Finds heads for bins of four distances, or (YOLO26) for the distances themselves, and for
    classes."""
    heads = box_and_classes(levels)
    if heads is None:
        return None
    _, _, sides, classes = heads
    if sides % 4 or (sides not in (4, 64) and "Softmax" not in levels.kinds):
        return None
    bins = sides // 4
    found = two_heads(levels, Finding("yolov8", classes), [
        ({"bins": bins}, lambda h: decoding.yolov8(h, levels.strides, bins))])
    sure = sides == 64 or levels.request.family == "yolov8"
    return found if sure or (found.disagreement or 1) < AGREES or (sides != 4 and found.disagreement) else None


def rtmdet(levels):
    """Finds heads for four distances from the corner of the cell, or their logarithms, and for
    classes."""
    heads = box_and_classes(levels)
    if heads is None or heads[2] != 4:
        return None
    ways = [(way, offset) for way in ("linear", "exp") for offset in (0.0, 0.5)]
    ways.sort(key=lambda w: w != ("exp" if "Exp" in levels.kinds else "linear", levels.request.cell_offset or 0.0))
    found = two_heads(levels, Finding("rtmdet", heads[3]), [
        ({"bins": 1, "cell_offset": offset, "distances": way},
         lambda h, o=offset, e=way == "exp": decoding.yolov8(h, levels.strides, 1, o, e)) for way, offset in ways])
    if found.disagreement is None:
        found.notes.append(f"nothing in the file says where its boxes lie: taken as rtmdet's, distances "
                           f"{found.keys['distances']}, cell_offset {found.keys['cell_offset']:g}; look at the "
                           "picture, or give --cell-offset, or --family yolov8 (YOLO26)")
    return found


def nanodet(levels):
    """Finds one head with the classes and the bins of four distances."""
    channels = levels.same_channels(0) if levels.count(1) else None
    wanted = len(levels.request.names or [])
    bins = levels.request.bins or 8
    if channels is None or channels <= 4 * bins or (wanted and channels != wanted + 4 * bins):
        return None
    hard = any(n.kind == "HardSwish" for n in levels.graph.nodes)  # NanoDet uses leaky ReLU
    family = levels.request.family or ("picodet" if hard and len(levels.levels) > 3 else "nanodet")
    names, keys = levels.cuts(["tensor"])
    found = Finding(family, channels - 4 * bins, names,
                    {"activation": {"class": "sigmoid"}, "bins": bins, "levels": keys})
    offset = levels.request.cell_offset
    plus = family == "nanodet" and len(levels.levels) > 3
    found.keys["cell_offset"] = (0.0 if plus else 0.5) if offset is None else offset
    if offset is None:
        as_in = "NanoDet-Plus (four strides)" if plus else "PicoDet" if family == "picodet" else "NanoDet (three strides)"
        found.notes.append(f"cell_offset is {found.keys['cell_offset']:g}, as in {as_in}; if all boxes lie half a cell "
                           "aside give --cell-offset")
    random = levels.random()
    return levels.finish(found, [decoding.nanodet([level[0] for level in random[0]], found.classes)], random)


def usual_anchors(found, anchors):
    found.notes.append(f"its anchors are not in the file: those of {found.family} for COCO were taken; give --anchors "
                       "if it was trained with others")
    return anchors


def set_anchors(found, keys, anchors):
    if len(anchors) != len(keys):
        raise Fault(f"the network has {len(keys)} levels and its anchors are not known; say --anchors "
                    "W,H,W,H,…/W,H,…, a group for each level")
    found.keys["levels"] = [{**key, "anchors": pairs} for key, pairs in zip(keys, anchors)]


def yolo_fastestv2(levels):
    """Finds heads for the boxes of all anchors, for their objectness, and for one soft-max of
    classes that all anchors share."""
    request = levels.request
    given = request.anchors
    count = len(given[0]) if given else 3
    channels = [levels.same_channels(i) for i in range(3)] if levels.count(3) else []
    if channels[:2] != [4 * count, count] or channels[2] is None:
        return None
    names, keys = levels.cuts(["box", "objectness", "classes"])
    found = Finding("yolo-fastestv2", channels[2], names, {"activation": {"class": "softmax"}})
    set_anchors(found, keys, given or usual_anchors(found, decoding.YOLO_FASTESTV2_ANCHORS))
    random = levels.random()
    return levels.finish(found, [decoding.yolo_fastestv2([level]) for level in random[0]], random)


def anchors_of(levels, count, classes):
    """Returns the anchors from the decoding of zeros in the file, in which each box equals its
    anchor; [] if there is none."""
    _, values, _ = levels.with_values(np.zeros)
    total = count * sum(level[0].rows * level[0].columns for level in levels.levels)
    for value in values:
        rows = decoding.as_rows(value, 5 + classes)
        if rows is None or len(rows) != total or not (rows[:, 2:4] > 1).all():
            continue
        found, begin = [], 0
        for level in levels.levels:
            cells = level[0].rows * level[0].columns
            found.append([[round(float(n), 3) for n in rows[begin + a * cells, 2:4]] for a in range(count)])
            begin += count * cells
        return found
    return []


def yolov5(levels):
    """Finds one head with (box, objectness, classes) for each anchor."""
    channels = levels.same_channels(0) if levels.count(1) else None
    request = levels.request
    given = request.anchors
    count = len(given[0]) if given else 3
    if channels is None or channels % count or channels // count < 6 or (levels.nodes and "Exp" in levels.kinds):
        return None
    classes = channels // count - 5
    family = "yolov7" if request.family == "yolov7" else "yolov5"
    names, keys = levels.cuts(["tensor"])
    found = Finding(family, classes, names, {"activation": {"class": "sigmoid"}})
    anchors = given or anchors_of(levels, count, classes)
    if not anchors and len(keys) == 3:
        anchors = usual_anchors(found, decoding.YOLOV7_ANCHORS if family == "yolov7" else decoding.YOLOV5_ANCHORS)
    if len(anchors) != len(keys) and request.family not in ("yolov5", "yolov7"):
        return None
    set_anchors(found, keys, anchors)
    random = levels.random()
    return levels.finish(found, [decoding.yolov5([level[0] for level in random[0]], levels.strides, anchors)], random)


def yolov8_with_more(levels):
    """Finds heads for boxes and classes beside heads for masks or key points, which are left
    out."""
    wanted = len(levels.request.names or [])
    picks = [(next((i for i, h in enumerate(level) if h.channels == 64), None),
              next((i for i, h in enumerate(level) if h.channels == wanted), None)) for level in levels.levels]
    if levels.count(2) or not wanted or wanted == 64 or any(None in pick for pick in picks):
        return None
    chosen = Levels(levels.graph, [[level[i] for i in pick] for level, pick in zip(levels.levels, picks)], levels.size,
                    levels.request)
    names, keys = chosen.cuts(["box", "classes"])
    found = Finding("yolov8", wanted, names, {"activation": {"class": "sigmoid"}, "bins": 16, "levels": keys})
    heads, values, _ = levels.random()
    mine = decoding.yolov8([[level[i] for i in pick] for level, pick in zip(heads, picks)], levels.strides, 16)
    more = {v.shape[1] - mine.shape[1] for v in values if v.ndim == 3 and v.shape[2] == len(mine)}
    found.disagreement = min((decoding.disagreement(mine, values, m) for m in more if m >= 0), default=None)
    if found.disagreement is None or found.disagreement >= AGREES:
        return None
    found.compared = AS_THE_FILE.format(max(found.disagreement, 1e-7))
    found.notes.append("it answers more than boxes (masks or key points), which is left out")
    return found


RULES = {"yolox": yolox, "fastestdet": yolox, "yolov8": yolov8, "yolov5": yolov5, "yolov7": yolov5, "nanodet": nanodet,
         "picodet": nanodet, "rtmdet": rtmdet, "yolo-fastestv2": yolo_fastestv2}
ONE_TO_ONE = "one2one"  # in names of the branch trained for one detection of each object


def dense(levels):
    """Returns the levels and a note. Leaves out the one-to-one branch if the file has both
    (YOLOv10, YOLO26), because the dense branch gives the likelihood."""
    kept = [[h for h in level if ONE_TO_ONE not in levels.graph.origin(h.name)] for level in levels.levels]
    if all(len(level) == 2 for level in kept) and levels.count(4):
        return Levels(levels.graph, kept, levels.size, levels.request), "of its two branches the dense one is taken"
    alone = all(not level for level in kept)
    return levels, "its heads answer once for each object (one-to-one), so that weak second boxes are rare" if alone else ""


def candidates(levels, family):
    """Returns the findings of all rules that fit. Those that agree with the decoding in the file
    come first."""
    if family and family not in RULES:
        return []
    levels, note = dense(levels)
    rules = [RULES[family]] if family else list(dict.fromkeys(RULES.values()))
    if family in ("", "yolov8"):
        rules.append(yolov8_with_more)
    found = [f for f in (rule(levels) for rule in rules) if f is not None]
    if family:
        found = [f for f in found if f.family == family]
    for finding in found:
        finding.notes += [note] if note else []
    agree = [f for f in found if f.disagreement is None or f.disagreement < AGREES]
    return sorted(agree or found, key=lambda f: f.disagreement is None)
