"""What an episode needs and what outlives it: the world, its ground, and the studio that it is played in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flysim.common.scratch import Scratch
from flysim.errors import FlysimError
from flysim.geometry.frames import Pose2
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.nav.worlds import find_difficulty, named_world, random_world
from flysim.paths.course import Ground
from flysim.render.choose import RendererName
from flysim.render.light import DAY, LightParams
from flysim.render.studio import Studio
from flysim.robots.robot import Robot
from flysim.sim.simulation import Simulation
from flysim.worlds.model import World


class Stage:
    """Owns one simulation at a time, and the pictures of it. Whatever stays between episodes is made once."""

    def __init__(
        self,
        name: str,
        robot: Robot,
        rig: StereoRig,
        renderer: RendererName,
        *,
        light: LightParams = DAY,
        dressed: bool,
        looks: bool = True,
        models: Sequence[str] = (),
    ) -> None:
        """Reads a named world; a random one waits for `renew`, and has no textures unless somebody `looks`.

        Raises:
            FlysimError: the world cannot be used.
        """
        self.robot = robot
        self.studio = Studio(robot, renderer if looks else None, light, rig)
        self._difficulty, self._looks = find_difficulty(name), looks
        self._scratch: Scratch | None = None
        self._ground: Ground | None = None
        if self._difficulty is None:
            self._ground = Ground(named_world(name, dressed=dressed, models=models), robot)

    @property
    def ground(self) -> Ground:
        """The floor of this episode's world: what of it is free, and how far it is to anywhere."""
        assert self._ground is not None  # `renew` comes first
        return self._ground

    @property
    def simulation(self) -> Simulation:
        """The physics of this episode, with the robot in it."""
        return self.studio.simulation

    def renew(self, rng: np.random.Generator) -> None:
        """Draws another world, if it is a random one."""
        if self._difficulty is None:
            return
        self._drop_scratch()
        self._scratch = Scratch()
        world = random_world(
            Path(self._scratch.name) / "world", int(rng.integers(2**31)), self._difficulty, plain=not self._looks
        )
        self._ground = Ground(world, self.robot)

    def set_up(self, start: Pose2) -> Simulation:
        """The world as its file has it, with the robot at `start`.

        Raises:
            RendererError: `gl` was asked for, and no context opens or the driver refuses the world.
        """
        return self.studio.set_up(self.world, start)

    @property
    def world(self) -> World:
        """What stands in this episode."""
        return self.ground.world

    def pair(self) -> ImagePair:
        """What the robot sees now.

        Raises:
            FlysimError: nobody was to look.
        """
        if not self._looks:
            raise FlysimError('this environment has no eyes: make it with render_mode="rgb_array"')
        return self.studio.pair()

    def _drop_scratch(self) -> None:
        if self._scratch is not None:
            self._scratch.cleanup()
            self._scratch = None

    def close(self) -> None:
        """Frees the client, the context and the files. Safe to call twice."""
        self.studio.close()
        self._drop_scratch()
