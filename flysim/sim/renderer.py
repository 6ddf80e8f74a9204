"""One signature for every renderer, and the choice between them."""

from __future__ import annotations

from typing import Literal, Protocol

from flysim.errors import RendererError, did_you_mean
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.sim.simulation import Simulation
from flysim.world.view import TrueView

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
    if name not in ("auto", "gl", "tiny"):
        raise RendererError(f"no renderer '{name}'. {did_you_mean(name, ('auto', 'gl', 'tiny'))}")
    if name == "auto":
        name = "gl" if gl_works() else "tiny"
    if name == "gl":
        from flysim.sim.render_gl import GlRenderer

        return GlRenderer(simulation)
    from flysim.sim.render_tiny import TinyRenderer

    return TinyRenderer(simulation)


def gl_works() -> bool:
    """Whether a headless OpenGL context opens on this machine."""
    from flysim.sim.render_gl import open_context

    try:
        open_context().release()
    except RendererError:
        return False
    return True
