"""What the environment's arguments may be."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

from flysim.errors import did_you_mean


def one_of(name: str, value: str, known: Any) -> None:
    """Refuses, with a ValueError, a word that is not known."""
    if value not in known:
        raise ValueError(f"no {name} {value!r}. {did_you_mean(str(value), known)}")


def ranged(record: Any, **ranges: tuple[float, float]) -> None:
    """Refuses fields of a record that are no numbers, out of their range, or broken where they count something.

    Args:
        record: a dataclass; a field that is annotated `int` counts, so that 2.5 is refused and True as well.
        ranges: field -> least and greatest value, both allowed.

    Raises:
        ValueError: with the field's name, its range and what was got.
    """
    counts = {field.name for field in fields(record) if field.type in ("int", int)}
    for name, (low, high) in ranges.items():
        value = getattr(record, name)
        number = isinstance(value, int if name in counts else int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:  # of NaN too
            kind = "a whole number" if name in counts else "a number"
            raise ValueError(f"{name} must be {kind} in [{low:g}, {high:g}], got {value!r}")


def image_size(size: tuple[int, int]) -> None:
    """Refuses, with a ValueError, what is no size of an image."""
    if (
        not isinstance(size, tuple | list)
        or len(size) != 2
        or not all(isinstance(side, int) and 16 <= side <= 4096 for side in size)
    ):
        raise ValueError(f"size must be two whole numbers of 16 to 4096 px, got {size}")


def numbers(name: str, value: Any, count: int) -> tuple[float, ...] | None:
    """So many finite numbers, or None for None.

    Raises:
        ValueError: it is something else.
    """
    if value is None:
        return None
    try:
        found = tuple(float(v) for v in value)
    except (TypeError, ValueError):
        found = ()
    if len(found) != count or not all(math.isfinite(v) for v in found):
        raise ValueError(f"{name} must be {count} finite numbers, got {value!r}")
    return found
