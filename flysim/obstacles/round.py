"""Cylinders and spheres: the circle or the sphere that the flies of a cluster lie on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from flysim.geometry.frames import Array

LEAST_FLIES, ENOUGH_FLIES = 12, 500  # of more, every second, third, ... is asked
ON_SURFACE = 0.005  # [m] what is further off counts less and less (soft L1)
SIDEWAYS = 0.5  # a fly whose normal is less steep than this lies on a side
LEAST_ARC_DEG = 100.0  # of a circle that is seen: less of it is as well a flat thing
ARC_BINS = 36
MIN_RADIUS, MAX_RADIUS = 0.015, 1.5  # [m]


class Round(NamedTuple):
    """A circle seen from above, or a sphere."""

    center: Array  # [2] or [3] m
    radius: float  # [m]


def fit_circle(points: Array, normals: Array, spread: Array) -> Round | None:
    """The circle, seen from above, that the flies on the upright sides of a cluster lie on.

    Args:
        points: `[N, 3]` [m].
        normals: `[N, 3]` of the surfaces.
        spread: `[N, 3]` one standard deviation of each position [m].

    Returns:
        None where there are too few flies, or less than 100 degrees of the circle are seen.
    """
    side = np.abs(normals[:, 2]) < SIDEWAYS
    found = _fit(points[side, :2], np.linalg.norm(spread[side, :2], axis=1))
    if found is None:
        return None
    out = points[side, :2] - found.center
    return found if _arc(out) >= LEAST_ARC_DEG else None


def fit_sphere(points: Array, spread: Array) -> Round | None:
    """The sphere that the flies of a cluster lie on; the arguments are `fit_circle`'s."""
    found = _fit(points, np.linalg.norm(spread, axis=1))
    if found is None:
        return None
    out = points - found.center
    high = np.linalg.norm(out[:, :2], axis=1) > 0.3 * found.radius  # the pole has no longitude
    return found if _arc(out[high, :2]) >= LEAST_ARC_DEG else None


def _fit(points: Array, noise: Array) -> Round | None:
    """The circle (`[N, 2]`) or sphere (`[N, 3]`) of least distances, from the algebraic one on.

    The start is Kasa's, "A circle fitting procedure and its error analysis", IEEE TIM 25, 1976.
    """
    if len(points) < LEAST_FLIES:
        return None
    every = -(-len(points) // ENOUGH_FLIES)
    points, noise = points[::every], noise[::every]
    middle = points.mean(axis=0)
    local = points - middle
    A = np.c_[2.0 * local, np.ones(len(local))]
    solved = np.linalg.lstsq(A, (local**2).sum(axis=1), rcond=None)[0]
    start = np.r_[solved[:-1], np.sqrt(max(solved[-1] + (solved[:-1] ** 2).sum(), MIN_RADIUS**2))]
    weight = 1.0 / (1.0 + noise / ON_SURFACE)

    def off(x: Array) -> Array:
        return weight * (np.linalg.norm(local - x[:-1], axis=1) - x[-1]) / ON_SURFACE

    def slope(x: Array) -> Array:
        way = local - x[:-1]
        outward = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
        return -weight[:, None] * np.c_[outward, np.ones(len(local))] / ON_SURFACE

    fit = least_squares(off, start, jac=slope, loss="soft_l1", max_nfev=50)  # pyright: ignore[reportArgumentType]
    radius = float(fit.x[-1])
    if not (np.isfinite(fit.x).all() and MIN_RADIUS <= radius <= MAX_RADIUS):
        return None
    return Round(middle + fit.x[:-1], radius)


def _arc(out: Array) -> float:
    """Degrees of a circle that hold points `[N, 2]` about its centre."""
    turn = np.arctan2(out[:, 1], out[:, 0]) / (2.0 * np.pi) % 1.0
    return 360.0 / ARC_BINS * len(np.unique((turn * ARC_BINS).astype(int)))
