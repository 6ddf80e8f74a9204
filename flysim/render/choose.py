"""One signature for every renderer, and the choice between them."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Literal, Protocol

import numpy as np

from flysim.errors import RendererError, did_you_mean
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, Pose2
from flysim.robots.robot import Robot
from flysim.sim.simulation import Simulation
from flysim.worlds.model import World
from flysim.worlds.view import TrueView

RendererName = Literal["auto", "gl", "tiny"]

# One light for all renderers: a high sun, no shadow, no gloss, so that both eyes see the same shading.
LIGHT_DIRECTION = (0.35, 0.25, 0.9)  # towards the light, world frame
AMBIENT, DIFFUSE = 0.6, 0.4
NEAR, FAR = 0.05, 60.0  # [m]
SKY = (178, 200, 220)  # RGB where nothing is


class Renderer(Protocol):
    """Draws a simulation's present state; bound to one simulation."""

    name: str

    def view(self, camera: Camera, T_world_optical: Array) -> TrueView:
        """What a camera at `T_world_optical` sees, with exact depth and body of each pixel."""
        ...

    def close(self) -> None:
        """Frees what it holds."""
        ...


def open_renderer(name: RendererName, simulation: Simulation) -> Renderer:
    """`gl` (moderngl through EGL), `tiny` (pybullet's own), or `auto`: gl where a context opens.

    `tiny` needs a simulation built with `textured=True`.

    Raises:
        RendererError: an unknown name, or `gl` asked for where no context opens.
    """
    if renderer_here(name) == "gl":
        from flysim.render.gl import GlRenderer

        return GlRenderer(simulation)
    from flysim.render.tiny import TinyRenderer

    return TinyRenderer(simulation)


@contextmanager
def drawn(world: World, robot: Robot, start: Pose2, name: RendererName) -> Iterator[tuple[Simulation, Renderer]]:
    """A simulation and what draws it, closed when the block ends.

    With `auto` it is `tiny` as well where a context opens, but its driver refuses the world.

    Raises:
        RendererError: as `open_renderer`.
        FlysimError: as `Simulation`.
    """
    with ExitStack() as stack:

        def opened(name: RendererName) -> tuple[Simulation, Renderer]:
            simulation = stack.enter_context(Simulation(world, robot, start, textured=name == "tiny"))
            eyes = open_renderer(name, simulation)
            stack.callback(eyes.close)
            return simulation, eyes

        here = renderer_here(name)
        try:
            simulation, eyes = opened(here)
        except RendererError:
            if name == here:
                raise
            stack.close()
            simulation, eyes = opened("tiny")
        yield simulation, eyes


def renderer_here(name: RendererName) -> Literal["gl", "tiny"]:
    """What `auto` stands for on this machine; "gl" and "tiny" are themselves.

    Raises:
        RendererError: an unknown name.
    """
    if name not in ("auto", "gl", "tiny"):
        raise RendererError(f"no renderer '{name}'. {did_you_mean(name, ('auto', 'gl', 'tiny'))}")
    if name == "auto":
        return "gl" if gl_works() else "tiny"
    return name


@functools.cache
def gl_works() -> bool:
    """Whether a headless OpenGL context opens on this machine; tried once a process."""
    from flysim.render.gl_context import close_context, open_context

    try:
        close_context(open_context())
    except RendererError:
        return False
    return True


def clip_optical(camera: Camera, half_pixel: tuple[float, float] = (0.5, 0.5)) -> Array:
    """`[4, 4]` projection from the optical frame to OpenGL's clip space, for any K.

    Args:
        camera: its calibration.
        half_pixel: where the renderer has the centre of the first pixel, from its corner [px].
    """
    ox, oy = half_pixel
    left, right = -(camera.cx + ox) / camera.fx, (camera.width - camera.cx - ox) / camera.fx
    top, bottom = (camera.cy + oy) / camera.fy, -(camera.height - camera.cy - oy) / camera.fy
    P = np.zeros((4, 4))
    P[0, 0], P[0, 2] = 2.0 / (right - left), (right + left) / (right - left)
    P[1, 1], P[1, 2] = 2.0 / (top - bottom), (top + bottom) / (top - bottom)
    P[2, 2], P[2, 3] = -(FAR + NEAR) / (FAR - NEAR), -2.0 * FAR * NEAR / (FAR - NEAR)
    P[3, 2] = -1.0
    return P @ np.diag([1.0, -1.0, -1.0, 1.0])  # optical y down, z forward -> OpenGL y up, z backward
