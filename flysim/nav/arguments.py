"""What the environment's arguments may be."""

from __future__ import annotations

import math
from typing import Any

from flysim.errors import did_you_mean


def one_of(name: str, value: str, known: Any) -> None:
    """Refuses, with a ValueError, a word that is not known."""
    if value not in known:
        raise ValueError(f"no {name} {value!r}. {did_you_mean(str(value), known)}")


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
