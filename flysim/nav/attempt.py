"""One attempt at a course, from its start on: how far it is, what a step earns, and when it is over."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flysim.nav.drive import Drive
from flysim.nav.scores import soft_spl, spl
from flysim.nav.settings import Settings
from flysim.paths.course import Course, Ground
from flysim.paths.field import Field

TIME_COST, COLLISION_COST, SUCCESS_GAIN = 0.01, 10.0, 10.0


class Attempt:
    """A robot under way to a goal, and the account of it."""

    def __init__(self, course: Course, ground: Ground, drive: Drive, settings: Settings) -> None:
        """The robot stands at the start of its course.

        Args:
            course: from where to where.
            ground: what it is on.
            drive: that moves the robot.
            settings: what it means to arrive, and how long it may take.
        """
        self.course, self.ground, self.drive = course, ground, drive
        self._settings = settings
        self.field = Field(ground, course.goal)
        self._way_left = self.field.at(course.start.x, course.start.y)
        self._clearance = ground.clearance(course.start.x, course.start.y)
        self._success, self._hit = False, ""
        self.over = False

    def go(self, v: float, w: float) -> tuple[float, bool, bool]:
        """One period towards speed v [m/s] and yaw rate w [rad/s].

        Returns:
            The reward; whether the robot arrived or touched something; whether the time is over.
        """
        self._hit = self.drive.go(v, w) or ""
        true, settings = self.drive.true, self._settings
        before, self._way_left = self._way_left, self.field.at(true.x, true.y)
        self._clearance = min(self._clearance, self.ground.clearance(true.x, true.y))
        collision = bool(self._hit)
        self._success = not collision and math.dist((true.x, true.y), self.course.goal) <= settings.goal_radius
        reward = before - self._way_left - TIME_COST - COLLISION_COST * collision + SUCCESS_GAIN * self._success
        terminated = collision or self._success
        truncated = not terminated and self.drive.seconds >= settings.time_limit - 1e-9
        self.over = terminated or truncated
        return float(reward), terminated, truncated

    def info(self) -> dict[str, Any]:
        """The environment's `info`, whose docstring has its keys."""
        shortest, driven, true = self.course.shortest, self.drive.driven, self.drive.true
        return {
            "success": self._success,
            "spl": spl(self._success, shortest, driven),
            "soft_spl": soft_spl(0.0 if self._success else self._way_left, shortest, driven),
            "collisions": int(bool(self._hit)),
            "path_length": driven,
            "clearance": self._clearance,
            "shortest": shortest,
            "distance": self._way_left,
            "time": self.drive.seconds,
            "position": np.array([true.x, true.y, true.yaw]),
            "hit": self._hit,
        }
