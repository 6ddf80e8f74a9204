"""DWA: the dynamic window on the fly map.

Fox, Burgard and Thrun, "The dynamic window approach to collision avoidance", 1997: among the speeds that can be reached
and from which the robot can still stop, the one that scores best by heading, clearance and speed. The heading is that
of a point on the cheapest way over the agent's chart, as in move_base.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.nav.agents.agent import Body, Observation, action
from flysim.nav.agents.chart import Chart
from flysim.nav.drive import ACCELERATION, TURN_ACCELERATION

SPEEDS, TURNS = 9, 21
HORIZON, MOMENTS = 1.2, 12  # [s] that a command is thought to hold, and moments in it
REPLAN = 5  # periods between two plans
MARGIN = 0.04  # [m] beyond the robot's radius
NEAR = 0.35  # [m] of clearance beyond which more is no better
W_WAY, W_CLEAR, W_SPEED, W_HEADING = 2.0, 0.9, 0.5, 0.6


class DwaAgent:
    """Scores a window of speeds and yaw rates by where they lead in a second."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._chart = Chart(body.radius + MARGIN, body.period)
        self._turn = 0
        self._v = self._w = 0.0

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode."""
        self._chart.clear()
        self._turn, self._v, self._w = 0, 0.0, 0.0

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        body = self._body
        distance, bearing = (float(v) for v in observation["goal"])
        self._chart.update(observation["velocity"], observation["obstacles"])
        if self._turn % REPLAN == 0:
            self._chart.plan(distance, bearing)
        self._turn += 1
        carrot = self._chart.ahead(0.5 + 0.6 * body.v_max) or (distance, bearing)
        target = carrot[0] * math.cos(carrot[1]), carrot[0] * math.sin(carrot[1])
        v, w = self._window(observation["velocity"])
        x, y, yaw = _arcs(v, w)
        points = self._chart.taken(body.v_max * HORIZON + 1.0)
        clear = np.full(len(v), NEAR)
        stops = np.full(len(v), True)
        if len(points):
            gaps = np.hypot(x[:, :, None] - points[:, 0], y[:, :, None] - points[:, 1]).min(axis=2) - body.radius
            clear = np.clip(gaps.min(axis=1), -body.radius, NEAR)
            # How far it goes before it would touch, against how far it goes before it stands.
            now = float(np.hypot(points[:, 0], points[:, 1]).min()) - body.radius
            touches = gaps < min(MARGIN / 2.0, now - 0.01)  # it may always go away from what is too near
            first = np.where(touches.any(axis=1), touches.argmax(axis=1), MOMENTS)
            run = v * (first / MOMENTS) * HORIZON
            stops = (run > v**2 / (2.0 * 0.8 * ACCELERATION) + v * body.period) | (first == MOMENTS) | (v < 1e-3)
        end = np.hypot(x[:, -1] - target[0], y[:, -1] - target[1])
        error = np.abs(
            (np.arctan2(target[1] - y[:, -1], target[0] - x[:, -1]) - yaw[:, -1] + math.pi) % math.tau - math.pi
        )
        score = -W_WAY * end - W_HEADING * error + W_CLEAR * clear / NEAR + W_SPEED * v / body.v_max
        score[~stops] -= 100.0
        if not stops.any() or (v[int(np.argmax(score))] < 0.02 and abs(w[int(np.argmax(score))]) < 0.05):
            return action(body, 0.0, math.copysign(0.6 * body.w_max, carrot[1]))
        best = int(np.argmax(score))
        return action(body, float(v[best]), float(w[best]))

    def _window(self, velocity: NDArray) -> tuple[NDArray, NDArray]:
        """`[n]` speeds and yaw rates that the wheels can reach in two periods."""
        body, dt = self._body, 2.0 * self._body.period
        now, turning = float(velocity[0]), float(velocity[1])
        low, high = max(0.0, now - ACCELERATION * dt), min(body.v_max, now + ACCELERATION * dt)
        left, right = (
            max(-body.w_max, turning - TURN_ACCELERATION * dt),
            min(body.w_max, turning + TURN_ACCELERATION * dt),
        )
        v, w = np.meshgrid(np.linspace(low, max(high, low), SPEEDS), np.linspace(left, max(right, left), TURNS))
        return v.ravel(), w.ravel()


def _arcs(v: NDArray, w: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """`[n, MOMENTS]` x, y [m] and heading [rad] along the arc of each command."""
    t = np.linspace(HORIZON / MOMENTS, HORIZON, MOMENTS)
    yaw = w[:, None] * t
    chord = v[:, None] * t * np.sinc(yaw / 2.0 / math.pi)
    return chord * np.cos(yaw / 2.0), chord * np.sin(yaw / 2.0), yaw
