"""What a model of a stranger may read: files of its own folder, and none outside it."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from ers_mj.errors import InputError

FOLDERS = ("meshdir", "texturedir", "assetdir")
MOST_COPIES = 20_000
COPIED = ("replicate", "composite", "flexcomp")
NESTED = ("worldbody", "body", "frame", *COPIED)
DEEPEST = 100  # parts within one another, and files that include one another


def parsed(path: Path) -> ElementTree.Element:
    """The root of an XML file.

    Raises:
        InputError: it is none.
    """
    try:
        return ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError, UnicodeError, LookupError, ValueError) as error:
        raise InputError(f"{path}: is not XML ({str(error)[:120]})") from None


def refuse_outside(path: Path, root: ElementTree.Element) -> None:
    """Raise InputError where a model, or what it includes, names a file that is not in its folder: by an absolute path,
    by one that goes up, or by a link that leads out.
    """
    _refuse(path, root, path.parent.resolve(), 0)


def _refuse_many(path: Path, root: ElementTree.Element) -> None:
    """Raise InputError where a few words of a model stand for more bodies than can be built."""
    if (count := _copies(root)) > MOST_COPIES:
        what = "is nested too deep" if math.isinf(count) else f"stands for {count:.3g} copies of its parts"
        raise InputError(f"{path}: {what}, at most {MOST_COPIES} copies and {DEEPEST} levels were expected")


def _copies(element: ElementTree.Element, depth: int = 0) -> float:
    """How many parts an element stands for, at least; no end of them where it is nested beyond reason."""
    try:
        own = math.prod(max(float(x), 1.0) for x in element.get("count", "1").split())
    except ValueError:
        own = 1.0
    within = sum(_copies(part, depth + 1) for part in element if part.tag in NESTED) if depth < DEEPEST else math.inf
    return (own if element.tag in COPIED else 1.0) * max(within, 1.0)


def _refuse(path: Path, root: ElementTree.Element, home: Path, depth: int) -> None:
    if depth > DEEPEST:
        raise InputError(f"{path}: models that include one another more than {DEEPEST} deep are not read")
    _refuse_many(path, root)
    folders = [""]
    for element in root.iter():
        for key, said in _paths(element):
            where = f"{path}: <{element.tag} {key}={said[:60]!r}>"
            parts = re.split(r"[/\\]", said)
            if os.path.isabs(said) or said.startswith("\\") or ":" in parts[0] or ".." in parts:
                raise InputError(f"{where} is outside the model's folder, which is all that is read")
            folders += [said] if key in FOLDERS else []
            for folder in folders:
                if not (home / folder / said).resolve().is_relative_to(home):
                    raise InputError(f"{where} is a link out of the model's folder, which is all that is read")
        if element.tag == "include" and (further := home / element.get("file", "")).is_file():
            _refuse(further, parsed(further), home, depth + 1)


def _paths(element: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """The attributes of an element that name files or folders."""
    return ((key, said) for key, said in element.items() if key.startswith("file") or key in FOLDERS)
