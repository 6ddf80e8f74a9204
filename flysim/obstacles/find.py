"""Flies to obstacles: off the ground, clustered, what stands under another's roof joined to it, a body round each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flysim.obstacles.again import seen_again
from flysim.obstacles.box import top, topped
from flysim.obstacles.cluster import dbscan
from flysim.obstacles.gather import as_seen
from flysim.obstacles.joined import Cluster, joined
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.shape import fit_solid
from flysim.obstacles.unsure import sure
from flysim.products.cloud import FlyCloud
from flysim.products.frame import Frame
from flysim.products.obstacle import Obstacle
from flysim.products.swarm import Swarm


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
    groups = [flies for flies in groups if len(flies) >= params.min_flies]
    groups = sure(cloud, groups, swarms, params.link_distance)
    found = [(flies, fit_solid(cloud, flies, params)) for flies in groups]
    found = _again(cloud, joined(cloud, found, params), params, swarms)
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
