"""A simulation and what draws it, set up together: the one place where a world becomes something that can be seen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

from flysim.common.one_of_a_kind import OneOfAKind
from flysim.errors import RendererError
from flysim.geometry.frames import Pose2
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.render.choose import Renderer, RendererName, open_renderer, renderer_here
from flysim.render.light import DAY, LightParams
from flysim.render.look import glance
from flysim.robots.robot import Robot
from flysim.sim.encoders import Encoders
from flysim.sim.simulation import Simulation
from flysim.worlds.model import World

if TYPE_CHECKING:
    from flysim.render.gl import GlRenderer


class Studio(OneOfAKind):
    """One simulation of a robot at a time, and who draws it: by the name that was asked for, or `tiny` with `auto`.

    With a rig it draws that rig's pairs and nothing else, in a hurry; what `gl` needs for that outlives a simulation.
    Without one it has `eyes`, which draw any camera with the truth behind each pixel.
    """

    def __init__(
        self, robot: Robot, renderer: RendererName | None, light: LightParams = DAY, rig: StereoRig | None = None
    ) -> None:
        """Opens nothing yet.

        Args:
            robot: who drives and looks.
            renderer: "gl", "tiny", or "auto": gl where a context opens and its driver takes the world; None: nobody
                looks.
            light: in the world.
            rig: whose pairs alone are to be drawn; None: whatever `eyes` is asked for.
        """
        self.drawn_by: Literal["gl", "tiny"] | None = None
        self._asked: RendererName | None = renderer
        self._robot, self._light, self._rig = robot, light, rig
        self._simulation: Simulation | None = None
        self._eyes: Renderer | None = None
        self._quick: GlRenderer | None = None
        self._drawn: World | None = None  # for which it was last chosen who draws

    @property
    def simulation(self) -> Simulation:
        """The physics of the moment, with the robot in it."""
        assert self._simulation is not None  # `set_up` comes first
        return self._simulation

    @property
    def eyes(self) -> Renderer:
        """What draws the simulation of the moment."""
        assert self._eyes is not None  # `set_up` comes first, and there is no rig
        return self._eyes

    def set_up(self, world: World, start: Pose2, encoders: Encoders | None = None) -> Simulation:
        """The world as its file has it, with the robot at `start`, in place of what stood here before.

        Args:
            world: what stands there.
            start: where the robot is set down.
            encoders: of its wheels; None: without a flaw.

        Raises:
            RendererError: an unknown name, `gl` was asked for and no context opens or its driver refuses the world,
                or a light that `tiny` cannot draw.
            FlysimError: as `Simulation`.
        """
        self._clear()
        if self._asked is None:
            self._simulation = Simulation(world, self._robot, start, encoders=encoders)
            return self._simulation
        here = self.drawn_by if self.drawn_by and world is self._drawn else renderer_here(self._asked)
        try:
            simulation = self._build(world, start, here, encoders)
        except RendererError:
            self.close()
            if self._asked == "gl" or here == "tiny":
                raise
            here = "tiny"
            simulation = self._build(world, start, here, encoders)
        self.drawn_by, self._drawn = here, world
        return simulation

    def _build(self, world: World, start: Pose2, name: Literal["gl", "tiny"], encoders: Encoders | None) -> Simulation:
        """Only `tiny` draws what pybullet keeps."""
        self._simulation = Simulation(world, self._robot, start, textured=name == "tiny", encoders=encoders)
        if self._rig is not None and name == "gl":
            self._bind(self._simulation, self._rig)
        else:
            self._eyes = open_renderer(name, self._simulation, self._light)
        return self._simulation

    def _bind(self, simulation: Simulation, rig: StereoRig) -> None:
        """One context draws all simulations: moderngl keeps 40 kB of each that is closed."""
        from flysim.render.gl import GlRenderer

        if self._quick is None:
            self._quick = GlRenderer(simulation, self._light, rig)
        else:
            self._quick.bind(simulation)

    def pair(self) -> ImagePair:
        """What the robot's two cameras, or those of the rig, see now."""
        rig = self._robot.rig if self._rig is None else self._rig
        return glance(self.simulation, self._quick or self.eyes, rig)

    def _clear(self) -> None:
        """Frees what belongs to the simulation of the moment, and that."""
        if self._eyes is not None:
            self._eyes.close()
            self._eyes = None
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None

    def close(self) -> None:
        """Frees the client and the context. Safe to call twice."""
        self._clear()
        if self._quick is not None:
            self._quick.close()
            self._quick = None
        self._drawn = None


@contextmanager
def drawn(
    world: World,
    robot: Robot,
    start: Pose2,
    name: RendererName,
    light: LightParams = DAY,
    encoders: Encoders | None = None,
) -> Iterator[tuple[Simulation, Renderer]]:
    """A simulation and what draws it, closed when the block ends.

    Raises:
        FlysimError: as `Studio.set_up`.
    """
    studio = Studio(robot, name, light)
    try:
        yield studio.set_up(world, start, encoders), studio.eyes
    finally:
        studio.close()
