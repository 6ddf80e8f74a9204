"""VFH: the vector field histogram on the fly map.

Borenstein and Koren, "The vector field histogram - fast obstacle avoidance for mobile robots", 1991; sectors widened by
the robot's radius and the cost of a direction as in VFH+ (Ulrich and Borenstein, 1998).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, wrap_angle
from flysim.nav.agents.agent import Body, Observation, action
from flysim.nav.agents.chart import Chart

DIRECTIONS = 72
LOOK = 1.6  # [m] what is farther off does not block a direction
REPLAN = 5  # periods between two plans
MARGIN = 0.08  # [m] beyond the robot's radius
CARROT = 0.9  # [m] of the point on the way that it heads for
W_GOAL, W_HEADING, W_LAST = 5.0, 1.5, 1.5  # of the cost of a direction


class VfhAgent:
    """Heads for the open direction nearest to where the way over its chart leads."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._chart = Chart(body.radius + MARGIN, body.period)
        self._turn = 0
        self._last = 0.0

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode."""
        self._chart.clear()
        self._turn, self._last = 0, 0.0

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Shares of the largest speed and yaw rate."""
        distance, bearing = (float(v) for v in observation["goal"])
        self._chart.update(observation["velocity"], observation["obstacles"])
        if self._turn % REPLAN == 0:
            self._chart.plan(distance, bearing)
        self._turn += 1
        carrot = self._chart.ahead(CARROT)
        aim = carrot[1] if carrot is not None else bearing
        points = self._chart.taken(LOOK)
        directions = np.asarray((np.arange(DIRECTIONS) + 0.5) * (math.tau / DIRECTIONS) - math.pi, np.float64)
        reach = min(LOOK, distance + 0.1)
        room = free_run(points, directions, self._body.radius + MARGIN, reach)
        now = self._last - float(observation["velocity"][1]) * self._body.period
        cost = (
            W_GOAL * np.abs(_wrapped(directions - aim))
            + W_HEADING * np.abs(directions)
            + W_LAST * np.abs(_wrapped(directions - now))
            + 8.0 * np.maximum(0.0, 0.8 - room / reach)
        )
        cost[room < 0.12] += 50.0
        best = int(np.argmin(cost))
        # Between two directions: the aim itself, where it is open.
        heading = float(directions[best])
        if abs(wrap_angle(aim - heading)) < math.tau / DIRECTIONS:
            heading = aim
        self._last = heading
        open_ahead = float(free_run(points, np.zeros(1), self._body.radius + 0.03, reach)[0])
        v = min(self._body.v_max, math.sqrt(max(0.0, 0.9 * (open_ahead - 0.06))), 0.2 + 1.5 * distance)
        v *= max(0.0, math.cos(heading)) ** 2 if abs(heading) < math.pi / 2.0 else 0.0
        return action(self._body, v, 3.0 * heading)


def free_run(points: Array, directions: Array, room: float, reach: float) -> Array:
    """`[k]` how far [m] a circle of radius `room` can go in each direction before it meets a point, `reach` at most."""
    if not len(points):
        return np.full(len(directions), reach)
    cos, sin = np.cos(directions)[:, None], np.sin(directions)[:, None]
    along = points[:, 0] * cos + points[:, 1] * sin
    aside = np.abs(points[:, 1] * cos - points[:, 0] * sin)
    meets = (aside < room) & (along > 0.0)
    run = along - np.sqrt(np.maximum(room**2 - aside**2, 0.0))
    return np.clip(np.where(meets, run, reach).min(axis=1), 0.0, reach)


def _wrapped(angle: Array) -> Array:
    return (angle + math.pi) % math.tau - math.pi
