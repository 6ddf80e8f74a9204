"""How good a match is where the truth of each pixel is known: shares within a tolerance, coverage, flies on a body."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.products.swarm import Swarm
from flysim.studies.bench.scene import Scene, SceneBody

TOLERANCES = (0.5, 1.0)  # [px]
CELL = 16  # [px] side of the cells of which coverage is the share
# [grey levels] standard deviation along its rows from which on a cell is textured: three times what a camera's noise
# of one level makes, so that it is the surface that matches there.
TEXTURED = 3.0
MOSTLY = 0.5  # share of a cell's pixels that both cameras must see
ON_BODY = 1.0  # [px] from the truth a fly may be that is counted on a body


def flies_within(scene: Scene, swarm: Swarm) -> tuple[float, ...]:
    """Share of all flies that are right to each of `TOLERANCES`; one at a pixel without truth is wrong. NaN: no fly."""
    return _within(_fly_errors(scene, swarm))


def dense_within(scene: Scene, disparity: NDArray[np.float32]) -> tuple[float, ...]:
    """Share of a dense matcher's pixels that are right to each of `TOLERANCES`; NaN where it gives none.

    Of the sky, and of what the right camera does not see, it is not asked: the flies are, so the rule favours it.
    """
    asked = np.isfinite(disparity) & scene.seen
    return _within(np.abs(disparity[asked] - scene.disparity[asked]))


def dense_density(scene: Scene, disparity: NDArray[np.float32]) -> float:
    """Share of the pixels that both cameras see for which a dense matcher gives a disparity."""
    return float(np.isfinite(disparity[scene.seen]).mean()) if scene.seen.any() else math.nan


def textured_cells(scene: Scene, *, min_depth: float, max_depth: float) -> NDArray[np.bool_]:
    """`[rows, columns]` whether a cell holds texture that a fly could sit on.

    Its grey levels vary along its rows (the baseline) by more than `TEXTURED`, and most of it shows what both cameras
    see at depths [m] that are searched. Cells that the image's border cuts are left out.
    """
    # The mean of three colours: as good a grey as any to tell texture by, and free of a weighting.
    grey = _cells(scene.pair.left.mean(axis=2))
    deviation = np.sqrt(grey.var(axis=3).mean(axis=1))
    searched = scene.seen & (scene.depth >= min_depth) & (scene.depth <= max_depth)
    return (deviation > TEXTURED) & (_cells(searched).mean(axis=(1, 3)) >= MOSTLY)


def coverage(textured: NDArray[np.bool_], swarm: Swarm) -> float:
    """Share of the textured cells in which at least one fly sits; NaN where no cell is textured."""
    u, v = _pixels(swarm).T // CELL
    inside = (v < textured.shape[0]) & (u < textured.shape[1])
    held = np.zeros_like(textured)
    held[v[inside], u[inside]] = True
    return float(held[textured].mean()) if textured.any() else math.nan


def flies_on(scene: Scene, body: SceneBody, swarm: Swarm) -> int:
    """Flies whose pixel shows a body, at its disparity within `ON_BODY`."""
    u, v = _pixels(swarm).T
    return int(((scene.link[v, u] == body.link) & (_fly_errors(scene, swarm) <= ON_BODY)).sum())


def _cells(image: NDArray) -> NDArray:
    """`[rows, CELL, columns, CELL]` view of the whole cells of an image."""
    rows, columns = image.shape[0] // CELL, image.shape[1] // CELL
    return image[: rows * CELL, : columns * CELL].reshape(rows, CELL, columns, CELL)


def _pixels(swarm: Swarm) -> NDArray[np.int64]:
    """`[N, 2]` the left pixels u, v that flies sit on."""
    return np.rint(swarm.uv).astype(np.int64).reshape(-1, 2)


def _fly_errors(scene: Scene, swarm: Swarm) -> NDArray[np.float32]:
    """`[N]` distance of each fly's disparity from the truth at its pixel [px]; inf where there is no truth."""
    u, v = _pixels(swarm).T
    off = np.abs(swarm.uv[:, 0] - swarm.uv_right[:, 0] - scene.disparity[v, u])
    return np.where(np.isfinite(off), off, np.float32(np.inf))


def _within(errors: NDArray[np.floating]) -> tuple[float, ...]:
    return tuple(float((errors <= tolerance).mean()) if len(errors) else math.nan for tolerance in TOLERANCES)
