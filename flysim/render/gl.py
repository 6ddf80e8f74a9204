"""The `gl` renderer: moderngl through EGL draws the bodies' meshes at their pybullet poses: colour, then truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from flysim.common.one_of_a_kind import OneOfAKind
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse
from flysim.geometry.rig import StereoRig
from flysim.render.gl_context import close_context, entered, open_context
from flysim.render.gl_world import GlWorld, Stand
from flysim.render.light import DAY, LightParams, lamp_position
from flysim.render.optics import clip_optical
from flysim.render.shading import Shading, program
from flysim.sim.simulation import Simulation
from flysim.worlds.surface.mesh import SAGITTA
from flysim.worlds.view import TrueView

QUARTER_PIXEL = 0.25  # [px] that a chord may be off at 1 m in pictures without truth
NOTHING = (np.inf, -1.0, 0.0, 0.0)  # depth [m] and link of the sky


@dataclass(frozen=True, slots=True, eq=False)
class _Shot:
    """One eye in a frame buffer."""

    clip_world: Array
    eye_at: Array  # `[3]`, world frame [m]
    viewport: tuple[int, int, int, int]  # [px] x, y, width, height


class GlRenderer(OneOfAKind):
    """Trilinear textures, exact calibration, depth under 0.1 mm, equal bytes across runs."""

    name = "gl"

    def __init__(self, simulation: Simulation, light: LightParams = DAY, rig: StereoRig | None = None) -> None:
        """Uploads the meshes and textures of the simulation's world and robot.

        Args:
            simulation: what is drawn.
            light: in the world.
            rig: cameras of whoever asks for `pictures` alone: round shapes are drawn as finely as those can tell.
                None: the robot's, and as finely as depth is told.

        Raises:
            RendererError: no OpenGL context opens, or the driver refuses the world or the size of the images.
        """
        self._sagitta = SAGITTA if rig is None else max(SAGITTA, QUARTER_PIXEL / max(rig.left.fx, rig.right.fx))
        self._simulation = simulation
        self._shaded_at: list[bytes] | None = None  # where everything stood when the shadows were drawn
        self._targets: dict[tuple[int, int], tuple[moderngl.Framebuffer, moderngl.Framebuffer]] = {}
        self._context = open_context()
        try:
            with entered(self._context, "draw this world"):
                self._programs = program(self._context, light), program(self._context, None)
                self._shading = Shading(self._context, self._programs[0], light)
                looking = simulation.robot.rig if rig is None else rig
                self._target(_stacked((looking.left, looking.right))[0])  # what is too large is told here
                self._world = self._upload(simulation)
        except BaseException:
            self.close()
            raise

    def _upload(self, simulation: Simulation) -> GlWorld:
        return GlWorld(self._context, self._programs, simulation.world, simulation.robot, self._sagitta)

    def bind(self, simulation: Simulation) -> None:
        """Draws another simulation of that robot from now on; its world is uploaded if it is another one.

        The context stays: moderngl keeps 40 kB of each that is closed.

        Raises:
            RendererError: the driver refuses the world; nothing can be drawn then.
        """
        self._simulation, self._shaded_at = simulation, None
        if self._world.world is not simulation.world:
            with entered(self._context, "draw this world"):
                self._world.release()
                self._world = self._upload(simulation)

    def view(self, camera: Camera, T_world_optical: Array) -> TrueView:
        """What a camera at `T_world_optical` sees, with exact depth and body of each pixel."""
        (rgb,), (truth,) = self._drawn([(camera, T_world_optical)], truth=True)
        return TrueView(
            camera=camera,
            rgb=np.ascontiguousarray(rgb),
            depth=np.ascontiguousarray(truth[..., 0]),
            link=truth[..., 1].astype(np.int32),
            T_world_optical=T_world_optical,
        )

    def pictures(self, eyes: Sequence[tuple[Camera, Array]]) -> list[NDArray[np.uint8]]:
        """What cameras see, each at its `T_world_optical`: `[H, W, 3]` RGB of each, without the truth."""
        return self._drawn(eyes, truth=False)[0]

    def _drawn(self, eyes: Sequence[tuple[Camera, Array]], *, truth: bool) -> tuple[list[NDArray], list[NDArray]]:
        """RGB, and if asked depth and link, of each eye."""
        size, viewports = _stacked([camera for camera, _ in eyes])
        shots = [
            _Shot(clip_optical(camera) @ inverse(T), T[:3, 3], viewport)
            for (camera, T), viewport in zip(eyes, viewports, strict=True)
        ]
        with entered(self._context, f"draw {size[0]}x{size[1]} px"):
            stand = self._world.stand(self._simulation)
            seen, true = self._target(size)
            self._context.enable(moderngl.DEPTH_TEST)
            self._context.depth_func = "<="
            self._light(stand, size, shots)
            rgb = self._pass(seen, (*self._shading.sky, 1.0), stand, shots)
            return rgb, self._pass(true, NOTHING, stand, shots, truth=True) if truth else []

    def _target(self, size: tuple[int, int]) -> tuple[moderngl.Framebuffer, moderngl.Framebuffer]:
        """What the passes for colour and for truth draw into."""
        if size not in self._targets:
            depth = self._context.depth_texture(size)
            colour, truth = self._context.texture(size, 4), self._context.texture(size, 2, dtype="f4")
            self._targets[size] = self._context.framebuffer([colour], depth), self._context.framebuffer([truth], depth)
        return self._targets[size]

    def _pass(
        self,
        target: moderngl.Framebuffer,
        empty: tuple[float, float, float, float],
        stand: Stand,
        shots: Sequence[_Shot],
        *,
        truth: bool = False,
    ) -> list[NDArray]:
        """Draws all eyes into a target that was `empty`, reads it at once, and cuts out each, its top row first."""
        width, height = target.size
        target.use()
        target.viewport = (0, 0, width, height)
        target.clear(color=empty)
        for shot in shots:
            self._begin(target.size, shot)
            target.viewport = shot.viewport
            self._world.draw(stand, shot.clip_world, truth=truth)
        target.viewport = (0, 0, width, height)
        data = target.read(components=2 if truth else 3, alignment=1, dtype="f4" if truth else "f1")
        pixels = np.frombuffer(data, np.float32 if truth else np.uint8).reshape(height, width, -1)
        return [pixels[y : y + h, x : x + w][::-1] for x, y, w, h in (shot.viewport for shot in shots)]

    def _begin(self, size: tuple[int, int], shot: _Shot) -> None:
        if self._shading.light != DAY:
            lamp_at = lamp_position(self._simulation.T_world_base(), self._simulation.robot)
            self._shading.begin(size, lamp_at, shot.eye_at)

    def _light(self, stand: Stand, size: tuple[int, int], shots: Sequence[_Shot]) -> None:
        """What is drawn before the pictures: shadows, if anything moved since they were, and mirror images."""

        def draw(clip_world: Array) -> None:
            self._world.draw(stand, clip_world, cull=False)

        if self._shading.light.shadows and stand.matrices != self._shaded_at:
            self._shaded_at = stand.matrices
            self._shading.shadow(self._world.corners(stand), draw)
        if self._shading.light.floor_shine:
            for shot in shots:
                self._begin(size, shot)
                self._shading.mirror(shot.viewport, shot.clip_world, draw)

    def close(self) -> None:
        """Frees the context and all it holds. Safe to call twice."""
        close_context(self._context)


def _stacked(cameras: Sequence[Camera]) -> tuple[tuple[int, int], list[tuple[int, int, int, int]]]:
    """The size [px] that holds the images of cameras one above the other, and the viewport of each."""
    tops = np.cumsum([0, *(camera.height for camera in cameras)]).tolist()
    viewports = [(0, top, camera.width, camera.height) for camera, top in zip(cameras, tops[:-1], strict=True)]
    return (max(camera.width for camera in cameras), tops[-1]), viewports
