"""The floor of a world: how high it is, what of it lies level underfoot, and where the things are that stand on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from flysim.errors import WorldError
from flysim.geometry.frames import Array, transform
from flysim.plain import shown_path
from flysim.worlds.cut import LEVEL, level_faces
from flysim.worlds.model import Link, Part, World
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape

NEAR_ZERO = 0.3  # [m] a floor is looked for so far from z = 0 before it is looked for anywhere
STEP = 0.15  # [m] a floor on top of another one is at most so high
SAME = 0.02  # [m] tops that differ less are one floor
LEAST_AREA, LEAST_SIDE = 1.0, 0.7  # [m^2, m] of a floor
PLANE_AREA = 1e6  # [m^2] what a plane counts for, which has no end
AROUND = 3.0  # [m] nearer than this to what stands there, (0, 0) is among the things
WEIGHTLESS = 0.01  # [m/s^2]
EXACT = 1e-6  # [m] a floor that is no farther from z = 0 is at z = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatTop:
    """A level surface that looks up.

    Attributes:
        z: its height [m].
        area: [m^2]
        low, high: `[2]` corners of the rectangle round it [m].
        endless: it is a plane's.
    """

    z: float
    area: float
    low: Array
    high: Array
    endless: bool = False

    def under(self, xy: Array) -> bool:
        """Whether a place `[2]` lies over the rectangle round it."""
        return self.endless or bool((xy >= self.low).all() and (xy <= self.high).all())


def flat_tops(shape: Shape, T: Array) -> Iterator[FlatTop]:
    """The level tops of a shape at T_world_shape; of a mesh, one for each height."""
    middle = T[:3, 3]
    if isinstance(shape, Plane):
        if T[2, 2] > LEVEL:
            yield FlatTop(z=float(middle[2]), area=PLANE_AREA, low=middle[:2], high=middle[:2], endless=True)
    elif isinstance(shape, Box):
        up = int(np.argmax(np.abs(T[2, :3])))
        if abs(T[2, up]) > LEVEL:
            corners = transform(T, shape.outline())
            area = float(np.prod(shape.size)) / shape.size[up]
            z = float(middle[2]) + abs(T[2, up]) * shape.size[up] / 2.0
            yield FlatTop(z=z, area=area, low=corners.min(axis=0)[:2], high=corners.max(axis=0)[:2])
    elif isinstance(shape, Cylinder):
        if abs(T[2, 2]) > LEVEL:
            z, r = float(middle[2]) + abs(T[2, 2]) * shape.length / 2.0, shape.radius
            yield FlatTop(z=z, area=float(np.pi * r * r), low=middle[:2] - r, high=middle[:2] + r)
    elif isinstance(shape, Mesh):
        faces, areas = level_faces(transform(T, shape.vertices)[shape.faces])
        height = faces.mean(axis=1)[:, 2]
        for key in np.unique(np.round(height / SAME)):
            mine = np.round(height / SAME) == key
            points = faces[mine].reshape(-1, 3)
            z = float(np.average(height[mine], weights=areas[mine]))
            yield FlatTop(z=z, area=float(areas[mine].sum()), low=points.min(axis=0)[:2], high=points.max(axis=0)[:2])


def hit_parts(link: Link) -> tuple[Part, ...]:
    """What a robot would stand on or run into: collisions, or what is seen where there are none."""
    return link.collisions or link.visuals


def middle_of(links: Iterable[Link]) -> Array:
    """`[2]` the place to begin at [m]: (0, 0) where that is among the things, else the middle of them."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for link in links:
        for part in hit_parts(link):
            if not isinstance(part.shape, Plane):
                points = transform(link.T_world_link @ part.T_link_part, part.shape.outline())[:, :2]
                low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    if not (low <= high).all() or ((low <= AROUND) & (high >= -AROUND)).all():
        return np.zeros(2)
    return (low + high) / 2.0


def floor_level(links: Iterable[Link]) -> float | None:
    """How high [m] the floor is that a robot drives on; None where nothing is level and wide.

    It is the highest one that lies under the place to begin at and within 0.3 m of z = 0, steps of more than 15 cm
    over a wider one left out; where there is none, the widest level of all.
    """
    links = [link for link in links if link.static]
    place = middle_of(links)
    tops = [
        top
        for link in links
        for part in link.collisions
        for top in flat_tops(part.shape, link.T_world_link @ part.T_link_part)
        if top.endless or (top.area >= LEAST_AREA and (top.high - top.low).min() >= LEAST_SIDE)
    ]
    near = [top for top in tops if abs(top.z) <= NEAR_ZERO and top.under(place)]
    near = near or [top for top in tops if abs(top.z) <= NEAR_ZERO]
    if not near:
        return None if not tops else _widest(tops).z
    level = _widest(near).z
    # A floor may lie on a wider one, as that of a house does on the ground.
    over = [top for top in near if level + SAME < top.z <= level + STEP and top.area >= 4.0 * LEAST_AREA]
    return level if not over else max(over, key=lambda top: (top.area, top.z)).z


def _widest(tops: list[FlatTop]) -> FlatTop:
    """Of the level with the most area its widest; of two such levels the lower one."""
    area = [sum(other.area for other in tops if abs(other.z - top.z) <= SAME) for top in tops]
    most = max(area)
    kept = [top for top, of in zip(tops, area, strict=True) if of >= 0.9 * most]
    return min(kept, key=lambda top: (round(top.z, 6), -top.area))


def grounded(world: World) -> World:
    """The world with its floor at z = 0, where robots believe it, and a warning if that moved it; itself if not."""
    level = floor_level(world.links)
    if level is None or abs(level) <= EXACT:
        return world
    down = np.eye(4)
    down[2, 3] = -level
    links = tuple(replace(link, T_world_link=down @ link.T_world_link) for link in world.links)
    said = f"the floor is at z = {level:.3f} m in the file: heights are told from it."
    return replace(world, links=links, warnings=(*world.warnings, said))


def refuse_weightless(world: World) -> None:
    """Refuses a world in which wheels do not drive.

    Raises:
        WorldError: nothing pulls a robot down.
    """
    if world.gravity > -WEIGHTLESS:
        raise WorldError(
            f"{shown_path(world.path)}: wheels do not drive without gravity, which is {world.gravity:g} m/s^2 along z "
            "here: give the world <gravity>0 0 -9.81</gravity>."
        )
