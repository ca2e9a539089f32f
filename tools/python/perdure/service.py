"""An inference service around a network of one's own: ``publish``."""

import signal
import sys
import threading
import time
import traceback
from typing import List, Optional, Protocol, Sequence

import numpy as np

from . import _perdure, messages
from .errors import Refused


class Detector(Protocol):
    """What ``publish`` needs of a network. Beside ``classes`` it may have ``name``, ``version``,
    ``box_sigma`` and ``boxes``, which go into ModelInfo."""

    classes: Sequence[str]  #: lower-case names, K of them, as in config/class_priors.yaml

    def detect(self, image: np.ndarray):
        """What is in an image, (height, width) or (height, width, 3) uint8 in the order blue,
        green, red, which must not be written to.

        Returns a list of ``perdure.Detection``, or two arrays: boxes (N, 4), x1 y1 x2 y2 in px,
        and activations (N, K + 1): log-likelihoods, [:, 0] of clutter, [:, k] of class k; only
        their differences matter. Of probabilities: ``perdure.activations(p)``.
        """


def activations(probabilities) -> np.ndarray:
    """Of (N, K) probabilities of the classes, each on its own (sigmoids): the activations
    (N, K + 1) float32, log p / (1 - p) against clutter's 0. Of a soft-max over K + 1, clutter
    first, its logarithm is enough. Better calibrated: ``perdure model calibrate``."""
    p = np.clip(np.atleast_2d(np.asarray(probabilities, float)), 1e-6, 1 - 1e-6)
    odds = np.log(p) - np.log1p(-p)
    return np.hstack([np.zeros((len(odds), 1)), odds]).astype(np.float32)


def _model_of(detector) -> "messages.ModelInfo":
    classes = getattr(detector, "classes", None)
    if not classes or isinstance(classes, str):
        raise Refused("a detector has `classes`, the list of its classes' names in lower case")
    if not callable(getattr(detector, "detect", None)):
        raise Refused("a detector has the method `detect(image)`")
    name = getattr(detector, "name", type(detector).__name__)
    version = getattr(detector, "version", "")
    return messages.ModelInfo(
        name=name,
        hash=_perdure.digest("\n".join([name, str(version), *classes])),
        classes=list(classes),
        box_sigma=getattr(detector, "box_sigma", 0.0),
        boxes=getattr(detector, "boxes", "cuboid"),
    )


def _detections_of(found, k: int) -> List["messages.Detection"]:
    """What ``detect`` returned, checked."""
    if found is None:
        return []
    if isinstance(found, tuple) and len(found) == 2:
        boxes, evidence = np.asarray(found[0], float), np.asarray(found[1], np.float32)
        if boxes.size == 0 and evidence.size == 0:
            return []
        if boxes.ndim != 2 or boxes.shape[1] != 4:
            raise Refused(f"detect must return boxes of shape (N, 4), not {boxes.shape}")
        if evidence.shape != (len(boxes), k + 1):
            raise Refused(
                f"detect must return activations of shape (N, K + 1), here ({len(boxes)}, {k + 1}), "
                f"not {evidence.shape}; [:, 0] is clutter"
            )
        return [messages.Detection(box=b, activations=a) for b, a in zip(boxes, evidence)]
    found = list(found)
    for i, detection in enumerate(found):
        if not isinstance(detection, messages.Detection):
            raise Refused(
                "detect must return a list of perdure.Detection, or two arrays (boxes, "
                f"activations), and [{i}] is a {type(detection).__name__}"
            )
        if len(detection.activations) != k + 1:
            raise Refused(
                f"detections[{i}].activations must have shape ({k + 1},): clutter first, then "
                f"{k} classes; not {np.shape(detection.activations)}"
            )
    return found


class _EndBySignal:
    """SIGTERM ends ``publish`` in order, as Ctrl-C does."""

    def __enter__(self):
        self._before = None
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGTERM, self._end)

    @staticmethod
    def _end(*_):
        raise SystemExit(0)

    def __exit__(self, *_):
        if self._before is not None:
            signal.signal(signal.SIGTERM, self._before)


def publish(
    detector: Detector,
    *,
    camera: str = "cam0",
    strength: int = 30,
    longest_s: float = 1.0,
    frames: Optional[int] = None,
    process: str = "inference",
    **settings,
) -> None:
    """Runs a network as an inference service, until Ctrl-C or SIGTERM::

        class Lamps:
            classes = ["lamp"]
            def detect(self, image): ...

        perdure.publish(Lamps())

    Each image of ``camera`` goes to ``detector.detect`` in this thread, the newest first; older
    ones are dropped and counted. Model, detections, liveliness and Health (under the name
    ``process``) are those of perdure-inference; they go on while the network computes.

    strength: the strongest living writer of ``detections`` is heard; 30 is heard in place of
        perdure-inference.
    longest_s: a frame that takes longer loses the topic to another inference process, if one runs.
    frames: ends after so many frames.
    settings: of the bus, as in ``perdure.subscribe``; the identity is "inference".

    An exception at the first frame ends it. Later ones are printed, counted in Health
    (``detect_failed``), and say so there until a frame succeeds.
    """
    model = _model_of(detector)
    service = _perdure.InferenceService(
        _perdure.BusSettings(**settings), process, camera, model, strength, longest_s
    )
    done = 0
    try:
        with _EndBySignal():
            while (frames is None or done < frames) and not service.ended:
                frame = service.next(0.5)
                if frame is None:
                    continue
                done += 1
                began = time.monotonic()
                try:
                    found = _detections_of(detector.detect(frame.image), len(model.classes))
                    service.answer(
                        messages.Detections(
                            stamp=frame.stamp,
                            camera=frame.camera,
                            detections=found,
                            forward_s=time.monotonic() - began,
                        )
                    )
                except Exception as error:
                    if service.frames_out == 0:
                        raise
                    traceback.print_exc(file=sys.stderr)
                    service.failed(f"detect failed: {type(error).__name__}: {error}; see its log")
            if service.ended:
                service.next(0)  # raises what has ended it, if it was not a signal
    finally:
        service.close()
