"""What flies spend on a pair, and how they become things, by how large its pictures are and how far off it looks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import StereoRig
from flysim.obstacles.parameters import ObstacleParams
from flysim.photographs.depths import Depths
from flysim.products.swarm import Swarm

PER_FLY = 40.0  # [px] of the left picture for each fly of the population; of a small picture fewer, down to
LEAST_PER_FLY = 16.0
LEAST_FLIES, MOST_FLIES = 6500, 60_000
FEWEST = 400  # of the smallest
# The set of the paper that preserves half of the flies; all else is as on renders. By their set C, a tenth sooner, 5 of
# 56 looks at four pairs are no better than StereoBM; by this one none.
OPERATORS = "B"
# The defaults of `ObstacleParams` are made for flies so far apart, as 16 px are at two metres for the rover.
USUAL = 0.064  # [m]
APART = 16  # [px]; on what has little texture flies of the photographs lie as far apart, however many they are


def fly_params(rig: StereoRig, depths: Depths, given: FlyParams | None = None) -> FlyParams:
    """How flies evolve on a pair.

    Args:
        rig: of the pair.
        depths: to search.
        given: how a user has them evolve; the depths are taken from `depths` all the same.
    """
    if given is None:
        pixels = rig.left.width * rig.left.height
        few = min(LEAST_FLIES, max(round(pixels / LEAST_PER_FLY), FEWEST))
        population = min(max(round(pixels / PER_FLY), few), MOST_FLIES)
        given = FlyParams(population=population, operators=OPERATORS)
    return replace(given, min_depth=depths.nearest, max_depth=depths.farthest)


def obstacle_params(rig: StereoRig, swarm: Swarm, given: ObstacleParams | None) -> ObstacleParams:
    """How flies become things: distances in proportion to how large a pixel is where the flies are."""
    if given is not None:
        return given
    usual = ObstacleParams()
    if not len(swarm.points):
        return usual
    apart = float(np.median(swarm.points[:, 2])) * APART / rig.left.fx
    scale = min(max(apart / USUAL, 1e-3), 1e3)
    lengths = ("ground_clearance", "link_distance", "min_height")
    return replace(usual, **{name: getattr(usual, name) * scale for name in lengths})
