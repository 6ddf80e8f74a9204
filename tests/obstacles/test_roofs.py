"""Which cluster is a part of another: what stands under its roof, figure by figure."""

import math

import numpy as np
import pytest

from flysim.obstacles.find import find_obstacles
from flysim.obstacles.joined import _over, _plan_area, _sectors, _under
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.shape import FittedShape


def body(size, center=(0.0, 0.0), yaw=0.0):
    return FittedShape("box", np.array([*center, size[2] / 2.0]), np.array(size), yaw)


LEG = body((0.1, 0.1, 0.3))  # 30 cm high
TABLE = body((0.8, 0.6, 0.5))
LEG_FLIES = np.array([[0.0, 0.0, 0.01 * k] for k in range(30)])
FAR = np.array([[0.39, 0.29, 0.5]] * 100)  # of the table, over no leg, in one direction


def under(roof_points, flies=LEG_FLIES, leg=LEG, table=TABLE):
    return _under(flies, leg, np.asarray(roof_points, float), table)


@pytest.mark.parametrize(("n", "roofed"), [(3, True), (2, False)])
def test_three_flies_over_it_make_a_roof(n, roofed):
    low = FAR * (1.0, 1.0, 0.2)
    assert under(np.concatenate([low, [[0.0, 0.0, 0.5]] * n])) == roofed


@pytest.mark.parametrize(("z", "roofed"), [(0.272, True), (0.268, False)])
def test_a_roof_may_seem_three_centimetres_lower_than_what_stands_under_it(z, roofed):
    low = FAR * (1.0, 1.0, 0.2)
    assert under(np.concatenate([low, [[0.0, 0.0, z]] * 3])) == roofed


@pytest.mark.parametrize(("x", "roofed"), [(0.078, True), (0.083, False)])
def test_it_may_stand_out_by_as_much(x, roofed):
    low = FAR * (1.0, 1.0, 0.2)
    assert under(np.concatenate([low, [[x, 0.0, 0.5]] * 3])) == roofed


@pytest.mark.parametrize(("inside", "roofed"), [(25, True), (23, False)])
def test_four_fifths_of_its_flies_stand_under_the_roof(inside, roofed):
    flies = np.array([[0.0, 0.0, 0.1]] * inside + [[0.6, 0.0, 0.1]] * (30 - inside))
    assert under([[0.0, 0.0, 0.5]] * 3, flies) == roofed


def ring(sectors, radius, z=0.4, n=20):
    """Flies in some of eight directions about the leg."""
    turns = np.repeat((np.arange(sectors) + 0.5) * math.pi / 4.0, n)
    return np.stack([radius * np.cos(turns), radius * np.sin(turns), np.full(len(turns), z)], axis=1)


@pytest.mark.parametrize(
    ("sectors", "radius", "roofed"), [(6, 0.3, True), (5, 0.3, False), (8, 0.58, True), (8, 0.62, False)]
)
def test_a_rim_has_flies_within_sixty_centimetres_in_six_of_eight_directions(sectors, radius, roofed):
    large = body((2.0, 2.0, 0.5))
    assert under(ring(sectors, radius), table=large) == roofed


@pytest.mark.parametrize(("low", "roofed"), [(4, True), (6, False)])
def test_nineteen_in_twenty_flies_of_a_rim_float_higher_than_what_stands_below(low, roofed):
    rim = ring(8, 0.3, n=13)[: 100 - low]
    assert under(np.concatenate([rim, [[0.3, 0.3, 0.1]] * low])) == roofed


def test_directions_are_counted_round_the_compass():
    for sectors in range(1, 9):
        assert _sectors(ring(sectors, 0.5)) == sectors
    assert _sectors(np.array([[0.1, 1e-3, 5.0], [0.1, -1e-3, 0.0]])) == 2  # one on each side of east
    assert _sectors(np.empty((0, 3))) == 0


def test_over_a_footprint_is_along_its_own_axes():
    turned = body((0.8, 0.2, 0.5), center=(1.0, 2.0), yaw=math.pi / 4.0)
    along, across = np.array([1.0, 1.0]) / math.sqrt(2.0), np.array([-1.0, 1.0]) / math.sqrt(2.0)
    for place, expected in (
        (0.42 * along, True), (-0.42 * along, True), (0.44 * along, False), (0.12 * across, True),
        (-0.12 * across, True), (0.14 * across, False), (0.42 * across, False),
    ):  # fmt: skip
        assert _over(np.array([[*(np.array([1.0, 2.0]) + place), 9.0]]), turned)[0] == expected
    assert _plan_area(turned) == pytest.approx(0.16)


def test_legs_under_one_table_are_all_joined_to_it(flies):
    from flysim.geometry.frames import Pose2

    up = (0.0, 0.0, 0.45)
    slab = flies.faces((0.9, 0.6, 0.1), Pose2(2.0, 1.0, 0.0), ("+x", "-x", "+y", "-y", "top"))
    parts = [(p + up, n, s, a + up, d, e) for p, n, s, a, d, e in slab]
    for x, y in ((1.75, 0.85), (2.25, 0.85), (2.25, 1.15)):
        parts += flies.faces((0.1, 0.1, 0.25), Pose2(x, y, 0.0), ("+x", "-x", "+y", "-y"), seed=1)
    cloud = flies.cloud_of(parts)
    away = flies.box((1.2, 0.8, 0.5), Pose2(-2.0, 1.0, 0.0), [(-4.0, 0.0, 0.8), (-2.0, 3.5, 0.8)])
    one, two = find_obstacles(flies.cloud_of(parts + away), ObstacleParams())  # whatever stands elsewhere
    assert max(one.size[0], two.size[0]) > 1.0 > min(one.size[0], two.size[0])
    (found,) = find_obstacles(cloud, ObstacleParams())
    above = np.flatnonzero(cloud.points[:, 2] > 0.04)
    assert len(found.flies) > 0.97 * len(above)
    assert (np.diff(found.flies) > 0).all()
    np.testing.assert_allclose(found.size, (0.9, 0.6, 0.55), atol=0.008)


def column(n, z=0.2):
    """`n` flies a centimetre from each other: one cluster."""
    return np.stack([0.01 * np.arange(n), np.zeros(n), np.full(n, z)], axis=1)


def found(flies, points, **given):
    n = len(points)
    zeros = np.zeros((n, 3))
    arms = np.repeat(points[:, None], 4, axis=1)
    cloud = flies.cloud_of([(points, np.tile([0.0, 0.0, 1.0], (n, 1)), zeros, arms, 0 * arms, np.zeros((n, 4), bool))])
    return find_obstacles(cloud, ObstacleParams(**given))


def test_an_obstacle_has_so_many_flies_at_least(flies):
    assert len(found(flies, column(25))) == 1
    assert found(flies, column(24)) == ()
    assert len(found(flies, column(30), min_flies=30)) == 1 and found(flies, column(30), min_flies=31) == ()


def test_flies_as_low_as_the_floor_are_none(flies):
    for z, expected in ((0.041, 0), (0.08, 1)):  # too low to be an obstacle, and high enough
        assert len(found(flies, column(40, z))) == expected
    assert len(found(flies, column(40, 0.0401), min_height=0.0)) == 1
    assert len(found(flies, column(40, 0.04), min_height=0.0)) == 0
    assert len(found(flies, column(40, 0.2), min_height=0.2)) == 1
    assert len(found(flies, column(40, 0.2), min_height=0.21)) == 0


def test_the_one_with_most_flies_comes_first(flies):
    away = (2.0, 0.0, 0.0)
    points = np.concatenate([column(30), column(60) + away, column(40) - away])
    assert [len(o.flies) for o in found(flies, points)] == [60, 40, 30]
