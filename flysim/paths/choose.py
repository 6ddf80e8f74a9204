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
    views: Outlook, here: Outlook, weight: Array, *, most: int, allowed: NDArray[np.bool_] | None = None
) -> list[int]:
    """Indices of at most `most` views, beside what is seen from `here`, in the order they were chosen.

    Args:
        views: to choose from.
        here: views that are taken anyway.
        weight: `[n]` of each target [m].
        most: stops.
        allowed: `[v]` which views may be taken; all, if it is None.
    """
    seen = views.seen
    worth = np.repeat(weight, BANDS) / BANDS
    best, second = np.zeros(seen.shape[1], np.float32), np.zeros(seen.shape[1], np.float32)
    for row in range(here.seen.shape[0]):
        _take(here.seen.indices, here.seen.data, here.seen.indptr, row, best, second)
    starts, columns, data = seen.indptr, seen.indices, seen.data
    some = np.flatnonzero(np.diff(starts) > 0)
    if allowed is not None:
        some = some[allowed[some]]
    chosen: list[int] = []
    if not len(some):
        return chosen
    keep = np.zeros(seen.shape[0], dtype=bool)
    keep[some] = True
    entries = np.repeat(keep, np.diff(starts))
    c, q = columns[entries], data[entries]
    first = np.concatenate([[0], np.cumsum(np.diff(starts)[some])[:-1]])
    w = worth[c].astype(np.float32)
    while len(chosen) < most:
        b, s = best[c], second[c]
        gain = np.maximum(q - b, 0.0) + AGAIN * (np.maximum(s, np.minimum(b, q)) - s)
        total = np.add.reduceat(gain * w, first)
        k = int(np.argmax(total))
        if total[k] < LEAST_GAIN:
            break
        chosen.append(int(some[k]))
        _take(columns, data, starts, some[k], best, second)
    return chosen


def _take(columns: NDArray, data: NDArray, starts: NDArray, row: int, best: NDArray, second: NDArray) -> None:
    at, q = columns[starts[row] : starts[row + 1]], data[starts[row] : starts[row + 1]]
    b = best[at]
    second[at] = np.maximum(second[at], np.minimum(b, q))
    best[at] = np.maximum(b, q)


def sides_seen(targets: Targets, shown: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """`[k, 8]` which sides each obstacle has, and which of them are seen.

    Args:
        targets: the obstacles' outlines.
        shown: `[n]` whether a point of them was seen.
    """
    key = targets.obstacle * SECTORS + targets.sector
    size = len(targets.names) * SECTORS
    points, hits = np.bincount(key, minlength=size), np.bincount(key, shown, minlength=size)
    has = points > 0
    return has.reshape(-1, SECTORS), (has & (hits >= SEEN * points)).reshape(-1, SECTORS)


def shown_by(views: Sequence[tuple[Outlook, Sequence[int]]], count: int) -> NDArray[np.bool_]:
    """`[count]` whether some of the picked views show a target's foot, middle or top."""
    shown = np.zeros(count * BANDS, dtype=bool)
    for outlook, rows in views:
        for row in rows:
            shown[outlook.seen.indices[outlook.seen.indptr[row] : outlook.seen.indptr[row + 1]]] = True
    return shown.reshape(count, BANDS).any(axis=1)
