"""What an agent has seen of the floor since the start, and a way over it: cells in its own dead reckoning."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra

from flysim.geometry.frames import Array, wrap_angle
from flysim.nav.agents.surroundings import RANGE, SECTORS, sector_bearings
from flysim.paths.lattice import chain, graph, neighbours

CELL = 0.05  # [m]
HALF = 12.0  # [m] the chart reaches so far from the start; what is farther off is free
SEEN, UNSEEN, MOST = 1.0, 0.2, 4.0  # evidence that a look adds, takes away where it looks through, and at most
TAKEN = 1.0  # evidence from which a cell is taken
BERTH, DEAR = 0.35, 4.0  # [m] nearer than this to things a metre costs up to 1 + DEAR
LOOKED = 0.65, 1.7  # [m] the floor of which a look tells that nothing low stands there
LOOKS = 3  # that it takes: what is at the view's edge for a moment has no flies yet
SPACE = 0.5  # [m] about the start that is taken for free
UNSEEN_DEAR = 1.5  # what a metre costs more where the robot would stand on floor that has not been in view
AVOIDED, AVOIDED_DEAR = 0.4, 3.0  # [m] about a place where it came no farther a metre costs so much more
NARROW_DEAR = 12.0  # and where it has less room than it likes
CLEARED = 0.9, 3.5  # [m] looks go over low things that are nearer, and find too little farther off
VIEW = math.radians(30.0)  # to each side: what is not looked at stays as it was
BEHIND = math.radians(120.0)  # bearing from which on no pair of cameras sees
RELIED = 3.0  # [m] what is farther off is not entered: a sector is wider there than the gaps that matter
SPREAD = np.linspace(-0.4, 0.4, 5) * math.tau / SECTORS  # rays of a sector, about a cell apart where it is widest


class Chart:
    """A grid of evidence about the start; the robot's own pose in it by its velocities."""

    def __init__(self, radius: float, period: float, margin: float = 0.0) -> None:
        """For a robot of `radius` [m] that tells its velocities every `period` [s] and likes a `margin` [m]."""
        self._radius, self._room, self._period = radius, radius + margin, period
        self._side = 2 * round(HALF / CELL) + 1
        self.clear()

    def clear(self) -> None:
        """A new episode: the robot is at (0, 0, 0) and has seen nothing."""
        self.x = self.y = self.yaw = 0.0
        self._evidence = np.zeros((self._side, self._side), np.float32)
        self._looks = np.zeros((self._side, self._side), np.uint8)
        self._stand(SPACE)
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
        self._stand(self._room)
        self._enter(np.asarray(obstacles, np.float64))

    def _stand(self, radius: float) -> None:
        """Where the robot is there is nothing else."""
        (i,), (j,) = self._cells(np.array([self.x]), np.array([self.y]))
        k = math.floor(radius / CELL)
        offset = np.arange(-k, k + 1)
        disc = np.hypot(offset[:, None], offset) <= radius / CELL
        self._looks[i - k : i + k + 1, j - k : j + k + 1][disc] = LOOKS

    def _enter(self, distance: Array) -> None:
        middle = sector_bearings()
        if self._all_round is None:
            # Cameras tell of nothing behind before the robot has moved: who does, is told exact distances all round.
            self._all_round = bool((distance[np.abs(middle) > BEHIND] < RANGE).any())
        viewed = (np.abs(middle) < VIEW) | self._all_round
        near, far = (CELL, RELIED) if self._all_round else CLEARED
        angle = (middle + self.yaw)[:, None] + SPREAD
        cos, sin = np.cos(angle), np.sin(angle)
        # What has been in view, whether anything was found there or not.
        looked = np.arange(near, far, CELL) if self._all_round else np.arange(*LOOKED, CELL)
        inside, i, j = self._rays(cos, sin, looked, viewed, distance + CELL)
        shown = np.zeros_like(self._looks)
        shown[i[inside], j[inside]] = LOOKS if self._all_round else 1
        self._looks = np.minimum(self._looks + shown, LOOKS)
        # What is looked through: to just before what is seen.
        seen = distance < RANGE - 1e-3
        free, i, j = self._rays(cos, sin, np.arange(near, far, CELL), seen & viewed, distance - 2.0 * CELL)
        cleared = np.zeros_like(self._evidence, bool)
        cleared[i[free], j[free]] = True
        # The width of a sector, so that a wall has no holes; far off, that is too wide to be relied on.
        seen = distance < RELIED
        i, j = self._cells(
            self.x + distance[seen][:, None] * cos[seen], self.y + distance[seen][:, None] * sin[seen]
        )
        hit = np.zeros_like(cleared)
        hit[i, j] = True
        self._evidence[cleared & ~hit] -= SEEN if self._all_round else UNSEEN
        self._evidence[hit] += SEEN
        np.clip(self._evidence, 0.0, MOST, out=self._evidence)

    def _rays(
        self, cos: Array, sin: Array, steps: Array, which: NDArray[np.bool_], end: Array
    ) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.intp]]:
        """Points at those steps [m] along rays: which lie before their sector's end [m], and all their cells."""
        i, j = self._cells(self.x + steps * cos[:, :, None], self.y + steps * sin[:, :, None])
        inside = which[:, None, None] & (steps < end[:, None, None])
        return np.broadcast_to(inside, i.shape), i, j

    def _cells(self, x: Array, y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        i = np.clip(np.rint((np.asarray(y) + HALF) / CELL), 0, self._side - 1).astype(np.intp)
        j = np.clip(np.rint((np.asarray(x) + HALF) / CELL), 0, self._side - 1).astype(np.intp)
        return i, j

    def taken(self, reach: float) -> Array:
        """`[n, 2]` middles [m] of taken cells within `reach` [m], in the robot's frame."""
        return self._near(self._evidence, TAKEN, reach)

    def unseen(self, reach: float) -> Array:
        """`[n, 2]` middles [m] of cells within `reach` [m] whose floor has not been in view, in the robot's frame."""
        return self._near(LOOKS - self._looks, 1, reach)

    def _near(self, grid: NDArray, least: float, reach: float) -> Array:
        k = math.ceil(reach / CELL)
        (i0,), (j0,) = self._cells(np.array([self.x]), np.array([self.y]))
        low_i, low_j = max(i0 - k, 0), max(j0 - k, 0)
        i, j = np.nonzero(grid[low_i : i0 + k + 1, low_j : j0 + k + 1] >= least)
        dx, dy = (j + low_j) * CELL - HALF - self.x, (i + low_i) * CELL - HALF - self.y
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.stack([cos * dx + sin * dy, cos * dy - sin * dx], axis=1)

    def forget(self) -> None:
        """Takes a look's evidence from everything: what was seen seldom is gone, what was seen often is not."""
        self._evidence = np.maximum(self._evidence - SEEN, 0.0)

    def avoid(self, x: float, y: float) -> None:
        """Makes ways about a place [m], where the robot came no farther, dear."""
        (i,), (j,) = self._cells(np.array([x]), np.array([y]))
        k = round(AVOIDED / CELL)
        self._avoided[max(i - k, 0) : i + k + 1, max(j - k, 0) : j + k + 1] += AVOIDED_DEAR

    def plan(self, distance: float, bearing: float) -> None:
        """Finds the cheapest way to the goal, over what is free or unknown; none if it is walled in."""
        gx, gy = self.x + distance * math.cos(self.yaw + bearing), self.y + distance * math.sin(self.yaw + bearing)
        edge = HALF - 1.0
        scale = min(1.0, edge / max(abs(gx), abs(gy), 1e-9))
        gx, gy = gx * scale, gy * scale
        pad = 2.5  # [m] round robot and goal; ways round large things need room
        low = np.array([min(self.x, gx), min(self.y, gy)]) - pad
        high = np.array([max(self.x, gx), max(self.y, gy)]) + pad
        (i0, i1), (j0, j1) = self._cells(np.array([low[0], high[0]]), np.array([low[1], high[1]]))
        some = self._evidence[i0 : i1 + 1, j0 : j1 + 1] >= TAKEN
        clear = np.asarray(ndimage.distance_transform_edt(~some)) * CELL if some.any() else np.full(some.shape, 9.0)
        start = tuple(int(c[0]) for c in self._cells(np.array([self.x]), np.array([self.y])))
        goal = tuple(int(c[0]) for c in self._cells(np.array([gx]), np.array([gy])))
        self._way = None
        seen = self._looks[i0 : i1 + 1, j0 : j1 + 1] >= LOOKS
        unseen = np.asarray(ndimage.distance_transform_edt(seen)) * CELL < self._radius - CELL
        price = (
            1.0
            + DEAR * np.clip(1.0 - (clear - self._room) / BERTH, 0.0, 1.0)
            + NARROW_DEAR * (clear < self._room)
            + 60.0 * (clear < self._radius)
            + UNSEEN_DEAR * unseen
            + self._avoided[i0 : i1 + 1, j0 : j1 + 1]
        )
        cells = _cheapest(price, (start[0] - i0, start[1] - j0), (goal[0] - i0, goal[1] - j0))
        if cells is not None:
            self._clear = np.asarray(clear)[cells[:, 0], cells[:, 1]]
            self._way = np.stack([(cells[:, 1] + j0) * CELL - HALF, (cells[:, 0] + i0) * CELL - HALF], axis=1)

    def ahead(self, reach: float) -> tuple[float, float] | None:
        """Distance [m] and bearing [rad] of the point about `reach` [m] along the way; None where there is no way."""
        if self._way is None:
            return None
        first, last = self._stretch(self._way, reach)
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
