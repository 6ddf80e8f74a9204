"""One place of a world, seen by the robot's cameras at several image sizes, with the truth of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.common.catalogue import find_robot, find_world
from flysim.geometry.frames import Pose2
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.render.choose import Renderer, RendererName
from flysim.render.look import look
from flysim.render.studio import drawn
from flysim.robots.robot import read_robot
from flysim.sim.simulation import Simulation
from flysim.truth.sight import seen_by_both
from flysim.worlds.model import World
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.view import TrueView

Size = tuple[int, int]  # [px] width, height

# From here the box of `paper` is 0.4 m wide, its centre 2.5 m before the cameras; and all but the sky and a strip
# beside the wall is nearer than 4 m, so that a matcher can be right about it.
WORLD, ROBOT, STAND = "paper", "rover", Pose2(-0.245, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneBody:
    """An obstacle as the left camera sees it.

    Attributes:
        link: its index in `World.links`.
        distance: along the floor, from the camera to its origin [m].
        width: of what is seen of it, along the image's rows [m].
    """

    name: str
    link: int
    distance: float
    width: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """A pair and what is true of each pixel of its left image.

    Attributes:
        disparity: `[H, W]` float32 u_left - u_right of what the pixel shows [px]; NaN where that is nothing, or
            falls beside the right image.
        depth: `[H, W]` float32 along the optical axis [m]; inf where nothing is.
        link: `[H, W]` int32 index into `World.links`; -1 where nothing is.
        seen: `[H, W]` bool: the right camera sees the same surface there.
        bodies: obstacles in view, the nearest first.
    """

    pair: ImagePair
    disparity: NDArray[np.float32]
    depth: NDArray[np.float32]
    link: NDArray[np.int32]
    seen: NDArray[np.bool_]
    bodies: tuple[SceneBody, ...]

    @property
    def size(self) -> Size:
        """Width and height [px]."""
        return self.pair.rig.left.width, self.pair.rig.left.height


def scenes(sizes: Sequence[Size], renderer: RendererName = "auto") -> tuple[list[Scene], str]:
    """The scene in each size, and the name of the renderer that drew it.

    Raises:
        RendererError: the renderer cannot draw here.
    """
    world, robot = read_world(find_world(WORLD)), read_robot(find_robot(ROBOT))
    with drawn(world, robot, STAND, renderer) as (simulation, eyes):
        return [_scene(simulation, eyes, size) for size in sizes], eyes.name


def _scene(simulation: Simulation, eyes: Renderer, size: Size) -> Scene:
    pair, views = look(simulation, eyes, simulation.robot.rig.resized(*size))
    left = views[0]
    disparity = true_disparity(pair.rig, left.depth)
    return Scene(
        pair=pair,
        disparity=disparity,
        depth=left.depth,
        link=left.link,
        seen=seen_by_both(views, max_range=math.inf) & np.isfinite(disparity),
        bodies=_bodies(simulation.world, left),
    )


def true_disparity(rig: StereoRig, depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """`[H, W]` u_left - u_right [px] of what a rectified rig's left pixels show at `[H, W]` depths [m].

    NaN where the depth is not finite, or the match falls beside the right image.
    """
    u = np.arange(depth.shape[1])
    known = np.isfinite(depth) & (depth > 0.0)
    disparity = rig.left.cx - rig.right.cx + rig.left.fx * rig.baseline / np.where(known, depth, 1.0)
    inside = (u - disparity >= 0.0) & (u - disparity <= rig.right.width - 1)
    return np.where(known & inside, disparity, np.nan).astype(np.float32)


def _bodies(world: World, left: TrueView) -> tuple[SceneBody, ...]:
    found = []
    camera, eye = left.camera, left.T_world_optical[:3, 3]
    for link in np.unique(left.link[left.link >= 0]).tolist():
        body = world.links[link]
        if body.structure:
            continue
        v, u = np.nonzero(left.link == link)
        across = (u - camera.cx) / camera.fx * left.depth[v, u]
        off = body.T_world_link[:2, 3] - eye[:2]
        width = float(across.max() - across.min())
        found.append(SceneBody(name=body.model, link=link, distance=float(np.hypot(*off)), width=width))
    return tuple(sorted(found, key=lambda body: body.distance))
