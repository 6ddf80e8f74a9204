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
_BRACKET = re.compile(r"[][{}]")
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
    _check(data, "")
    return data


def parse_json(text: str) -> Any:
    """The data of a JSON text: numbers are finite.

    Raises:
        ValueError: as `parse_toml`.
    """
    _check_depth(_JSON_STRING.sub("s", text))
    data = json.loads(text, parse_constant=_no_number, parse_float=_finite)
    _check(data, "")
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
    depth = 0
    for bracket in _BRACKET.finditer(bare):
        depth += 1 if bracket[0] in "[{" else -1
        if depth > MAX_DEPTH:
            raise ValueError(f"lists or tables are nested deeper than {MAX_DEPTH}: flatten them")


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is no number")


def _finite(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError(f"{shown(word)} is larger than any number can be")
    return value


def _check(data: Any, key: str) -> None:
    """Refuses, by the key it stands under, what no reader of flysim could use."""
    if isinstance(data, dict):
        for name, value in data.items():
            _check(value, f"{key}.{name}" if key else name)
    elif isinstance(data, list):
        for index, value in enumerate(data):
            _check(value, f"{key}.{index}" if key else str(index))
    elif isinstance(data, int) and not -(2**BITS) <= data < 2**BITS:
        raise ValueError(f"{key}: a whole number of more than {BITS + 1} bits")
    elif isinstance(data, str) and len(data) > MAX_TEXT:
        raise ValueError(f"{key}: a text of {len(data)} characters, at most {MAX_TEXT} are read")
