"""Families identified by their outputs: boxes and scores of all levels together."""

import numpy as np

from .faults import Fault
from .finding import Finding
from .graph import Node
from .heads import CHOOSING, decoding_nodes, find_heads

# Operators that do not change scores. An activation before them may be removed.
PASSING = {"Reshape", "Transpose", "Concat", "Slice", "Squeeze", "Unsqueeze", "Flatten", "Identity", "Split", "Cast",
           "Gather"}
MANY_QUERIES = 1000  # above, the rows are of cells or priors, not of queries


class Outputs:
    def __init__(self, graph, size, request):
        self.graph, self.size, self.request = graph, size, request
        self.shapes = {o: graph.shape(o) for o in graph.outputs}
        self.known = None  # (boxes, scores), if they were found before the outputs

    def of_rank(self, rank):
        return {o: s for o, s in self.shapes.items() if s is not None and len(s) == rank and s[0] == 1}

    def pair(self):
        """Returns (boxes, scores) if one output is (1,N,4) and another (1,N,C)."""
        if self.known:
            return self.known
        found = self.of_rank(3)
        count = len(self.request.names or [])
        pairs = [(b, s) for b in found for s in found if b != s and found[b][2] == 4 and found[b][1] == found[s][1]]
        if not pairs:
            return None
        producers = self.graph.producers()

        def likely(pair):
            boxes, scores = pair
            named = any(word in boxes.lower() for word in ("box", "loc", "coord"))
            return (found[scores][2] in (count, count + 1), named, producers[scores].kind == "Softmax",
                    producers[boxes].kind != "Softmax", producers[boxes].kind == "Sigmoid")

        pairs.sort(key=likely, reverse=True)
        if self.request.boxes:
            pairs = [p for p in pairs if p[0] == self.request.boxes] or pairs
        elif len(pairs) > 1 and likely(pairs[0]) == likely(pairs[1]):
            raise Fault(f"the outputs {' and '.join(p[0] for p in pairs[:2])} could both be the boxes; say --boxes "
                        "NAME")
        return pairs[0]

    def strip(self, name, boxes=0):
        """Removes the sigmoid or soft-max before `name` if only shape operators follow it. Returns
        "sigmoid", "softmax", or "" if there is none. The first `boxes` columns of a concatenation
        are not scores."""
        producers = self.graph.producers()
        found, todo = [], [name]
        while todo:
            node = producers.get(todo.pop())
            if node is None:
                continue
            if node.kind in ("Sigmoid", "Softmax"):
                found.append(node)
            elif node.kind == "Concat" and boxes:
                first = self.graph.shape(node.inputs[0])
                if first is None or first[node.attributes["axis"]] != boxes:
                    return ""
                todo += node.inputs[1:]
                boxes = 0
            elif node.kind in PASSING and not node.domain:
                todo += node.inputs if node.kind == "Concat" else node.inputs[:1]
        kinds = {n.kind for n in found}
        if len(kinds) != 1 or boxes:
            return ""
        for node in found:
            if node.outputs[0] in self.graph.outputs:  # keeps the names of the outputs
                node.kind, node.attributes = "Identity", {}
            else:
                self.graph.rename_uses(node.outputs[0], node.inputs[0])
        return kinds.pop().lower()


def parts_of(graph, name, shape):
    """Adds Slices of the first four columns and of the others. Returns their names."""
    found = []
    for part, begin, end in (("boxes", 0, 4), ("scores", 4, shape[2])):
        inputs = [name]
        for key, value in (("begin", begin), ("end", end), ("axis", 2)):
            constant = f"perdure_{part}_{key}"
            graph.constants[constant] = np.array([value], np.int64)
            inputs.append(constant)
        graph.nodes.append(Node("Slice", inputs, [f"perdure_{part}"]))
        graph.shapes[f"perdure_{part}"] = [1, shape[1], end - begin]
        found.append(f"perdure_{part}")
    graph.outputs = graph.outputs + found
    return found


def single(outputs):
    """Finds one tensor: YOLOv5 (1,N,5+K), YOLOv8 (1,4+K,N), RT-DETR (1,Q,4+K)."""
    graph, request = outputs.graph, outputs.request
    wanted, family = len(request.names or []), request.family
    for name, (_, rows, columns) in outputs.of_rank(3).items():
        if family in ("yolov5", "yolov7", "") and columns > 5 and (columns == wanted + 5 or family):
            found = Finding(family or "yolov5", columns - 5, {name: "predictions"})
            found.keys = {"activation": {"class": "sigmoid", "applied": True},
                          "outputs": {"predictions": "predictions"}}
            found.notes.append("its heads were not found, or decode in a way of their own, so that its probabilities "
                               "are taken: evidence ends at ±16")
            return found
        if family in ("yolov8", "") and rows > 4 and columns > rows and (rows == wanted + 4 or family):
            found = Finding("yolov8", rows - 4, {name: "predictions"})
            kind = outputs.strip(name, boxes=4)
            found.keys = {"activation": {"class": "sigmoid", "applied": kind != "sigmoid"},
                          "outputs": {"predictions": "predictions"}}
            return found
        if family in ("detr", "") and columns > 4 and rows <= MANY_QUERIES and columns == wanted + 4:
            kind = outputs.strip(name, boxes=4)
            boxes, scores = parts_of(graph, name, [1, rows, columns])
            found = Finding("detr", columns - 4, {boxes: "boxes", scores: "scores"})
            found.keys = {"activation": {"class": "sigmoid", "applied": kind != "sigmoid"},
                          "outputs": {"boxes": "boxes", "scores": "scores"}}
            return found
    return None


def box_form(outputs, name, family, found):
    """Returns `boxes` of model.json: offsets if priors are given. Otherwise the form is found by
    decoding zeros, for which each box equals its prior."""
    graph, request = outputs.graph, outputs.request
    form = {"y_first": True} if request.y_first else {}
    if request.priors is not None:
        rows = outputs.shapes[name][1]
        if len(request.priors) != rows:
            raise Fault(f"{len(request.priors)} priors were given for {rows} boxes; give a file with one line x y "
                        "width height for each")
        return {**form, "form": "offsets", "priors_file": "", "variances": request.variances}
    if family == "detr":
        return form
    heads, _ = find_heads(graph)
    known = {h.name: np.zeros((1, h.channels, h.rows, h.columns), np.float32) for h in heads}
    boxes = graph.evaluate(known)[0].get(name)
    kinds = {n.kind for n in decoding_nodes(graph, heads)} if heads else set()
    if boxes is not None and "Exp" not in kinds:
        raise Fault("the boxes of this network are offsets of its priors (nothing in the file decodes them); "
                    "say --priors FILE with a line x y width height for each, in shares of the image")
    if boxes is None:
        found.notes.append("its boxes are taken for corners x1 y1 x2 y2 in shares of the image; if they come out "
                           "elsewhere give --y-first, or --priors")
        return form
    b = boxes[0]
    corners = bool((b[:, 2] >= b[:, 0]).all() and (b[:, 3] >= b[:, 1]).all())
    form["form"] = "corners" if corners else "centre"
    form["unit"] = "shares" if float(np.abs(b).max()) < 4 else "pixels"
    return form


def two(outputs):
    """Finds separate boxes and scores: SSD and DETR."""
    names = outputs.pair()
    if names is None:
        return None
    graph, request = outputs.graph, outputs.request
    boxes, scores = names
    rows, columns = outputs.shapes[scores][1:]
    wanted = len(request.names or [])
    attends = any(n.kind == "MatMul" and all(graph.constant(i) is None for i in n.inputs) for n in graph.nodes)
    family = request.family or ("detr" if attends and rows <= MANY_QUERIES else "ssd")
    kind = outputs.strip(scores)
    background = columns == wanted + 1
    soft = kind == "softmax" or (kind == "" and background)
    found = Finding(family, columns - 1 if background or (not wanted and (family == "ssd" or soft)) else columns,
                    {boxes: "boxes", scores: "scores"})
    place = ("first" if family == "ssd" else "last") if found.classes < columns else "none"
    found.keys = {"activation": {"class": "softmax" if soft and place != "none" else "sigmoid", "background": place},
                  "outputs": {"boxes": "boxes", "scores": "scores"}}
    if kind == "softmax" and place == "none":
        raise Fault(f"the scores of this network are a soft-max over {columns} classes without a background; "
                    "give the names of all its columns but the background, or export the scores with it")
    if kind == "":
        found.notes.append("its scores are taken for raw values: no sigmoid or soft-max was found behind them")
    form = box_form(outputs, boxes, family, found)
    if form:
        found.keys["boxes"] = form
    return found


def chosen(graph, name):
    """Returns true if the rows of a tensor were selected from others, and are not direct outputs of
    a decoder."""
    producers, todo = graph.producers(), [name]
    while todo:
        node = producers.get(todo.pop())
        if node is None:
            continue
        if node.kind in CHOOSING or node.kind in ("GatherElements", "GatherND"):
            return True
        if node.kind in PASSING or node.kind in ("Sigmoid", "Softmax", "Mul", "Div"):
            todo += node.inputs
    return False


def before_choice(outputs):
    """Returns (boxes, scores) of a decoder before the selection that its exporter added: the
    sigmoids that TopK reads, and the boxes (1,Q,4) by centres that are then converted to
    corners."""
    graph = outputs.graph
    producers = graph.producers()
    ends = graph.ancestors([o for o in graph.outputs])
    for choice in reversed([n for n in ends if n.kind == "TopK"]):
        scores = choice.inputs[0]
        while scores in producers and producers[scores].kind in ("Reshape", "Flatten", "Squeeze"):
            scores = producers[scores].inputs[0]
        shape = graph.shape(scores)
        if shape is None or len(shape) != 3 or scores not in producers or producers[scores].kind != "Sigmoid":
            continue
        for node in reversed(ends):
            whole = graph.shape(node.inputs[0]) if node.inputs else None
            apart = node.kind in ("Split", "Gather", "Slice") and whole == [1, shape[1], 4]
            if apart and not chosen(graph, node.inputs[0]):
                return node.inputs[0], scores
    return None


def queried(outputs):
    """Finds RT-DETR, D-FINE and similar networks: a decoder with outputs for queries that were
    selected before it."""
    graph, pair = outputs.graph, outputs.pair()
    if pair is None or any(chosen(graph, name) for name in pair):
        pair = before_choice(outputs)
        if pair is None or pair[0] in graph.outputs:
            return None
        graph.outputs = [*graph.outputs, *pair]
        outputs.shapes.update({name: graph.shape(name) for name in pair})
        outputs.known = pair
    found = two(outputs)
    if found is None or found.family != "detr":
        return None
    found.input = {"scale": 1 / 255, "mean": [0, 0, 0]}
    found.notes.append("its queries are chosen inside, as in RT-DETR and D-FINE, and its input is taken for theirs: "
                       "colours from 0 to 1; where it is another give --scale and --mean")
    found.compared = "its boxes are taken as the file gives them"
    return found


def find(outputs):
    family = outputs.request.family
    found = two(outputs) if family in ("", "ssd", "detr") else None
    found = found or single(outputs)
    if found is not None:
        found.compared = "its boxes are taken as the file gives them"
    return found
