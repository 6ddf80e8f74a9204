"""Two agents that set the scale: one that drives at random, and one that sees nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.nav.agents.agent import Observation, RobotLimits, towards


class RandomAgent:
    """A random action each time: what chance achieves."""

    def __init__(self, limits: RobotLimits) -> None:
        self._limits = limits

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""
        self._rng = rng

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        return self._rng.uniform((0.0, -1.0), (1.0, 1.0)).astype(np.float32)


class StraightAgent:
    """Turns to the goal and drives there, whatever is in between: what no eyes achieve."""

    def __init__(self, limits: RobotLimits) -> None:
        self._limits = limits

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        return towards(self._limits, float(observation["goal"][1]), self._limits.v_max)
