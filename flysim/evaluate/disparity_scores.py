"""How good matches are where the true disparity of pixels is known, by the rules of the field's benchmarks.

Shares within a tolerance are Middlebury's (bad-T is what is left of them), D1 is KITTI 2015's: an error of more than 3
px and 5 % of the truth. Flies and dense matchers are judged by the same function.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array

TOLERANCES = (0.5, 1.0, 2.0, 3.0)  # [px]
D1_PX, D1_SHARE = 3.0, 0.05
CELL = 16  # [px] side of the cells of which coverage is the share
TEXTURED = 3.0  # [grey levels] deviation along its rows from which on a cell is textured
MOSTLY = 0.5  # share of a cell's pixels whose truth must be known


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DisparityTruth:
    """What the true disparities of a left picture are.

    Attributes:
        disparity: `[H, W]` float32 u_left - u_right [px]; NaN where nobody knows.
        seen: `[H, W]` bool, whether the right camera sees the pixel as well.
    """

    disparity: NDArray[np.float32]
    seen: NDArray[np.bool_]

    @classmethod
    def of(cls, disparity: NDArray[np.float32], seen: NDArray[np.bool_] | None = None) -> DisparityTruth:
        """The truth of a map; what is hidden is worked out where no mask of it is given."""
        known = np.isfinite(disparity)
        return cls(disparity=disparity, seen=known & (not_hidden(disparity) if seen is None else seen))


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Errors over some pixels; shares are of the `count` that have a truth, None where there are none.

    Attributes:
        count: matches that have a truth.
        within_0_5px, within_1px, within_2px, within_3px: share that is nearer to it.
        median_px: median error [px].
        d1: share that is off by more than 3 px and 5 %.
        median_m, median_rel: median error of depth [m], and as a share of it; None where nothing is metric.
    """

    count: int
    within_0_5px: float | None = None
    within_1px: float | None = None
    within_2px: float | None = None
    within_3px: float | None = None
    median_px: float | None = None
    d1: float | None = None
    median_m: float | None = None
    median_rel: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchScores:
    """How good an engine's matches are.

    Attributes:
        engine: its name.
        seen: over pixels that both cameras see.
        everywhere: over all with a truth.
        matches: how many there are, with a truth or without.
        density: share of the pixels that both cameras see which have a match, of a dense engine; None of flies.
        coverage: share of the textured cells that hold a match; None where none is textured.
        ms: wall-clock milliseconds.
    """

    engine: str
    seen: Accuracy
    everywhere: Accuracy
    matches: int
    density: float | None
    coverage: float | None
    ms: float

    def to_json(self) -> dict[str, Any]:
        """Figures over pixels that both cameras see; under `all_pixels` those over all."""
        return {
            **_told(self.seen),
            "coverage": _short(self.coverage),
            **({} if self.density is None else {"density": _short(self.density)}),
            "count": self.matches,
            "ms": round(self.ms, 2),
            "all_pixels": _told(self.everywhere),
        }


def score_points(
    uv: NDArray, disparity: NDArray[np.floating], truth: DisparityTruth, gain: float, offset: float
) -> tuple[Accuracy, Accuracy]:
    """Accuracy of matches at left pixels: over those that both cameras see, and over all.

    Args:
        uv: `[N, 2]` left pixels.
        disparity: `[N]` theirs [px].
        truth: of the picture.
        gain: depth is gain / (disparity - offset) [m]; 0 where nothing is metric.
        offset: [px] what the principal points differ by, cx of the left less cx of the right.
    """
    height, width = truth.disparity.shape
    u, v = (np.rint(at).astype(np.int64) for at in np.reshape(uv, (-1, 2)).T)
    inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    u, v, disparity = u[inside], v[inside], np.asarray(disparity, np.float64)[inside]
    true = truth.disparity[v, u].astype(np.float64)
    seen = truth.seen[v, u]
    return _accuracy(disparity[seen], true[seen], gain, offset), _accuracy(disparity, true, gain, offset)


def score_map(
    disparity: NDArray[np.floating], truth: DisparityTruth, gain: float, offset: float
) -> tuple[Accuracy, Accuracy, float]:
    """The same of a dense matcher's valid pixels, and the share of the pixels that both cameras see which it gives."""
    valid = np.isfinite(disparity)
    v, u = np.nonzero(valid)
    uv = np.stack([u, v], axis=1)
    density = float(valid[truth.seen].mean()) if truth.seen.any() else math.nan
    return (*score_points(uv, disparity[v, u], truth, gain, offset), density)


def _accuracy(disparity: Array, true: Array, gain: float, offset: float) -> Accuracy:
    known = np.isfinite(true) & np.isfinite(disparity)
    disparity, true = disparity[known], true[known]
    if not len(true):
        return Accuracy(count=0)
    error = np.abs(disparity - true)
    shares = [float((error <= tolerance).mean()) for tolerance in TOLERANCES]
    median_m = median_rel = None
    if gain > 0.0:
        with np.errstate(divide="ignore", invalid="ignore"):
            depth, truly = gain / (disparity - offset), gain / (true - offset)
        off = np.abs(depth - truly)[np.isfinite(depth) & np.isfinite(truly) & (truly > 0.0)]
        rel = (np.abs(depth - truly) / truly)[np.isfinite(depth) & np.isfinite(truly) & (truly > 0.0)]
        median_m, median_rel = (float(np.median(one)) if len(one) else None for one in (off, rel))
    return Accuracy(
        count=len(true),
        within_0_5px=shares[0],
        within_1px=shares[1],
        within_2px=shares[2],
        within_3px=shares[3],
        median_px=float(np.median(error)),
        d1=float(((error > D1_PX) & (error > D1_SHARE * np.abs(true))).mean()),
        median_m=median_m,
        median_rel=median_rel,
    )


def textured_cells(left: NDArray[np.uint8], truth: DisparityTruth | None = None) -> NDArray[np.bool_]:
    """`[rows, columns]` whether a cell varies along its rows, and most of it has a truth that both cameras see.

    Cells that the picture's border cuts are left out.
    """
    grey = _cells(left.mean(axis=2))
    textured = np.sqrt(grey.var(axis=3).mean(axis=1)) > TEXTURED
    if truth is None:
        return textured
    return textured & (_cells(truth.seen.astype(np.float64)).mean(axis=(1, 3)) >= MOSTLY)


def coverage(textured: NDArray[np.bool_], uv: NDArray) -> float | None:
    """Share of the textured cells in which there is a match; None where no cell is textured."""
    u, v = np.rint(np.reshape(uv, (-1, 2))).astype(np.int64).T // CELL
    inside = (v < textured.shape[0]) & (u < textured.shape[1]) & (u >= 0) & (v >= 0)
    held = np.zeros_like(textured)
    held[v[inside], u[inside]] = True
    return float(held[textured].mean()) if textured.any() else None


def not_hidden(disparity: NDArray[np.float32]) -> NDArray[np.bool_]:
    """`[H, W]` which left pixels of a true disparity map the right camera sees: nothing nearer falls on their place."""
    height, width = disparity.shape
    v, u = np.nonzero(np.isfinite(disparity))
    d = disparity[v, u].astype(np.float64)
    there = np.rint(u - d).astype(np.int64)
    inside = (there >= 0) & (there < width)
    nearest = np.full((height, width + 2), -np.inf)
    for step in (-1, 0, 1):  # a surface that faces the right camera less has gaps there
        np.maximum.at(nearest, (v[inside], there[inside] + 1 + step), d[inside] - abs(step))
    seen = np.zeros(disparity.shape, np.bool_)
    seen[v[inside], u[inside]] = d[inside] >= nearest[v[inside], there[inside] + 1] - 1.0
    return seen


def _cells(image: NDArray) -> NDArray:
    rows, columns = image.shape[0] // CELL, image.shape[1] // CELL
    return image[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL)


def _short(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, 5)


def _told(of: Accuracy) -> dict[str, Any]:
    names = ("within_0_5px", "within_1px", "within_2px", "within_3px", "median_px", "d1", "median_m", "median_rel")
    return {**{name: _short(getattr(of, name)) for name in names}, "scored": of.count}
