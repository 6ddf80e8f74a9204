"""Figures of a record held to their ranges, when the record is made."""

from __future__ import annotations

from dataclasses import fields
from typing import Any


def ranged(record: Any, **ranges: tuple[float, float] | tuple[float, float, str]) -> None:
    """Refuses fields of a record that are no numbers, out of their range, or broken where they count something.

    Args:
        record: a dataclass; a field that is annotated `int` counts, so that 2.5 is refused and True as well.
        ranges: field -> least and greatest value, both allowed, and the unit if there is one.

    Raises:
        ValueError: with the field's name, its range and what was got.
    """
    counts = {field.name for field in fields(record) if field.type in ("int", int)}
    for name, (low, high, *unit) in ranges.items():
        value = getattr(record, name)
        number = isinstance(value, int if name in counts else int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:  # of NaN too
            kind = "a whole number" if name in counts else "a number"
            between = " ".join((f"[{low:g}, {high:g}]", *unit))
            raise ValueError(f"{name} must be {kind} in {between}, got {value!r}")
