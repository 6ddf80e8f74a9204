"""Obstacles as places to look at: points on their outlines with the way they face, at foot, middle and top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from flysim.geometry.frames import Array
from flysim.paths.grid import Grid
from flysim.worlds.model import World

APART = 0.08  # [m] between points on one side of an outline
SECTORS = 8  # of 45 degrees, by the way the outline faces
BANDS = 3  # heights looked at: foot, middle, top
AHEAD, FREE = 0.08, 0.04  # [m] so far before it a point has so much free room, or it is in a chink nobody sees into
OUT = 0.03  # [m] a point lies so far off the outline, so that its own obstacle does not hide it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Targets:
    """What a path is to look at.

    Attributes:
        names: of each obstacle: its models, at most three.
        centers: `[k, 2]` [m].
        xy: `[n, 2]` points on the outlines [m].
        normal: `[n, 2]` unit vectors that point out of the obstacle.
        z: `[n, 3]` heights of foot, middle and top there [m].
        obstacle: `[n]` whose outline it is.
        sector: `[n]` which of eight ways it faces.
        length: `[n]` metres of outline it stands for.
    """

    names: tuple[str, ...]
    centers: Array
    xy: Array
    normal: Array
    z: Array
    obstacle: NDArray[np.intp]
    sector: NDArray[np.intp]
    length: Array


def find_targets(world: World, grid: Grid, merge_gap: float) -> Targets:
    """The obstacles of a grid; those at most `merge_gap` [m] apart are one."""
    mask = grid.obstacle >= 0
    if not mask.any():
        none = np.empty((0, 2))
        empty = np.empty(0, dtype=np.intp)
        return Targets(
            names=(), centers=none, xy=none, normal=none, z=np.empty((0, 3)), obstacle=empty, sector=empty,
            length=np.empty(0),
        )  # fmt: skip
    # A cell is painted when it is touched, half a cell too far on either side.
    reach = max(merge_gap - grid.cell, 0.0) / 2.0
    near = mask if reach == 0.0 else np.asarray(ndimage.distance_transform_edt(~mask)) * grid.cell <= reach
    label = np.zeros(mask.shape, np.int32)
    count = int(ndimage.label(near, structure=np.ones((3, 3)), output=label))  # type: ignore[arg-type]
    label[~mask] = 0
    names: list[dict[str, None]] = [{} for _ in range(count)]
    for i, (row, column) in grid.of_link.items():
        k = label[row, column]
        if k:
            names[k - 1][world.links[i].model] = None
    edge = mask & ~np.asarray(ndimage.binary_erosion(mask, border_value=0), dtype=bool)
    smooth = np.asarray(ndimage.gaussian_filter(mask.astype(np.float32), 2.0))
    gy, gx = (np.asarray(ndimage.sobel(smooth, axis=axis), dtype=np.float64) for axis in (0, 1))
    length = np.hypot(gx, gy)
    ij = np.argwhere(edge & (length > 1e-6))
    at = ij[:, 0], ij[:, 1]
    normal = -np.stack([gx[at], gy[at]], axis=1) / length[at][:, None]
    open_ = grid.clear_of(grid.points(ij) + normal * AHEAD) >= FREE
    ij, normal = ij[open_], normal[open_]
    obstacle = label[ij[:, 0], ij[:, 1]].astype(np.intp) - 1
    sector = np.floor((np.arctan2(normal[:, 1], normal[:, 0]) + np.pi / SECTORS) / (2 * np.pi / SECTORS)).astype(int)
    sector %= SECTORS
    block = max(1, round(APART / grid.cell))
    key = np.stack([obstacle, sector, ij[:, 0] // block, ij[:, 1] // block], axis=1)
    _, first, times = np.unique(key, axis=0, return_index=True, return_counts=True)
    ij, normal, obstacle, sector = ij[first], normal[first], obstacle[first], sector[first]
    low = np.maximum(grid.bottom[ij[:, 0], ij[:, 1]], 0.0) + 0.01
    high = np.maximum(grid.top[ij[:, 0], ij[:, 1]] - 0.01, low)
    centers = np.array(ndimage.center_of_mass(mask, label, range(1, count + 1)))
    return Targets(
        names=tuple(_named(list(models)) for models in names),
        centers=centers[:, ::-1] * grid.cell + grid.origin,
        xy=grid.points(ij) + normal * (OUT + grid.cell / 2.0),
        normal=normal,
        z=np.stack([low, (low + high) / 2.0, high], axis=1),
        obstacle=obstacle,
        sector=sector,
        length=np.asarray(times * grid.cell, dtype=np.float64),
    )


def _named(models: list[str]) -> str:
    return "+".join(models if len(models) <= 4 else [*models[:3], f"{len(models) - 3} more"])
