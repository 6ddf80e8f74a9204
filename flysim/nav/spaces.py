"""What an agent of the environment may do and what it is told: gymnasium's spaces."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import InvalidAction

from flysim.nav.agents.surroundings import RANGE, SECTORS
from flysim.nav.settings import ActionKind

FARTHEST_GOAL = 100.0  # [m] that an observation tells
TOP_FLIES = 64
# Of the largest speed and yaw rate: what the discrete actions command.
DISCRETE = ((0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (1.0, 0.5), (1.0, -0.5), (0.5, 1.0), (0.5, -1.0), (0.0, 0.0))


def action_space(kind: ActionKind) -> spaces.Space[Any]:
    """Shares of the largest speed and yaw rate, or one of `DISCRETE`."""
    if kind == "discrete":
        return spaces.Discrete(len(DISCRETE))
    return spaces.Box(np.array([0.0, -1.0], np.float32), np.array([1.0, 1.0], np.float32), dtype=np.float32)


def observation_space(kind: str, size: tuple[int, int]) -> spaces.Dict:
    """What is told with one kind of observation, of images of `size` (width, height) [px]."""
    turn = np.float32(math.pi)
    found: dict[str, spaces.Space[Any]] = {
        "goal": spaces.Box(np.array([0, -turn], np.float32), np.array([FARTHEST_GOAL, turn], np.float32)),
        "velocity": spaces.Box(np.array([-10, -20], np.float32), np.array([10, 20], np.float32)),
    }
    if kind == "pixels":
        for side in ("left", "right"):
            found[side] = spaces.Box(0, 255, (size[1], size[0], 3), np.uint8)
    else:
        found["obstacles"] = spaces.Box(0.0, RANGE, (SECTORS,), np.float32)
    if kind == "flies":
        found["flies"] = spaces.Box(-10.0, 10.0, (TOP_FLIES, 3), np.float32)
    return spaces.Dict(found)


def command(space: spaces.Space[Any], action: Any) -> tuple[float, float]:
    """Shares of the largest speed and yaw rate that an action of `action_space` stands for.

    Raises:
        InvalidAction: it is none of the space.
    """
    if isinstance(space, spaces.Discrete):
        if not space.contains(action):
            raise InvalidAction(f"action must be a whole number of 0 to {len(DISCRETE) - 1}, got {action!r}")
        return DISCRETE[int(action)]
    try:
        both = np.asarray(action, np.float32)
    except (TypeError, ValueError):
        both = np.empty(0, np.float32)
    if not space.contains(both):  # a NaN is not in a Box either
        raise InvalidAction(f"action must be speed in [0, 1] and yaw rate in [-1, 1], both finite, got {action!r}")
    return float(both[0]), float(both[1])
