"""A table as text, for whoever prints it."""

from __future__ import annotations

from dataclasses import dataclass

NOTHING = "-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """A title, the columns' names, and rows of as many cells; what they mean below it.

    `left` are the columns whose text begins at their left edge; figures end at the right one.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    left: tuple[int, ...] = (0,)


def number(value: float | None, digits: int = 1) -> str:
    """A figure as a cell has it."""
    return NOTHING if value is None else f"{value:.{digits}f}"


def percent(share: float | None) -> str:
    """A share as a cell has it."""
    return NOTHING if share is None else f"{100.0 * share:.1f} %"
