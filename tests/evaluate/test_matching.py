import numpy as np
import pytest

from flysim.evaluate.matching import harmonic, match
from flysim.geometry.camera import Camera
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle
from flysim.worlds.shapes import Box, Plane


def true_at(x, y, size=(0.4, 0.4, 0.4), visible=True, link=0):
    return TrueObstacle(
        name=f"at_{x}_{y}",
        links=(link,),
        center=np.array([x, y, size[2] / 2]),
        size=np.array(size),
        yaw=0.0,
        symmetry="rectangle",
        shape="box",
        visible_points=np.empty((0, 3)),
        visible_pixels=1000 if visible else 0,
    )


@pytest.fixture
def matched(by_hand):
    """`match` in a world of a floor, a wall and a box that is true only where a test says so."""
    links = (
        by_hand.body("floor", Plane((20.0, 20.0)), structure=True),
        by_hand.body("wall", Box((0.1, 8.0, 1.0)), 3.05, 0.0, 0.5, structure=True),
        by_hand.box("box", (0.4, 0.4, 0.4), 2.75, 0.0),
    )

    def run(truth, estimates, points=()):
        world = by_hand.world(*links)
        stop = by_hand.stop(world, 0.0, 0.0, 0.0, camera=Camera.from_fov(4, 3, 1.2))
        return match(truth, estimates, world=world, motion=Motion.of(world, [stop]), cloud=by_hand.cloud(points))

    return run


def test_each_estimate_stands_for_the_nearest_in_sum(matched, by_hand):
    estimates = [by_hand.estimate(x, 0, (0.4,) * 3) for x in (1.1, 0.1)]
    m = matched([true_at(0, 0), true_at(1, 0)], estimates)
    assert m.pairs == {0: 1, 1: 0}
    assert (m.precision, m.recall, m.f1) == (1.0, 1.0, 1.0)


def test_an_estimate_beyond_the_gate_is_false_and_the_obstacle_missed(matched, by_hand):
    small = (0.1, 0.1, 0.4)
    assert matched([true_at(0, 0, small)], [by_hand.estimate(0.29, 0, small)]).pairs == {0: 0}
    m = matched([true_at(0, 0, small)], [by_hand.estimate(0.31, 0, small)])
    assert (m.pairs, m.false, m.precision, m.recall, m.f1) == ({}, (0,), 0.0, 0.0, 0.0)


def test_a_long_obstacle_seen_in_part_is_found_where_it_stands_and_not_beside_it(matched, by_hand):
    long = (3.0, 0.2, 0.4)
    assert matched([true_at(0, 0, long)], [by_hand.estimate(1.2, 0.15, (0.5, 0.2, 0.4))]).found == 1
    assert matched([true_at(0, 0, long)], [by_hand.estimate(1.2, 0.5, (0.5, 0.2, 0.4))]).found == 0


def test_a_far_pair_never_drives_a_good_one_apart(matched, by_hand):
    # Two matches (0.28 and 0.29 m off) are possible, but one estimate is exactly right.
    size = (0.1, 0.1, 0.4)
    m = matched(
        [true_at(0, 0, size), true_at(0.28, 0, size)],
        [by_hand.estimate(0, 0, size), by_hand.estimate(-0.29, 0, size)],
    )
    assert m.pairs == {0: 0}
    assert m.false == (1,)


def test_what_is_not_visible_asks_for_nothing_and_excuses_what_stands_there(matched, by_hand):
    truth = [true_at(0, 0), true_at(2, 0, visible=False)]
    one, two = by_hand.estimate(0, 0, (0.4,) * 3), by_hand.estimate(2, 0, (0.4,) * 3)
    for estimates in ([one], [one, two]):
        m = matched(truth, estimates)
        assert (m.precision, m.recall, m.f1, m.visible) == (1.0, 1.0, 1.0, 1)
    assert matched(truth, [one, two]).pairs == {0: 0, 1: 1}


def test_a_visible_obstacle_chooses_before_one_that_is_not(matched, by_hand):
    m = matched([true_at(0, 0, visible=False), true_at(0.2, 0)], [by_hand.estimate(0.05, 0, (0.4,) * 3)])
    assert m.pairs == {1: 0}
    assert m.recall == 1.0


@pytest.mark.parametrize(
    ("visible", "estimates", "expected"),
    [(False, 0, (1.0, 1.0, 1.0)), (True, 0, (0.0, 0.0, 0.0)), (False, 1, (0.0, 1.0, 0.0))],
)
def test_figures_where_there_is_nothing_to_divide_by(matched, by_hand, visible, estimates, expected):
    truth = [true_at(0, 0)] if visible else []
    m = matched(truth, [by_hand.estimate(5, 5, (0.4,) * 3)] * estimates)
    assert (m.precision, m.recall, m.f1) == expected


def cluster(x, y, z, spread=0.0, n=50):
    return np.random.default_rng(0).normal(size=(n, 3)) * spread + (x, y, z)


@pytest.mark.parametrize(
    ("points", "false"),
    [
        (cluster(2.99, 2.0, 0.5), 0),  # 1 cm before the wall
        (cluster(0.5, 1.0, 0.02), 0),  # 2 cm above the floor
        (cluster(2.95, 2.0, 0.5), 1),  # 5 cm before it
        (cluster(0.5, 1.0, 0.3), 1),  # in the air
    ],
)
def test_a_cluster_on_ground_or_walls_is_no_false_obstacle(matched, by_hand, points, false):
    estimate = by_hand.estimate(*points[0][:2], (0.2, 0.2, 0.4), flies=range(len(points)))
    m = matched([], [estimate], points)
    assert (len(m.false), len(m.on_structure)) == (false, 1 - false)


def test_a_cluster_near_the_wall_but_nearer_to_an_obstacle_is_false(matched, by_hand):
    # The box's back is at 2.95, the wall's face at 3.0. Both 2.972 and 2.985 are within 3 cm of the wall.
    box = true_at(2.75, 0, link=2)
    first = by_hand.estimate(2.75, 0, (0.4,) * 3)
    for x, false in ((2.972, 1), (2.985, 0)):
        points = cluster(x, 0.0, 0.3)
        double = by_hand.estimate(x, 0.0, (0.02, 0.2, 0.4), flies=range(len(points)))
        m = matched([box], [first, double], np.concatenate([points]))
        assert (len(m.false), len(m.on_structure)) == (false, 1 - false)


def test_an_estimate_without_flies_or_without_a_place_is_false(matched, by_hand):
    m = matched([true_at(0, 0)], [by_hand.estimate(np.nan, 0, (0.4,) * 3), by_hand.estimate(5, 0.0, (0.4,) * 3)])
    assert m.false == (0, 1)
    assert m.recall == 0.0


def test_harmonic_mean():
    assert harmonic(0.5, 1.0) == pytest.approx(2 / 3)
    assert harmonic(0.0, 0.0) == 0.0
