"""Louchet's warning values: flies ahead warn by their nearness, and turn the robot away."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.common.ranges import ranged
from flysim.nav.agents.agent import BEARINGS, Observation, RobotLimits, action


@dataclass(frozen=True, slots=True, kw_only=True)
class WarningParams:
    """How the warning agent weighs what it sees; chosen by hand in `yard`.

    Attributes:
        near: what is farther off does not warn [m].
        slow: sum of warnings that halves the speed.
        corridor: half width of the corridor ahead, where warnings have fallen to 1/e [radii of the robot].
        gain: a warning is (near / gap - 1) over this.
        undecided: sums of both sides that differ by less leave the robot turning to the side it turned to before.
        to_goal: yaw rate by the goal's bearing [1/s].
        away: yaw rate by the sum of warnings [rad/s].
        most_away: largest yaw rate by them [rad/s].
        least_gap: what is nearer to the robot's circle warns as if it were so far off: a warning has an end [m].
    """

    near: float = 1.2
    slow: float = 1.5
    corridor: float = 1.6
    gain: float = 4.0
    undecided: float = 0.05
    to_goal: float = 1.2
    away: float = 1.2
    most_away: float = 2.0
    least_gap: float = 0.02

    def __post_init__(self) -> None:
        ranged(self, near=(0.05, 20.0), corridor=(0.1, 20.0), undecided=(0.0, 100.0), most_away=(0.0, 50.0))
        ranged(self, least_gap=(1e-3, 1.0, "m"))
        ranged(self, **dict.fromkeys(("slow", "gain", "to_goal", "away"), (0.01, 100.0)))


class WarningAgent:
    """Louchet's warning values: what is near and in the corridor ahead warns, and turns the robot away.

    Boumaza and Louchet, "Dynamic flies: using real-time parisian evolution in robotics", 2001: flies weighted by
    nearness and by the corridor ahead drive speed and heading. Here the obstacles' distances by sector take the flies'
    place, so that it runs on any observation.
    """

    Params = WarningParams

    def __init__(self, limits: RobotLimits, params: WarningParams | None = None) -> None:
        self._limits, self._params, self._side = limits, params or WarningParams(), 1.0

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""
        self._side = 1.0

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        p, bearing = self._params, float(observation["goal"][1])
        distance = np.asarray(observation["obstacles"], np.float64)
        ahead = distance * np.cos(BEARINGS)
        aside = distance * np.sin(BEARINGS)
        corridor = np.exp(-((aside / (p.corridor * self._limits.radius)) ** 2))
        gap = np.maximum(distance - self._limits.radius, p.least_gap)
        warning = np.where((ahead > 0.0) & (distance < p.near), corridor * (p.near / gap - 1.0) / p.gain, 0.0)
        left, right = warning[BEARINGS > 0.0].sum(), warning[BEARINGS <= 0.0].sum()
        total = left + right
        if abs(left - right) > p.undecided:
            self._side = 1.0 if right > left else -1.0
        turn = p.to_goal * bearing / (1.0 + total) + self._side * min(p.away * total, p.most_away)
        v = self._limits.v_max / (1.0 + (total / p.slow) ** 2) * max(0.0, math.cos(bearing / (1.0 + total)))
        return action(self._limits, v, turn)
