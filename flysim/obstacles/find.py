"""Flies to obstacles: off the ground, clustered, what stands under another's roof joined to it, a body round each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.obstacles.again import seen_again
from flysim.obstacles.box import top, topped
from flysim.obstacles.cluster import dbscan
from flysim.obstacles.gather import as_seen
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.shape import FittedShape, distance_to, fit_solid
from flysim.products.cloud import FlyCloud
from flysim.products.frame import Frame
from flysim.products.obstacle import Obstacle
from flysim.products.swarm import Swarm

ROOF_FLIES = 3  # of another cluster that lie over the footprint of one, and over its upper end, make a roof
AFLOAT = 0.95  # share of a cluster's flies that lie higher than what stands in its footprint: so does all of it
AROUND, SECTORS, SURROUNDED = (
    0.6,
    8,
    6,
)  # a rim has flies within so many metres in six of eight directions; a room has not
ROOFED = 0.8  # share of a cluster's flies that stand within another's footprint, for it to stand under its roof
TOUCHING = 4  # flies of a cluster on what was fitted to another: they may be two sides of one body
EAVES = 0.03  # [m] that they may stand out, and that a roof may seem to be lower than what stands under it

Cluster = tuple[NDArray[np.int64], FittedShape]  # flies, and the body they lie on


def find_obstacles(
    cloud: FlyCloud, params: ObstacleParams, swarms: Sequence[tuple[Frame, Swarm]] = ()
) -> tuple[Obstacle, ...]:
    """The obstacles that the flies of all stops stand for, the one with most flies first.

    The flies of every stop are clustered together, so that an object seen from several sides is one obstacle. A table
    hides the upper ends of its legs from a camera above it: a cluster that stands within the footprint of a larger one
    is a part of it.

    Args:
        cloud: the flies of all stops.
        params: how they become obstacles.
        swarms: the frames and swarms that the cloud was gathered from, in which what was found is looked for again:
            how high it goes, as stops see it that have few of its flies.
    """
    above = np.flatnonzero(cloud.points[:, 2] > params.ground_clearance)
    if len(above) < max(params.min_flies, 1):
        return ()
    labels = dbscan(cloud.points[above], params.link_distance, params.min_neighbours)
    groups = [above[labels == label] for label in range(labels.max() + 1)]
    found = [(flies, fit_solid(cloud, flies, params)) for flies in groups if len(flies) >= params.min_flies]
    found = _again(cloud, _joined(cloud, found, params), params, swarms)
    found = sorted(found, key=lambda cluster: -len(cluster[0]))
    return tuple(
        Obstacle(shape=body.shape, center=body.center, size=body.size, yaw=body.yaw, flies=flies)
        for flies, body in found
        if body.size[2] >= params.min_height
    )


def _again(
    cloud: FlyCloud, clusters: list[Cluster], params: ObstacleParams, swarms: Sequence[tuple[Frame, Swarm]]
) -> list[Cluster]:
    """The clusters with the height of those whose top no fly lies on told once more, now by every stop."""
    unsure = [k for k, (flies, body) in enumerate(clusters) if body.shape != "sphere" and not topped(cloud, flies)]
    if not (params.silhouettes and params.climb and params.again and swarms and unsure):
        return clusters
    frames = [(frame, as_seen(frame.pair, swarm)) for frame, swarm in swarms]
    cloud = replace(cloud, again=seen_again(frames, cloud, [clusters[k] for k in unsure]))
    found = list(clusters)
    for k in unsure:
        flies, body = clusters[k]
        height = top(cloud, flies, params.trim)
        x, y, _ = body.center
        found[k] = flies, body._replace(center=np.array([x, y, height / 2.0]), size=np.array([*body.size[:2], height]))
    return found


def _joined(cloud: FlyCloud, clusters: list[Cluster], params: ObstacleParams) -> list[Cluster]:
    """The clusters with those under another's roof, and those that are one body with it, made a part of that one.

    The smallest come first.
    """
    clusters = sorted(clusters, key=lambda cluster: _plan_area(cluster[1]))
    for k, (flies, body) in enumerate(clusters):
        for other in range(len(clusters) - 1, k, -1):
            roof_flies, roof = clusters[other]
            under = _under(cloud.points[flies], body, cloud.points[roof_flies], roof)
            if not (under or _touching(cloud.points[flies], body, cloud.points[roof_flies], roof)):
                continue
            together = np.sort(np.concatenate([roof_flies, flies]))
            whole = fit_solid(cloud, together, params)
            if under or whole.shape != "other":
                clusters[other] = together, whole
                clusters[k] = np.empty(0, np.int64), body
                break
    return [cluster for cluster in clusters if len(cluster[0])]


def _plan_area(body: FittedShape) -> float:
    return float(body.size[0] * body.size[1])


def _touching(points: Array, body: FittedShape, other_points: Array, other: FittedShape) -> bool:
    """Whether flies of one cluster lie on what was fitted to the other: two sides of a box, a bare strip between."""
    if "other" in (body.shape, other.shape):
        return False
    return any(
        (np.abs(distance_to(there, on)) <= EAVES).sum() >= TOUCHING
        for there, on in ((points, other), (other_points, body))
    )


def _under(points: Array, body: FittedShape, roof_points: Array, roof: FittedShape) -> bool:
    """Whether a cluster stands within another's footprint and under its flies."""
    if _over(points, roof).mean() < ROOFED:
        return False
    higher = roof_points[:, 2] > body.size[2] - EAVES
    # A roof as high as the camera is hardly seen from above; but then its rim floats over what stands below.
    return bool(
        (_over(roof_points, body) & higher).sum() >= ROOF_FLIES
        or (higher.mean() >= AFLOAT and _sectors(roof_points - body.center) >= SURROUNDED)
    )


def _sectors(ways: Array) -> int:
    """In how many of eight directions, seen from above, some way `[N, 3]` is shorter than AROUND."""
    near = ways[np.linalg.norm(ways[:, :2], axis=1) <= AROUND]
    turn = np.arctan2(near[:, 1], near[:, 0]) / (2.0 * np.pi) % 1.0
    return len(np.unique((turn * SECTORS).astype(int)))


def _over(points: Array, body: FittedShape) -> NDArray[np.bool_]:
    """`[N]` which points `[N, 3]` are over the footprint of a body."""
    c, s = np.cos(body.yaw), np.sin(body.yaw)
    x, y = (points[:, :2] - body.center[:2]).T
    along = np.abs(np.stack([c * x + s * y, c * y - s * x], axis=1))
    return np.all(along <= body.size[:2] / 2.0 + EAVES, axis=1)
