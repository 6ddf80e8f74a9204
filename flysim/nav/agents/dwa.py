"""DWA: the dynamic window on the fly map.

Fox, Burgard and Thrun, "The dynamic window approach to collision avoidance", 1997: among the speeds that can be reached
and from which the robot can still stop, the one that scores best by heading, clearance and speed. The heading is that
of a point on the cheapest way over the agent's chart, as in move_base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flysim.common.ranges import ranged
from flysim.common.records import record_of
from flysim.nav.agents.agent import Observation, RobotLimits, action
from flysim.nav.agents.chart import Chart
from flysim.nav.agents.chart_params import ChartParams
from flysim.nav.drive import LIMITS


@dataclass(frozen=True, slots=True, kw_only=True)
class DwaParams:
    """How DWA scores a command; chosen on `random-medium` and `random-hard`.

    Attributes:
        speeds: speeds of the window that are tried.
        turns: yaw rates of the window that are tried.
        horizon: for how long a command is thought to hold [s].
        moments: points in that time at which it is looked for contact.
        replan: periods between two plans over the chart.
        margin: kept free beyond the robot's radius [m].
        near: clearance beyond which more is no better [m].
        w_way: weight of the distance left to the point on the way.
        w_clear: of the clearance, as a share of `near`.
        w_speed: of the speed, as a share of the largest.
        w_heading: of the angle left to the point on the way.
        acceleration, turn_acceleration: that it takes its wheels to be capable of [m/s^2], [rad/s^2].
        brake: share of that acceleration with which it must be able to stop before it touches something.
        carrot: how far the point on the way is that it heads for [m], standing.
        carrot_s: and so much more for each m/s of its largest speed [s].
        escape: it never counts a touch that is so much farther than what is nearest already [m].
        spin: share of the largest yaw rate with which it turns where no command is free.
        chart: of its chart, a `ChartParams` or a dict of its fields.
    """

    speeds: int = 9
    turns: int = 21
    horizon: float = 1.2
    moments: int = 12
    replan: int = 5
    margin: float = 0.04
    near: float = 0.35
    w_way: float = 2.0
    w_clear: float = 0.9
    w_speed: float = 0.5
    w_heading: float = 0.6
    acceleration: float = LIMITS.acceleration
    turn_acceleration: float = LIMITS.turn_acceleration
    brake: float = 0.8
    carrot: float = 0.5
    carrot_s: float = 0.6
    escape: float = 0.01
    spin: float = 0.6
    chart: ChartParams = field(default_factory=ChartParams)

    def __post_init__(self) -> None:
        weights = dict.fromkeys(("w_way", "w_clear", "w_speed", "w_heading"), (0.0, 1e3))
        ranged(
            self,
            speeds=(2, 101),
            turns=(2, 201),
            horizon=(0.1, 10.0),
            moments=(2, 200),
            replan=(1, 1000),
            margin=(0.0, 1.0),
            near=(0.01, 10.0),
            acceleration=(0.01, 100.0),
            turn_acceleration=(0.01, 1000.0),
            brake=(0.01, 1.0),
            carrot=(0.05, 20.0),
            carrot_s=(0.0, 20.0),
            escape=(0.0, 1.0),
            spin=(0.0, 1.0),
            **weights,
        )
        object.__setattr__(self, "chart", record_of(ChartParams, "chart", self.chart))


class DwaAgent:
    """Scores a window of speeds and yaw rates by where they lead in a second."""

    Params = DwaParams

    def __init__(self, limits: RobotLimits, params: DwaParams | None = None) -> None:
        self._limits, self._params = limits, params or DwaParams()
        self._chart = Chart(limits.radius + self._params.margin, limits.period, self._params.chart)
        self._turn = 0
        self._v = self._w = 0.0

    def begin(self, rng: np.random.Generator) -> None:
        """Forgets the last episode: a new one begins."""
        self._chart.clear()
        self._turn, self._v, self._w = 0, 0.0, 0.0

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        limits, p = self._limits, self._params
        distance, bearing = (float(v) for v in observation["goal"])
        self._chart.update(observation["velocity"], observation["obstacles"])
        if self._turn % p.replan == 0:
            self._chart.plan(distance, bearing)
        self._turn += 1
        carrot = self._chart.ahead(p.carrot + p.carrot_s * limits.v_max) or (distance, bearing)
        target = carrot[0] * math.cos(carrot[1]), carrot[0] * math.sin(carrot[1])
        v, w = self._window(observation["velocity"])
        x, y, yaw = _arcs(v, w, p.horizon, p.moments)
        points = self._chart.taken(limits.v_max * p.horizon + 1.0)
        clear = np.full(len(v), p.near)
        stops = np.full(len(v), True)
        if len(points):
            gaps = np.hypot(x[:, :, None] - points[:, 0], y[:, :, None] - points[:, 1]).min(axis=2) - limits.radius
            clear = np.clip(gaps.min(axis=1), -limits.radius, p.near)
            # How far it goes before it would touch, against how far it goes before it stands.
            now = float(np.hypot(points[:, 0], points[:, 1]).min()) - limits.radius
            touches = gaps < min(p.margin / 2.0, now - p.escape)  # it may always go away from what is too near
            first = np.where(touches.any(axis=1), touches.argmax(axis=1), p.moments)
            run = v * (first / p.moments) * p.horizon
            stops = (
                (run > v**2 / (2.0 * p.brake * p.acceleration) + v * limits.period) | (first == p.moments) | (v < 1e-3)
            )
        end = np.hypot(x[:, -1] - target[0], y[:, -1] - target[1])
        error = np.abs(
            (np.arctan2(target[1] - y[:, -1], target[0] - x[:, -1]) - yaw[:, -1] + math.pi) % math.tau - math.pi
        )
        score = -p.w_way * end - p.w_heading * error + p.w_clear * clear / p.near + p.w_speed * v / limits.v_max
        score[~stops] -= 100.0
        if not stops.any() or (v[int(np.argmax(score))] < 0.02 and abs(w[int(np.argmax(score))]) < 0.05):
            return action(limits, 0.0, math.copysign(p.spin * limits.w_max, carrot[1]))
        best = int(np.argmax(score))
        return action(limits, float(v[best]), float(w[best]))

    def _window(self, velocity: NDArray) -> tuple[NDArray, NDArray]:
        """`[n]` speeds and yaw rates that the wheels can reach in two periods."""
        limits, p, dt = self._limits, self._params, 2.0 * self._limits.period
        now, turning = float(velocity[0]), float(velocity[1])
        low, high = max(0.0, now - p.acceleration * dt), min(limits.v_max, now + p.acceleration * dt)
        left, right = (
            max(-limits.w_max, turning - p.turn_acceleration * dt),
            min(limits.w_max, turning + p.turn_acceleration * dt),
        )
        v, w = np.meshgrid(np.linspace(low, max(high, low), p.speeds), np.linspace(left, max(right, left), p.turns))
        return v.ravel(), w.ravel()


def _arcs(v: NDArray, w: NDArray, horizon: float, moments: int) -> tuple[NDArray, NDArray, NDArray]:
    """`[n, moments]` x, y [m] and heading [rad] along the arc of each command."""
    t = np.linspace(horizon / moments, horizon, moments)
    yaw = w[:, None] * t
    chord = v[:, None] * t * np.sinc(yaw / 2.0 / math.pi)
    return chord * np.cos(yaw / 2.0), chord * np.sin(yaw / 2.0), yaw
