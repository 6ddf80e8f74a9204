"""Flies to obstacles: off the ground, clustered, an upright box round each cluster."""

from __future__ import annotations

import numpy as np

from flysim.obstacles.cloud import FlyCloud
from flysim.obstacles.cluster import dbscan
from flysim.obstacles.obstacle import Obstacle
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.shape import fit_solid


def find_obstacles(cloud: FlyCloud, params: ObstacleParams) -> tuple[Obstacle, ...]:
    """The obstacles that the flies of all stops stand for, the one with most flies first.

    The flies of every stop are clustered together, so that an object seen from several sides is one obstacle.
    """
    above = np.flatnonzero(cloud.points[:, 2] > params.ground_clearance)
    if len(above) < max(params.min_flies, 1):
        return ()
    labels = dbscan(cloud.points[above], params.link_distance, params.min_neighbours)
    found = []
    for label in range(labels.max() + 1):
        flies = above[labels == label]
        if len(flies) < params.min_flies:
            continue
        body = fit_solid(cloud, flies, params)
        if body.size[2] >= params.min_height:
            found.append(Obstacle(shape=body.shape, center=body.center, size=body.size, yaw=body.yaw, flies=flies))
    return tuple(sorted(found, key=lambda obstacle: -len(obstacle.flies)))
