"""OpenCV's FileStorage as somebody else wrote it: YAML, XML or JSON, its matrices and its plain values.

Read without OpenCV: its reader takes sizes from the file at their word. What it writes has one form, which is all that
is read here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.foreign.data import parse_json
from flysim.plain import shown

MAX_BYTES = 2**26  # two maps of a megapixel as text
MAX_ELEMENTS = 2**24  # of one matrix
_HEAD = re.compile(r"^[ \t]*\"?([A-Za-z_][\w.\-]{0,80})\"?[ \t]*:[ \t]*(.*?)[ \t]*$", re.MULTILINE)
_MATRIX = re.compile(
    r"!!opencv-(?:nd-)?matrix[ \t]*\n"
    r"\s*(?:rows:[ \t]*(\d{1,7})\s*\n\s*cols:[ \t]*(\d{1,7})|sizes:[ \t]*\[([\d, ]{1,40})\])[ \t]*\n"
    r"\s*dt:[ \t]*\"?([\w()]{1,12})\"?[ \t]*\n\s*data:[ \t]*\[([^][]*)\]"
)
_KIND = re.compile(r"(\d{0,3})[a-z]")

Storage = dict[str, Any]  # name -> [rows, cols] or [rows, cols, channels] float64, number or text


def parse_storage(text: str) -> Storage:
    """The matrices and values of a FileStorage by their names.

    Raises:
        ValueError: it is none, or a matrix is not of the size it states.
    """
    start = text.lstrip()[:400]
    if start.startswith("<"):
        return dict(_xml(text))
    if start.startswith("{"):
        data = parse_json(text)
        return {name: _of_json(name, value) for name, value in data.items()} if isinstance(data, dict) else {}
    return dict(_yaml(text))


def _yaml(text: str) -> Iterator[tuple[str, Any]]:
    at = 0
    while (head := _HEAD.search(text, at)) is not None:
        name, value = head[1], head[2]
        at = head.end() + 1
        if value.startswith(("!!opencv-matrix", "!!opencv-nd-matrix")):
            found = _MATRIX.match(text, head.start(2))
            if found is None:
                raise ValueError(f"{shown(name)} is no matrix as OpenCV writes them")
            sizes = found[3].replace(",", " ").split() if found[3] else [found[1], found[2]]
            yield name, _matrix(name, sizes, found[4], found[5].replace(",", " ").split())
            at = found.end()
        elif value.startswith("["):
            end = text.find("]", head.start(2))
            if end < 0:
                raise ValueError(f"{shown(name)} has no end")
            yield name, text[head.start(2) + 1 : end].replace(",", " ").split()
            at = end + 1
        elif value:
            yield name, value.strip("\"'")


def _xml(text: str) -> Iterator[tuple[str, Any]]:
    from xml.etree.ElementTree import ParseError

    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import fromstring

    try:
        root = fromstring(text, forbid_dtd=True)
    except (ParseError, DefusedXmlException, ValueError) as refusal:
        raise ValueError(f"it is no XML: {shown(str(refusal) or type(refusal).__name__)}") from None
    for child in root:
        words = {part.tag: (part.text or "").strip() for part in child}
        if {"dt", "data"} <= words.keys() and words.keys() & {"rows", "sizes"}:
            sizes = words["sizes"].split() if "sizes" in words else [words["rows"], words.get("cols", "")]
            name = str(child.tag)
            yield name, _matrix(name, sizes, words["dt"].strip('"'), words["data"].split())
        else:
            yield str(child.tag), (child.text or "").strip()


def _of_json(name: str, value: Any) -> Any:
    if isinstance(value, dict) and {"dt", "data"} <= value.keys() and isinstance(value["data"], list):
        given = value["sizes"] if isinstance(value.get("sizes"), list) else [value.get("rows"), value.get("cols")]
        return _matrix(name, list(map(str, given)), str(value["dt"]), list(map(str, value["data"])))
    return value


def _matrix(name: str, sizes: list[str], kind: str, words: list[str]) -> NDArray[np.float64]:
    of = _KIND.fullmatch(kind)
    if of is None or not all(size.isdecimal() and len(size) <= 7 for size in sizes) or not 1 <= len(sizes) <= 3:
        raise ValueError(f"{shown(name)} has no size, or no type of numbers that is known")
    channels = int(of[1] or 1)
    shape = (*map(int, sizes), *([channels] if channels > 1 else []))
    if math.prod(shape) != len(words) or len(words) > MAX_ELEMENTS:
        raise ValueError(f"{shown(name)} holds {len(words)} numbers, not {' x '.join(map(str, shape))}")
    try:
        values = np.array(words, np.float64)
    except ValueError:
        values = np.array([np.nan])
    if not np.isfinite(values).all():
        raise ValueError(f"{shown(name)} holds what is no finite number")
    return values.reshape(shape)
