import tracemalloc

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.obstacles.cluster import NOISE, dbscan


def test_a_chain_is_one_cluster_and_a_gap_makes_two():
    x = np.array([0.0, 0.05, 0.10, 0.15, 0.40, 0.45, 0.50, 1.0])
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    labels = dbscan(points, 0.06, 2)
    assert len(set(labels[:4])) == 1 and len(set(labels[4:7])) == 1
    assert labels[0] != labels[4]
    assert labels[7] == NOISE
    assert sorted(set(labels)) == [NOISE, 0, 1]


def test_a_point_counts_itself_as_its_neighbour():
    pair = np.array([[0.0, 0, 0], [0.05, 0, 0]])
    assert (dbscan(pair, 0.06, 2) == 0).all()
    assert (dbscan(pair, 0.06, 3) == NOISE).all()
    assert (dbscan(pair, 0.04, 1) >= 0).all() and len(set(dbscan(pair, 0.04, 1))) == 2


def test_border_points_do_not_join_two_clusters():
    # Six points at each end; one in the middle has two of each within reach, too few to be a core.
    left = np.stack([np.linspace(-0.010, 0.0, 6)] + [np.zeros(6)] * 2, axis=1)
    points = np.concatenate([left, left + np.array([0.110, 0, 0]), [[0.05, 0, 0]]])
    labels = dbscan(points, 0.0525, 6)
    assert len(set(labels[:6])) == 1 and len(set(labels[6:12])) == 1
    assert labels[0] != labels[6]
    assert labels[12] in (labels[0], labels[6])


def test_no_points_and_no_cores():
    assert dbscan(np.empty((0, 3)), 0.1, 3).shape == (0,)
    assert (dbscan(np.arange(12.0).reshape(4, 3), 0.1, 3) == NOISE).all()


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 80), st.floats(0.02, 0.5), st.integers(1, 6))
def test_it_agrees_with_the_definition(seed, n, distance, neighbours):
    points = np.random.default_rng(seed).uniform(size=(n, 3))
    labels = dbscan(points, distance, neighbours)
    near = np.linalg.norm(points[:, None] - points[None], axis=2) <= distance
    core = near.sum(axis=1) >= neighbours
    reached = (near & core[None]).any(axis=1)
    assert ((labels != NOISE) == reached).all()
    linked = near & core[None] & core[:, None]
    for _ in range(n):  # the transitive closure of "cores near each other"
        linked = linked @ linked
    for i in np.flatnonzero(core):
        assert ((labels == labels[i]) & core == linked[i]).all()
    for i in np.flatnonzero(reached & ~core):
        assert labels[i] in labels[near[i] & core]


def test_where_points_lie_dense_no_pair_of_them_is_kept():
    points = np.random.default_rng(0).uniform(0.0, 0.1, (6000, 3))  # 18 million pairs
    dbscan(points[:10], 0.09, 4)
    tracemalloc.start()
    labels = dbscan(points, 0.09, 4)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (labels == 0).all() and peak < 20e6


def test_clusters_are_numbered_in_the_order_of_their_first_cores():
    places = np.array([3.0, 1.0, 2.0])
    points = np.stack([np.tile(places, 4) + np.repeat(np.arange(4) * 0.01, 3)] + [np.zeros(12)] * 2, axis=1)
    assert dbscan(points, 0.05, 3).tolist() == [0, 1, 2] * 4
