"""The `tiny` renderer: pybullet's own software renderer, which works everywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flysim.common.one_of_a_kind import OneOfAKind
from flysim.errors import RendererError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse
from flysim.render.light import DAY, LightParams
from flysim.render.optics import FAR, NEAR, SKY, clip_optical
from flysim.sim.bullet import pybullet as p
from flysim.sim.simulation import Simulation
from flysim.worlds.view import TrueView

# TinyRenderer's principal point is (W/2, H/2 - 1) for a symmetric frustum, with pixel centres at integers.
HALF_PIXEL = (0.0, 1.0)
BODY_BITS = (1 << 24) - 1  # the mask packs the link's index above the body's id


def refuse_light(light: LightParams) -> None:
    """Refuses what only `gl` can draw.

    Raises:
        RendererError: a lamp, shadows or a floor that shines.
    """
    if light.lamp or light.floor_shine or light.shadows:
        raise RendererError("light.lamp, light.shadows and light.floor_shine need the renderer gl, not tiny.")


class TinyRenderer(OneOfAKind):
    """Nearest-texel sampling, no mipmaps: coarser than `gl`, and 15 times slower."""

    name = "tiny"

    def __init__(self, simulation: Simulation, light: LightParams = DAY) -> None:
        """Binds to a simulation built with `textured=True`.

        Raises:
            RendererError: a light that only `gl` can draw.
        """
        refuse_light(light)
        self._simulation, self._light = simulation, light
        last = max([simulation.body, *simulation.link_of_body], default=0)
        self._link = np.full(last + 2, -1, np.int32)
        for body, link in simulation.link_of_body.items():
            self._link[body] = link

    def view(self, camera: Camera, T_world_optical: Array) -> TrueView:
        """What a camera at `T_world_optical` sees, with exact depth and body of each pixel."""
        T_gl_world = np.diag([1.0, -1.0, -1.0, 1.0]) @ inverse(T_world_optical)
        P = clip_optical(camera, HALF_PIXEL) @ np.diag([1.0, -1.0, -1.0, 1.0])
        *_, rgba, depth, mask = p.getCameraImage(
            camera.width,
            camera.height,
            viewMatrix=T_gl_world.T.ravel().tolist(),
            projectionMatrix=P.T.ravel().tolist(),
            renderer=p.ER_TINY_RENDERER,
            lightDirection=self._light.direction,
            lightColor=(1, 1, 1),
            lightAmbientCoeff=self._light.ambient,
            lightDiffuseCoeff=1.0 - self._light.ambient,
            lightSpecularCoeff=0,
            shadow=0,
            physicsClientId=self._simulation.client,
        )
        shape = (camera.height, camera.width)
        depth = np.asarray(depth, np.float64).reshape(shape)
        bodies = np.asarray(mask, np.int64).reshape(shape)
        hit = bodies >= 0
        rgb = np.asarray(rgba, np.uint8).reshape(*shape, 4)[..., :3].copy()
        rgb[~hit] = SKY
        if self._light.tint != DAY.tint:
            rgb = np.rint(np.minimum(rgb * np.array(self._light.tint), 255.0)).astype(np.uint8)
        metric = FAR * NEAR / (FAR - (FAR - NEAR) * depth)
        return TrueView(
            camera=camera,
            rgb=rgb,
            depth=np.where(hit, metric, np.inf).astype(np.float32),
            link=np.where(hit, self._link[np.where(hit, bodies & BODY_BITS, -1)], -1).astype(np.int32),
            T_world_optical=T_world_optical,
        )

    def pictures(self, eyes: Sequence[tuple[Camera, Array]]) -> list[NDArray[np.uint8]]:
        """What cameras see, each at its `T_world_optical`: `[H, W, 3]` RGB of each; no faster than `view`."""
        return [self.view(camera, T_world_optical).rgb for camera, T_world_optical in eyes]

    def close(self) -> None:
        """Holds nothing of its own."""
