"""What an agent has seen of the floor since the start, and a way over it: cells in its own dead reckoning."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra

from flysim.common.ranges import ranged
from flysim.geometry.frames import Array, wrap_angle
from flysim.nav.agents.surroundings import RANGE, SECTORS, sector_bearings
from flysim.paths.lattice import chain, graph, neighbours

FAN = 5  # rays over the width of a sector, so that a wall far off has no holes
OPEN = 9.0  # [m] of room everywhere, where nothing is taken


@dataclass(frozen=True, slots=True, kw_only=True)
class ChartParams:
    """How a chart is drawn and what a way over it costs; chosen on `random-medium` and `random-hard`.

    Attributes:
        cell: side of a cell [m].
        reach: it covers so much to each side of the start [m]; what is farther off is not entered.
        seen: evidence that a look adds where it finds something.
        unseen: evidence that it takes away where it looks through.
        most: evidence that a cell holds at most: what has gone must be forgotten in time.
        taken: evidence from which a cell is taken.
        berth: nearer than this to things, beyond the robot's room, a metre costs more [m].
        dear: how much more a metre costs there, at most, in metres.
        unseen_dear: how much more over floor that has not been in view.
        shut: how much more where there is no room: the last resort.
        looked_from, looked_to: distances of the floor that a look shows [m].
        cleared_from, cleared_to: distances at which a look gives up what it does not find: it goes over low things that
            are nearer, and finds too little farther off [m].
        view_deg: to each side that a look shows; what is not looked at stays as it was [degrees].
        space: about the start that is taken for known [m].
        detour: round robot and goal in which a way is looked for; ways round large things need room [m].
    """

    cell: float = 0.05
    reach: float = 12.0
    seen: float = 1.0
    unseen: float = 0.2
    most: float = 4.0
    taken: float = 1.0
    berth: float = 0.35
    dear: float = 4.0
    unseen_dear: float = 1.0
    shut: float = 60.0
    looked_from: float = 0.6
    looked_to: float = 2.5
    cleared_from: float = 0.9
    cleared_to: float = 3.5
    view_deg: float = 30.0
    space: float = 0.5
    detour: float = 2.5

    def __post_init__(self) -> None:
        ranged(
            self,
            cell=(0.02, 0.5, "m"),
            reach=(3.0, 30.0, "m"),
            taken=(0.01, 100.0),
            berth=(0.01, 5.0, "m"),
            view_deg=(0.0, 180.0, "degrees"),
            space=(0.0, 3.0, "m"),
            detour=(0.0, 10.0, "m"),
            **dict.fromkeys(("seen", "unseen", "most"), (0.0, 100.0)),
            **dict.fromkeys(("dear", "unseen_dear", "shut"), (0.0, 1e4, "metres")),
            **dict.fromkeys(("looked_from", "looked_to", "cleared_from", "cleared_to"), (0.0, 10.0, "m")),
        )


class Chart:
    """A grid of evidence about the start; the robot's own pose in it by its velocities."""

    def __init__(self, radius: float, period: float, params: ChartParams | None = None) -> None:
        """For a robot of `radius` [m] that tells its velocities every `period` [s]."""
        self._room, self._period, self._params = radius, period, params or ChartParams()
        self._side = 2 * round(self._params.reach / self._params.cell) + 1
        self.clear()

    def clear(self) -> None:
        """A new episode: the robot is at (0, 0, 0) and has seen nothing."""
        self.x = self.y = self.yaw = 0.0
        self._evidence = np.zeros((self._side, self._side), np.float32)
        self._known = np.zeros((self._side, self._side), bool)
        self._stand(self._params.space)
        self._fresh = False
        self._way: Array | None = None

    def update(self, velocity: NDArray, obstacles: NDArray) -> None:
        """Moves on by one period and enters what is seen now."""
        v, w = float(velocity[0]), float(velocity[1])
        turn = w * self._period
        heading = self.yaw + turn / 2.0
        self.x += v * self._period * math.cos(heading)
        self.y += v * self._period * math.sin(heading)
        self.yaw = wrap_angle(self.yaw + turn)
        self._stand(self._room)
        self._enter(np.asarray(obstacles, np.float64))

    def _stand(self, radius: float) -> None:
        """Where the robot is there is nothing else."""
        (i,), (j,) = self._cells(np.array([self.x]), np.array([self.y]))
        cells = radius / self._params.cell
        di, dj = np.nonzero(np.hypot(*np.mgrid[: 2 * int(cells) + 1, : 2 * int(cells) + 1] - int(cells)) <= cells)
        i, j = i + di - int(cells), j + dj - int(cells)
        inside = (i >= 0) & (i < self._side) & (j >= 0) & (j < self._side)
        self._known[i[inside], j[inside]] = True

    def _enter(self, distance: Array) -> None:
        p, bearing = self._params, sector_bearings() + self.yaw
        cos, sin = np.cos(bearing), np.sin(bearing)
        seen = distance < RANGE - 1e-3
        # What is looked through: rays to just before what is seen.
        steps = np.arange(p.cleared_from, p.cleared_to, p.cell)
        viewed = np.abs(sector_bearings()) < math.radians(p.view_deg)
        free = (seen & viewed)[:, None] & (steps[None, :] < distance[:, None] - 2.0 * p.cell)
        i, j = self._cells(self.x + steps * cos[:, None], self.y + steps * sin[:, None])
        cleared = np.zeros_like(self._evidence, bool)
        cleared[i[free], j[free]] = True
        # What has been in view, whether anything was found there or not.
        steps = np.arange(p.looked_from, p.looked_to, p.cell / 1.5)
        inside = viewed[:, None] & (steps[None, :] < distance[:, None] + p.cell)
        for aside in (-0.25, 0.25):
            a = bearing + aside * math.tau / SECTORS
            i, j = self._cells(self.x + steps * np.cos(a)[:, None], self.y + steps * np.sin(a)[:, None])
            self._known[i[inside], j[inside]] = True
        wide = np.linspace(-0.5, 0.5, FAN) * math.tau / SECTORS
        d = distance[seen][:, None]
        a = bearing[seen][:, None] + wide
        i, j = self._cells(self.x + d * np.cos(a), self.y + d * np.sin(a))
        hit = np.zeros_like(cleared)
        hit[i, j] = True
        self._evidence[cleared & ~hit] -= p.unseen
        self._evidence[hit] += p.seen
        np.clip(self._evidence, 0.0, p.most, out=self._evidence)

    def _cells(self, x: Array, y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        p = self._params
        i = np.clip(np.rint((np.asarray(y) + p.reach) / p.cell), 0, self._side - 1).astype(np.intp)
        j = np.clip(np.rint((np.asarray(x) + p.reach) / p.cell), 0, self._side - 1).astype(np.intp)
        return i, j

    def taken(self, reach: float) -> Array:
        """`[n, 2]` middles [m] of taken cells within `reach` [m], in the robot's frame."""
        p = self._params
        k = math.ceil(reach / p.cell)
        (i0,), (j0,) = self._cells(np.array([self.x]), np.array([self.y]))
        low_i, low_j = max(i0 - k, 0), max(j0 - k, 0)
        i, j = np.nonzero(self._evidence[low_i : i0 + k + 1, low_j : j0 + k + 1] >= p.taken)
        dx, dy = (j + low_j) * p.cell - p.reach - self.x, (i + low_i) * p.cell - p.reach - self.y
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.stack([cos * dx + sin * dy, cos * dy - sin * dx], axis=1)

    def plan(self, distance: float, bearing: float) -> None:
        """Finds the cheapest way to the goal, over what is free or unknown; none if it is walled in."""
        p = self._params
        gx, gy = self.x + distance * math.cos(self.yaw + bearing), self.y + distance * math.sin(self.yaw + bearing)
        edge = p.reach - 1.0
        scale = min(1.0, edge / max(abs(gx), abs(gy), 1e-9))
        gx, gy = gx * scale, gy * scale
        low = np.array([min(self.x, gx), min(self.y, gy)]) - p.detour
        high = np.array([max(self.x, gx), max(self.y, gy)]) + p.detour
        (i0, i1), (j0, j1) = self._cells(np.array([low[0], high[0]]), np.array([low[1], high[1]]))
        some = self._evidence[i0 : i1 + 1, j0 : j1 + 1] >= p.taken
        clear = np.asarray(ndimage.distance_transform_edt(~some)) * p.cell if some.any() else np.full(some.shape, OPEN)
        start = tuple(int(c[0]) for c in self._cells(np.array([self.x]), np.array([self.y])))
        goal = tuple(int(c[0]) for c in self._cells(np.array([gx]), np.array([gy])))
        self._way = None
        price = self._price(np.asarray(clear), ~self._known[i0 : i1 + 1, j0 : j1 + 1])
        cells = _cheapest(price, (start[0] - i0, start[1] - j0), (goal[0] - i0, goal[1] - j0))
        if cells is not None:
            x, y = (cells[:, 1] + j0) * p.cell - p.reach, (cells[:, 0] + i0) * p.cell - p.reach
            self._way = np.stack([x, y], axis=1)

    def _price(self, clear: Array, unseen: NDArray[np.bool_]) -> Array:
        """What a metre costs in each cell; near things dear, in things so dear that it is the last resort."""
        p, room = self._params, self._room
        near = p.dear * np.clip(1.0 - (clear - room) / p.berth, 0.0, 1.0)
        return 1.0 + near + p.shut * (clear < room) + p.unseen_dear * unseen

    def ahead(self, reach: float) -> tuple[float, float] | None:
        """Distance [m] and bearing [rad] of the point about `reach` [m] along the way; None where there is no way."""
        if self._way is None:
            return None
        off = np.hypot(self._way[:, 0] - self.x, self._way[:, 1] - self.y)
        k = int(np.argmin(off))
        run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self._way[k:], axis=0), axis=1))])
        x, y = self._way[k + min(int(np.searchsorted(run, reach)), len(run) - 1)]
        return math.hypot(x - self.x, y - self.y), wrap_angle(math.atan2(y - self.y, x - self.x) - self.yaw)


def _cheapest(price: Array, start: tuple[int, int], goal: tuple[int, int]) -> NDArray[np.intp] | None:
    """`[n, 2]` cells from start to goal, the price of all of which is least."""
    height, width = price.shape
    index = np.arange(height * width).reshape(height, width)
    edges = [
        (index[a].ravel(), index[b].ravel(), (cells * (price[a] + price[b]) / 2.0).ravel())
        for a, b, cells in neighbours((height, width))
    ]
    first, last = start[0] * width + start[1], goal[0] * width + goal[1]
    before = dijkstra(graph(edges, height * width), directed=False, indices=last, return_predecessors=True)[1]
    nodes = chain(before, first, last)
    return None if nodes is None else np.stack(np.divmod(np.array(nodes), width), axis=1)
