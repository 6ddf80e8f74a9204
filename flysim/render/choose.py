"""One signature for every renderer, and the choice between them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from flysim.errors import RendererError, did_you_mean
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.render.light import DAY, LightParams
from flysim.sim.simulation import Simulation
from flysim.worlds.view import TrueView

RendererName = Literal["auto", "gl", "tiny"]


class Renderer(Protocol):
    """Draws a simulation's present state; bound to one simulation."""

    name: str

    def view(self, camera: Camera, T_world_optical: Array) -> TrueView:
        """What a camera at `T_world_optical` sees, with exact depth and body of each pixel."""
        ...

    def pictures(self, eyes: Sequence[tuple[Camera, Array]]) -> list[NDArray[np.uint8]]:
        """What cameras see, each at its `T_world_optical`: `[H, W, 3]` RGB of each, without the truth."""
        ...

    def close(self) -> None:
        """Frees what it holds."""
        ...


def open_renderer(name: RendererName, simulation: Simulation, light: LightParams = DAY) -> Renderer:
    """`gl` (moderngl through EGL), `tiny` (pybullet's own), or `auto`: gl where a context opens.

    `tiny` needs a simulation built with `textured=True`.

    Raises:
        RendererError: an unknown name, `gl` asked for where no context opens, or a light that `tiny` cannot draw.
    """
    if renderer_here(name) == "gl":
        from flysim.render.gl import GlRenderer

        return GlRenderer(simulation, light)
    from flysim.render.tiny import TinyRenderer

    return TinyRenderer(simulation, light)


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
