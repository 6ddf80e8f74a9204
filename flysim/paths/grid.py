"""The floor in cells: where the robot can stand, what stands there instead, and how high."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from flysim.geometry.frames import Array, transform
from flysim.paths.footprint import Disc, Footprint, Points, Polygon, footprint, heights
from flysim.worlds.cut import filled, level_faces, surface_points
from flysim.worlds.ground import middle_of
from flysim.worlds.model import Link, World
from flysim.worlds.shapes import Mesh, Plane

CELL = 0.025  # [m]
MAX_CELLS = 2_500_000
ROUND = 3.0  # [m] of floor round all that stands there
LEAST_HEIGHT = 0.02  # [m] what is lower than this blocks no robot
FLOOR = 0.02  # [m] a floor may lie this far from z = 0
COARSEST = 0.08  # [m] of a cell; of a larger world only what is near the place to begin at is surveyed
REACH = 50.0  # [m] so near
UPWARDS = 0.7  # the least z of the normal of a plane that carries
SINGLE = 400  # faces of a mesh's floor that are painted one by one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grid:
    """Square cells over the floor; row i is y, column j is x.

    Attributes:
        origin: x, y of the middle of cell (0, 0) [m].
        cell: side [m].
        clearance: `[H, W]` distance [m] from a cell's middle to the nearest thing that a robot would hit.
        obstacle: `[H, W]` index of the link whose obstacle covers the cell; -1 where there is none.
        top: `[H, W]` height [m] of what stands in the cell, structure included; -inf where nothing does.
        bottom: `[H, W]` height [m] of its lowest point; inf where nothing does.
        of_link: for each link that is an obstacle one of its cells (i, j).
    """

    origin: tuple[float, float]
    cell: float
    clearance: NDArray[np.float32]
    obstacle: NDArray[np.int32]
    top: NDArray[np.float32]
    bottom: NDArray[np.float32]
    of_link: dict[int, tuple[int, int]]

    @property
    def shape(self) -> tuple[int, int]:
        """How many rows and columns of cells there are."""
        return self.clearance.shape[0], self.clearance.shape[1]

    def cells(self, xy: Array) -> NDArray[np.intp]:
        """`[N, 2]` row and column of `[N, 2]` points [m], clipped to the grid."""
        ij = np.rint((np.asarray(xy) - self.origin) / self.cell).astype(np.intp)[..., ::-1]
        return np.clip(ij, 0, np.array(self.shape) - 1)

    def points(self, ij: NDArray[np.intp]) -> Array:
        """`[N, 2]` x, y [m] of the middles of `[N, 2]` cells."""
        return np.asarray(ij, dtype=np.float64)[..., ::-1] * self.cell + self.origin

    def clear_of(self, xy: Array) -> Array:
        """`[N]` clearance [m] at points; 0 outside of the grid."""
        xy = np.asarray(xy, dtype=np.float64)
        i, j = np.moveaxis(self.cells(xy), -1, 0)
        off = np.abs((xy - self.origin) / self.cell - np.stack([j, i], axis=-1)).max(axis=-1)
        return np.where(off < 1.0, self.clearance[i, j], 0.0)


def survey(world: World, robot_height: float, around: float = ROUND) -> Grid:
    """The grid of a world for a robot of that height [m], with `around` [m] of floor round all that stands there.

    A link blocks with its collision shapes, or with its visuals where it has none, between 2 cm and the robot's
    height. An obstacle is what is seen of a link that is no structure, above the ground.
    """
    seen = [(i, shape, T) for i, link in enumerate(world.links) for shape, T in _placed(link, "visuals")]
    spans = [heights(shape, T) if not isinstance(shape, Plane) else (0.0, 0.0) for _, shape, T in seen]
    covered = [
        None
        if isinstance(shape, Plane)
        else footprint(shape, T, LEAST_HEIGHT, 1e6, CELL / 2.0, solid=not world.links[i].static)
        for i, shape, T in seen
    ]
    hit = [
        footprint(shape, T, LEAST_HEIGHT, robot_height, CELL / 2.0, solid=not link.static)
        for link in world.links
        for shape, T in _placed(link, "collisions")
        if not isinstance(shape, Plane)
    ]
    boxes = np.array([f.bounds() for f in (*covered, *hit) if f is not None]).reshape(-1, 4)
    low, high, cell = _window(boxes, middle_of(world.links), around)
    low = np.floor(low / (2.0 * cell)) * (2.0 * cell)  # (0, 0), where paths start, is the middle of an even cell
    width, height = (int(n) + 1 for n in np.ceil((high - low) / cell))
    origin, shape = (float(low[0]), float(low[1])), (height, width)

    blocked = np.zeros(shape, dtype=bool)
    for one in hit:
        if one is not None:
            for rows, columns, inside in _painted(one, origin, cell, shape):
                blocked[rows, columns] |= inside
    x, y = (origin[k] + cell * np.arange(n, dtype=np.float64) for k, n in enumerate((width, height)))
    blocked |= _beyond_planes(world, x, y, robot_height)
    blocked |= ~_carried(world, origin, cell, shape)
    obstacle = np.full(shape, -1, dtype=np.int32)
    top, bottom = np.full(shape, -np.inf, np.float32), np.full(shape, np.inf, np.float32)
    of_link: dict[int, tuple[int, int]] = {}
    for (i, _, _), (lowest, highest), one in zip(seen, spans, covered, strict=True):
        if one is None:
            continue
        for rows, columns, inside in _painted(one, origin, cell, shape):
            if not world.links[i].structure:
                obstacle[rows, columns][inside] = i
                if i not in of_link and inside.any():
                    a, b = np.argwhere(inside)[0]
                    of_link[i] = (rows.start + int(a), columns.start + int(b))
            np.maximum(top[rows, columns], highest, out=top[rows, columns], where=inside)
            np.minimum(bottom[rows, columns], lowest, out=bottom[rows, columns], where=inside)
    clearance = np.asarray(ndimage.distance_transform_edt(~blocked)) if blocked.any() else np.full(shape, 1e6)
    return Grid(
        origin=origin,
        cell=cell,
        clearance=(clearance * cell).astype(np.float32),
        obstacle=obstacle,
        top=top,
        bottom=bottom,
        of_link=of_link,
    )


def _window(boxes: Array, place: Array, around: float) -> tuple[Array, Array, float]:
    """`[2]` corners of the floor that is surveyed [m], and the side of its cells [m].

    Args:
        boxes: `[n, 4]` bounds of all that stands there [m].
        place: `[2]` where paths begin, or near [m].
        around: [m] of floor round it all.
    """
    low = np.minimum(boxes[:, :2].min(axis=0, initial=np.inf), place) - around
    high = np.maximum(boxes[:, 2:].max(axis=0, initial=-np.inf), place) + around
    if math.sqrt(float(np.prod(high - low)) / MAX_CELLS) > COARSEST:
        low, high = np.maximum(low, place - REACH), np.minimum(high, place + REACH)
    return low, high, max(CELL, math.sqrt(float(np.prod(high - low)) / MAX_CELLS))


def _placed(link: Link, first: str) -> Iterator[tuple]:
    """(shape, T_world_shape) of a link's visuals or collisions, or of the others where it has none."""
    parts = (link.visuals or link.collisions) if first == "visuals" else (link.collisions or link.visuals)
    for part in parts:
        yield part.shape, link.T_world_link @ part.T_link_part


def _painted(
    one: Footprint, origin: tuple[float, float], cell: float, shape: tuple[int, int]
) -> Iterator[tuple[slice, slice, NDArray[np.bool_]]]:
    """The window of the cells that a footprint may touch, and which of them it does."""
    x0, y0, x1, y1 = one.bounds()
    j0, j1 = (max(0, math.floor((x0 - origin[0]) / cell)), min(shape[1], math.ceil((x1 - origin[0]) / cell) + 1))
    i0, i1 = (max(0, math.floor((y0 - origin[1]) / cell)), min(shape[0], math.ceil((y1 - origin[1]) / cell) + 1))
    if i0 >= i1 or j0 >= j1:
        return  # beyond what is surveyed
    rows, columns = slice(i0, i1), slice(j0, j1)
    match one:
        case Points():
            inside = _touched(one.xy, (i0, j0), (i1 - i0, j1 - j0), origin, cell)
            if one.spacing > cell:
                inside |= _closed(inside, one.spacing / cell)
            corner = origin[0] + cell * j0, origin[1] + cell * i0
            filled(inside, one.triangles, one.level, corner, cell)
        case Disc() | Polygon():
            j, i = np.meshgrid(np.arange(j0, j1, dtype=np.float64), np.arange(i0, i1, dtype=np.float64))
            x, y = origin[0] + cell * j, origin[1] + cell * i
            inside = one.covers(x, y, cell / 2.0)  # a cell counts when it is touched
    yield rows, columns, np.asarray(inside)


def _beyond_planes(world: World, x: Array, y: Array, height: float) -> NDArray[np.bool_]:
    """`[H, W]` cells behind a plane that collides: it has no end, and nothing stands behind it."""
    behind = np.zeros((len(y), len(x)), dtype=bool)
    for link in world.links:
        for shape, T in _placed(link, "collisions"):
            if isinstance(shape, Plane) and link.collisions:
                a, b, c = T[:3, 2]
                level = min(c * LEAST_HEIGHT, c * height)
                behind |= a * (x[None, :] - T[0, 3]) + b * (y[:, None] - T[1, 3]) + level - c * T[2, 3] < -1e-6
    return behind


def _touched(
    xy: Array, first: tuple[int, int], shape: tuple[int, int], origin: tuple[float, float], cell: float
) -> NDArray[np.bool_]:
    """The cells of a window from (row, column) `first` on in which points `[n, 2]` lie."""
    inside = np.zeros(shape, dtype=bool)
    j, i = np.rint((xy - origin) / cell).astype(np.intp).T
    i, j = i - first[0], j - first[1]
    within = (i >= 0) & (i < shape[0]) & (j >= 0) & (j < shape[1])
    inside[i[within], j[within]] = True
    return inside


def _closed(mask: NDArray[np.bool_], cells: float) -> NDArray[np.bool_]:
    """With the gaps that are no wider than so many cells closed."""
    return np.asarray(ndimage.binary_closing(mask, iterations=math.ceil(cells)), dtype=bool)


def _carried(world: World, origin: tuple[float, float], cell: float, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """`[H, W]` cells that have a floor at z = 0: a plane, the top of a shape, or what is level of a mesh."""
    floor = np.zeros(shape, dtype=bool)
    for link in world.links:
        if not link.collisions or not link.static:
            continue
        for one, T in _placed(link, "collisions"):
            if isinstance(one, Plane):
                floor |= _level_of(T, origin, cell, shape)
            elif isinstance(one, Mesh):
                faces, areas = level_faces(transform(T, one.vertices)[one.faces])
                under = (np.abs(faces[:, :, 2]) <= FLOOR).all(axis=1)
                _paint_faces(faces[under], areas[under], floor, origin, cell)
            elif abs(heights(one, T)[1]) <= FLOOR:
                covered = footprint(one, T, -1e6, 1e6, cell / 2.0, solid=False)
                if covered is not None:
                    for rows, columns, inside in _painted(covered, origin, cell, shape):
                        floor[rows, columns] |= inside
    return floor


def _level_of(T: Array, origin: tuple[float, float], cell: float, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """`[H, W]` where a plane that looks up is at z = 0; one that tilts carries as far as it is."""
    a, b, c = T[:3, 2]
    if c <= UPWARDS:
        return np.zeros(shape, dtype=bool)
    x, y = (origin[k] + cell * np.arange(n, dtype=np.float64) - T[k, 3] for k, n in ((0, shape[1]), (1, shape[0])))
    return np.abs(T[2, 3] - (a * x[None, :] + b * y[:, None]) / c) <= FLOOR


def _paint_faces(
    faces: Array, areas: Array, floor: NDArray[np.bool_], origin: tuple[float, float], cell: float
) -> None:
    """Paints triangles `[n, 3, 3]`: the largest exactly, the many small ones by points on them."""
    order = np.argsort(-areas)
    for face in faces[order[:SINGLE]]:
        for rows, columns, inside in _painted(Polygon.hull(face[:, :2]), origin, cell, floor.shape):  # type: ignore[arg-type]
            floor[rows, columns] |= inside
    if len(order) > SINGLE:
        points, apart = surface_points(faces[order[SINGLE:]], cell / 2.0)
        touched = _touched(points[:, :2], (0, 0), (floor.shape[0], floor.shape[1]), origin, cell)
        if apart > cell:
            touched |= _closed(touched, apart / cell)
        floor |= touched
