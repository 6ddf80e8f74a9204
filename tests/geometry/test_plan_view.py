import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.plan_view import axes, extent, fold_yaw, plan_hull, smallest_rectangle

length = st.floats(0.01, 5.0)
angle = st.floats(-10.0, 10.0)


@settings(deadline=None)
@given(length, length, angle, st.floats(-9, 9), st.floats(-9, 9))
def test_the_rectangle_round_a_turned_rectangle_is_itself(a, b, yaw, x, y):
    corners = np.array([[a, b], [a, -b], [-a, b], [-a, -b]]) / 2 @ axes(yaw) + (x, y)
    found = smallest_rectangle(corners)
    assert (found.length, found.width) == pytest.approx((max(a, b), min(a, b)), rel=1e-6, abs=1e-7)
    assert found.center == pytest.approx([x, y], abs=1e-6)
    assert -math.pi / 2 <= found.yaw < math.pi / 2
    if abs(a - b) > 0.02 * max(a, b):
        turned = yaw if a > b else yaw + math.pi / 2
        assert abs(math.sin(found.yaw - turned)) < 1e-6


@settings(deadline=None)
@given(angle)
def test_folding_a_heading_keeps_the_axis_and_its_range(yaw):
    folded = fold_yaw(yaw)
    assert -math.pi / 2 <= folded < math.pi / 2
    assert math.sin(folded - yaw) == pytest.approx(0.0, abs=1e-9)


def test_a_rectangle_round_a_triangle_lies_on_one_of_its_sides():
    # 3-4-5: on either short side it has area 12, on the long one 5 x 2.4 = 12: a tie, decided one way.
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])
    results = {smallest_rectangle(corners[list(order)])[1:] for order in ((0, 1, 2), (2, 1, 0), (1, 0, 2))}
    assert len(results) == 1
    assert smallest_rectangle(corners).length * smallest_rectangle(corners).width == pytest.approx(12.0)


@pytest.mark.parametrize("n", [500, 50_000])
def test_the_hull_keeps_the_extent_along_every_heading(n):
    xy = np.random.default_rng(1).normal(size=(n, 2)) * (1.0, 0.3)
    corners = xy[plan_hull(xy)]
    assert len(corners) < 60
    for yaw in np.linspace(-1.5, 1.5, 31):
        assert np.array(extent(corners, yaw)) == pytest.approx(np.array(extent(xy, yaw)), abs=1.5e-4)


@pytest.mark.parametrize("n", [1, 2, 3, 5000])
def test_points_in_a_line_have_two_ends(n):
    t = np.random.default_rng(2).permutation(n) / max(n - 1, 1)
    xy = np.stack([1.0 + t * 3.0, 2.0 - t * 4.0], axis=1)
    ends = xy[plan_hull(xy)]
    assert np.ptp(ends, axis=0) == pytest.approx([3.0, 4.0] if n > 1 else [0.0, 0.0])
    assert smallest_rectangle(xy)[1:3] == pytest.approx((5.0 if n > 1 else 0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(("off", "kept"), [(0.95e-4, False), (1.05e-4, True)])
def test_of_many_points_those_a_tenth_of_a_millimetre_off_the_farthest_are_left_out(off, kept):
    turn = np.arange(16) * math.pi / 8.0  # the directions in which the farthest are looked for
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    beside = (math.cos(math.pi / 16.0) + off) * np.array([[math.cos(math.pi / 16.0), math.sin(math.pi / 16.0)]])
    inside = np.random.default_rng(0).uniform(-0.5, 0.5, (1000, 2))
    found = plan_hull(np.concatenate([circle, beside, inside]))
    assert sorted(found.tolist()) == list(range(17 if kept else 16))
    # What stands far from the origin is no other.
    away = plan_hull(np.concatenate([circle, beside, inside]) + np.array([30.0, -20.0]))
    assert sorted(away.tolist()) == sorted(found.tolist())
    # Few points are all asked.
    assert 16 in plan_hull(np.concatenate([circle, beside]))
