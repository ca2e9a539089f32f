"""Errors for networks that cannot be imported: they name the operator and an export that works."""

from onnx import GraphProto

from .faults import Fault

FAMILIES = ("yolov5", "yolov7", "yolov8", "yolox", "nanodet", "picodet", "rtmdet", "fastestdet", "yolo-fastestv2", "ssd",
            "detr")

EXPORTS = {
    "yolov5": "python export.py --weights FILE.pt --include onnx --opset 12",
    "yolov7": "python export.py --weights FILE.pt --grid (without --end2end)",
    "yolov8": "yolo export model=FILE.pt format=onnx opset=12 nms=False",
    "yolox": "python tools/export_onnx.py -n NAME -c FILE.pth --output-name FILE.onnx",
    "nanodet": "python tools/export_onnx.py --cfg_path CONFIG --model_path FILE.ckpt",
    "picodet": "tools/export_model.py -c CONFIG -o weights=FILE --export_serving_model=False export.post_process=False, "
               "then paddle2onnx",
    "rtmdet": "the raw answers of its heads (mmdetection: mode='tensor'), by torch.onnx.export",
    "yolo-fastestv2": "python pytorch2onnx.py --data DATA --weights FILE.pth --output FILE.onnx",
    "fastestdet": "python test.py --yaml CONFIG --weight FILE.pth --img IMAGE --onnx",
    "ssd": "boxes [1,N,4] and scores [1,N,classes+1] as they are before the suppression "
           "(TensorFlow: export_tflite_ssd_graph.py --add_postprocessing_op=false)",
    "detr": "torch.onnx.export of the model without its post-processing: outputs pred_logits and pred_boxes",
}

INSIDE = ("TopK", "GridSample", "Einsum", "GatherElements", "GatherND", "ScatterND", "NonZero", "NonMaxSuppression",
          "RoiAlign", "If", "Loop", "Scan", "DeformConv", "ConvInteger", "MatMulInteger", "DynamicQuantizeLinear")


def exports(family):
    if family in EXPORTS:
        return f"Export {family} so: {EXPORTS[family]}"
    return "Exports that work:" + "".join(f"\n  {k:14} {v}" for k, v in EXPORTS.items())


def refuse_choosing(path, operators, family):
    """Refuses a network with its own suppression, because its output has no evidence for each
    class."""
    raise Fault(f"{path} chooses its boxes itself (operator {', '.join(operators)}), and behind it no heads of a known "
                f"family were found; Perdure needs the boxes before that choice, with a score for each class. "
                f"{exports(family)}")


def refuse_hidden(path, node, found, family):
    """Refuses a network with an undetected head, because it would be imported with fewer levels."""
    what = f"{node.domain}.{node.kind}" if node.domain else node.kind
    where = f"node {node.name}" if node.name else f"the node that gives {node.outputs[0]}"
    levels = f"; only {found} of its levels were found" if found else ""
    raise Fault(f"{path} has the operator {what} ({where}), behind which heads of the network cannot be seen{levels}; "
                f"export it again without this operator. {exports(family)}")


def refuse_own(path, graph):
    """Refuses networks of the project's own family, because the graph lacks their calibration."""
    if {"logits8", "box8"} <= set(graph.outputs):
        raise Fault(f"{path} is of the project's own family perdure: use it as it is, with the model.json that "
                    "tools/train wrote beside it")


def refuse_rotated(path, graph):
    """Refuses rotated boxes, whose angle would be taken for a class."""
    if graph.metadata.get("task") == "obb":
        raise Fault(f"{path} finds rotated boxes (task obb), and Perdure reads upright ones; export a network that was "
                    f"trained for the task detect. {exports('yolov8')}")


def inside(path, graph, family, onnx_runtime):
    """Returns the remaining operators that OpenCV 4.6 lacks. Refuses the network if there are such
    operators and no ONNX Runtime, or if operators belong to other runtimes or have subgraphs."""
    found = sorted({n.kind for n in graph.nodes if n.kind in INSIDE or n.domain})
    own = any(n.domain or any(isinstance(a, GraphProto) for a in n.attributes.values()) for n in graph.nodes)
    if not found or (onnx_runtime and not own):
        return found
    foreign = sorted({f"{n.domain}.{n.kind}" for n in graph.nodes if n.domain})
    more = f" {', '.join(foreign)} belong to another runtime." if foreign else ""
    if "TopK" in found and family == "detr":
        more += " RT-DETR and its kin choose their queries so; take DETR or a YOLO, or a Perdure that was built with " \
                "ONNX Runtime (Debian 13)."
    raise Fault(f"{path} computes with {', '.join(found)} inside the network, which OpenCV 4.6 does not have.{more} "
                f"{exports(family)}")
