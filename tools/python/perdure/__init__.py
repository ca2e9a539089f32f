"""Perdure's map of objects for Python.

::

    import perdure

    for frame in perdure.subscribe("objects"):           # a running Perdure
        for o in frame:
            print(o.id, o.class_name, o.position)

    perdure.Map("map.sqlite").by_class("car")            # the durable map
    perdure.read("run.mcap")                             # a recording
    perdure.publish(MyNetwork())                         # an inference service

Topics, quality of service, bounds and security are those of the C++ programs. Lengths are in
metres, angles in radians, times in nanoseconds of the sensor clock. W is the reference frame of
odometry, B the body, M the map.
"""

from ._perdure import __version__
from .bus import Gone, Publisher, Subscription, publisher, subscribe, topics
from .errors import (
    Error,
    Missing,
    OtherVersion,
    Refused,
    Silence,
    Unavailable,
    UnknownTopic,
    Unusable,
)
from .maps import Map
from .messages import CLASSES as _CLASSES
from .messages import Message
from .recordings import Recorded, Recording, read
from .service import Detector, activations, publish

globals().update(_CLASSES)

__all__ = [
    "Detector", "Error", "Gone", "Map", "Message", "Missing", "OtherVersion", "Publisher",
    "Recorded", "Recording", "Refused", "Silence", "Subscription", "Unavailable", "UnknownTopic",
    "Unusable", "activations", "publish", "publisher", "read", "subscribe", "topics",
    *_CLASSES,
]  # fmt: skip
