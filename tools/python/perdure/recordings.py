"""Recordings of ``perdure record`` and ``perdure pipeline --record`` (MCAP): ``read``."""

import os
import warnings
from typing import Any, Dict, Iterator, NamedTuple, Sequence

from . import _perdure
from .errors import Missing, OtherVersion, Unavailable, Unusable


class Recorded(NamedTuple):
    """One message of a recording."""

    topic: str  #: topic name, such as "frame/cam0"
    time_ns: int  #: time of reception by the recorder, ns since 1970; never decreases
    message: Any  #: an instance of the topic's class


class Recording:
    """A recording; each iteration starts at its beginning. Created by ``read``."""

    def __init__(self, path, topics: Sequence[str] = ()) -> None:
        self.path = os.fspath(path)
        if not os.path.exists(self.path):
            raise Missing(f"there is no recording {self.path}; perdure record makes them")
        if isinstance(topics, str):
            topics = [topics]
        try:
            self._inner = _perdure.Recording(self.path, list(topics))
        except Unavailable as error:
            raise Unusable(str(error)) from None  # the file exists

    @property
    def topics(self) -> Dict[str, int]:
        """Number of messages of each topic."""
        return self._inner.topics

    @property
    def seconds(self) -> float:
        """Time from the first message to the last, s."""
        return (self._inner.end_ns - self._inner.start_ns) * 1e-9

    @property
    def counts(self) -> Dict[str, int]:
        """Number of unreadable messages so far, by reason."""
        return self._inner.counts

    def __iter__(self) -> Iterator[Recorded]:
        self._inner.rewind()
        read = 0
        while True:
            found = self._inner.next()
            if found is None:
                break
            read += 1
            yield Recorded(*found)
        self._say_what_was_left_out(read)

    def _say_what_was_left_out(self, read: int) -> None:
        problem = self._inner.problem
        if not problem:
            return
        if read == 0:
            if self._inner.other_version:
                raise OtherVersion(
                    f"no message of {self.path} can be read: {problem}; it was recorded by another "
                    "version of Perdure (or is damaged): read it with that version's package"
                )
            raise Unusable(f"no message of {self.path} can be read: {problem}")
        warnings.warn(f"{self.path}: left out {self.counts}; first: {problem}", stacklevel=3)


def read(path, topics: Sequence[str] = ()) -> Recording:
    """The messages of a recording, a file or a folder of segments, in the order of their times::

        for topic, time_ns, message in perdure.read("run.mcap", topics=["objects"]):
            print(message.stamp.time_ns, len(message))

    Unreadable messages are omitted and counted, and a warning at the end reports them.

    Raises Missing, Unusable, OtherVersion, UnknownTopic (with the topics of the recording).
    """
    return Recording(path, topics)
