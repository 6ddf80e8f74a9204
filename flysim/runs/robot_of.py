"""The robot of a scenario: its file, read as the scenario says."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flysim.runs.scenario import Scenario

if TYPE_CHECKING:
    from flysim.robots.robot import Robot


def robot_of(plan: Scenario) -> Robot:
    """A scenario's robot, with the wheels and the cameras that the scenario gives it.

    Raises:
        RobotError: it cannot be read.
    """
    from flysim.robots.robot import read_robot

    return read_robot(plan.robot_path, plan.wheels, plan.cameras)
