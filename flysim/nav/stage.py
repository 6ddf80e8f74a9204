"""What an episode needs and what outlives it: the world, its ground, the eyes, and the simulation of the moment."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flysim.common.scratch import Scratch
from flysim.errors import FlysimError, RendererError
from flysim.geometry.frames import Pose2
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.nav.worlds import find_difficulty, named_world, random_world
from flysim.paths.course import Ground
from flysim.render.choose import RendererName, renderer_here
from flysim.render.gl import GlRenderer
from flysim.render.light import DAY, LightParams
from flysim.render.look import glance
from flysim.render.tiny import TinyRenderer, refuse_light
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
    ) -> None:
        """Reads a named world; a random one waits for `renew`, and has no textures unless somebody `looks`.

        Raises:
            FlysimError: the world cannot be used.
        """
        self.robot, self.rig, self._light = robot, rig, light
        self._renderer: RendererName = renderer
        self.drawn_by: RendererName = renderer  # once it is set up: "gl" or "tiny"
        self._difficulty, self._looks = find_difficulty(name), looks
        self._eyes: GlRenderer | None = None
        self._refused: World | None = None  # what the driver has refused, so that `tiny` draws it
        self._scratch: Scratch | None = None
        self._simulation: Simulation | None = None
        self._ground: Ground | None = None
        if self._difficulty is None:
            self._ground = Ground(named_world(name, dressed=dressed), robot)

    @property
    def ground(self) -> Ground:
        """The floor of this episode's world: what of it is free, and how far it is to anywhere."""
        assert self._ground is not None  # `renew` comes first
        return self._ground

    @property
    def simulation(self) -> Simulation:
        """The physics of this episode, with the robot in it."""
        assert self._simulation is not None  # `set_up` comes first
        return self._simulation

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
        self._close_simulation()
        if not self._looks:
            return self._open(start)
        if self._refused is not self.world:
            self.drawn_by = renderer_here(self._renderer)
        if self.drawn_by == "gl":
            try:
                return self._seen(start)
            except RendererError:
                self._close_eyes()
                self._close_simulation()
                if self._renderer == "gl":
                    raise
                self.drawn_by, self._refused = "tiny", self.world
        refuse_light(self._light)
        return self._open(start)

    def _open(self, start: Pose2) -> Simulation:
        textured = self._looks and self.drawn_by == "tiny"
        self._simulation = Simulation(self.world, self.robot, start, textured=textured)
        return self._simulation

    def _seen(self, start: Pose2) -> Simulation:
        """The world with eyes that draw it; those of the episode before, if there are any."""
        simulation = self._open(start)
        if self._eyes is None:
            self._eyes = GlRenderer(simulation, self._light, self.rig)
        else:
            self._eyes.bind(simulation)
        return simulation

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
        return glance(self.simulation, self._eyes or TinyRenderer(self.simulation, self._light), self.rig)

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
