"""What of a world is structure, ground or wall, by what it is: the floor lies wide and flat underfoot, walls are thin
and long or close a room. What the file says of it counts before that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from flysim.geometry.frames import Array, transform
from flysim.geometry.plan_view import smallest_rectangle
from flysim.worlds.cut import cell_for, level_faces, longest, solid_cells
from flysim.worlds.ground import STEP, floor_level, middle_of
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere

LOW = 0.02  # [m] what is no higher over the floor is driven over
WIDE = 2.0  # [m] the lesser side of a floor
FLAT = 10.0  # a floor's lesser side is so many times what it rises over the floor at least
SHARE = 0.4  # of the rectangle round a mesh that level faces underfoot cover, where it is a floor
CEILING, SLAB = 1.8, 0.4  # [m] a wide slab so high, and no thicker, is a ceiling
THICK, LONG, TALL = 0.3, 2.5, 0.3  # [m] a wall is at most, at least, at least
NAMED_THICK, NAMED_LONG = 0.5, 0.6  # [m] the same of what is called a wall
SLIM, NAMED_SLIM = 4.0, 2.0  # a wall is so many times as long as it is thick
SHORT, RING_SLIM = 0.6, 3.0  # [m] a piece of a ring of walls is so long at least, and so many times its thickness
FOOT = 0.3  # [m] a wall begins no higher over the floor
CELLS, FINEST = 250_000, 0.05  # at most, and their side [m], of the plan in which walls are looked for
TOUCH = 0.02  # [m] parts of a link whose upright boxes are no farther apart belong together
MOST_PARTS = 2000  # of a link that is looked at for this
ROOM = 1.5  # [m^2] a closed ring of walls has so much room at least


@dataclass(frozen=True, slots=True, eq=False)
class _Upright:
    """A box that stands on a face: its lengths on the floor and where it begins and ends over it [m]."""

    length: float
    thickness: float
    low: float
    high: float

    def is_wall(self, *, named: bool) -> bool:
        thick, long, slim = (NAMED_THICK, NAMED_LONG, NAMED_SLIM) if named else (THICK, LONG, SLIM)
        slender = self.thickness <= thick and self.length >= max(long, slim * self.thickness)
        return slender and self.stands()

    def is_piece(self) -> bool:
        return self.thickness <= THICK and self.length >= max(SHORT, RING_SLIM * self.thickness) and self.stands()

    def stands(self) -> bool:
        return self.low <= FOOT and self.high >= TALL


def told_apart(links: Sequence[Link], said: Sequence[bool | None]) -> tuple[Link, ...]:
    """Links with their structure known. One that stands still and has both a floor or walls and things on it is two.

    Args:
        links: of a world.
        said: of each, what the file says; None: nothing.
    """
    if all(one is not None for one in said):
        return tuple(replace(link, structure=bool(one)) for link, one in zip(links, said, strict=True))
    level = floor_level(links) or 0.0
    found: list[Link] = []
    unsure: list[int] = []
    for link, one in zip(links, said, strict=True):
        if one is not None:
            found.append(replace(link, structure=one))
        elif any(isinstance(part.shape, Plane) for part in link.visuals + link.collisions):
            halves = _parted(link, level) if link.static else [replace(link, structure=True)]
            found += [piece for half in halves for piece in ([half] if half.structure else _pieces(half))]
        elif not link.static:
            found.append(replace(link, structure=False))
        else:
            made = [piece for half in _parted(link, level) for piece in ([half] if half.structure else _pieces(half))]
            unsure += [len(found) + k for k, part in enumerate(made) if not part.structure]
            found += made
    for k in _ring(found, unsure, level):
        found[k] = replace(found[k], structure=True)
    return tuple(found)


def _parted(link: Link, level: float) -> list[Link]:
    """The link as it is, or its structure and the rest of it."""
    seen = [_is_structure(link, part, level) for part in link.visuals]
    hit = [_is_structure(link, part, level) for part in link.collisions]
    first = seen or hit
    if all(first) or not any(first):
        return [replace(link, structure=first[0])]
    halves = []
    for structure in (True, False):
        visuals = tuple(part for part, one in zip(link.visuals, seen, strict=True) if one == structure)
        collisions = tuple(part for part, one in zip(link.collisions, hit, strict=True) if one == structure)
        if visuals or collisions:
            halves.append(replace(link, visuals=visuals, collisions=collisions, structure=structure))
    return halves


def _pieces(link: Link) -> list[Link]:
    """What stands still in one link, as so many links as there are things in it that stand apart."""
    parts = (*link.visuals, *link.collisions)
    if not 2 <= len(parts) <= MOST_PARTS:
        return [link]
    corners = [transform(link.T_world_link @ part.T_link_part, part.shape.outline()) for part in parts]
    low = np.array([points.min(axis=0) for points in corners])
    high = np.array([points.max(axis=0) for points in corners])
    near = (low[:, None] <= high[None] + TOUCH).all(axis=2)
    count, of = connected_components(csr_array(near & near.T), directed=False)
    if count == 1:
        return [link]
    seen = len(link.visuals)
    return [
        replace(
            link,
            name=link.name if k == 0 else f"{link.name}#{k + 1}",
            visuals=tuple(part for part, one in zip(link.visuals, of[:seen], strict=True) if one == k),
            collisions=tuple(part for part, one in zip(link.collisions, of[seen:], strict=True) if one == k),
        )
        for k in range(count)
    ]


def _is_structure(link: Link, part: Part, level: float) -> bool:
    shape, T = part.shape, link.T_world_link @ part.T_link_part
    if isinstance(shape, Plane):
        return True
    if isinstance(shape, Mesh):
        return _mesh_is_structure(transform(T, shape.vertices)[shape.faces], level, _called_wall(link))
    if isinstance(shape, Sphere):
        return float(T[2, 3]) + shape.radius <= level + LOW
    points = transform(T, shape.outline())
    span, low, high = np.ptp(points, axis=0), points[:, 2].min() - level, points[:, 2].max() - level
    if high <= LOW:
        return True
    box = _upright(shape, T, level) if isinstance(shape, Box) else None
    least = box.thickness if box is not None else float(span[:2].min())
    if least >= WIDE and (high <= min(STEP, least / FLAT) or (low >= CEILING and high - low <= SLAB)):
        return not isinstance(shape, Cylinder) or high <= STEP or low >= CEILING
    return box is not None and box.is_wall(named=_called_wall(link))


def _called_wall(link: Link) -> bool:
    return "wall" in f"{link.model}::{link.name}".lower()


def _upright(box: Box, T: Array, level: float) -> _Upright | None:
    up = int(np.argmax(np.abs(T[2, :3])))
    if abs(T[2, up]) < 0.999:
        return None
    thickness, length = sorted(box.size[k] for k in range(3) if k != up)
    half = box.size[up] / 2.0
    return _Upright(length, thickness, float(T[2, 3]) - half - level, float(T[2, 3]) + half - level)


def _mesh_is_structure(triangles: Array, level: float, named: bool) -> bool:
    points = triangles.reshape(-1, 3)
    low, high = points.min(axis=0), points.max(axis=0)
    if high[2] - level <= LOW:
        return True
    span = high - low
    if span[:2].min() >= WIDE and low[2] - level >= CEILING and span[2] <= SLAB:
        return True
    if span[:2].min() >= WIDE:
        faces, areas = level_faces(triangles)
        under = faces[:, :, 2].max(axis=1) <= level + STEP if len(faces) else np.zeros(0, bool)
        if float(areas[under].sum()) >= SHARE * span[0] * span[1]:
            return True
    if high[2] - level < TALL or low[2] - level > FOOT or span[:2].max() < (NAMED_LONG if named else LONG):
        return False
    cell = cell_for(points, FINEST, CELLS)
    mask = solid_cells(triangles, level + 0.1, level + TALL, cell)
    extent, thick = longest(mask, cell)
    return extent >= (NAMED_LONG if named else LONG) and thick <= (NAMED_THICK if named else THICK) + cell


def _ring(links: list[Link], unsure: list[int], level: float) -> list[int]:
    """Which links are pieces of a closed ring of walls round the place to begin at."""
    place = middle_of(links)
    pieces: list[tuple[int, Array, Box]] = []
    for k, link in enumerate(links):
        for part in link.visuals or link.collisions:
            T = link.T_world_link @ part.T_link_part
            box = _upright(part.shape, T, level) if isinstance(part.shape, Box) else None
            if box is not None and link.static and (box.is_piece() if k in set(unsure) else link.structure):
                pieces.append((k, transform(T, part.shape.outline()), part.shape))  # type: ignore[arg-type]
    if not any(k in set(unsure) for k, _, _ in pieces):
        return []
    corners = np.concatenate([points for _, points, _ in pieces])[:, :2]
    cell = cell_for(corners, FINEST, CELLS)
    start = corners.min(axis=0) - 2.0 * cell
    shape = tuple((np.ceil((corners.max(axis=0) - start) / cell).astype(int) + 3)[::-1])
    y, x = (start[i] + cell * np.arange(n) for i, n in ((1, shape[0]), (0, shape[1])))
    owner = np.full(shape, -1)
    for k, points, _ in pieces:
        owner[_inside(points[:, :2], x, y, cell)] = k
    walls = owner >= 0
    label = np.zeros(shape, np.int32)
    ndimage.label(~walls, output=label)
    row, column = (round((place[i] - start[i]) / cell) for i in (1, 0))
    if not (0 <= row < shape[0] and 0 <= column < shape[1]) or walls[row, column]:
        return []
    room = label == label[row, column]
    if room[0].any() or room[-1].any() or room[:, 0].any() or room[:, -1].any() or room.sum() * cell * cell < ROOM:
        return []
    # What stands in the room has it on all sides; a piece of the ring has something else behind it.
    return sorted(_beside(room, owner) & _beside(~room & ~walls, owner) & set(unsure))


def _beside(region: NDArray[np.bool_], owner: NDArray[np.int_]) -> set[int]:
    """Owners of the cells along a region."""
    near = np.asarray(ndimage.binary_dilation(region, np.ones((3, 3)), iterations=2), dtype=bool)
    return set(np.unique(owner[near]).tolist())


def _inside(points: Array, x: Array, y: Array, cell: float) -> NDArray[np.bool_]:
    """`[H, W]` cells that an upright box with these corners touches."""
    box = smallest_rectangle(points)
    c, s = np.cos(box.yaw), np.sin(box.yaw)
    dx, dy = x[None, :] - box.center[0], y[:, None] - box.center[1]
    along, across = np.abs(c * dx + s * dy), np.abs(c * dy - s * dx)
    return (along <= (box.length + cell) / 2.0) & (across <= (box.width + cell) / 2.0)
