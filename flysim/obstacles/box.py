"""The upright box round a cluster of flies: heading from its edges, each face from the flies that lie on it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.obstacles.edge import edge, supported
from flysim.products.cloud import FlyCloud

UP = np.array([0.0, 0.0, 1.0])
COARSE_DEG, FINE_DEG = 2.0, 0.25
EDGE_SIGMA = 0.008  # [m] how near a fly must be to a face to speak for it: a few times the fly noise at 2 m
STRAY = np.array([0.0, 0.01, 0.02, 0.04])  # share of the flies that may lie astray beyond one side
FACING = math.cos(math.radians(20.0))  # a fly lies on a face if its normal is as near to the face's own
FACE_FLIES = 5  # that many tell a face better than where its neighbours end
ENOUGH_FLIES = 2000  # to tell a heading by; of more, every second, third, ... is asked
FACE_SHARE = 0.1  # of the flies of the fullest face that looks the same way, which the outermost one holds at least
BEYOND = 0.03  # of an obstacle's flies may lie beyond its outermost face
FACE_DEPTH = 0.01  # [m] flies of one face, noise left out, lie within this; a step behind it is another face


def fit_box(cloud: FlyCloud, flies: NDArray[np.int64], trim: float) -> tuple[Array, Array, float]:
    """Centre `[3]`, size `[3]` and yaw of the upright box that holds the flies of a cluster, standing on z = 0.

    The heading is the one at which most flies lie near a face (the closeness criterion of Zhang, Xu, Dong and Dolan,
    "Efficient L-shape fitting for vehicle detection using laser scanners", IV 2017, with a Gaussian in place of their
    reciprocal). A face that flies lie on is where they say, the surer ones first; one that no stop saw is where the
    surfaces of its neighbours end (`edge`), but for a share `trim` of the flies that may be astray.
    """
    xy = cloud.points[flies[:: -(-len(flies) // ENOUGH_FLIES)], :2]
    coarse = np.arange(0.0, 90.0, COARSE_DEG)
    best = coarse[np.argmax([_closeness(xy, angle, trim) for angle in coarse])]
    fine = best + np.arange(-COARSE_DEG, COARSE_DEG + 1e-9, FINE_DEG)
    angle = math.radians(fine[np.argmax([_closeness(xy, a, trim) for a in fine])])
    x = np.array([math.cos(angle), math.sin(angle), 0.0])
    y = np.array([-math.sin(angle), math.cos(angle), 0.0])
    sides = [(-_side(cloud, flies, -axis, trim), _side(cloud, flies, axis, trim)) for axis in (x, y)]
    center = sum(sides[0]) / 2.0 * x + sum(sides[1]) / 2.0 * y
    length, width = (max(high - low, 0.0) for low, high in sides)
    height = top(cloud, flies, trim)
    if width > length:  # length is the longer side
        length, width, angle = width, length, angle + math.pi / 2.0
    yaw = (angle + math.pi / 2.0) % math.pi - math.pi / 2.0
    return np.array([center[0], center[1], height / 2.0]), np.array([length, width, height]), yaw


def top(cloud: FlyCloud, flies: NDArray[np.int64], trim: float) -> float:
    """How high a cluster reaches [m]."""
    face = _face(cloud, flies, UP)
    if face is None:
        face = max(_last(cloud, flies, UP, trim), supported(cloud, flies, UP) or 0.0)
    return max(face, 0.0)


def bottom(cloud: FlyCloud, flies: NDArray[np.int64], trim: float) -> float:
    """How far down a cluster was seen to reach [m above z = 0]."""
    return -_side(cloud, flies, -UP, trim)


def topped(cloud: FlyCloud, flies: NDArray[np.int64]) -> bool:
    """Whether flies lie on the top of a cluster, so that nothing else need tell how high it is."""
    return _face(cloud, flies, UP) is not None


def _side(cloud: FlyCloud, flies: NDArray[np.int64], direction: Array, trim: float) -> float:
    """How far the box reaches in a direction [m from the origin]."""
    face = _face(cloud, flies, direction)
    return _last(cloud, flies, direction, trim) if face is None else face


def _face(cloud: FlyCloud, flies: NDArray[np.int64], direction: Array) -> float | None:
    """How far away the face is that flies lie on in a direction [m from the origin]; None where they tell of none."""
    points, spread = cloud.points[flies], cloud.spread[flies]
    on_face = cloud.normals[flies] @ direction > FACING
    if on_face.sum() < FACE_FLIES:
        return None
    reach, noise = points[on_face] @ direction, np.abs(spread[on_face] @ direction)
    outermost = _outermost(reach, FACE_DEPTH + float(np.median(noise)))
    if not outermost.any():
        return None
    # None is surer than the surest tenth: one fly astray, seen along the face, must not outweigh all on it.
    sure = np.maximum(noise[outermost], np.quantile(noise[outermost], 0.1))
    face = _weighted_median(reach[outermost], 1.0 / (sure + 1e-3) ** 2)
    # The top of the lower of two parts faces upwards as well; that of the higher may be out of sight.
    beyond = (_least(cloud, flies, direction) > face + FACE_DEPTH).sum()
    return face if beyond <= max(FACE_FLIES, BEYOND * len(flies)) else None


def _last(cloud: FlyCloud, flies: NDArray[np.int64], direction: Array, trim: float) -> float:
    """Where, in a direction that no face tells of, the last flies are or their surfaces end [m from the origin]."""
    last = float(np.quantile(_least(cloud, flies, direction), 1.0 - trim))
    end = edge(cloud, flies, direction)
    return last if end is None else max(end, last)


def _least(cloud: FlyCloud, flies: NDArray[np.int64], direction: Array) -> Array:
    """`[n]` the lower end of where each fly may be in a direction [m]: an unsure one must not push a face out."""
    return cloud.points[flies] @ direction - np.abs(cloud.spread[flies] @ direction)


def _outermost(reach: Array, depth: float) -> NDArray[np.bool_]:
    """`[n]` which flies lie on the outermost face: of the last `depth` metres with enough of them, the fullest."""
    ordered = np.sort(reach)
    within = np.arange(1, len(ordered) + 1) - np.searchsorted(ordered, ordered - depth)
    enough = np.flatnonzero(within >= max(FACE_FLIES, FACE_SHARE * within.max(initial=0)))
    if not len(enough):
        return np.zeros(len(reach), np.bool_)
    near = enough[ordered[enough] >= ordered[enough[-1]] - depth]  # some of the last ones may be astray
    last = ordered[near[np.argmax(within[near])]]
    return (reach <= last) & (reach >= last - depth)


def _weighted_median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(cumulative, 0.5 * cumulative[-1])])


def _closeness(xy: Array, angle_deg: float, trim: float) -> float:
    """How many flies lie near the sides of the rectangle at an angle, each fly counted by its nearest side."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    nearest = np.full(len(xy), np.inf)
    for along in (c * xy[:, 0] + s * xy[:, 1], c * xy[:, 1] - s * xy[:, 0]):
        ordered = np.sort(along)
        for side in (_low_end(ordered, trim), -_low_end(-ordered[::-1], trim)):
            nearest = np.minimum(nearest, np.abs(along - side))
    return float(np.exp(-0.5 * (nearest / EDGE_SIGMA) ** 2).sum())


def _low_end(ordered: Array, trim: float) -> float:
    """Where the low end of a side's flies is: of a few ends, each with more flies astray, the one with most flies."""
    ends = ordered[((trim + STRAY) * (len(ordered) - 1)).astype(int)]
    near = np.searchsorted(ordered, ends + EDGE_SIGMA) - np.searchsorted(ordered, ends - EDGE_SIGMA)
    return float(ends[np.argmax(near)])
