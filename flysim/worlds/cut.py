"""Meshes seen from above: points on them, the cells that they fill between two heights, and their flat tops."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from flysim.geometry.frames import Array

MAX_POINTS = 4_000_000  # of one mesh's surface
LEVEL = 0.95  # a face is level when its normal's z is above
MAX_HOLES = 2000  # of a mesh's outline that are looked into


def surface_points(triangles: Array, spacing: float) -> tuple[Array, float]:
    """`[n, 3]` points of triangles `[F, 3, 3]` on a lattice in each, and how far apart they are at most [m].

    That is `spacing`, or more where that made too many points.
    """
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    pieces = np.maximum(np.ceil(sides / spacing), 1.0)
    while ((pieces + 1) * (pieces + 2) / 2).sum() > MAX_POINTS and pieces.max() > 1.0:
        pieces = np.maximum(np.floor(pieces / 1.5), 1.0)
    found = []
    for n in np.unique(pieces).astype(int).tolist():
        some = triangles[pieces == n]
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1))
        a, b = i[i + j <= n] / n, j[i + j <= n] / n
        weights = np.stack([1.0 - a - b, a, b], axis=1)
        found.append(np.einsum("kc,fcd->fkd", weights, some).reshape(-1, 3))
    return np.concatenate(found), float((sides / pieces).max())


def between(triangles: Array, low: float, high: float) -> Array:
    """`[F, 3, 3]` those of the triangles that reach between two heights [m]."""
    z = triangles[:, :, 2]
    return triangles[(z.max(axis=1) > low) & (z.min(axis=1) < high)]


def filled(mask: NDArray[np.bool_], inside_of: Array, level: float, origin: tuple[float, float], cell: float) -> None:
    """Fills those holes in an outline of cells that lie within a solid, and leaves the others: a room is free.

    Args:
        mask: `[H, W]` cells that a mesh's surface touches; changed.
        inside_of: `[F, 3, 3]` all triangles of the mesh, world frame.
        level: height [m] at which the cells are looked at.
        origin: x, y [m] of the middle of cell (0, 0).
        cell: side [m].
    """
    holes = np.asarray(ndimage.binary_fill_holes(mask)) & ~mask
    label = np.zeros(mask.shape, np.int32)
    count = int(ndimage.label(holes, output=label))  # type: ignore[arg-type]
    if not count:
        return
    if count > MAX_HOLES:
        mask |= holes
        return
    # In each hole the cell that is farthest from its edge: a line up from there meets no edge by chance.
    depth = np.asarray(ndimage.distance_transform_edt(holes))
    for row, column in ndimage.maximum_position(depth, label, range(1, count + 1)):
        x, y = origin[0] + cell * (column + 0.0137), origin[1] + cell * (row + 0.0191)
        if winding(inside_of, x, y, level) > 0:
            mask |= label == label[row, column]


def winding(triangles: Array, x: float, y: float, z: float) -> int:
    """How often a closed surface surrounds a point: faces above it that look up, less those that look down."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    box = (triangles[:, :, 0].min(axis=1) <= x) & (triangles[:, :, 0].max(axis=1) >= x)
    box &= (triangles[:, :, 1].min(axis=1) <= y) & (triangles[:, :, 1].max(axis=1) >= y)
    a, b, c = a[box], b[box], c[box]

    def side(p: Array, q: Array) -> Array:
        return (q[:, 0] - p[:, 0]) * (y - p[:, 1]) - (q[:, 1] - p[:, 1]) * (x - p[:, 0])

    u, v, w = side(b, c), side(c, a), side(a, b)
    area = u + v + w
    hit = ((u > 0.0) & (v > 0.0) & (w > 0.0)) | ((u < 0.0) & (v < 0.0) & (w < 0.0))
    height = (u * a[:, 2] + v * b[:, 2] + w * c[:, 2])[hit] / area[hit]
    return int(np.sign(area[hit])[height > z].sum())


def solid_cells(triangles: Array, low: float, high: float, cell: float) -> NDArray[np.bool_]:
    """`[H, W]` cells of the box round triangles `[F, 3, 3]` that their solid fills between two heights [m]."""
    some = between(triangles, low, high)
    points = surface_points(some, cell / 2.0)[0] if len(some) else np.zeros((0, 3))
    points = points[(points[:, 2] > low) & (points[:, 2] < high), :2]
    if not len(points):
        return np.zeros((1, 1), dtype=bool)
    start = points.min(axis=0)
    at = np.rint((points - start) / cell).astype(int)
    mask = np.zeros(at.max(axis=0)[::-1] + 1, dtype=bool)
    mask[at[:, 1], at[:, 0]] = True
    filled(mask, triangles, (low + high) / 2.0, (float(start[0]), float(start[1])), cell)
    return mask


def level_faces(triangles: Array) -> tuple[Array, Array]:
    """`[n, 3, 3]` the triangles that are level and look up, and `[n]` their areas [m^2]."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    level = normal[:, 2] > LEVEL * np.maximum(length, 1e-300)
    return triangles[level], length[level] / 2.0


def longest(mask: NDArray[np.bool_], cell: float) -> tuple[float, float]:
    """Of the longest piece of a mask that hangs together, its extent and its thickness [m]."""
    label = np.zeros(mask.shape, np.int32)
    count = int(ndimage.label(mask, structure=np.ones((3, 3)), output=label))  # type: ignore[arg-type]
    if not count:
        return 0.0, 0.0
    boxes = ndimage.find_objects(label)
    extents = [max(part.stop - part.start for part in box) if box else 0 for box in boxes]
    k = int(np.argmax(extents))
    own = np.pad(label[boxes[k]] == k + 1, 1)
    thick = 2.0 * float(np.asarray(ndimage.distance_transform_edt(own)).max()) - 1.0
    return extents[k] * cell, max(thick, 1.0) * cell


def cell_for(points: Array, finest: float, most: int) -> float:
    """Side [m] of cells over the box round `[n, 2 or 3]` points of which there are at most `most`."""
    span = np.ptp(points[:, :2], axis=0) if len(points) else np.zeros(2)
    return max(finest, math.sqrt(float(np.prod(np.maximum(span, finest))) / most))
