"""What truly stands in the world, and how much of it the cameras could see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import Array, frozen
from flysim.geometry.plan_view import APART, extent, plan_hull
from flysim.truth.body import Kind, Symmetry, measure, parts_of
from flysim.truth.gap import touching_groups
from flysim.truth.motion import Motion
from flysim.truth.sight import Sight
from flysim.worlds.model import World

LEAST_PIXELS = 50  # fewer than these over all stops: not visible
AT_FOOT = 0.05  # [m] an obstacle seen down to this above its foot is seen down to its foot
VOXEL = 0.005  # [m] of the stored visible points
NAMED = 3  # bodies that a group's name spells out when it has more than four


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueObstacle:
    """One obstacle of the world, at its place at the last stop.

    Attributes:
        links: its bodies' indices in `World.links`.
        center: `[3]` [m], world frame.
        size: `[3]` length, width, height above the ground [m], length >= width.
        yaw: heading of its length [rad], in [-pi/2, pi/2); 0 where it is round.
        shape: an upright "box" or "cylinder", a "sphere", or "other": groups, meshes, what leans.
        symmetry: "round" has no heading; a "square" has four equal ones, a "rectangle" two.
        visible_points: `[K, 3]` surface points that both cameras of one stop saw within range [m, world],
            thinned to one a 5 mm voxel, with every point kept that bounds the set from above or in height.
        visible_pixels: how many left pixels, over all stops, those were.
    """

    name: str
    links: tuple[int, ...]
    center: Array
    size: Array
    yaw: float
    symmetry: Symmetry
    shape: Kind
    visible_points: Array
    visible_pixels: int

    def __post_init__(self) -> None:
        for name in ("center", "size", "visible_points"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.float64))

    @property
    def visible(self) -> bool:
        """Whether enough of it was seen to ask that it be found."""
        return self.visible_pixels >= LEAST_PIXELS

    def visible_extent(self, yaw: float | None = None) -> tuple[Array, Array] | None:
        """`[3]` centre [m, world] and `[3]` size of the visible part, along a heading (default: its own).

        In plan it spans the visible points. In height it goes from the highest visible point down to the
        obstacle's true foot if it was seen down to 5 cm above it: obstacles stand on the ground, and their
        last centimetres cannot be told from it. Seen less far down, it ends at the lowest visible point. Of an
        upright cylinder or a sphere it is the whole circle in plan, and the whole of a sphere: any part of it tells
        how large the rest is and where, so that half of one is no excuse. None where nothing is visible.
        """
        if not len(self.visible_points):
            return None
        yaw = self.yaw if yaw is None else yaw
        low, high = extent(self.visible_points[:, :2], yaw)
        foot = self.center[2] - self.size[2] / 2.0
        if self.shape == "sphere":
            return np.array(self.center), np.array(self.size)
        bottom, top = self.visible_points[:, 2].min(), self.visible_points[:, 2].max()
        if bottom - foot <= AT_FOOT:
            bottom = foot
        if self.shape == "cylinder":
            return np.array([*self.center[:2], (bottom + top) / 2.0]), np.array([*self.size[:2], top - bottom])
        c, s = np.cos(yaw), np.sin(yaw)
        x, y = (low + high) / 2.0
        center = np.array([c * x - s * y, s * x + c * y, (bottom + top) / 2.0])
        return center, np.array([*(high - low), top - bottom])


def true_obstacles(
    world: World, seen: Sequence[Sight], motion: Motion, *, merge_gap: float = APART
) -> tuple[TrueObstacle, ...]:
    """Every obstacle of a world, in the order of its file, seen or not.

    A body is a link that is not structure. Bodies that touch or stand at most `merge_gap` apart are one
    obstacle, named after all of them.

    Args:
        world: where they stand.
        seen: what both cameras saw at each stop; what is out of range there is not visible.
        motion: where they stood; they are told where they are at the last stop.
        merge_gap: [m]
    """
    bodies = [i for i, link in enumerate(world.links) if not link.structure and parts_of(link)]
    shapes = {i: [(part.shape, motion.last[i] @ part.T_link_part) for part in parts_of(world.links[i])] for i in bodies}
    found = []
    for group in touching_groups([shapes[i] for i in bodies], merge_gap):
        links = tuple(bodies[k] for k in group)
        box = measure([shape for i in links for shape in shapes[i]])
        if box is not None:
            found.append((links, box))
    names = _names(world, bodies, [links for links, _ in found])
    points, pixels = _visible(seen, motion, [links for links, _ in found])
    return tuple(
        TrueObstacle(name=name, links=links, visible_points=p, visible_pixels=n, **box._asdict())
        for name, (links, box), p, n in zip(names, found, points, pixels, strict=True)
    )


def _names(world: World, bodies: list[int], groups: list[tuple[int, ...]]) -> list[str]:
    """A group's models joined by "+"; with the link's name where a model's other bodies stand apart."""
    of_model: dict[str, set[int]] = {}
    for i in bodies:
        of_model.setdefault(world.links[i].model, set()).add(i)
    names = []
    for group in groups:
        parts: dict[str, None] = {}
        for i in group:
            link = world.links[i]
            parts[link.model if of_model[link.model] <= set(group) else f"{link.model}/{link.name}"] = None
        label = list(parts)
        if len(label) > NAMED + 1:
            label = [*label[:NAMED], f"{len(label) - NAMED} more"]
        names.append("+".join(label))
    return names


def _visible(seen: Sequence[Sight], motion: Motion, groups: list[tuple[int, ...]]) -> tuple[list[Array], list[int]]:
    """For each group of links its visible points, at their last place, and its count of visible pixels."""
    owner = np.full(len(motion.last) + 1, -1, dtype=np.int32)  # the last entry is for link -1: nothing
    for k, links in enumerate(groups):
        owner[list(links)] = k
    gathered: list[list[Array]] = [[] for _ in groups]
    pixels = [0] * len(groups)
    for sight in seen:
        mask = sight.seen & (owner[sight.stop.views[0].link] >= 0)
        if not mask.any():
            continue
        link = sight.stop.views[0].link[mask]
        points = sight.points(mask)
        order = np.argsort(link, kind="stable")
        ids, starts = np.unique(link[order], return_index=True)
        for i, rows in zip(ids.tolist(), np.split(order, starts[1:]), strict=True):
            k = int(owner[i])
            pixels[k] += len(rows)
            gathered[k].append(_thin(motion.carry(i, sight.stop.index, points[rows])))
    return [_thin(np.concatenate(p)) if p else np.empty((0, 3)) for p in gathered], pixels


def _thin(points: Array) -> Array:
    """One point a voxel, and all that bound the set: its extents along any heading stay exact."""
    keep = np.zeros(len(points), dtype=bool)
    keep[one_a_voxel(points, VOXEL)] = True
    keep[plan_hull(points[:, :2])] = True
    keep[[points[:, 2].argmin(), points[:, 2].argmax()]] = True
    return points[keep]


def one_a_voxel(points: Array, voxel: float) -> np.ndarray:
    """Indices of the first point in each cell of a grid of `voxel` [m], `[N, 3]` points in, N >= 1."""
    key = np.zeros(len(points), dtype=np.int64)
    for column in points.T:
        cell = np.floor(column / voxel).astype(np.int64)
        cell -= cell.min()
        key = key * (cell.max() + 1) + cell
    # Neighbours in a row of pixels mostly share a cell: dropping them first makes the sort short.
    new = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    return new[np.unique(key[new], return_index=True)[1]]
