"""What an agent is: from an observation to an action, ten times a second."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flysim.nav.agents.surroundings import sector_bearings

Observation = Mapping[str, NDArray[Any]]
BEARINGS = sector_bearings()


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLimits:
    """What an agent may know of the robot that it drives.

    Attributes:
        radius: [m] of its circle.
        v_max: [m/s]
        w_max: [rad/s]
        period: [s] for which an action holds.
    """

    radius: float
    v_max: float
    w_max: float
    period: float


class Agent(Protocol):
    """Drives one episode after another.

    It may have an `info`, a mapping of what it has to say of the episode: `recoveries` is kept with the episode.
    """

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""
        ...

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """`[2]` shares of the largest speed and yaw rate."""
        ...


def action(limits: RobotLimits, v: float, w: float) -> NDArray[np.float32]:
    """The action for v [m/s] and yaw rate w [rad/s], as far as the robot can do it."""
    return np.array([np.clip(v / limits.v_max, 0.0, 1.0), np.clip(w / limits.w_max, -1.0, 1.0)], np.float32)


def towards(limits: RobotLimits, bearing: float, speed: float) -> NDArray[np.float32]:
    """Turns to a bearing [rad] and drives there at up to `speed` [m/s], the slower the more it has to turn."""
    v = speed * max(0.0, math.cos(bearing)) ** 3 if abs(bearing) < math.pi / 2.0 else 0.0
    return action(limits, v, 2.5 * bearing)
