"""Tables that fit the width there is: no figure is broken, whatever the width.

A table that is too wide is laid out another way, the first that fits: its headings over several lines; its columns of
text too; turned, so that each row is a column, as many side by side as fit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from flysim.common.sheet import Sheet

GAP = 2  # [characters] between two columns
LEAST_TEXT = 24  # of a column of text that is broken into lines


class Laid(NamedTuple):
    """A table as it is printed, and the width of each column; None: as wide as there is room."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    widths: tuple[int | None, ...]
    left: tuple[int, ...]


def fitted(sheet: Sheet, width: int) -> list[Laid]:
    """The table or tables that a sheet becomes on lines of `width` characters."""
    cells = [max((len(row[i]) for row in sheet.rows), default=0) for i in range(len(sheet.columns))]
    whole = [max(len(name), cell) for name, cell in zip(sheet.columns, cells, strict=True)]
    folded = [max(_longest_word(name), cell) for name, cell in zip(sheet.columns, cells, strict=True)]
    for widths in (whole, folded):
        if _total(widths) <= width:
            return [Laid(sheet.columns, sheet.rows, tuple(widths), sheet.left)]
    text = [i for i in sheet.left if i and folded[i] > LEAST_TEXT]
    if text and _total([LEAST_TEXT if i in text else w for i, w in enumerate(folded)]) <= width:
        widest = max(text, key=lambda i: folded[i])
        room = width - _total([0 if i in text else w for i, w in enumerate(folded)])
        for i in text:
            folded[i] = LEAST_TEXT
        folded[widest] = room - LEAST_TEXT * (len(text) - 1)
        return [Laid(sheet.columns, sheet.rows, tuple(folded), sheet.left)]
    return list(_turned(sheet, width))


def _turned(sheet: Sheet, width: int) -> Iterator[Laid]:
    label = max(map(len, sheet.columns))
    rows = list(sheet.rows)
    while rows:
        count = next((n for n in range(len(rows), 1, -1) if _total(_widths(label, rows[:n])) <= width), 1)
        some, rows = rows[:count], rows[count:]
        widths: list[int | None] = list(_widths(label, some))
        alone = _total(_widths(label, some)) > width  # a text that must be broken into lines
        if alone:
            widths[1] = max(width - GAP - label, 1)
        turned = tuple(zip(*some, strict=True))
        body = tuple((name, *cells) for name, cells in zip(sheet.columns[1:], turned[1:], strict=True))
        yield Laid((sheet.columns[0], *turned[0]), body, tuple(widths), (0, 1) if alone else (0,))


def _widths(label: int, rows: Sequence[Sequence[str]]) -> list[int]:
    return [label, *(max(map(len, row)) for row in rows)]


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _longest_word(text: str) -> int:
    return max(map(len, text.split()), default=0)
