"""What an agent has seen of the floor since the start, and a way over it: cells in its own dead reckoning."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from flysim.geometry.frames import Array, wrap_angle
from flysim.nav.agents.chart_params import ChartParams
from flysim.nav.agents.surroundings import RANGE, SECTORS, sector_bearings
from flysim.paths.lattice import chain, graph, neighbours

FAN = np.linspace(-0.4, 0.4, 5) * math.tau / SECTORS  # rays of a sector, about a cell apart where it is widest
OPEN = 9.0  # [m] of room everywhere, where nothing is taken


Cells = tuple[NDArray[np.intp], NDArray[np.intp]]  # rows and columns


class Chart:
    """A grid of evidence about the start; the robot's own pose in it by its velocities."""

    def __init__(self, radius: float, period: float, params: ChartParams | None = None, *, margin: float = 0.0) -> None:
        """For a robot of `radius` [m] that tells its velocities every `period` [s] and likes a `margin` [m]."""
        self._radius, self._room, self._period, self._params = radius, radius + margin, period, params or ChartParams()
        self._side = 2 * round(self._params.reach / self._params.cell) + 1
        self.clear()

    def clear(self) -> None:
        """A new episode: the robot is at (0, 0, 0) and has seen nothing."""
        self.x = self.y = self.yaw = 0.0
        self._evidence = np.zeros((self._side, self._side), np.float32)
        self._far = np.zeros_like(self._evidence)
        self._looks = np.zeros((self._side, self._side), np.uint8)
        self._stand(self._params.space)
        self._all_round: bool | None = None  # until the first look
        self._way: Array | None = None
        self._clear = np.zeros(0)
        self._avoided = np.zeros((self._side, self._side), np.float32)

    def update(self, velocity: NDArray, obstacles: NDArray) -> None:
        """Moves on by one period and enters what is seen now."""
        v, w = float(velocity[0]), float(velocity[1])
        turn = w * self._period
        heading = self.yaw + turn / 2.0
        self.x += v * self._period * math.cos(heading)
        self.y += v * self._period * math.sin(heading)
        self.yaw = wrap_angle(self.yaw + turn)
        self._stand(self._radius)  # not the room that it likes: of that, it knows only what it has seen
        self._enter(np.asarray(obstacles, np.float64))

    def _stand(self, radius: float) -> None:
        """Where the robot is there is nothing else."""
        (i,), (j,) = self._cells(np.array([self.x]), np.array([self.y]))
        cells = radius / self._params.cell
        di, dj = np.nonzero(np.hypot(*np.mgrid[: 2 * int(cells) + 1, : 2 * int(cells) + 1] - int(cells)) <= cells)
        i, j = i + di - int(cells), j + dj - int(cells)
        inside = (i >= 0) & (i < self._side) & (j >= 0) & (j < self._side)
        self._looks[i[inside], j[inside]] = self._params.looks

    def _enter(self, distance: Array) -> None:
        p, middle = self._params, sector_bearings()
        if self._all_round is None:
            self._all_round = bool((distance[np.abs(middle) > math.radians(p.behind_deg)] < RANGE).any())
        viewed = (np.abs(middle) < math.radians(p.view_deg)) | self._all_round
        angle = (middle + self.yaw)[:, None] + FAN
        cos, sin = np.cos(angle), np.sin(angle)
        # The floor that has been in view, whether anything was found there or not.
        looked = np.arange(*((p.cell, p.relied) if self._all_round else (p.looked_from, p.looked_to)), p.cell)
        inside, i, j = self._rays(cos, sin, looked, viewed, distance + p.cell)
        shown = np.zeros_like(self._looks)
        shown[i[inside], j[inside]] = p.looks if self._all_round else 1
        self._looks = np.minimum(self._looks + shown, p.looks)
        # What is looked through: to just before what is seen.
        seen = (distance < RANGE - 1e-3) | self._all_round  # cameras may have found nothing on what is bare
        start, end = (p.cell, p.relied) if self._all_round else (p.cleared_from, p.cleared_to)
        through = np.arange(start, max(end, p.far_cleared_to), p.cell)
        free, i, j = self._rays(cos, sin, through, seen & viewed, distance - 2.0 * p.cell)
        less = p.seen if self._all_round else p.unseen
        relied = p.relied if self._all_round else p.relied_by_eye
        self._weigh(self._far, (i[free], j[free]), less, self._hits(cos, sin, distance, relied, p.far_to))
        free = free & (through < end)
        self._weigh(self._evidence, (i[free], j[free]), less, self._hits(cos, sin, distance, 0.0, relied))

    def _hits(self, cos: Array, sin: Array, distance: Array, low: float, high: float) -> Cells:
        """Cells of what is seen that far off [m], over the width of a sector, so that a wall has no holes."""
        seen = (distance >= low) & (distance < high)
        away = distance[seen][:, None]
        return self._cells(self.x + away * cos[seen], self.y + away * sin[seen])

    def _weigh(self, grid: NDArray[np.float32], through: Cells, less: float, hits: Cells) -> None:
        """Adds evidence where something is seen, and takes it where it is looked through."""
        hit, cleared = np.zeros((2, *grid.shape), bool)
        hit[hits], cleared[through] = True, True
        grid[cleared & ~hit] -= less
        grid[hit] += self._params.seen
        np.clip(grid, 0.0, self._params.most, out=grid)

    def _rays(
        self, cos: Array, sin: Array, steps: Array, which: NDArray[np.bool_], end: Array
    ) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.intp]]:
        """Points at those steps [m] along rays: which lie before their sector's end [m], and all their cells."""
        i, j = self._cells(self.x + steps * cos[:, :, None], self.y + steps * sin[:, :, None])
        inside = which[:, None, None] & (steps < end[:, None, None])
        return np.broadcast_to(inside, i.shape), i, j

    def _cells(self, x: Array, y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        p = self._params
        i = np.clip(np.rint((np.asarray(y) + p.reach) / p.cell), 0, self._side - 1).astype(np.intp)
        j = np.clip(np.rint((np.asarray(x) + p.reach) / p.cell), 0, self._side - 1).astype(np.intp)
        return i, j

    def taken(self, reach: float) -> Array:
        """`[n, 2]` middles [m] of taken cells within `reach` [m], in the robot's frame."""
        return self._near(self._evidence >= self._params.taken, reach)

    def unseen(self, reach: float) -> Array:
        """`[n, 2]` middles [m] of cells within `reach` [m] whose floor has not been in view, in the robot's frame."""
        return self._near(self._looks < self._params.looks, reach)

    def hidden(self, reach: float, beside: float) -> Array:
        """`[n, 2]` as `unseen`, of what is nearer than `beside` [m] to a taken cell: there is the rest of a thing."""
        taken, unseen = self.taken(reach + beside), self.unseen(reach)
        if not len(taken) or not len(unseen):
            return np.zeros((0, 2))
        return unseen[KDTree(taken).query(unseen, distance_upper_bound=beside)[0] < beside]

    def _near(self, which: NDArray[np.bool_], reach: float) -> Array:
        p = self._params
        k = math.ceil(reach / p.cell)
        (i0,), (j0,) = self._cells(np.array([self.x]), np.array([self.y]))
        low_i, low_j = max(i0 - k, 0), max(j0 - k, 0)
        i, j = np.nonzero(which[low_i : i0 + k + 1, low_j : j0 + k + 1])
        dx, dy = (j + low_j) * p.cell - p.reach - self.x, (i + low_i) * p.cell - p.reach - self.y
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.stack([cos * dx + sin * dy, cos * dy - sin * dx], axis=1)

    def forget(self) -> None:
        """Takes a look's evidence from everything: what was seen seldom is gone, what was seen often is not."""
        self._evidence = np.maximum(self._evidence - self._params.seen, 0.0)

    def avoid(self, x: float, y: float) -> None:
        """Makes ways about a place [m], where the robot came no farther, dear."""
        (i,), (j,) = self._cells(np.array([x]), np.array([y]))
        k = round(self._params.avoided / self._params.cell)
        self._avoided[max(i - k, 0) : i + k + 1, max(j - k, 0) : j + k + 1] += self._params.avoided_dear

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
        price = self._price(np.asarray(clear), (slice(i0, i1 + 1), slice(j0, j1 + 1)))
        cells = _cheapest(price, (start[0] - i0, start[1] - j0), (goal[0] - i0, goal[1] - j0))
        if cells is not None:
            self._clear = np.asarray(clear)[cells[:, 0], cells[:, 1]]
            self._way = np.stack([(cells[:, 1] + j0) * p.cell - p.reach, (cells[:, 0] + i0) * p.cell - p.reach], axis=1)

    def _price(self, clear: Array, part: tuple[slice, slice]) -> Array:
        """What a metre costs in each cell of a part; near things dear, in things so dear that it is the last resort."""
        p = self._params
        seen = self._looks[part] >= p.looks
        unseen = np.zeros_like(seen)
        if not seen.all():
            unseen = np.asarray(ndimage.distance_transform_edt(seen)) * p.cell < self._radius - p.cell
        far = self._far[part] >= p.taken
        if far.any():
            far = np.asarray(ndimage.distance_transform_edt(~far)) * p.cell < self._radius
        near = p.dear * np.clip(1.0 - (clear - self._room) / p.berth, 0.0, 1.0)
        narrow = p.narrow_dear * (clear < self._room) + p.shut * (clear < self._radius)
        return 1.0 + near + narrow + p.unseen_dear * unseen + p.far_dear * far + self._avoided[part]

    def ahead(self, reach: float) -> tuple[float, float] | None:
        """Distance [m] and bearing [rad] of the point about `reach` [m] along the way; None where there is no way."""
        if self._way is None:
            return None
        _, last = self._stretch(self._way, reach)
        x, y = self._way[last]
        return math.hypot(x - self.x, y - self.y), wrap_angle(math.atan2(y - self.y, x - self.x) - self.yaw)

    def narrowest(self, reach: float) -> float:
        """[m] from the next `reach` [m] of the way to the nearest thing; inf where there is no way."""
        if self._way is None:
            return math.inf
        first, last = self._stretch(self._way, reach)
        return float(self._clear[first : last + 1].min())

    def _stretch(self, way: Array, reach: float) -> tuple[int, int]:
        """Indices of the points on the way that are nearest and `reach` [m] farther on."""
        k = int(np.argmin(np.hypot(way[:, 0] - self.x, way[:, 1] - self.y)))
        run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way[k:], axis=0), axis=1))])
        return k, k + min(int(np.searchsorted(run, reach)), len(run) - 1)


def _cheapest(price: Array, start: tuple[int, int], goal: tuple[int, int]) -> NDArray[np.intp] | None:
    """`[n, 2]` cells from start to goal, where a metre costs `price`."""
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
