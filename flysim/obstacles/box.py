"""The upright box round a cluster of flies: heading from its edges, faces that stray flies cannot push out."""

from __future__ import annotations

import math

import numpy as np

from flysim.geometry.frames import Array

COARSE_DEG, FINE_DEG = 2.0, 0.25
EDGE_SIGMA = 0.008  # [m] how near a fly must be to a face to speak for it: a few times the fly noise at 2 m


def fit_box(points: Array, trim: float) -> tuple[Array, Array, float]:
    """Centre `[3]`, size `[3]` and yaw of the upright box that holds `[N, 3]` points standing on z = 0.

    The heading is the one at which most flies lie near a face (the closeness criterion of Zhang, Xu, Dong and Dolan,
    "Efficient L-shape fitting for vehicle detection using laser scanners", IV 2017), with a Gaussian in place of
    their reciprocal. The faces are quantiles, so a share `trim` of the flies may be astray beyond each one.
    """
    xy = points[:, :2]
    coarse = np.arange(0.0, 90.0, COARSE_DEG)
    best = coarse[np.argmax([_closeness(xy, angle, trim) for angle in coarse])]
    fine = best + np.arange(-COARSE_DEG, COARSE_DEG + 1e-9, FINE_DEG)
    angle = math.radians(fine[np.argmax([_closeness(xy, a, trim) for a in fine])])
    low, high = _faces(_turned(xy, angle), trim)
    size_xy = high - low
    center = _turned(((low + high) / 2.0)[None], -angle)[0]
    if size_xy[1] > size_xy[0]:  # length is the longer side
        size_xy, angle = size_xy[::-1], angle + math.pi / 2.0
    height = float(np.quantile(points[:, 2], 1.0 - trim))
    yaw = (angle + math.pi / 2.0) % math.pi - math.pi / 2.0
    return np.array([*center, height / 2.0]), np.array([*size_xy, height]), yaw


def _turned(xy: Array, angle: float) -> Array:
    """Points in axes turned by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.stack([c * xy[:, 0] + s * xy[:, 1], c * xy[:, 1] - s * xy[:, 0]], axis=1)


def _faces(xy: Array, trim: float) -> tuple[Array, Array]:
    return np.quantile(xy, trim, axis=0), np.quantile(xy, 1.0 - trim, axis=0)


def _closeness(xy: Array, angle_deg: float, trim: float) -> float:
    turned = _turned(xy, math.radians(angle_deg))
    low, high = _faces(turned, trim)
    nearest = np.minimum(np.abs(turned - low), np.abs(turned - high)).min(axis=1)
    return float(np.exp(-0.5 * (nearest / EDGE_SIGMA) ** 2).sum())
