"""Distances in plan, by hand arithmetic."""

import math

import numpy as np
import pytest

from flysim.worlds.random.plan import Places, apart, gap, outlines, sees
from flysim.worlds.random.recipe import standing
from flysim.worlds.shapes import Box, Cylinder, Sphere

GREY = (0.5, 0.5, 0.5)


def one(shape, x, y, yaw_deg=0.0):
    (outline,) = outlines(standing("m", shape, x, y, GREY, yaw_deg))
    return outline


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        (one(Box((0.4, 0.2, 1)), 0, 0), one(Box((0.4, 0.2, 1)), 1, 0), 0.6),
        (one(Box((0.4, 0.2, 1)), 0, 0), one(Box((0.4, 0.2, 1)), 1, 0, 90), 0.7),
        (one(Box((2.0, 2.0, 1)), 0, 0), one(Box((2.0, 2.0, 1)), 3, 0, 45), 2.0 - math.sqrt(2.0)),
        (one(Cylinder(0.3, 1), 0, 0), one(Sphere(0.2), 3, 4), 4.5),
        (one(Cylinder(0.1, 1), 2, 2), one(Box((2, 2, 1)), 0, 0), math.sqrt(2.0) - 0.1),
        (one(Box((2.0, 0.1, 1)), 0, 0), one(Box((2.0, 0.1, 1)), 0, 0, 90), 0.0),  # a cross: no corner in the other
        (one(Box((2.0, 2.0, 1)), 0, 0), one(Sphere(0.1), 0.5, 0), 0.0),
    ],
)
def test_gaps(a, b, expected):
    assert gap(a, b) == pytest.approx(expected, abs=1e-8)
    assert gap(b, a) == pytest.approx(expected, abs=1e-8)
    if expected:
        assert apart([a], [b], expected - 1e-6)
        assert not apart([b], [a], expected + 1e-6)


def test_a_line_of_sight_ends_at_a_body_in_between():
    post = one(Cylinder(0.05, 1), 1.0, 0.0)
    points = np.array([[2.0, 0.0], [2.0, 0.5], [0.5, 0.0], [2.0, 0.08]])
    assert sees(points, np.zeros(2), [post]).tolist() == [False, True, True, False]


def test_a_wall_parts_a_room_where_it_leaves_less_than_the_robot_needs():
    wall = one(Box((0.1, 1.0, 1)), 0.0, 0.0)
    for side, expected in ((0.7, 2), (1.2, 1)):  # 0.2 m, then 0.7 m between the wall's end and the room's
        ends = [one(Box((3.0, 0.1, 1)), 0.0, sign * (side + 0.05)) for sign in (-1, 1)]
        places = Places.of((-1.5, -side), (1.5, side), [wall, *ends])
        assert places.parts(0.25)[1] == expected
