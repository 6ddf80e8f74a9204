"""TOML and JSON that somebody else wrote: so deep, so large a number, so long a text, and no more.

Readers call themselves for each level, and keep a copy of a dotted key for each of its parts: a file of 60 kB can take
gigabytes. So depth is counted before one is called.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from flysim.errors import FlysimError
from flysim.foreign.files import read_text
from flysim.plain import shown, shown_path

MAX_DEPTH = 32  # tables and lists within each other, and parts of a dotted key
MAX_TEXT = 10_000  # characters of one string
BITS = 63  # of a whole number beside its sign

# Both take an unfinished string to its end, so that no text is looked through twice.
_JSON_STRING = re.compile(r'"(?:[^"\\]++|\\.)*+"?', re.DOTALL)
_TOML_STRING = re.compile(
    r'"""(?:[^"\\]++|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']++|'(?!''))*+(?:''')?"
    r'|"(?:[^"\\\n]++|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
OPENING, CLOSING = np.frombuffer(b"[{", np.uint8), np.frombuffer(b"]}", np.uint8)
_LONG_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{MAX_DEPTH}}}")


def parse_toml(text: str) -> dict[str, Any]:
    """The data of a TOML text.

    Raises:
        ValueError: it is none, or it has more than `MAX_DEPTH` levels, a whole number of more than 64 bits or a string
            of more than `MAX_TEXT` characters.
    """
    bare = _TOML_STRING.sub(lambda found: "" if found[0].startswith("#") else "s", text)
    _check_depth(bare)
    if _LONG_KEY.search(bare):
        raise ValueError(f"a key has more than {MAX_DEPTH} parts: flatten it")
    data = tomllib.loads(text)
    check_data(data)
    return data


def parse_json(text: str, *, max_text: int = MAX_TEXT) -> Any:
    """The data of a JSON text: numbers are finite, strings have at most `max_text` characters.

    Raises:
        ValueError: as `parse_toml`.
    """
    _check_depth(_JSON_STRING.sub("s", text))
    data = json.loads(text, parse_constant=_no_number, parse_float=_finite)
    check_data(data, max_text)
    return data


def read_json(path: Path, what: str, limit: int, error: type[FlysimError] = FlysimError) -> Any:
    """The data of a JSON file. `what` names it in errors: "report".

    Raises:
        error: the file cannot be read, is too large, or is not such JSON.
    """
    text = read_text(path, what, limit, error)
    try:
        return parse_json(text)
    except json.JSONDecodeError as refusal:
        reason = f"at line {refusal.lineno}: {refusal.msg}"
    except ValueError as refusal:
        reason = f"in a value: {refusal}"
    raise error(f"{shown_path(path)}: no {what}: it is damaged {reason}.")


def _check_depth(bare: str) -> None:
    letters = np.frombuffer(bare.encode("utf-8", "replace"), np.uint8)
    opens, closes = np.isin(letters, OPENING), np.isin(letters, CLOSING)
    depth = np.cumsum(opens.astype(np.int32) - closes)
    if depth.max(initial=0) > MAX_DEPTH:
        raise ValueError(f"lists or tables are nested deeper than {MAX_DEPTH}: flatten them")


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


def _finite(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError(f"{shown(word)} is larger than any number can be")
    return value


def _problem(data: Any, max_text: int) -> str:
    """What of the data no reader of flysim could use, by the key it stands under; empty where there is nothing."""
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            if problem := _problem(value, max_text):
                return f"{key}{problem if problem.startswith(': ') else '.' + problem}"
    elif isinstance(data, int) and not -(2**BITS) <= data < 2**BITS:
        return f": a whole number of more than {BITS + 1} bits"
    elif isinstance(data, str) and len(data) > max_text:
        return f": a text of {len(data)} characters, at most {max_text} are read"
    return ""


def check_data(data: Any, max_text: int = MAX_TEXT) -> None:
    """Refuses, with a ValueError, a whole number of more than 64 bits and a text longer than `max_text`."""
    if problem := _problem(data, max_text):
        raise ValueError(problem.removeprefix(": "))
