"""An inference service around a network of one's own: ``publish``."""

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
    """What ``publish`` needs of a network. Beside ``classes`` it may have ``name``, ``version``,
    ``box_sigma`` and ``boxes``, which go into ModelInfo, and the method ``look``::

        def look(self, image, expected):
            '''The filter's predictions that no box of ``detect`` met, a list of
            ``perdure.Prediction`` with ``box`` (in this image, its part inside), ``class_name``,
            ``probability``. Called after ``detect``, where there are any.

            Returns an array (N,) of nats: log P(this picture | the object is there, and detect
            did not report it) / P(this picture | nothing is there); NaN: nothing is said of it.
            Or two arrays: nats and boxes (N, 4), where the object really is in the image.'''

    Answers are evidence that the object exists, whatever its class, and go out as detections with
    ``primed`` and ``primed_for``. Those beyond 5 nats are cut."""

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


_HORIZON_S = 0.5  # how long after their frame predictions are of use
_MET = 0.6  # overlap (IoU) from which a reported box meets a prediction
_MOST_NATS = 5.0  # of one answer


def _overlaps(a, b) -> np.ndarray:
    """(N, M) IoU of boxes (N, 4) and (M, 4)."""
    low, high = np.maximum(a[:, None, :2], b[None, :, :2]), np.minimum(a[:, None, 2:], b[None, :, 2:])
    both = np.prod(np.maximum(high - low, 0.0), axis=2)
    areas = [np.prod(x[:, 2:] - x[:, :2], axis=1) for x in (a, b)]
    return both / np.maximum(areas[0][:, None] + areas[1][None, :] - both, 1e-9)


def _expected_in(predictions, frame, classes) -> List["messages.Prediction"]:
    """The predictions as they are in this frame; none where they are of another one."""
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
    """Reported boxes meet predictions one to one, those that overlap most first."""
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
    """What ``look`` returned, checked, as detections."""
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

    A detector with the method ``look`` answers the filter's predictions too (``Detector``).

    An exception at the first frame ends it. Later ones are printed, counted in Health
    (``detect_failed``), and say so there until a frame succeeds.
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
        with _EndBySignal():
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
                service.next(0)  # raises what has ended it, if it was not a signal
    finally:
        service.close()
