"""The `gl` renderer: moderngl through EGL draws the bodies' meshes at their pybullet poses: colour, then truth."""

from __future__ import annotations

from collections.abc import Sequence

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

CHORD = 0.2  # [px] that a chord may be off at 1 m in pictures without truth
NOTHING = (np.inf, -1.0, 0.0, 0.0)  # depth [m] and link of the sky


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
        self._sagitta = SAGITTA if rig is None else max(SAGITTA, CHORD / max(rig.left.fx, rig.right.fx))
        self._simulation = simulation
        self._shaded_at: list[bytes] | None = None  # where everything stood when the shadows were drawn
        self._targets: dict[tuple[int, int], tuple[moderngl.Framebuffer, moderngl.Framebuffer]] = {}
        self._context = open_context()
        try:
            with entered(self._context, "draw this world"):
                self._programs = program(self._context, light), program(self._context, None)
                self._shading = Shading(self._context, self._programs[0], light)
                looking = simulation.robot.cameras if rig is None else (rig.left, rig.right)
                for camera in looking:  # what is too large is told here
                    self._target((camera.width, camera.height))
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
        rgb, truth = self._drawn(self._stand(), camera, T_world_optical, truth=True)
        return TrueView(
            camera=camera,
            rgb=rgb,
            depth=np.ascontiguousarray(truth[..., 0]),
            link=truth[..., 1].astype(np.int32),
            T_world_optical=T_world_optical,
        )

    def pictures(self, eyes: Sequence[tuple[Camera, Array]]) -> list[NDArray[np.uint8]]:
        """What cameras see, each at its `T_world_optical`: `[H, W, 3]` RGB of each, without the truth."""
        stand = self._stand()
        return [self._drawn(stand, camera, T)[0] for camera, T in eyes]

    def _stand(self) -> Stand:
        return self._world.stand(self._simulation)

    def _drawn(self, stand: Stand, camera: Camera, T_world_optical: Array, *, truth: bool = False) -> list[NDArray]:
        """RGB, and if asked depth and link, the top row first."""
        size, clip_world = (camera.width, camera.height), clip_optical(camera) @ inverse(T_world_optical)
        with entered(self._context, f"draw {camera.width}x{camera.height} px"):
            targets = self._target(size)
            self._context.enable(moderngl.DEPTH_TEST)
            self._context.depth_func = "<="
            self._light(stand, size, clip_world, T_world_optical[:3, 3])
            seen = np.ascontiguousarray(self._pass(targets[0], (*self._shading.sky, 1.0), stand, clip_world))
            return [seen, self._pass(targets[1], NOTHING, stand, clip_world, truth=True)] if truth else [seen]

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
        clip_world: Array,
        *,
        truth: bool = False,
    ) -> NDArray:
        """Draws all into a target that was `empty`, and reads it."""
        width, height = target.size
        target.use()
        target.clear(color=empty)
        self._world.draw(stand, clip_world, truth=truth)
        data = target.read(components=2 if truth else 3, alignment=1, dtype="f4" if truth else "f1")
        pixels = np.frombuffer(data, np.float32 if truth else np.uint8).reshape(height, width, -1)
        return pixels[::-1]

    def _light(self, stand: Stand, size: tuple[int, int], clip_world: Array, eye_at: Array) -> None:
        """What is drawn before a picture: shadows, if anything moved since they were, and the mirror image."""
        if self._shading.light == DAY:
            return

        def draw(clip_world: Array) -> None:
            self._world.draw(stand, clip_world, cull=False)

        if self._shading.light.shadows and stand.matrices != self._shaded_at:
            self._shaded_at = stand.matrices
            self._shading.shadow(self._world.corners(stand), draw)
        lamp_at = lamp_position(self._simulation.T_world_base(), self._simulation.robot)
        self._shading.begin(size, lamp_at, eye_at)
        self._shading.mirror(clip_world, draw)

    def close(self) -> None:
        """Frees the context and all it holds. Safe to call twice."""
        close_context(self._context)
