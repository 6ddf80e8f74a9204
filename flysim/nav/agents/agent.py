"""Who drives: agents that map an observation to an action, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from flysim.common.catalogue import find_policy
from flysim.errors import FlysimError, did_you_mean
from flysim.geometry.frames import wrap_angle
from flysim.nav.agents.surroundings import sector_bearings

Observation = Mapping[str, NDArray[Any]]
BEARINGS = sector_bearings()


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """What an agent may know of its robot.

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
    """Drives one episode after another."""

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode."""
        ...

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """`[2]` shares of the largest speed and yaw rate."""
        ...


def action(body: Body, v: float, w: float) -> NDArray[np.float32]:
    """The action for v [m/s] and yaw rate w [rad/s], as far as the robot can do it."""
    return np.array([np.clip(v / body.v_max, 0.0, 1.0), np.clip(w / body.w_max, -1.0, 1.0)], np.float32)


def towards(body: Body, bearing: float, speed: float) -> NDArray[np.float32]:
    """Turns to a bearing [rad] and drives there at up to `speed` [m/s], the slower the more it has to turn."""
    v = speed * max(0.0, math.cos(bearing)) ** 3 if abs(bearing) < math.pi / 2.0 else 0.0
    return action(body, v, 2.5 * bearing)


class RandomAgent:
    """A random action each time: what chance achieves."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode."""
        self._rng = rng

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        return self._rng.uniform((0.0, -1.0), (1.0, 1.0)).astype(np.float32)


class StraightAgent:
    """Turns to the goal and drives there, whatever is in between: what no eyes achieve."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode."""

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        return towards(self._body, float(observation["goal"][1]), self._body.v_max)


class WarningAgent:
    """Louchet's warning values: what is near and in the corridor ahead warns, and turns the robot away.

    Boumaza and Louchet, "Dynamic flies: using real-time parisian evolution in robotics", 2001: flies weighted by
    nearness and by the corridor ahead drive speed and heading. Here the obstacles' distances by sector take the flies'
    place, so that it runs on any observation.
    """

    NEAR = 1.2  # [m] beyond which nothing warns
    SLOW = 1.5  # sum of warnings that halves the speed

    def __init__(self, body: Body) -> None:
        self._body, self._side = body, 1.0

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode."""
        self._side = 1.0

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        bearing = float(observation["goal"][1])
        distance = np.asarray(observation["obstacles"], np.float64)
        ahead = distance * np.cos(BEARINGS)
        aside = distance * np.sin(BEARINGS)
        corridor = np.exp(-((aside / (1.6 * self._body.radius)) ** 2))
        gap = np.maximum(distance - self._body.radius, 0.02)
        warning = np.where((ahead > 0.0) & (distance < self.NEAR), corridor * (self.NEAR / gap - 1.0) / 4.0, 0.0)
        left, right = warning[BEARINGS > 0.0].sum(), warning[BEARINGS <= 0.0].sum()
        total = left + right
        if abs(left - right) > 0.05:
            self._side = 1.0 if right > left else -1.0
        turn = 1.2 * bearing / (1.0 + total) + self._side * min(1.2 * total, 2.0)
        v = self._body.v_max / (1.0 + (total / self.SLOW) ** 2) * max(0.0, math.cos(bearing / (1.0 + total)))
        return action(self._body, v, turn)


AGENTS = ("straight", "warning", "vfh", "dwa", "ppo", "random")


def make_agent(name: str, body: Body) -> Agent:
    """An agent by name, or the path of a policy file that `flysim train` wrote.

    Raises:
        FlysimError: there is none of that name, or the policy cannot be used.
    """
    from flysim.nav.agents.dwa import DwaAgent
    from flysim.nav.agents.vfh import VfhAgent

    kinds = {
        "straight": StraightAgent,
        "warning": WarningAgent,
        "vfh": VfhAgent,
        "dwa": DwaAgent,
        "random": RandomAgent,
    }
    if name == "ppo" or name.endswith(".npz"):
        from flysim.nav.agents.policy import PolicyAgent, load_policy

        return PolicyAgent(body, load_policy(find_policy(name)))
    if name not in kinds:
        raise FlysimError(f"no agent '{name}'. {did_you_mean(name, AGENTS)}")
    return kinds[name](body)


def turned(bearing: float, by: float) -> float:
    """A bearing [rad] after a turn."""
    return wrap_angle(bearing - by)
