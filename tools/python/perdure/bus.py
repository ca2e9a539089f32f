"""Topics of a running Perdure: ``subscribe`` and ``publisher``.

Settings that every call here takes, all optional: ``interface`` (network interface, "lo"),
``domain`` (DDS domain), ``vehicle`` ("ego"), ``security`` (folder of identities), ``identity`` (a
folder in it; "subscriber"), ``peers`` (addresses of other hosts), ``process`` (what this program
is called in ``perdure topics``). What is not given is said by bus.yaml (/etc/perdure, config, or
the file that PERDURE_BUS names), PERDURE_DOMAIN and CYCLONEDDS_URI, as for ``perdure echo``;
PERDURE_DOMAIN goes before ``domain``.
"""

import atexit
import os
import time

from . import _perdure
from .errors import Error, Silence
from .messages import TOPIC_TYPES

_buses = {}
_process = os.getpid()


def _bus(process="python", **settings):
    """The participant of these settings, one a process."""
    if os.getpid() != _process:
        raise Error(
            "this process was forked from one that imported perdure, and DDS does not survive "
            'that; use multiprocessing.get_context("spawn")'
        )
    key = (process, *sorted((name, str(value)) for name, value in settings.items()))
    if key not in _buses:
        _buses[key] = _perdure.Bus(_perdure.BusSettings(**settings), process)
    return _buses[key]


@atexit.register
def _leave():
    if os.getpid() == _process:
        _buses.clear()


def topics():
    """Names of all topics and of their types: {"objects": "Objects", "frame/": "Frame", …}.

    "frame/" stands for frame/<camera>, as "frame/cam0".
    """
    return dict(TOPIC_TYPES)


class Gone:
    """An instance of a keyed topic that was disposed of; only the key of ``message`` means
    anything (the id of an ObjectState, the square of a MapTile)."""

    def __init__(self, message):
        self.message = message

    def __repr__(self):
        return f"Gone({self.message!r})"


class Subscription:
    """Messages as they come: iterate, or call ``next``. Made by ``subscribe``.

    It waits without the GIL, and Ctrl-C ends the wait within 0.2 s. What comes while nobody asks
    is kept up to the topic's depth, the newest of it (4 frames, 8 objects, 512 inertial samples).
    One thread may wait at a time; ``close`` may be called from any.
    """

    def __init__(self, names, *, timeout=None, count=None, gone=False, **settings):
        self._names = names
        self._timeout = timeout
        self._left = count
        self._inner = _perdure.Subscription(_bus(**settings), list(names), gone)

    def next(self, seconds=None):
        """The next message, or None after ``seconds`` (None: it waits for ever) or once closed."""
        found = self._inner.next(seconds)
        if found is None:
            return None
        topic, message, gone = found
        if gone:
            message = Gone(message)
        return message if len(self._names) == 1 else (topic, message)

    def __iter__(self):
        return self

    def __next__(self):
        if self._left == 0:
            raise StopIteration
        message = self.next(self._timeout)
        if message is None:
            if self.closed:
                raise StopIteration
            raise Silence(f"nothing came for {self._timeout} s: {self._inner.why_silent()}")
        if self._left is not None:
            self._left -= 1
        return message

    def wait_for_writer(self, seconds=None):
        """True once somebody writes one of the topics; False after ``seconds``."""
        end = None if seconds is None else time.monotonic() + seconds
        while not self.matched:
            if self.closed or (end is not None and time.monotonic() >= end):
                return False
            time.sleep(0.02)
        return True

    @property
    def matched(self):
        """How many writers there are now."""
        return self._inner.matched

    @property
    def counts(self):
        """What was lost or could not be read since the start, by reason (as in Health):
        "objects_malformed_bad_covariance", "frame_cam0_sample_lost", …"""
        return self._inner.counts

    @property
    def closed(self):
        return self._inner.closed

    def close(self):
        """Ends it; who waits for a message gets none."""
        self._inner.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def subscribe(*names, timeout=None, count=None, gone=False, **settings):
    """Messages of a topic::

        for frame in perdure.subscribe("objects"):
            for o in frame:
                print(o.id, o.class_name, o.pmf[0], o.position)

    Of several topics it yields (topic, message).

    timeout: seconds without a message after which iterating raises Silence, which says why.
    count: it ends after so many messages.
    gone: of keyed topics (object_state, map), also what was disposed of, as Gone.
    settings: of the bus, see this module.

    Raises UnknownTopic, Unavailable.
    """
    if not names:
        raise TypeError("subscribe wants the name of a topic; perdure.topics() lists them")
    return Subscription(names, timeout=timeout, count=count, gone=gone, **settings)


class Publisher:
    """Writes one topic, with its quality of service and its bounds. Made by ``publisher``."""

    def __init__(self, topic, *, strength=0, lease_s=0.0, **settings):
        self._inner = _perdure.Publisher(_bus(**settings), topic, strength, lease_s)

    def write(self, message):
        """Raises Refused with the field and the reason where it is not what readers take."""
        self._inner.write(message)

    def dispose(self, message):
        """Of a keyed topic: the instance with this message's key is gone."""
        self._inner.dispose(message)

    def acknowledged(self, seconds):
        """Waits until every reader has all that was written; False after ``seconds``."""
        return self._inner.acknowledged(seconds)

    @property
    def matched(self):
        """How many readers there are now."""
        return self._inner.matched

    def wait_for_reader(self, seconds=None):
        """True once somebody reads; False after ``seconds``."""
        end = None if seconds is None else time.monotonic() + seconds
        while not self.matched:
            if end is not None and time.monotonic() >= end:
                return False
            time.sleep(0.02)
        return True


def publisher(topic, *, strength=0, lease_s=0.0, **settings):
    """A writer of any topic, for drivers and experiments; of a network's results: ``publish``.

    strength, lease_s: of ``detections``, which only its strongest living writer is heard on.
    """
    return Publisher(topic, strength=strength, lease_s=lease_s, **settings)
