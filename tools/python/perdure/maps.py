"""The durable map of objects: ``Map``."""

import os
import secrets
import time
import warnings
from typing import Iterator, List, Optional

import numpy as np

from . import messages
from .bus import Publisher, Subscription
from .errors import Missing, Unavailable, Unusable

_MOST = 100_000  # objects in a reply


def _files():
    """The module that reads files, loaded where it is used first: it brings Ceres."""
    from . import _map

    if not getattr(_map, "registered", False):
        messages.register(_map)
        _map.registered = True
    return _map


class Map:
    """A map of objects: a file, or that of the running map store.

    ``Map("map.sqlite")`` reads the file that map_store or ``perdure pipeline`` wrote, also while a
    service writes on; every question reads it anew. ``Map()`` asks the map store on the bus, with
    the settings of ``perdure.subscribe``. Both answer as ``perdure map`` does.

    frame: "M", in which the map is one, without the odometry's drift; or, of a file, "W": as
    stored, each object in the odometry's frame of its own session. Positions are in metres there.
    patience_s: how long the map store on the bus may take to answer.
    """

    def __init__(self, path=None, *, frame="M", patience_s=5.0, **settings) -> None:
        if frame not in ("M", "W"):
            raise ValueError(f'frame must be "M" or "W", not {frame!r}')
        if path is None and frame == "W":
            raise ValueError('frame="W" reads what is stored: give the map\'s file')
        self._as_stored = frame == "W"
        self._path = None if path is None else os.fspath(path)
        if self._path is not None and not os.path.exists(self._path):
            raise Missing(
                f"there is no map {self._path}; give the file that map_store writes (store.path), "
                "or map.sqlite of a pipeline's output"
            )
        self._patience_s = patience_s
        self._settings = settings
        self._client = secrets.randbits(64)
        self._request = 0
        self._line = None

    def objects(self) -> List["messages.MapObject"]:
        """All objects, by id."""
        return self._ask(kind="all").objects

    def by_class(self, name: str) -> List["messages.MapObject"]:
        """Those whose most probable class has this name, by id."""
        return self._ask(kind="by_class", class_name=name).objects

    def near(self, place, radius: float) -> List["messages.MapObject"]:
        """Those whose centre is within ``radius`` m of ``place`` (3,), the nearest first."""
        return self._ask(kind="by_radius", low=place, radius=radius).objects

    def in_box(self, low, high) -> List["messages.MapObject"]:
        """Those whose centre is between two corners (3,), m, by id."""
        corners = np.array([low, high], float)
        return self._ask(kind="by_box", low=corners.min(0), high=corners.max(0)).objects

    def get(self, object_id: int) -> Optional["messages.MapObject"]:
        """The object with this id; None where the map has none."""
        objects = self._ask(kind="by_id", object_id=object_id).objects
        return objects[0] if objects else None

    def belief(self, object_id: int) -> Optional["messages.ObjectBelief"]:
        """All that is believed of it: every class with its Gaussian, as stored in W, and the
        evidence; None where the map has no such object."""
        beliefs = self._ask(kind="by_id", object_id=object_id).beliefs
        return beliefs[0] if beliefs else None

    def __iter__(self) -> Iterator["messages.MapObject"]:
        return iter(self.objects())

    def __len__(self) -> int:
        return len(self.objects())

    def __getitem__(self, object_id: int) -> "messages.MapObject":
        found = self.get(object_id)
        if found is None:
            raise KeyError(f"the map has no object {object_id}")
        return found

    def __repr__(self) -> str:
        return f"Map({self._path!r})" if self._path else "Map()"

    def _ask(self, **question):
        query = messages.MapQuery(limit=_MOST, **question)
        reply = self._ask_bus(query) if self._path is None else self._ask_file(query)
        if reply.truncated:
            warnings.warn(
                f"there are more than these {len(reply.objects)} objects; raise map_store's "
                "query.limit, or read its file",
                stacklevel=3,
            )
        return reply

    def _ask_file(self, query):
        try:
            return _files().ask(self._path, query, self._as_stored)
        except Unavailable as error:
            raise Unusable(str(error)) from None  # it is there

    def _ask_bus(self, query):
        """The same question again each half second until it is answered: one that was sent before
        both ends have met is lost."""
        if self._line is None:
            self._line = (
                Publisher("map/query", **self._settings),
                Subscription(("map/reply",), **self._settings),
            )
        questions, answers = self._line
        self._request += 1
        query.client, query.request = self._client, self._request
        end, again = time.monotonic() + self._patience_s, 0.0
        while time.monotonic() < end:
            met = questions.matched > 0 and answers.matched > 0
            if met and time.monotonic() >= again:
                questions.write(query)
                again = time.monotonic() + 0.5
            reply = answers.next(0.02)
            if reply is None or (reply.client, reply.request) != (query.client, query.request):
                continue
            if not reply.ok:
                raise Unavailable(reply.error)
            return reply
        raise Unavailable(
            f"no map store answers within {self._patience_s} s: {answers._inner.why_silent()}; "
            'or read its file: perdure.Map("map.sqlite")'
        )
