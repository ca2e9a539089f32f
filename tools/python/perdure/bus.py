"""Topics of a running Perdure: ``subscribe`` and ``publisher``.

All calls here take these optional settings: ``interface`` (network interface, "lo"), ``domain``
(DDS domain), ``vehicle`` ("ego"), ``security`` (folder of identities), ``identity`` (a folder in
it; "subscriber"), ``peers`` (addresses of other hosts), ``process`` (name of this program in
``perdure topics``). Missing settings come from bus.yaml (/etc/perdure, config, or the file that
PERDURE_BUS names), PERDURE_DOMAIN and CYCLONEDDS_URI, as for ``perdure echo``. PERDURE_DOMAIN
overrides ``domain``.
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
    """The participant of these settings, one for each process."""
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

    "frame/" stands for frame/<camera>, for example "frame/cam0".
    """
    return dict(TOPIC_TYPES)


def _wait_for_match(endpoint, seconds):
    end = None if seconds is None else time.monotonic() + seconds
    while not endpoint.matched:
        if getattr(endpoint, "closed", False) or (end is not None and time.monotonic() >= end):
            return False
        time.sleep(0.02)
    return True


class Gone:
    """A disposed instance of a keyed topic. Only the key of ``message`` is valid (the id of an
    ObjectState, the square of a MapTile)."""

    def __init__(self, message):
        self.message = message

    def __repr__(self):
        return f"Gone({self.message!r})"


class Subscription(_perdure.Subscription):
    """Messages in the order of arrival: iterate, or call ``next``. Created by ``subscribe``.

    It waits without the GIL, and Ctrl-C ends the wait within 0.2 s. Between calls, it stores the
    newest messages up to the topic's depth (4 frames, 8 objects, 512 inertial samples). One thread
    may wait at a time; ``close`` may be called from any.
    """

    def __init__(self, names, *, timeout=None, count=None, gone=False, **settings):
        self._names = names
        self._timeout = timeout
        self._left = count
        super().__init__(_bus(**settings), list(names), gone)

    def next(self, seconds=None):
        """The next message, or None after ``seconds`` (None: no limit) or after ``close``."""
        found = super().next(seconds)
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
            raise Silence(f"nothing came for {self._timeout} s: {self.why_silent()}")
        if self._left is not None:
            self._left -= 1
        return message

    def wait_for_writer(self, seconds=None):
        """True when one of the topics has a writer; False after ``seconds``."""
        return _wait_for_match(self, seconds)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def subscribe(*names, timeout=None, count=None, gone=False, **settings):
    """Messages of a topic::

        for frame in perdure.subscribe("objects"):
            for o in frame:
                print(o.id, o.class_name, o.pmf[0], o.position)

    For several topics, it yields (topic, message).

    timeout: seconds without a message after which the iteration raises Silence with the reason.
    count: number of messages after which it ends.
    gone: for keyed topics (object_state, map), also yields disposed instances as Gone.
    settings: of the bus, see this module.

    Raises UnknownTopic, Unavailable.
    """
    if not names:
        raise TypeError("subscribe wants the name of a topic; perdure.topics() lists them")
    return Subscription(names, timeout=timeout, count=count, gone=gone, **settings)


class Publisher(_perdure.Publisher):
    """Writes one topic, with its quality of service and its bounds. Created by ``publisher``."""

    def __init__(self, topic, *, strength=0, lease_s=0.0, **settings):
        super().__init__(_bus(**settings), topic, strength, lease_s)

    def wait_for_reader(self, seconds=None):
        """True when the topic has a reader; False after ``seconds``."""
        return _wait_for_match(self, seconds)


def publisher(topic, *, strength=0, lease_s=0.0, **settings):
    """A writer of any topic, for drivers and experiments. For a network's results, use ``publish``.

    strength, lease_s: for ``detections``; of its writers, only the strongest live one is read.
    """
    return Publisher(topic, strength=strength, lease_s=lease_s, **settings)
