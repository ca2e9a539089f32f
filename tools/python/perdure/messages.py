"""The classes of messages, created from the description that the C++ programs use.

Every topic's type and the types inside it are classes here and in ``perdure``: ``Objects``,
``ObjectBelief``, ``Detections``, … ``help(perdure.Objects)`` shows fields, shapes and units. A new
instance has the defaults of C++: ``Detection(box=(10, 10, 50, 80))``.

Times are in nanoseconds of the sensor clock, lengths in metres, angles in radians. Arrays are numpy
arrays of float64 unless stated otherwise; a message owns its arrays, and they may be changed.
``Frame.pixels`` is the exception: it is a read-only view of the memory of the received image.
"""

import numpy as np

from . import _perdure
from ._notes import NOTES


class Message:
    """Base class of all messages: fields by name, ``==``, and a text for people."""

    __slots__ = ()
    _fields = ()

    def __init__(self, **values):
        self._set_defaults()
        for name, value in values.items():
            if name.startswith("_") or not hasattr(type(self), name):
                raise TypeError(
                    f"{type(self).__name__} has no {name}; it has {', '.join(self._fields)}"
                )
            setattr(self, name, value)

    def _set_defaults(self):
        _perdure.set_defaults(type(self).__name__, self)

    def __repr__(self):
        parts = []
        for name in self._fields:
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and value.size > 12:
                value = f"<{value.dtype} {value.shape}>"
            elif isinstance(value, list) and len(value) > 3:
                value = f"<{len(value)} items>"
            parts.append(f"{name}={value!s}")
        return f"{type(self).__name__}({', '.join(parts)})"

    def __eq__(self, other):
        if type(other) is not type(self):
            return NotImplemented
        return all(
            np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b
            for a, b in ((getattr(self, f), getattr(other, f)) for f in self._fields)
        )

    __hash__ = None

    def __reduce__(self):
        return _restored, (type(self).__name__, [getattr(self, f) for f in self._fields])

    def to_dict(self):
        """The fields as a dict, recursively; arrays stay arrays."""

        def plain(value):
            if isinstance(value, Message):
                return value.to_dict()
            return [plain(v) for v in value] if isinstance(value, list) else value

        return {name: plain(getattr(self, name)) for name in self._fields}


def _restored(name, values):
    instance = CLASSES[name].__new__(CLASSES[name])
    for field, value in zip(instance._fields, values):
        setattr(instance, field, value)
    return instance


class _Pose:
    __slots__ = ()

    def _set_defaults(self):
        self.q_xyzw = np.array([0.0, 0.0, 0.0, 1.0])
        self.p = np.zeros(3)

    @property
    def rotation(self) -> "Array":
        """(3, 3): takes directions of the second frame to the first; of ``T_WB``, B to W."""
        x, y, z, w = self.q_xyzw
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )

    @property
    def matrix(self) -> "Array":
        """(4, 4): takes points of the second frame to the first."""
        m = np.eye(4)
        m[:3, :3] = self.rotation
        m[:3, 3] = self.p
        return m

    def __matmul__(self, points) -> "Array":
        """``T_WB @ points`` transforms (3,) or (N, 3) points from B to W, in metres."""
        return np.asarray(points) @ self.rotation.T + self.p


class _State:
    """Access to the elements of mean: [x, y, z, yaw, log length, log width, log height]."""

    __slots__ = ()

    @property
    def position(self) -> "Array":
        """(3,) centre, m."""
        return self.mean[:3]

    @property
    def yaw(self) -> "float":
        """rad, about the vertical."""
        return float(self.mean[3])

    @property
    def size(self) -> "Array":
        """(3,) length, width, height, m."""
        return np.exp(self.mean[4:7])


class _ObjectBelief(_State):
    __slots__ = ()

    @property
    def best(self) -> "ClassBelief":
        """The most probable ClassBelief."""
        return self.classes[0]

    @property
    def class_name(self) -> "str":
        """Name of the most probable class."""
        return self.classes[0].name

    @property
    def class_names(self) -> "List[str]":
        """Names of the classes, as ``pmf`` is ordered: the most probable first."""
        return [c.name for c in self.classes]

    @property
    def pmf(self) -> "Array":
        """(K,) probabilities of the classes, given that the object exists; they sum to 1."""
        return np.array([c.probability for c in self.classes])

    @property
    def mean(self) -> "Array":
        """(7,) of the most probable class: centre, m; yaw, rad; log of length, width, height."""
        return self.classes[0].mean

    @property
    def covariance(self) -> "Array":
        """(7, 7) of ``mean``."""
        return self.classes[0].covariance


class _Objects:
    __slots__ = ()

    def __iter__(self) -> "Iterator[ObjectBelief]":
        return iter(self.objects)

    def __len__(self) -> "int":
        return len(self.objects)

    def __getitem__(self, index) -> "ObjectBelief":
        return self.objects[index]

    @property
    def ids(self) -> "npt.NDArray[np.uint64]":
        """(N,) uint64."""
        return np.array([o.id for o in self.objects], np.uint64)

    @property
    def existence(self) -> "Array":
        """(N,) probabilities."""
        return np.array([o.existence for o in self.objects])

    @property
    def mean(self) -> "Array":
        """(N, 7) of each object's most probable class."""
        return np.array([o.mean for o in self.objects]).reshape(-1, 7)

    @property
    def covariance(self) -> "Array":
        """(N, 7, 7) of ``mean``."""
        return np.array([o.covariance for o in self.objects]).reshape(-1, 7, 7)


class _ObjectState:
    __slots__ = ()

    @property
    def id(self) -> "int":
        """The object's id, by which the topic is keyed."""
        return self.object.id

    @id.setter
    def id(self, value):
        self.object.id = value


class _Box:
    __slots__ = ()

    @property
    def box(self) -> "Array":
        """(4,) x1, y1, x2, y2, px of the distorted image; x right, y down."""
        return np.array([self.x1, self.y1, self.x2, self.y2])

    @box.setter
    def box(self, corners):
        self.x1, self.y1, self.x2, self.y2 = (float(c) for c in corners)


class _Frame:
    __slots__ = ()

    @property
    def image(self) -> "npt.NDArray[np.uint8]":
        """(height, width) uint8, or (height, width, 3) in the order blue, green, red.

        ``pixels`` itself, without a copy, unless the frame came as JPEG: it is unpacked then.
        """
        if self.encoding.startswith("jpeg"):
            return _perdure.unpacked(self).pixels
        return self.pixels


_MIXINS = {
    "ClassBelief": _State,
    "Detection": _Box,
    "Frame": _Frame,
    "MapObject": _State,
    "ObjectBelief": _ObjectBelief,
    "ObjectState": _ObjectState,
    "Objects": _Objects,
    "Pose": _Pose,
    "Prediction": _Box,
}

_POSE = [
    ("q_xyzw", "array", (4,), "unit quaternion, w last", "float64"),
    ("p", "array", (3,), "m", "float64"),
]


def hint_of(field):
    """The type hint of a field of the schema."""
    _, kind, _, _, item = field
    return {
        "array": "npt.NDArray[np.{}]",
        "bytes": "npt.NDArray[np.{}]",
        "pixels": "npt.NDArray[np.uint8]",
        "pose": "Pose",
        "choice": "Literal[{}]",
        "message": "{}",
        "optional_message": "Optional[{}]",
        "optional_float": "Optional[float]",
        "list": "List[{}]",
        "names": "List[str]",
        "counts": "Dict[str, int]",
    }.get(kind, kind).format(", ".join(f'"{w}"' for w in item) if kind == "choice" else item)


def line_of(struct, field):
    """Docstring line of a field: shape, unit and meaning."""
    name, kind, shape, unit, item = field
    said = []
    if shape is not None:
        said.append("(" + ", ".join("n" if n is None else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")")
        if item != "float64":
            said.append(item)
    elif kind == "pixels":
        said.append("(height, width) or (height, width, 3) uint8; of a JPEG its bytes")
    elif kind == "choice":
        said.append(" | ".join(item))
    elif kind == "list":
        said.append(f"list of {item}")
    elif kind in ("message", "optional_message"):
        said.append(item + (" or None" if kind == "optional_message" else ""))
    note = NOTES.get(f"{struct}.{name}")
    unit = "" if note and note.startswith("=") else unit
    said += [text for text in (unit, note and note.lstrip("=")) if text]
    return f"{name}: {', '.join(said) or kind}"


def _make(name, fields):
    mixin = _MIXINS.get(name)
    names = list(dict.fromkeys(f[0] for f in fields))
    slots = [n for n in names if not hasattr(mixin, n)]
    lines = "\n".join(line_of(name, f) for f in fields)
    namespace = {
        "__slots__": tuple(slots),
        "__doc__": f"{NOTES.get(name, name + '.')}\n\n{lines}",
        "__module__": "perdure",
        "_fields": tuple(names),
    }
    bases = (mixin, Message) if mixin else (Message,)
    return type(name, bases, namespace)


SCHEMA = {"Pose": _POSE, **_perdure.schema()}
TOPIC_TYPES = _perdure.topic_types()
CLASSES = {name: _make(name, fields) for name, fields in SCHEMA.items()}


def register(module):
    """Registers the Python classes of the structs in a C++ module."""
    for name, made in CLASSES.items():
        module.register_class(name, made, [f[0] for f in SCHEMA[name]])


register(_perdure)
globals().update(CLASSES)
