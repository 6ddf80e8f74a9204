"""What an agent is told: from the robot's cameras, an engine and a short memory to an observation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, transform, wrap_angle
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.nav.agents.surroundings import Surroundings, exact_distances
from flysim.nav.drive import PERIOD_S, Drive
from flysim.nav.seeing import Seeing
from flysim.nav.settings import NO_ENGINE, Settings
from flysim.nav.spaces import FARTHEST_GOAL, TOP_FLIES
from flysim.nav.stage import Stage
from flysim.robots.robot import Robot


class Senses:
    """The senses of one robot: what they told last, and what is remembered of it."""

    def __init__(self, settings: Settings, robot: Robot) -> None:
        """Loads the engine, if the observation needs one.

        Raises:
            FlysimError: a lens that folds the image, or there is no such engine.
        """
        self._observation = settings.observation
        self._cameras = settings.at_work(robot.rig.resized(*settings.size, stretched=True))
        self._seeing: Seeing | None = None
        if settings.observation not in NO_ENGINE:
            self._seeing = Seeing(settings.observation, robot, self._cameras.believed, settings.flies)
        about = settings.counts()
        self._most = about.most
        self._memory = Surroundings(max(1, round(settings.memory / PERIOD_S)), about)
        self._points = np.zeros((0, 3))
        self._pair: ImagePair | None = None

    @property
    def rig(self) -> StereoRig:
        """The cameras as they are to be drawn."""
        return self._cameras.drawn

    def begin(self, rng: np.random.Generator) -> None:
        """A new episode: nothing has been seen."""
        self._memory.clear()
        if self._cameras.disturbed:  # a perfect camera draws nothing from the episode's random numbers
            self._cameras.begin(int(rng.integers(2**63)))
        if self._seeing is not None:
            self._seeing.begin()

    def observe(
        self, stage: Stage, drive: Drive, goal: tuple[float, float], rng: np.random.Generator
    ) -> dict[str, NDArray[Any]]:
        """The observation of this moment, whose keys are those of the environment's docstring.

        Args:
            stage: where the robot is.
            drive: how it moves.
            goal: x, y [m], where it is sent to in the frame of its odometry.
            rng: the engine's source of randomness.
        """
        pose = drive.odometry
        self._pair = None
        off = goal[0] - pose.x, goal[1] - pose.y
        away, bearing = math.hypot(*off), wrap_angle(math.atan2(off[1], off[0]) - pose.yaw)
        found: dict[str, NDArray[Any]] = {
            "goal": np.array([min(away, FARTHEST_GOAL), bearing], np.float32),
            "velocity": np.array(drive.velocity, np.float32),
        }
        if self._observation == "pixels":
            self._pair = self._look(stage, drive)
            return {**found, "left": self._pair.left.copy(), "right": self._pair.right.copy()}
        if self._seeing is None:
            found["obstacles"] = exact_distances(stage.ground.outline, drive.true)
            return found
        self._pair = self._look(stage, drive)
        self._points = self._seeing.see(self._pair, pose, drive.seconds, rng)
        some = self._points[:: math.ceil(max(len(self._points), 1) / self._most)]
        self._memory.add(transform(pose.matrix, some)[:, :2], pose)
        found["obstacles"] = self._memory.distances(pose)
        if self._observation == "flies":
            top = np.zeros((TOP_FLIES, 3), np.float32)
            top[: min(len(self._points), TOP_FLIES)] = self._points[:TOP_FLIES]
            found["flies"] = np.clip(top, -10.0, 10.0)
        return found

    def seen(self, stage: Stage, drive: Drive) -> tuple[ImagePair, Array, Array]:
        """For pictures: the pair, `[n, 3]` this look's points in base_link, `[m, 2]` all remembered, in odometry."""
        if self._pair is None:
            self._pair = self._look(stage, drive)
        return self._pair, self._points, self._memory.points()

    def _look(self, stage: Stage, drive: Drive) -> ImagePair:
        """What the robot sees now, by its cameras as they are."""
        return self._cameras.take(stage.pair(), round(drive.seconds / PERIOD_S), drive.velocity[1])
