"""The cheapest way over cells, against a count by hand and a search without a library."""

import heapq
import math

import numpy as np
import pytest
from scipy.sparse.csgraph import dijkstra

from flysim.paths.lattice import chain, graph, neighbours


def over(price):
    """The graph of an array in which a step costs its length times the mean price of both cells."""
    index = np.arange(price.size).reshape(price.shape)
    return graph(
        [
            (index[a].ravel(), index[b].ravel(), (d * (price[a] + price[b]) / 2).ravel())
            for a, b, d in neighbours(price.shape)
        ],
        price.size,
    )


def by_hand(price, start):
    """Dijkstra's search, written out."""
    cost, queue = np.full(price.shape, np.inf), [(0.0, start)]
    cost[start] = 0.0
    while queue:
        so_far, (i, j) = heapq.heappop(queue)
        if so_far > cost[i, j]:
            continue
        for di in (-1, 0, 1):
            for dj in (-1, 0, 1):
                k, m = i + di, j + dj
                if (di, dj) != (0, 0) and 0 <= k < price.shape[0] and 0 <= m < price.shape[1]:
                    new = so_far + math.hypot(di, dj) * (price[i, j] + price[k, m]) / 2
                    if new < cost[k, m] - 1e-12:
                        cost[k, m] = new
                        heapq.heappush(queue, (new, (k, m)))
    return cost


def test_every_pair_of_neighbours_is_there_once():
    pairs = set()
    index = np.arange(12).reshape(3, 4)
    for a, b, distance in neighbours((3, 4)):
        for one, other in zip(index[a].ravel().tolist(), index[b].ravel().tolist(), strict=True):
            (i, j), (k, m) = divmod(one, 4), divmod(other, 4)
            assert math.hypot(i - k, j - m) == pytest.approx(distance)
            assert (one, other) not in pairs and (other, one) not in pairs
            pairs.add((one, other))
    assert len(pairs) == 3 * 3 + 2 * 4 + 2 * (2 * 3)  # sideways, down, and both diagonals


@pytest.mark.parametrize("seed", range(5))
def test_costs_are_those_of_a_search_by_hand(seed):
    price = np.random.default_rng(seed).uniform(1.0, 9.0, (7, 9))
    found = dijkstra(over(price), directed=False, indices=0).reshape(price.shape)
    np.testing.assert_allclose(found, by_hand(price, (0, 0)))


def test_a_chain_runs_round_a_wall_and_ends_where_there_is_no_way():
    price = np.ones((5, 5))
    price[1:4, 2] = 100.0
    before = dijkstra(over(price), directed=False, indices=14, return_predecessors=True)[1]
    way = chain(before, 10, 14)  # from the middle of the left side to that of the right one
    assert way[0] == 10 and way[-1] == 14
    assert not set(way) & {7, 12, 17}
    alone = graph([(np.array([0]), np.array([1]), np.array([1.0]))], 3)
    before = dijkstra(alone, directed=False, indices=0, return_predecessors=True)[1]
    assert chain(before, 1, 0) == [1, 0]
    assert chain(before, 2, 0) is None
