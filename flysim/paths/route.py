"""Ways over the free floor: shortest with a berth, pulled straight; and a short tour of many places."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from flysim.geometry.frames import Array
from flysim.paths.grid import Grid
from flysim.paths.lattice import chain, graph, neighbours

STEP = 0.05  # [m] between the nodes of the graph, or more where that makes too many
MAX_NODES = 150_000
SLACK = 0.01  # [m] that a straight line may come nearer between two nodes; the margin is thrice that
BERTH = 0.25  # [m] beyond what the robot needs; nearer to things a metre costs up to DEAR more
DEAR = 2.0


class Ways:
    """The free floor as a graph; distances and ways from a place are found once and kept."""

    def __init__(self, grid: Grid, room: float, dear: float = DEAR) -> None:
        """`room` [m] is how far from everything the robot's axis has to stay; with `dear` 0 ways are the shortest."""
        self.grid, self.room, self._dear = grid, room, dear
        free_cells = int(np.count_nonzero(grid.clearance >= room))
        stride = max(1, round(STEP / grid.cell), math.ceil(math.sqrt(free_cells / MAX_NODES)))
        rows, columns = np.arange(0, grid.shape[0], stride), np.arange(0, grid.shape[1], stride)
        clear = grid.clearance[np.ix_(rows, columns)]
        self._index = np.full(clear.shape, -1, dtype=np.int64)
        free = clear >= room
        self._index[free] = np.arange(free.sum())
        i, j = np.nonzero(free)
        self.nodes = grid.points(np.stack([rows[i], columns[j]], axis=1))  # [n, 2] m
        self._graph = self._edges(clear, stride * grid.cell)
        self.region: NDArray[np.int32] = connected_components(self._graph, directed=False)[1]
        self._known: dict[int, tuple[Array, NDArray[np.int32]]] = {}

    def _edges(self, clear: NDArray[np.float32], step: float) -> csr_array:
        dear = 1.0 + self._dear * np.clip(1.0 - (clear - self.room) / BERTH, 0.0, 1.0)
        n = len(self.nodes)
        edges = []
        for a, b, cells in neighbours((clear.shape[0], clear.shape[1])):
            length = cells * step
            # No point between two nodes is nearer to anything than this: clearance changes by a metre a metre at most.
            least = (clear[a] + clear[b] - length) / 2.0
            both = (self._index[a] >= 0) & (self._index[b] >= 0) & (least >= self.room - SLACK)
            edges.append((self._index[a][both], self._index[b][both], length * (dear[a] + dear[b])[both] / 2.0))
        return graph(edges, n)

    def node_at(self, xy: Array, region: int | None = None) -> int:
        """The node nearest to a point, of one region if that is given; -1 where there is none."""
        off = np.hypot(*(self.nodes - xy).T)
        if region is not None:
            off = np.where(self.region == region, off, np.inf)
        return int(np.argmin(off)) if len(off) and np.isfinite(off.min()) else -1

    def costs(self, node: int) -> Array:
        """`[n]` cost of the way from a node to every node; inf where there is none."""
        return self._from(node)[0]

    def forget(self) -> None:
        """Lets go of what was found: a place's ways take 12 bytes a node, which adds up over a thousand places."""
        self._known.clear()

    def _from(self, node: int) -> tuple[Array, NDArray[np.int32]]:
        if node not in self._known:
            cost, before = dijkstra(self._graph, directed=False, indices=node, return_predecessors=True)
            self._known[node] = (cost, before)
        return self._known[node]

    def way(self, start: int, end: int) -> list[tuple[float, float]]:
        """Points between two nodes, both left out, with straight free lines between each and the next.

        Raises:
            ValueError: there is no way.
        """
        nodes = chain(self._from(start)[1], end, start)
        if nodes is None:
            raise ValueError("no way leads there: ask for nodes of one region")
        points = self.nodes[nodes[::-1]]
        kept, at = [], 0
        while at < len(points) - 1:
            # The farthest point in a straight line; the next one always is.
            far = next(k for k in range(len(points) - 1, at, -1) if k == at + 1 or self.straight(points[at], points[k]))
            kept.append((float(points[far][0]), float(points[far][1])))
            at = far
        return kept[:-1]

    def straight(self, a: Array, b: Array) -> bool:
        """Whether the robot can drive straight from `a` to `b`."""
        count = max(2, math.ceil(float(np.hypot(*(b - a))) / (self.grid.cell / 2.0)) + 1)
        points = a + np.linspace(0.0, 1.0, count)[:, None] * (b - a)
        return bool((self.grid.clear_of(points) >= self.room - SLACK).all())


def tour(costs: Array) -> list[int]:
    """A short order of places that begins at 0: nearest neighbour, then 2-opt. `costs` is `[n, n]`, symmetric."""
    left, order = set(range(1, len(costs))), [0]
    while left:
        order.append(min(left, key=lambda k: (costs[order[-1], k], k)))
        left.remove(order[-1])
    better = True
    while better:
        better = False
        for i, j in itertools.combinations(range(1, len(order)), 2):
            before, first, last = order[i - 1], order[i], order[j]
            change = costs[before, last] - costs[before, first]
            if j + 1 < len(order):
                after = order[j + 1]
                change += costs[first, after] - costs[last, after]
            if change < -1e-9:
                order[i : j + 1] = order[i : j + 1][::-1]
                better = True
    return order
