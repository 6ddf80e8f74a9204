"""Flies against the visible true surface: accuracy, precision, completeness, F-score.

Precision, recall (here completeness) and F-score as Knapitsch et al., "Tanks and Temples", ACM TOG 36(4),
2017: precision is the share of flies closer than tau to the truth, completeness the share of the truth closer
than tau to a fly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from flysim.evaluate.matching import harmonic
from flysim.geometry.frames import Array, transform
from flysim.products.cloud import FlyCloud
from flysim.truth.body import parts_of, surface_distance
from flysim.truth.motion import Motion
from flysim.truth.obstacles import one_a_voxel
from flysim.truth.sight import Sight
from flysim.worlds.model import World
from flysim.worlds.shapes import Mesh

TAUS = (0.01, 0.02, 0.05)  # [m]
MOST_SAMPLES = 800_000  # over all stops: every pixel of two 640x480 stops, every second one each way of ten
VOXEL = 0.02  # [m] completeness counts one point a voxel, so that near surface does not outweigh far


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VisibleSurface:
    """Samples of what both cameras saw, gathered over the stops, sorted by body, at each body's last place.

    Attributes:
        points: `[N, 3]` [m, world].
        spacing: `[N]` [m] how far a visible surface point can be from its nearest sample, here.
        starts: link -> (first, end) of its samples.
    """

    points: Array
    spacing: NDArray[np.float32]
    starts: dict[int, tuple[int, int]]


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceScore:
    """Flies against the visible surface. By-threshold figures are in the order of `TAUS`.

    Attributes:
        accuracy_median: [m] None where there is no fly or nothing visible.
        accuracy_p90: [m]
    """

    accuracy_median: float | None
    accuracy_p90: float | None
    precision: tuple[float, ...]
    completeness: tuple[float, ...]
    f_score: tuple[float, ...]


def score_surface(world: World, motion: Motion, seen: Sequence[Sight], cloud: FlyCloud) -> SurfaceScore:
    """All figures of a fly cloud against what was visible from the stops, structure included."""
    surface = visible_surface(seen, motion)
    off = fly_distances(world, motion, surface, cloud)
    precision = [float(np.mean(off < tau)) if len(off) else 0.0 for tau in TAUS]
    missing = surface_distances(motion, surface, cloud)
    completeness = [float(np.mean(missing < tau)) if len(missing) else 0.0 for tau in TAUS]
    scored = off if len(surface.points) else off[:0]
    return SurfaceScore(
        accuracy_median=_finite(np.median(scored)) if len(scored) else None,
        accuracy_p90=_finite(np.quantile(scored, 0.9, method="higher")) if len(scored) else None,
        precision=tuple(precision),
        completeness=tuple(completeness),
        f_score=tuple(harmonic(p, r) for p, r in zip(precision, completeness, strict=True)),
    )


def visible_surface(seen: Sequence[Sight], motion: Motion) -> VisibleSurface:
    """Samples on a regular pixel grid, coarse enough that all stops together stay bounded."""
    stride = max(1, math.ceil(math.sqrt(sum(sight.seen.size for sight in seen) / MOST_SAMPLES)))
    points, spacing, links = [np.empty((0, 3))], [np.empty(0, np.float32)], [np.empty(0, np.int32)]
    for sight in seen:
        view = sight.stop.views[0]
        mask = sight.seen[::stride, ::stride]
        link = view.link[::stride, ::stride]
        v, u = np.ogrid[: mask.shape[0], : mask.shape[1]]
        z = np.where(mask, view.depth[::stride, ::stride], np.float32(1.0))
        x = ((u * stride - view.camera.cx) / view.camera.fx).astype(np.float32) * z
        y = ((v * stride - view.camera.cy) / view.camera.fy).astype(np.float32) * z
        near = _spacing((x, y, z), mask, link, stride / view.camera.fx)[mask]
        optical = np.stack([x[mask], y[mask], z[mask]], axis=1)
        world_points, link = transform(view.T_world_optical, optical), link[mask]
        for i in np.flatnonzero(motion.moved).tolist():
            of_link = link == i
            world_points[of_link] = motion.carry(i, sight.stop.index, world_points[of_link])
        points.append(world_points)
        spacing.append(near)
        links.append(link)
    link = np.concatenate(links)
    order = np.argsort(link, kind="stable")
    ids, first = np.unique(link[order], return_index=True)
    ends = np.append(first, len(order))[1:]
    return VisibleSurface(
        points=np.concatenate(points)[order],
        spacing=np.concatenate(spacing)[order],
        starts={i: (a, b) for i, a, b in zip(ids.tolist(), first.tolist(), ends.tolist(), strict=True)},
    )


def _spacing(
    optical: tuple[NDArray[np.float32], ...], mask: NDArray[np.bool_], link: NDArray[np.int32], angle: float
) -> NDArray[np.float32]:
    """`[h, w]` reach of each sample of a grid: three quarters of the diagonal of its cell on the surface.

    Half a diagonal is the middle of a cell; the rest is for the rim, where the last sample can be more than
    half a cell from the edge. A cell's sides are measured to the nearer neighbour on the same body, so that a
    slanted surface has its long cells and a step in depth does not count; alone, they are those of a surface
    that faces the camera.
    """
    squares = np.zeros(mask.shape, dtype=np.float32)
    facing = (angle * optical[2]).astype(np.float32) ** 2
    for axis in (0, 1):
        one, two = (slice(1, None), slice(None, -1)) if axis == 0 else (np.s_[:, 1:], np.s_[:, :-1])
        step = np.zeros_like(squares[one])
        for component in optical:
            step += (component[one] - component[two]) ** 2
        step[~(mask[one] & mask[two] & (link[one] == link[two]))] = np.inf
        side = np.full(mask.shape, np.inf, dtype=np.float32)
        np.minimum(side[one], step, out=side[one])
        np.minimum(side[two], step, out=side[two])
        squares += np.where(np.isfinite(side), side, facing)
    return np.float32(0.75) * np.sqrt(squares)


def fly_distances(world: World, motion: Motion, surface: VisibleSurface, cloud: FlyCloud) -> Array:
    """`[N]` distance [m] of every fly to the visible surface; inf where none is, or a fly is not finite."""
    return distances_to(world, motion, surface, cloud.points, cloud.stop)


def distances_to(
    world: World, motion: Motion, surface: VisibleSurface, points: ArrayLike, stops: NDArray[np.int32]
) -> Array:
    """`[N]` distance [m] of points to the visible surface; inf where none is, or a point is not finite.

    To each visible body it is the exact distance to the body's surface, but at least the distance to the
    nearest visible sample less that sample's spacing: exact on what was seen, and a point on a hidden face is
    charged the way to what was seen. The nearest body counts.

    Args:
        world: whose bodies they are.
        motion: where those stood.
        surface: what was seen of them.
        points: `[N, 3]` [m, world].
        stops: `[N]` index of the stop at which each was seen.
    """
    flies = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    best = np.full(len(flies), np.inf)
    sound = np.isfinite(flies).all(axis=1)
    # Meshes last: their exact distance is slow, and by then most flies have a nearer body.
    slow = {i: any(isinstance(part.shape, Mesh) for part in parts_of(world.links[i])) for i in surface.starts}
    for i in sorted(surface.starts, key=lambda i: (slow[i], surface.starts[i][0] - surface.starts[i][1], i)):
        first, end = surface.starts[i]
        samples, spacing = surface.points[first:end], surface.spacing[first:end]
        placed = motion.carry_all(i, stops, flies)
        low, high = (np.array([f(column) for column in samples.T]) for f in (np.min, np.max))
        beyond = np.maximum(np.maximum(low - placed, placed - high), 0.0)
        rows = np.flatnonzero(sound & (np.linalg.norm(beyond, axis=1) - spacing.max() < best))
        exact = surface_distance(world.links[i], motion.last[i], placed[rows])
        rows, exact = rows[exact < best[rows]], exact[exact < best[rows]]
        if not len(rows):
            continue
        near, at = KDTree(samples, balanced_tree=False, compact_nodes=False).query(placed[rows], workers=1)
        best[rows] = np.minimum(best[rows], np.maximum(exact, near - spacing[at]))
    return best


def surface_distances(motion: Motion, surface: VisibleSurface, cloud: FlyCloud) -> Array:
    """`[M]` distance [m] of one visible point a 2 cm voxel to the nearest fly; inf beyond all thresholds."""
    flies = np.asarray(cloud.points, dtype=np.float64).reshape(-1, 3)
    sound = np.isfinite(flies).all(axis=1)
    flies, stops = flies[sound], cloud.stop[sound]
    still = np.ones(len(surface.points), dtype=bool)
    distances = []
    for i in [i for i in surface.starts if motion.moved[i]]:
        first, end = surface.starts[i]
        still[first:end] = False
        distances.append(_to_nearest(surface.points[first:end], motion.carry_all(i, stops, flies)))
    return np.concatenate([_to_nearest(surface.points[still], flies), *distances])


def _to_nearest(points: Array, flies: Array) -> Array:
    if not len(points) or not len(flies):
        return np.full(len(one_a_voxel(points, VOXEL)) if len(points) else 0, np.inf)
    points = points[one_a_voxel(points, VOXEL)]
    return KDTree(flies).query(points, distance_upper_bound=max(TAUS) * 1.01, workers=1)[0]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
