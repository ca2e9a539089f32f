"""python3 -m perdure_model: the part of `perdure model import` that processes graphs. Writes the
network, its model.json and reference outputs for the comparison with OpenCV; prints its findings.
"""

import json
import os
import sys
from pathlib import Path

try:
    import numpy as np
    import onnx
except ImportError as missing:
    print(f"perdure model: {missing.name} is missing; install it: apt-get install python3-onnx (deploy/install "
          "--model)", file=sys.stderr)
    sys.exit(69)

from . import counterpart
from . import heads as tracing
from . import level_families, output_families, quantised, reshaping, sayings
from .class_names import names_in
from .faults import INPUT_OUTPUT, USAGE, Fault, unwritten
from .finding import INPUTS
from .graph import Graph
from .opencv import Repair
from .options import Request, parsed

# Fits of networks of COCO to KITTI drive 0005 (tools/docs/adr/0055).
USUAL_CALIBRATION = {"temperature": 0.3, "bias": 0.0, "clutter_rate": 0.89}
CALIBRATION_OF_QUALITY_SCORES = {"temperature": 0.3, "bias": -2.4, "clutter_rate": 0.97}
FAMILIES_OF_QUALITY_SCORES = ("nanodet", "picodet", "rtmdet")


def calibration_of(family):
    return CALIBRATION_OF_QUALITY_SCORES if family in FAMILIES_OF_QUALITY_SCORES else USUAL_CALIBRATION


def recognise(path, graph, size, request):
    sayings.refuse_own(path, graph)
    sayings.refuse_rotated(path, graph)
    heads, others = tracing.find_heads(graph)
    found = []
    if heads and request.family not in ("ssd", "detr"):
        found = level_families.candidates(level_families.Levels(graph, tracing.levels_of(heads), size, request),
                                          request.family)
    if request.names and any(f.classes == len(request.names) for f in found):
        found = [f for f in found if f.classes == len(request.names)]
    best = found[0] if found else None
    choosing = tracing.choosing_operators(graph)
    disagrees = best is not None and best.disagreement is not None and best.disagreement >= level_families.AGREES
    if (best is None or disagrees) and choosing and request.family in ("", "detr"):
        best = output_families.queried(output_families.Outputs(graph, size, request)) or best
        disagrees = disagrees and not (best and best.family == "detr")
    if (best is None or disagrees) and choosing and request.family != "detr":
        sayings.refuse_choosing(path, choosing, request.family)
    if best is None or disagrees and not request.anchors:
        best = output_families.find(output_families.Outputs(graph, size, request)) or best
    hidden = tracing.hides_heads(graph, others) if best is None or best in found else None
    if hidden:
        sayings.refuse_hidden(path, hidden, len(tracing.levels_of(heads)), best.family if best else request.family)
    if best is None:
        shapes = ", ".join(f"{o} {'x'.join(map(str, graph.shape(o) or ['?']))}" for o in graph.outputs)
        where = f"as {request.family}" if request.family else "as any family"
        raise Fault(f"{path} is not known {where} by its outputs ({shapes}); give --family, or the right --classes, or "
                    f"export it otherwise. {sayings.exports(request.family)}")
    if best.disagreement is not None and best.disagreement >= level_families.AGREES:
        raise Fault(f"{path} has the heads of {best.family}, but {best.compared}; give --family or --anchors. "
                    f"{sayings.exports(best.family)}")
    return best


def check_names(path, found, request, graph):
    names = request.names or names_in(graph)
    if names is None:
        raise Fault(f"{path} does not say the names of its {found.classes} classes; give --classes FILE or "
                    "NAME,NAME,…", USAGE)
    if len(names) != found.classes:
        rotated = "; or is the last one the angle of rotated boxes (OBB), which are not read?"
        raise Fault(f"{path} ({found.family}) has {found.classes} classes and {len(names)} names were given; "
                    f"give as many, in the network's order{rotated if found.classes == len(names) + 1 else ''}")
    return names


def cut(path, graph, found, request):
    """Cuts the graph at the heads. Returns the operators in the remaining graph that OpenCV
    lacks."""
    was = {n.kind for n in graph.nodes}
    graph.keep(found.cuts)
    for old, new in found.cuts.items():  # first renames other tensors with these names
        graph.rename(old, f"perdure_cut_{new}")
    for new in found.cuts.values():
        graph.rename(new, f"perdure_was_{new}")
        graph.rename(f"perdure_cut_{new}", new)
    inside = sayings.inside(path, graph, found.family, request.onnx_runtime)
    others = [i for i in graph.inputs if i != graph.image]
    if others:
        raise Fault(f"{path} needs the inputs {', '.join(others)} beside the image; export a network that takes an "
                    "image only")
    gone = [k for k in tracing.CHOOSING if k in was - {n.kind for n in graph.nodes}]
    if gone:
        found.notes.append(f"{', '.join(gone)} was cut off: Perdure takes the heads before it")
    return inside


def other_size(args, graph, found, size, request):
    """Returns the input size that --input requests. For "camera" it has the camera's aspect ratio
    and about as many pixels as `size`."""
    if not request.new_size:
        return size
    steps = [level["stride"] for level in found.keys.get("levels", [])] or [32]
    new = request.new_size if request.new_size != "camera" else reshaping.of_camera(size, request.camera,
                                                                                  min(max(steps), 32))
    if list(new) != list(size):
        reshaping.reshape(args.network, graph, found, size, new)
        found.notes.append(f"its input is {new[0]}x{new[1]}; the file was made for {size[0]}x{size[1]}")
    return list(new)


def input_of(found, request):
    return {**INPUTS[found.family], **found.input, **request.input}


def description(args, found, names, size, request):
    keys = dict(found.keys)
    if keys.get("boxes", {}).get("form") == "offsets":
        keys["boxes"]["priors_file"] = args.out.name + ".priors.txt"
    return {"comment": f"written by perdure model import from {args.network.name}", "name": args.network.stem,
            "family": found.family,
            "input": {"width": size[0], "height": size[1], **input_of(found, request)}, "classes": names, **keys,
            "calibration": calibration_of(found.family)}


def write_reference(args, graph, size, given, found, inside):
    """Writes a noise image and the network's outputs for it, for the comparison with OpenCV."""
    folder, outputs = args.reference, list(found.cuts.values())
    pixels = np.random.default_rng(11).uniform(0, 255, (1, 3, size[1], size[0]))
    mean, scale = (np.broadcast_to(given[k], 3).reshape(3, 1, 1) for k in ("mean", "scale"))
    image = ((pixels - mean) * scale).astype(np.float32)
    values, why = counterpart.answers(args.network, graph, image, found, outputs, inside)
    if why:
        return why
    try:
        folder.mkdir(parents=True, exist_ok=True)
        image.tofile(folder / "input.f32")
        for name in outputs:
            np.ascontiguousarray(values[name], np.float32).tofile(folder / f"{name}.f32")
    except OSError as e:
        raise unwritten(f"{folder}, where answers are compared,", e)
    return ""


def write(args, graph, described, priors):
    try:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        onnx.save(graph.to_model(), str(args.out))
        Path(f"{args.out}.model.json").write_text(json.dumps(described, indent=1) + "\n")
        if "priors_file" in described.get("boxes", {}):
            np.savetxt(f"{args.out}.priors.txt", priors, fmt="%.7g")
    except OSError as e:
        raise unwritten(args.shown or e.filename or args.out, e)


def imported(args, request, graph):
    """Imports and writes the network. Returns the finding, the input size, and the repairs."""
    eight_bits = quantised.to_float(graph)
    size = graph.fix_input(args.network, request.size)
    graph.fold()
    request.names = request.names or names_in(graph)
    found = recognise(args.network, graph, size, request)
    names = check_names(args.network, found, request, graph)
    found.notes += [eight_bits] if eight_bits else []
    inside = cut(args.network, graph, found, request)
    size = other_size(args, graph, found, size, request)
    outputs = list(found.cuts.values())
    given = input_of(found, request)
    if args.reference:  # by the original graph, which shows wrong repairs too
        why = write_reference(args, graph, size, given, found, inside)
        found.notes += [why] if why else []
    repaired = {} if inside else Repair(graph).run()  # repairs for OpenCV deviate from the standard
    if inside:
        found.keys["backend"] = "onnxruntime"
        found.notes.append(f"it computes with {', '.join(inside)}, which OpenCV does not have: for ONNX Runtime alone")
    graph.keep(outputs)
    write(args, graph, description(args, found, names, size, request), request.priors)
    return found, size, repaired


def tell(graph, request, found, size, repaired):
    given = input_of(found, request)
    print(f"family      {found.family}, {found.classes} classes, input {size[0]}x{size[1]}")
    print(f"cut at      {', '.join(found.cuts.values())}: {len(graph.nodes)} operators are left")
    if repaired:
        print(f"repaired    {', '.join(f'{what} ({n})' for what, n in sorted(repaired.items()))}")
    print(f"decoding    {found.compared}")
    usual = f" (usual for {found.family}; else give --colour, --scale, --mean, --fit)"
    said = {"colour", "scale", "fit"} <= set(request.input)
    print(f"input       {given['colour']}, (pixel − {given['mean']})·{given['scale']}, {given['fit']}"
          f"{'' if said else usual}")
    for note in found.notes:
        print(f"note        {note}")
    sys.stdout.flush()


def run(args):
    request = Request(args)
    graph = Graph.load(args.network)
    try:
        done = imported(args, request, graph)
    except Fault:
        raise
    except Exception as e:  # an inconsistent graph may fail anywhere
        raise Fault(f"{args.network} is not a graph that makes sense here ({type(e).__name__}: {e}); export it again, "
                    "with opset 12")
    try:
        tell(graph, request, *done)
    except OSError as e:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # avoids a second error when Python flushes at exit
        raise Fault(f"standard output cannot be written whole ({e.strerror}); free space, or send it elsewhere",
                    INPUT_OUTPUT)


def main():
    try:
        run(parsed(sys.argv[1:]))
    except Fault as fault:
        print(f"perdure model: {fault}", file=sys.stderr)
        sys.exit(fault.status)


if __name__ == "__main__":
    main()
