"""Somebody else's text in ours: printable, short, on one line.

What a file, a folder or a command line holds may be anything: escape sequences that drive a terminal, characters that
turn the writing round or take no room, a megabyte without a space.
"""

from __future__ import annotations

import re
from pathlib import Path

LINE = 290  # characters of an error; with "flysim: " before it a line has less than 300
MAX_PATH = 120  # characters of a path in an error
_LONG = re.compile(rf"\S{{{MAX_PATH + 10},}}")  # a path, with quotes and a colon perhaps, is no longer


def plain(text: str) -> str:
    """The text with a `?` for each character that is not printable: controls, line ends, marks of direction."""
    return text if text.isprintable() else "".join(c if c.isprintable() else "?" for c in text)


def shortened(text: str, most: int = LINE) -> str:
    """A text of at most so many characters: of a longer one the middle goes."""
    if len(text) <= most:
        return text
    end = (most - 3) // 3
    return f"{text[: most - 3 - end]}...{text[-end:]}"


def one_line(text: str) -> str:
    """An error's text: printable, and of at most `LINE` characters; what no space divides gives way first."""
    return plain(shortened(_LONG.sub(lambda word: shortened(word[0], MAX_PATH), text)))


def shown(text: str) -> str:
    """A quoted, printable, single-line and short form of somebody else's text."""
    return f"'{plain(text[:80])}{'...' if len(text) > 80 else ''}'"


def shown_path(path: str | Path) -> str:
    """A path on one line, whatever characters are in it; of a very long one the end."""
    text = plain(str(path))
    return text if len(text) <= MAX_PATH else f"...{text[3 - MAX_PATH :]}"
