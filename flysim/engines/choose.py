"""Every engine that can see for the robot, by name: the flies, and what one would reach for in their place.

All have one signature, `see(pair, params, *, rng) -> Swarm`: the same pair, depths and population go in, points on
surfaces come out, and the same clusterer and evaluator judge them.
"""

from __future__ import annotations

from importlib import import_module
from typing import Protocol

import numpy as np

from flysim.errors import EngineError, did_you_mean
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.swarm import Swarm


class See(Protocol):
    """An engine.

    Args of a call:
        pair: what the two cameras saw.
        params: depths to search and flies to spend; what of it an engine reads its module tells.
        rng: its only source of randomness; most rivals take none.
    """

    def __call__(self, pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
        """The surfaces seen in a pair."""
        ...


# Loaded when first used: a scenario that names an engine must not bring a compiler along.
_HOME = {
    "flies": "flysim.flies.evolution:evolve",
    "sgbm": "flysim.engines.matchers:sgbm",
    "bm": "flysim.engines.matchers:bm",
    "exhaustive": "flysim.engines.exhaustive:exhaustive",
    "chance": "flysim.engines.chance:chance",
}
NAMES = tuple(_HOME)
DEFAULT = "flies"


def check(name: str) -> str:
    """The name, if there is such an engine.

    Raises:
        EngineError: there is none; the message has the nearest.
    """
    if name not in _HOME:
        raise EngineError(f"no engine '{name}'. {did_you_mean(name, NAMES)}")
    return name


def engine(name: str) -> See:
    """The engine of a name.

    Raises:
        EngineError: there is none of that name.
    """
    module, _, function = _HOME[check(name)].partition(":")
    return getattr(import_module(module), function)


def warm(name: str) -> None:
    """Lets an engine see a tiny pair, so that what it loads and compiles once is not counted as time of a stop."""
    camera = Camera(width=96, height=64, fx=80.0, fy=80.0, cx=47.5, cy=31.5)
    image = np.random.default_rng(0).integers(0, 256, (64, 96, 3), np.uint8)
    pair = ImagePair(left=image, right=np.roll(image, -8, axis=1), rig=StereoRig.parallel(camera, 0.1))
    engine(name)(pair, FlyParams(population=200, max_iterations=2), rng=np.random.default_rng(0))
