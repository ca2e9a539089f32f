"""An inference service for a user's network: ``publish``."""

import contextlib
import copy
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
    """Interface of a network for ``publish``. Beside ``classes`` it may have ``name``, ``version``,
    ``box_sigma`` and ``boxes``, which are copied to ModelInfo, and the method ``look``::

        def look(self, image, expected):
            '''``expected``: the filter's predictions without a box of ``detect``, a list of
            ``perdure.Prediction`` with ``box`` (in this image, clipped to it), ``class_name``,
            ``probability``. Called after ``detect`` if there are any.

            Returns an array (N,) of nats: log P(this picture | the object exists, and detect
            did not report it) / P(this picture | no object); NaN: no evidence.
            Or two arrays: nats and boxes (N, 4), the true positions in the image.'''

    The nats are evidence for existence, independent of the class. They are published as detections
    with ``primed`` and ``primed_for``, and limited to ±5 nats."""

    classes: Sequence[str]  #: K lower-case names, as in config/class_priors.yaml

    def detect(self, image: np.ndarray):
        """Detects objects in an image, (height, width) or (height, width, 3) uint8 in the order
        blue, green, red. The image is read-only.

        Returns a list of ``perdure.Detection``, or two arrays: boxes (N, 4), x1 y1 x2 y2 in px, and
        activations (N, K + 1): log-likelihoods, [:, 0] of clutter, [:, k] of class k. Only their
        differences matter. ``perdure.activations(p)`` computes them from probabilities.
        """


def activations(probabilities) -> np.ndarray:
    """Converts (N, K) independent class probabilities (sigmoids) to activations (N, K + 1) float32:
    log p / (1 - p) against 0 for clutter. For a soft-max over K + 1 with clutter first, use its
    logarithm instead. ``perdure model calibrate`` gives better calibrated values."""
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
    """Checks and converts the result of ``detect``."""
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


_HORIZON_S = 0.5  # seconds after their frame in which predictions are valid
_MET = 0.6  # least overlap (IoU) of a reported box and a prediction
_MOST_NATS = 5.0  # limit of one top-down log-likelihood


def _overlaps(a, b) -> np.ndarray:
    """(N, M) IoU of boxes (N, 4) and (M, 4)."""
    low, high = np.maximum(a[:, None, :2], b[None, :, :2]), np.minimum(a[:, None, 2:], b[None, :, 2:])
    both = np.prod(np.maximum(high - low, 0.0), axis=2)
    areas = [np.prod(x[:, 2:] - x[:, :2], axis=1) for x in (a, b)]
    return both / np.maximum(areas[0][:, None] + areas[1][None, :] - both, 1e-9)


def _expected_in(predictions, frame, classes) -> List["messages.Prediction"]:
    """The predictions for this frame; none if they belong to another one."""
    after = 1e-9 * (frame.stamp.time_ns - predictions.stamp.time_ns)
    fits = predictions.stamp.source == frame.stamp.source and 0 <= after <= _HORIZON_S
    if not fits or predictions.camera not in ("", frame.camera):
        raise LookupError
    expected = []
    for p in predictions.predictions:
        moved = p.box + after * np.array(
            [p.velocity_x1, p.velocity_y1, p.velocity_x2, p.velocity_y2]
        )
        box = np.clip(moved, 0, [frame.width, frame.height] * 2)
        if p.class_name in classes and p.object_id and (box[2:] - box[:2] >= 1).all():
            inside = copy.copy(p)
            inside.box = box
            expected.append(inside)
    return expected


def _unmet(expected, found) -> List["messages.Prediction"]:
    """Predictions without a reported box; pairs are one-to-one, by decreasing overlap."""
    if not expected or not found:
        return expected
    overlaps = _overlaps(np.array([p.box for p in expected]), np.array([d.box for d in found]))
    met, used = set(), set()
    for e, d in zip(*np.unravel_index(np.argsort(-overlaps, axis=None), overlaps.shape)):
        if overlaps[e, d] >= _MET and e not in met and d not in used:
            met.add(e)
            used.add(d)
    return [p for i, p in enumerate(expected) if i not in met]


def _answers_of(said, asked, k: int) -> List["messages.Detection"]:
    """Checks the result of ``look`` and converts it to detections."""
    nats, boxes = said if isinstance(said, tuple) and len(said) == 2 else (said, None)
    nats = np.asarray(nats, float)
    if nats.shape != (len(asked),):
        raise Refused(
            f"look must return nats of shape ({len(asked)},), one for each prediction, "
            f"not {nats.shape}; NaN where it says nothing"
        )
    if boxes is None:
        boxes = np.array([p.box for p in asked])
    boxes = np.asarray(boxes, float)
    if boxes.shape != (len(asked), 4):
        raise Refused(f"look must return boxes of shape ({len(asked)}, 4), not {boxes.shape}")
    answers = []
    for prediction, box, value in zip(asked, boxes, nats):
        if np.isnan(value):
            continue
        evidence = np.full(k + 1, np.clip(value, -_MOST_NATS, _MOST_NATS), np.float32)
        evidence[0] = 0.0
        answers.append(
            messages.Detection(
                box=box, activations=evidence, primed=True, primed_for=prediction.object_id
            )
        )
    return answers


@contextlib.contextmanager
def _ended_by_signal():
    """SIGTERM and SIGHUP (unless ignored) end ``publish`` in order, like Ctrl-C."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) != signal.SIG_IGN:
                before[number] = signal.signal(number, lambda *_: sys.exit(0))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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

    This thread calls ``detector.detect`` for images of ``camera``, the newest first; older ones are
    dropped and counted. Model, detections, liveliness and Health (under the name ``process``) are
    those of perdure-inference; they continue while the network computes.

    strength: only the strongest live writer of ``detections`` is read; 30 overrides
    perdure-inference.
    longest_s: after a longer frame, another inference process takes over the topic, if one runs.
    frames: number of frames after which it ends.
    settings: of the bus, as in ``perdure.subscribe``; the identity is "inference".

    A detector with the method ``look`` also evaluates the filter's predictions (``Detector``).

    An exception at the first frame ends the service. Later ones are printed, counted in Health
    (``detect_failed``), and reported there until a frame succeeds.
    """
    model = _model_of(detector)
    look = getattr(detector, "look", None)
    service = _perdure.InferenceService(
        _perdure.BusSettings(**settings), process, camera, model, strength, longest_s, bool(look)
    )

    def answers(frame, found):
        predictions = service.predictions()
        if predictions is None:
            return []
        try:
            expected = _expected_in(predictions, frame, model.classes)
        except LookupError:
            service.count("predictions_stale")
            return []
        asked = _unmet(expected, found)
        return _answers_of(look(frame.image, asked), asked, len(model.classes)) if asked else []

    done = 0
    try:
        with _ended_by_signal():
            while (frames is None or done < frames) and not service.ended:
                frame = service.next(0.5)
                if frame is None:
                    continue
                done += 1
                began = time.monotonic()
                try:
                    found = _detections_of(detector.detect(frame.image), len(model.classes))
                    if look:
                        found = found + answers(frame, found)
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
                service.next(0)  # raises the error that ended it, unless it was a signal
    finally:
        service.close()
