"""Computes the reference outputs of a network for an image, without the library of the service."""

import os
import sys

import numpy as np
import onnx
from onnx import TensorProto, helper


def answers(path, graph, image, found, outputs, inside):
    """Returns ({tensor: values}, the reason if there are none). Uses numpy, or ONNX Runtime on the
    original file if operators that OpenCV lacks remain (`inside`)."""
    if inside:
        return by_onnx_runtime(path, graph, image, found)
    values, stuck = graph.evaluate({graph.image: image}, outputs)
    if any(o not in values for o in outputs):
        return {}, f"not compared with OpenCV's answers: {', '.join(sorted(set(stuck)))} has no counterpart here"
    return values, ""


def sources_of(graph, found):
    """Returns {tensor of the description: its name in the file}. The name is that of the input if
    the tensor was the output of an activation that was removed."""
    producers = graph.producers()
    return {new: producers[new].inputs[0] if producers[new].kind == "Identity" else old
            for old, new in found.cuts.items()}


def zeros_for(given, types):
    """Returns zeros for an input other than the image. Such inputs do not affect the tensors."""
    return np.zeros([d if isinstance(d, int) else 1 for d in given.shape], types[given.type])


def quietly_imported():
    """Returns onnxruntime, or None if it is not installed. Its messages are suppressed, because
    Debian's package shares a library with onnx and registers operators a second time."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    sys.stderr.flush()
    os.dup2(nowhere, 2)
    try:
        import onnxruntime
        return onnxruntime
    except ImportError:
        return None
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def by_onnx_runtime(path, graph, image, found):
    unsure = "not compared with the file's own answers: "
    onnxruntime = quietly_imported()
    if onnxruntime is None:
        return {}, unsure + "python3-onnxruntime is not installed"
    sources = sources_of(graph, found)
    model = onnx.load(str(path))
    there = {o.name for o in model.graph.output}
    model.graph.output.extend(helper.make_tensor_value_info(s, TensorProto.FLOAT, None)
                              for s in sources.values() if s not in there)
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])
    types = {f"tensor({kind})": kind for kind in ("float", "double", "int32", "int64", "bool")}
    types |= {"tensor(float)": "float32", "tensor(double)": "float64", "tensor(float16)": "float16"}
    feeds = {}
    for given in session.get_inputs():
        pictured = len(given.shape) == 4
        if pictured and (given.type != "tensor(float)" or given.shape[2:] != list(image.shape[2:]) and
                         all(isinstance(d, int) for d in given.shape[2:])):
            return {}, unsure + "its input has another type or size than the file's"
        feeds[given.name] = image if pictured else zeros_for(given, types)
    return dict(zip(sources, session.run(list(sources.values()), feeds))), ""
