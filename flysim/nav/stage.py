"""What an episode needs and what outlives it: the world, its ground, the eyes, and the simulation of the moment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flysim.errors import RendererError
from flysim.geometry.frames import Pose2
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.nav.course import Ground
from flysim.nav.worlds import find_difficulty, named_world, random_world
from flysim.scratch import Scratch
from flysim.sim.look import look
from flysim.sim.render_pair import PairRenderer
from flysim.sim.render_tiny import TinyRenderer
from flysim.sim.renderer import RendererName
from flysim.sim.robot import Robot
from flysim.sim.simulation import Simulation
from flysim.world.model import World


class Stage:
    """Owns one simulation at a time, and the pictures of it. Whatever stays between episodes is made once."""

    def __init__(
        self, name: str, robot: Robot, rig: StereoRig, renderer: RendererName, *, dressed: bool, looks: bool = True
    ) -> None:
        """Reads a named world; a random one waits for `renew`, and has no textures unless somebody `looks`.

        Raises:
            FlysimError: the world or the renderer cannot be used.
        """
        self.robot, self.rig = robot, rig
        self.drawn_by = renderer
        self._difficulty, self._looks = find_difficulty(name), looks
        self._eyes: PairRenderer | None = None
        self._scratch: Scratch | None = None
        self._simulation: Simulation | None = None
        self._ground: Ground | None = None
        if self._difficulty is None:
            self._ground = Ground(named_world(name, dressed=dressed), robot)

    @property
    def ground(self) -> Ground:
        """Of the world of this episode."""
        assert self._ground is not None  # `renew` comes first
        return self._ground

    @property
    def simulation(self) -> Simulation:
        """Of this episode."""
        assert self._simulation is not None  # `set_up` comes first
        return self._simulation

    def renew(self, rng: np.random.Generator) -> None:
        """Draws another world, if it is a random one."""
        if self._difficulty is None:
            return
        self._close_eyes()
        self._drop_scratch()
        self._scratch = Scratch()
        world = random_world(
            Path(self._scratch.name) / "world", int(rng.integers(2**31)), self._difficulty, plain=not self._looks
        )
        self._ground = Ground(world, self.robot)

    def set_up(self, start: Pose2) -> Simulation:
        """The world as its file has it, with the robot at `start`."""
        self._close_simulation()
        tiny = self.drawn_by == "tiny"
        self._simulation = Simulation(self.world, self.robot, start, textured=tiny)
        return self._simulation

    @property
    def world(self) -> World:
        """Of this episode."""
        return self.ground.world

    def pair(self) -> ImagePair:
        """What the robot sees now.

        Raises:
            RendererError: `gl` was asked for and no context opens.
        """
        if self._eyes is None and self.drawn_by != "tiny":
            try:
                self._eyes = PairRenderer(self.world, self.robot, self.rig)
            except RendererError:
                if self.drawn_by == "gl":
                    raise
                self.drawn_by = "tiny"
                self._again_with_textures()
        if self._eyes is not None:
            return self._eyes.pair(self.simulation)
        return look(self.simulation, TinyRenderer(self.simulation), self.rig)[0]

    def _again_with_textures(self) -> None:
        """`auto` finds out at the first picture, before anything has moved."""
        self.set_up(self.simulation.odometry.pose)

    def _close_eyes(self) -> None:
        if self._eyes is not None:
            self._eyes.close()
            self._eyes = None

    def _close_simulation(self) -> None:
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None

    def _drop_scratch(self) -> None:
        if self._scratch is not None:
            self._scratch.cleanup()
            self._scratch = None

    def close(self) -> None:
        """Frees the client, the context and the files. Safe to call twice."""
        self._close_simulation()
        self._close_eyes()
        self._drop_scratch()
