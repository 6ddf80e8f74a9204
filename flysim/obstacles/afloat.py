"""Things that do not stand on the floor: on a shelf, hanging, or where no floor was seen. Each gets its own height."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flysim.obstacles.box import bottom
from flysim.obstacles.parameters import ObstacleParams
from flysim.products.cloud import FlyCloud
from flysim.products.obstacle import Obstacle

HIGH = 0.3  # share of a thing's height: one whose lower end is seen to be higher does not stand on the floor
GAP = 3.0  # times the clearance that the lower end is higher at least


def lifted(
    cloud: FlyCloud, obstacles: Sequence[Obstacle], params: ObstacleParams, *, floor: bool
) -> tuple[tuple[Obstacle, ...], tuple[bool, ...]]:
    """Obstacles whose boxes reach down to what was seen of them, where that is not the floor; and which these are.

    Args:
        cloud: that they were found in.
        obstacles: standing on z = 0, as `find_obstacles` gives them.
        params: those they were found by.
        floor: whether there is a floor at z = 0; without, nothing stands on it.
    """
    found, afloat = [], []
    for one in obstacles:
        top = float(one.center[2] + one.size[2] / 2.0)
        low = min(max(bottom(cloud, one.flies, params.trim), 0.0), top)
        hangs = not floor or low > max(HIGH * top, GAP * params.ground_clearance)
        afloat.append(bool(hangs))
        if not hangs:
            found.append(one)
            continue
        center, size = one.center.copy(), one.size.copy()
        center[2], size[2] = (low + top) / 2.0, top - low
        found.append(replace(one, center=np.asarray(center), size=np.asarray(size)))
    return tuple(found), tuple(afloat)
