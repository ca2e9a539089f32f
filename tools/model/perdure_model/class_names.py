"""Class names from a user's file or list, or from the network's metadata."""

import ast
import os
import re
import unicodedata
from pathlib import Path

from .faults import DATA, UNAVAILABLE, USAGE, Fault

UNUSED = ("n/a", "???")  # unused numbers in COCO's list of 91
SAVE = "save the file as UTF-8"


def names_of(text):
    """Returns names from a file with one name per line, or from a list with commas."""
    if os.path.isfile(text):  # also False for a list that is too long for a path
        return distinct(names_of_lines(text, decoded(text)))
    if not ("," in text or not ("/" in text or text.endswith((".txt", ".names")))):
        raise Fault(f"the file of class names {text} is missing; give a file with a name a line, or names with commas "
                    "between", UNAVAILABLE)
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise Fault(f"--classes {text} holds an empty name; give a name for each class of the network", USAGE)
    refuse_repeated("--classes", "the names", list(enumerate(names, 1)), USAGE)
    return distinct(names)


def decoded(path):
    try:
        content = Path(path).read_bytes()
    except OSError as e:
        raise Fault(f"the file of class names {path} cannot be read ({e.strerror}); is it yours?", UNAVAILABLE)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in content:
        raise Fault(f"{path} is not UTF-8 but UTF-16, or no text; {SAVE}", DATA)
    try:
        return content.decode("utf-8-sig")  # skips a byte-order mark
    except UnicodeDecodeError as e:
        line = e.object.count(b"\n", 0, e.start) + 1
        raise Fault(f"{path}:{line} is not UTF-8 (byte 0x{e.object[e.start]:02x}); {SAVE}", DATA)


def names_of_lines(path, text):
    lines = [(n, line.strip(" \t")) for n, line in enumerate(re.split("\r\n|\n|\r", text), 1)]
    named = [(n, name) for n, name in lines if name]
    for n, name in named:
        for c in name:
            if unicodedata.category(c) in ("Cc", "Zl", "Zp") or c == "\ufeff":
                raise Fault(f"{path}:{n} holds the control character U+{ord(c):04X}; remove it: a name is plain text",
                            DATA)
    if not named:
        raise Fault(f"{path} holds no names; give a name a line, for each class of the network", DATA)
    refuse_repeated(path, "lines", named, DATA)
    return [name for _, name in named]


def refuse_repeated(where, what, named, status):
    first, repeated = {}, []
    for n, name in named:
        if name.lower() in UNUSED:
            continue
        if name.lower() in first:
            repeated.append((first[name.lower()], n, name.lower()))
        first.setdefault(name.lower(), n)
    if repeated:
        a, b, name = repeated[0]
        more = f", and {len(repeated) - 1} more names repeat" if len(repeated) > 1 else ""
        raise Fault(f"{where}: {what} {a} and {b} are both {name}{more}; give each class a name of its own, in the "
                    "network's order", status)


def distinct(names):
    """Appends its index to each repeated name: n/a-12 and so on."""
    lower = [name.lower() for name in names]
    return [n if lower.count(n) == 1 else f"{n}-{i}" for i, n in enumerate(lower)]


def names_in(graph):
    """Returns the class names that Ultralytics stores in the file."""
    try:
        names = ast.literal_eval(graph.metadata["names"])
        return distinct([str(names[i]) for i in sorted(names)] if isinstance(names, dict) else [str(n) for n in names])
    except (KeyError, ValueError, SyntaxError, TypeError):
        return None
