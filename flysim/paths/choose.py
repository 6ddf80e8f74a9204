"""Few views that together show much: chosen greedily, the one that adds most first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.paths.outlook import Outlook
from flysim.paths.target import BANDS, SECTORS, Targets

AGAIN = 0.35  # of a first look's worth is in a second one at the same side
LEAST_GAIN = 0.12  # [m] of outline, seen well, that a further stop has to add
SEEN = 0.5  # share of a side's points that must be shown for the side to count as seen


def cover(
    views: Outlook,
    taken: Sequence[tuple[Outlook, int]],
    weight: Array,
    *,
    most: int,
    least: float = LEAST_GAIN,
    allowed: NDArray[np.bool_] | None = None,
) -> list[int]:
    """Indices of at most `most` views, beside those `taken` anyway, in the order they were chosen.

    Args:
        views: to choose from.
        taken: views of any outlook on the same targets.
        weight: `[n]` of each target [m]; 0 leaves it out.
        most: stops.
        least: [m] of outline, seen well, that a view has to add.
        allowed: `[v]` which views may be taken; all, if it is None.
    """
    worth = np.repeat(weight, BANDS) / BANDS
    best, second = np.zeros(len(worth), np.float32), np.zeros(len(worth), np.float32)
    for other, view in taken:
        _take(*other.entries(view), best, second)
    row = np.repeat(np.arange(len(views.xy)), np.diff(views.starts))
    kept = worth[views.columns] > 0.0
    if allowed is not None:
        kept &= allowed[row]
    row, c, q = row[kept], views.columns[kept], views.quality[kept]
    w = worth[c].astype(np.float32)
    some, first = np.unique(row, return_index=True)
    chosen: list[int] = []
    while len(chosen) < min(most, len(some)):
        b, s = best[c], second[c]
        gain = np.maximum(q - b, 0.0) + AGAIN * (np.maximum(s, np.minimum(b, q)) - s)
        total = np.add.reduceat(gain * w, first)
        k = int(np.argmax(total))
        if total[k] < least:
            break
        chosen.append(int(some[k]))
        _take(*views.entries(chosen[-1]), best, second)
    return chosen


def _take(
    columns: NDArray[np.intp], quality: NDArray[np.float32], best: NDArray[np.float32], second: NDArray[np.float32]
) -> None:
    second[columns] = np.maximum(second[columns], np.minimum(best[columns], quality))
    best[columns] = np.maximum(best[columns], quality)


def sides_seen(targets: Targets, shown: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """`[k, 8]` which sides each obstacle has, and which of them are seen.

    Args:
        targets: the obstacles' outlines.
        shown: `[n]` whether a point of them was seen.
    """
    key = targets.obstacle * SECTORS + targets.sector
    size = len(targets.names) * SECTORS
    points = np.bincount(key, minlength=size).reshape(-1, SECTORS)
    hits = np.bincount(key, shown, minlength=size).reshape(-1, SECTORS)
    has = points > 0
    return has, has & (hits >= SEEN * points)


def shown_by(taken: Sequence[tuple[Outlook, int]], count: int) -> NDArray[np.bool_]:
    """`[count]` whether some of the views show a target's foot, middle or top."""
    shown = np.zeros(count * BANDS, dtype=bool)
    for outlook, view in taken:
        shown[outlook.entries(view)[0]] = True
    return np.asarray(shown.reshape(count, BANDS).any(axis=1))
