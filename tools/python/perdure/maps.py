"""The durable map of objects: ``Map``."""

import getpass
import json
import os
import pathlib
import secrets
import shutil
import subprocess
import tempfile
import time
import warnings
from typing import Iterator, List, Optional

import numpy as np

from . import messages
from .bus import Publisher, Subscription
from .errors import Missing, Refused, Unavailable, Unusable

_MOST = 100_000  # limit of objects in a reply


def _files():
    """The module that reads files. It is loaded on first use, because it links Ceres."""
    from . import _map

    if not getattr(_map, "registered", False):
        messages.register(_map)
        _map.registered = True
    return _map


def _command() -> str:
    """The program `perdure`: that of this build folder, or of the installation."""
    built = pathlib.Path(_files().__file__).parents[2] / "bin/perdure"
    found = str(built) if built.exists() else shutil.which("perdure")
    if found is None:
        raise Unavailable("the program perdure is not installed: apt install perdure-tools")
    return found


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return str(os.getuid())


class Map:
    """A map of objects: a file, or that of the running map store.

    ``Map("map.sqlite")`` reads the file of map_store or ``perdure pipeline``, even while a service
    writes to it; every call reads it again. ``Map()`` queries the map store on the bus, with the
    settings of ``perdure.subscribe``. The results equal those of ``perdure map``.

    frame: "M", the consistent frame of the map, without the odometry's drift. For a file also "W":
    as stored, each object in the odometry frame of its session. Positions are in metres in this
    frame.
    patience_s: longest wait for a reply of the map store on the bus.
    """

    def __init__(self, path=None, *, frame="M", patience_s=5.0, **settings) -> None:
        if frame not in ("M", "W"):
            raise Refused(f'frame must be "M" or "W", not {frame!r}')
        if path is None and frame == "W":
            raise Refused('frame="W" reads what is stored: give the map\'s file')
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
        self._lines = {}

    def objects(self) -> List["messages.MapObject"]:
        """All objects, by id."""
        return self._ask(kind="all").objects

    def by_class(self, name: str) -> List["messages.MapObject"]:
        """Objects whose most probable class has this name, by id. Warns if there are none."""
        found = self._ask(kind="by_class", class_name=name).objects
        if not found:
            names = ", ".join(sorted({o.class_name for o in self})) or "none"
            warnings.warn(f"the map has no {name!r}; its classes are: {names}", stacklevel=2)
        return found

    def near(self, place, radius: float) -> List["messages.MapObject"]:
        """Objects whose centre is within ``radius`` m of ``place`` (3,), the nearest first."""
        if not radius >= 0:
            raise Refused(f"radius must be at least 0 m, not {radius!r}")
        return self._ask(kind="by_radius", low=place, radius=radius).objects

    def in_box(self, low, high) -> List["messages.MapObject"]:
        """Objects whose centre is between two corners (3,), m, by id."""
        if np.shape(low) != (3,) or np.shape(high) != (3,):
            raise Refused(f"low and high must have 3 numbers each, not {low!r} and {high!r}")
        corners = np.array([low, high], float)
        return self._ask(kind="by_box", low=corners.min(0), high=corners.max(0)).objects

    def get(self, object_id: int) -> Optional["messages.MapObject"]:
        """The object with this id, or to which it was joined; None if it does not exist."""
        objects = self._ask(kind="by_id", object_id=object_id).objects
        return objects[0] if objects else None

    def belief(self, object_id: int) -> Optional["messages.ObjectBelief"]:
        """The complete belief of an object: every class with its Gaussian, as stored in W, and the
        evidence. None if the object does not exist."""
        beliefs = self._ask(kind="by_id", object_id=object_id).beliefs
        return beliefs[0] if beliefs else None

    def corrections(self) -> List["messages.Correction"]:
        """The standing corrections of people, by id."""
        return self._ask(kind="all").corrections

    def correct(
        self, object_id: int, *, not_there: bool = False, class_name: Optional[str] = None,
        same_as: Optional[int] = None, different_from: Optional[int] = None,
        nats: float = 0.0, author: Optional[str] = None,
    ) -> "messages.Correction":  # fmt: skip
        """States that the map is wrong about an object. Give one of the four statements.

        not_there: it does not exist. class_name: its right class. same_as: it is the same as this
        object. different_from: this object, or a track merged into it, is another one. nats:
        log-likelihood ratio of the statement; 0: the map store's ``corrections.nats``. author: by
        default, the user's name. The result's ``id`` serves to ``withdraw`` it. A file must not be
        in use by a map store; with ``bus.security`` this needs the role ``operator``.
        """
        if [not_there or None, class_name, same_as, different_from].count(None) != 3:
            raise Refused("give one of not_there=True, class_name, same_as, different_from")
        statement = {"kind": "not_there"}
        if class_name is not None:
            statement = {"kind": "class", "class_name": class_name}
        elif not not_there:
            other = different_from if same_as is None else same_as
            statement = {"kind": "same" if same_as is not None else "different", "other": other}
        return self._correct(object=object_id, nats=nats, author=author or _user(), **statement)

    def withdraw(self, correction_id: int) -> "messages.Correction":
        """Takes a correction back. The map is then as if it had not been stated."""
        return self._correct(id=correction_id, withdrawn=True)

    def look(self, poses, *, rig, route=False, step_s=1.0, after_s=0.0, by=()) -> List[dict]:
        """What poses of the body are expected to show, the most bits first: `perdure map look`.

        poses: (N, 4): x, y, z [m] and yaw [rad] in M. rig: the rig file, or a drive with the camera. route:
        evaluate the poses as one route, one each ``step_s``; the result has one entry. after_s:
        seconds after the newest data of the map. by: rank by these parts only, of "existence",
        "class", "position", "unseen". Needs the map's file, and the command `perdure`.
        """
        poses = np.asarray(poses, float)
        if poses.ndim != 2 or poses.shape[1] != 4:
            raise Refused(f"poses must have shape (N, 4), not {poses.shape}")
        if self._path is None:
            raise Refused("look() reads the map's file: give it to Map()")
        with tempfile.NamedTemporaryFile("w", suffix=".tum") as plan:
            for k, (x, y, z, yaw) in enumerate(poses):
                turn = f"0 0 {np.sin(yaw / 2)} {np.cos(yaw / 2)}"
                plan.write(f"{k * step_s} {x} {y} {z} {turn}\n")
            plan.flush()
            done = subprocess.run(
                [_command(), "map", "look", self._path, "--json", "--rig", os.fspath(rig)]
                + ["--route" if route else "--poses", plan.name, "--most", str(len(poses))]
                + ["--after", str(after_s)]
                + (["--by", ",".join(by)] if by else []),
                capture_output=True, text=True, check=False,
            )  # fmt: skip
        if done.returncode != 0:
            raise Unusable(done.stderr.strip())
        if done.stderr:
            warnings.warn(done.stderr.strip(), stacklevel=2)
        return json.loads(done.stdout)["prospects"]

    def __iter__(self) -> Iterator["messages.MapObject"]:
        return iter(self.objects())

    def __len__(self) -> int:
        return len(self.objects())

    def __contains__(self, item) -> bool:
        """Whether the map has an object with this id, or this object's id."""
        object_id = getattr(item, "id", item)
        return getattr(self.get(object_id), "id", None) == object_id  # not that of a joined one

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

    def _correct(self, **fields):
        if self._path is None:
            request = messages.MapCorrection(correction=messages.Correction(**fields))
            return self._ask_bus(request, "map/correct", Refused).corrections[0]
        words = {"other": {"same": "--same-as", "different": "--different-from"}, "id": "--withdraw",
                 "class_name": "--class", "nats": "--nats", "author": "--author"}  # fmt: skip
        command = [_command(), "map", "correct", "--db", self._path, "--json"]
        command += [str(fields["object"])] if "object" in fields else []
        command += ["--not-there"] if fields.get("kind") == "not_there" else []
        for name in sorted(words.keys() & fields.keys()):
            option = words[name] if name != "other" else words[name][fields["kind"]]
            command += [f"{option}={fields[name]}"] if name != "nats" or fields[name] else []
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            wrong = done.returncode in (1, 64)  # the statement, not the file
            raise (Refused if wrong else Unusable)(done.stderr.strip())
        return messages.Correction(**json.loads(done.stdout)[0])

    def _ask_file(self, query):
        try:
            return _files().ask(self._path, query, self._as_stored)
        except Unavailable as error:
            raise Unusable(str(error)) from None  # the file exists

    def _ask_bus(self, query, topic="map/query", refusal=Unavailable):
        """Repeats the query each half second until a reply arrives, because a request is lost if
        sent before reader and writer are matched."""
        if topic not in self._lines:
            self._lines[topic] = (
                Publisher(topic, **self._settings),
                Subscription(("map/reply",), **self._settings),
            )
        questions, answers = self._lines[topic]
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
                raise refusal(reply.error)
            return reply
        raise Unavailable(
            f"no map store answers within {self._patience_s} s: {answers.why_silent()}; "
            'or read its file: perdure.Map("map.sqlite")'
        )
