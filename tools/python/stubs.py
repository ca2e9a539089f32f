#!/usr/bin/env python3
"""Writes the type hints that follow from the topics: perdure/*.pyi.

usage: PYTHONPATH=build/release/python tools/python/stubs.py [--check]
--check writes nothing, and exits with status 1 if they are out of date.
"""
import inspect
import pathlib
import sys

sys.path.pop(0)  # the sources beside this file have no compiled module
from perdure import bus, messages  # noqa: E402

FOLDER = pathlib.Path(__file__).parent / "perdure"
HEAD = "# Made by tools/python/stubs.py of the topics' description; do not edit.\n"
REST = HEAD.replace("Made", "The rest is made")


def by_hand(name):
    """The part of a file that is not generated."""
    text = (FOLDER / name).read_text(encoding="utf-8")
    return text[: text.index(REST)] + REST


def member(name, value):
    """A property or method of a class, with its docstring."""
    if isinstance(value, property):
        doc = (value.fget.__doc__ or "").strip().split("\n")[0]
        hint = value.fget.__annotations__["return"]
        lines = [f"    @property\n    def {name}(self) -> {hint}: ...  # {doc}"]
        if value.fset:
            lines.append(f"    @{name}.setter\n    def {name}(self, value: Any) -> None: ...")
        return lines
    if not callable(value) or name == "_set_defaults":
        return []
    given = ", ".join(f"{p}: Any" if p != "self" else p for p in inspect.signature(value).parameters)
    return [f"    def {name}({given}) -> {value.__annotations__['return']}: ..."]


def class_text(name, fields):
    mixin = messages._MIXINS.get(name)
    lines = [f"class {name}(Message):"]
    hints = dict.fromkeys(f[0] for f in fields)
    for field in fields:
        if mixin is None or not hasattr(mixin, field[0]):
            hints[field[0]] = messages.hint_of(field)
    for field in fields:
        if hints.get(field[0]):
            said = messages.line_of(name, field).split(": ", 1)[1]
            lines.append(f"    {field[0]}: {hints.pop(field[0])}  # {said}")
    for base in reversed(mixin.__mro__[:-1] if mixin else []):
        for key, value in vars(base).items():
            if not key.startswith("__") or key in ("__getitem__", "__iter__", "__len__", "__matmul__"):
                lines += member(key, value)
    return "\n".join(lines) + "\n"


OPTIONS = "*, timeout: Optional[float] = ..., count: Optional[int] = ..., gone: bool = ..., **settings: Any"


def bus_text():
    lines = [by_hand("bus.pyi")]
    for topic, name in bus.topics().items():
        if topic.endswith("/"):
            continue  # an unknown name, covered by the overload for str
        lines.append(
            f'@overload\ndef subscribe(topic: Literal["{topic}"], {OPTIONS}) -> '
            f"Subscription[messages.{name}]: ...\n"
        )
    lines.append(f"@overload\ndef subscribe(topic: str, {OPTIONS}) -> Subscription[Any]: ...\n")
    lines.append(
        f"@overload\ndef subscribe(topic: str, *more: str, {OPTIONS[3:]}) -> "
        "Subscription[Tuple[str, Any]]: ...\n"
    )
    return "".join(lines)


def messages_text():
    return by_hand("messages.pyi") + "\n".join(class_text(n, f) for n, f in messages.SCHEMA.items())


def package_text():
    """Type hints for the names that perdure/__init__.py creates at run time."""
    source = (FOLDER / "__init__.py").read_text(encoding="utf-8")
    imports = source[source.index("from .bus") : source.index("globals()")]
    kept = [i for i in imports.split("from ")[1:] if "_CLASSES" not in i]
    lines = [HEAD]
    for part in kept:
        module, names = part.split(" import ", 1)
        for name in names.replace("(", "").replace(")", "").replace(",", " ").split():
            lines.append(f"from {module} import {name} as {name}\n")
    lines += [f"from .messages import {name} as {name}\n" for name in messages.CLASSES]
    lines.append("\n__version__: str\n")
    return "".join(lines)


def main():
    stale = []
    made = {
        "__init__.pyi": package_text(),
        "bus.pyi": bus_text(),
        "messages.pyi": messages_text(),
    }
    for name, text in made.items():
        path = FOLDER / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if "--check" not in sys.argv:
                path.write_text(text, encoding="utf-8")
    if stale and "--check" in sys.argv:
        sys.exit(f"{', '.join(stale)} are not up to date: {inspect.getdoc(sys.modules[__name__])}")
    print("made " + ", ".join(stale) if stale else "up to date")


if __name__ == "__main__":
    main()
