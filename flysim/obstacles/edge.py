"""Where a cluster ends in a direction that no face of it was seen to face: at the silhouettes of its neighbours."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.obstacles.flat import MISSES
from flysim.products.cloud import FlyCloud

OUTWARD = 0.3  # least cosine between an arm and the direction for it to speak for that end
LEAST_ARMS = 6
BLUR = 0.004  # [m] arms that end within this of one another end at the same edge
CELL = 0.0002  # [m] arms that end within one are counted as one place
FINE = 0.003  # [m] size of a pixel on the surface above which its arm counts for less
NEAR_END = 0.05  # [m] the edge is sought this far from the outermost arm
ASTRAY = 0.02  # share of the arms that may run over an edge
LEAST_SUPPORT = 3  # arms of one stop that tell how high a surface goes on at least
SUPPORT = 0.34  # share of the arms of that stop that go on as far
STRAIGHT = 0.999  # least cosine between a surface's arm and up for it to have been followed that way (`climb`)
STRONG = 0.5  # an edge has at least this share of the arms of the strongest one


def edge(cloud: FlyCloud, flies: NDArray[np.int64], direction: Array) -> float | None:
    """How far along a direction the arms of a cluster's flies say that it reaches [m from the origin].

    Arms that end at an edge end close together, those that end elsewhere, at a false match or a fold, anywhere. So the
    edge is the outermost place where many end: a peak of their density, in which an arm on a steeply seen surface,
    whose pixels are long, counts for less.

    Args:
        cloud: what the flies belong to.
        flies: `[n]` the cluster's.
        direction: `[3]` unit vector.

    Returns:
        None where fewer than six arms end in that direction.
    """
    ends, step, ended, _ = _arms(cloud, flies)
    outward = (step @ direction) / np.maximum(np.linalg.norm(step, axis=-1), 1e-12)
    speaks = ended & (outward >= OUTWARD)
    if speaks.sum() < LEAST_ARMS:
        return None
    pixel = (step @ direction)[speaks]
    at = (ends @ direction)[speaks] + 0.5 * pixel  # the surface ends between the last pixel and the next
    weight = 1.0 / (1.0 + (pixel / FINE) ** 2)
    order = np.argsort(at, kind="stable")
    at, weight = at[order], weight[order]
    outermost = at[np.searchsorted(np.cumsum(weight), (1.0 - ASTRAY) * weight.sum())]
    near = at[(at >= outermost - NEAR_END) & (at <= outermost + BLUR)]
    peak = near[np.flatnonzero((density := _density(near, at, weight)) >= STRONG * density.max())[-1]]
    there = np.abs(at - peak) <= 2.0 * BLUR
    return float(np.average(at[there], weights=weight[there]))


def _density(places: Array, at: Array, weight: Array) -> Array:
    """`[n]` how many of the sorted places `at` lie about each of some sorted places: Gaussians of BLUR, by weight."""
    within = 5.0 * BLUR  # beyond it a place counts for a millionth
    used = slice(*np.searchsorted(at, (places[0] - within, places[-1] + within)))
    cells = np.floor((at[used] - places[0]) / CELL).astype(np.int64)
    first = cells.min()
    counts = np.bincount(cells - first, weight[used])
    reach = math.ceil(within / CELL)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) * (CELL / BLUR)) ** 2)
    smooth = np.convolve(counts, bell)[reach:-reach].astype(np.float64)
    return smooth[np.floor((places - places[0]) / CELL).astype(np.int64) - first]


def supported(cloud: FlyCloud, flies: NDArray[np.int64], up: Array) -> float | None:
    """How far up the texture of a cluster's upright surfaces was seen, whether it ends there or leaves the view [m].

    One stop is enough, however many others stood too near to see that high. None where at no stop three of the flies
    were followed up.
    """
    ends, step, _, stop = _arms(cloud, flies)
    straight = (step @ up) >= STRAIGHT * np.maximum(np.linalg.norm(step, axis=-1), 1e-12)
    # Less what an arm that runs over a silhouette gains.
    reached, stop = (ends - MISSES * step)[straight] @ up, stop[straight]
    by_stop = (np.sort(reached[stop == k])[::-1] for k in np.unique(stop))
    told = [
        of_stop[max(LEAST_SUPPORT, math.ceil(SUPPORT * len(of_stop))) - 1]
        for of_stop in by_stop
        if len(of_stop) >= LEAST_SUPPORT
    ]
    return float(max(told)) if told else None


def _arms(cloud: FlyCloud, flies: NDArray[np.int64]) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.int32]]:
    """`[n, 3]` ends and steps of all arms of a cluster's flies, `[n]` whether they ended, `[n]` their stops."""
    again = cloud.again
    mine = np.isin(again.fly, flies)
    return (
        np.concatenate([cloud.arms[flies].reshape(-1, 3), again.end[mine]]),
        np.concatenate([cloud.steps[flies].reshape(-1, 3), again.step[mine]]),
        np.concatenate([cloud.ended[flies].ravel(), again.ended[mine]]),
        np.concatenate([np.repeat(cloud.stop[flies], cloud.arms.shape[1]), again.stop[mine]]),
    )
