"""Intersection over union of an estimate and of what was visible, by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.evaluate.overlap import overlap
from flysim.geometry.plan_view import axes
from flysim.products.obstacle import Obstacle
from flysim.truth.obstacles import TrueObstacle

SIZE = (0.6, 0.4, 0.5)


def corners(size, yaw, center):
    half = np.array(size) / 2
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    points = signs * half
    points[:, :2] = points[:, :2] @ axes(yaw)
    return points + np.array([*center, half[2]])


def true(size=SIZE, yaw=0.0, symmetry="rectangle", points=None):
    points = corners(size, yaw, (1.0, 2.0)) if points is None else points
    return TrueObstacle(
        name="it", links=(0,), center=np.array([1.0, 2.0, size[2] / 2]), size=np.array(size), yaw=yaw,
        symmetry=symmetry, shape="cylinder" if symmetry == "round" else "box", visible_points=points,
        visible_pixels=1000,
    )  # fmt: skip


def found(size=SIZE, yaw=0.0, center=(1.0, 2.0), shape="box"):
    center = np.array([*center, size[2] / 2])
    return Obstacle(shape=shape, center=center, size=np.array(size), yaw=yaw, flies=np.zeros(0, np.int64))


@given(st.floats(-1.5, 1.5))
def test_what_is_as_it_is_has_all_in_common(yaw):
    assert overlap(true(yaw=yaw), found(yaw=yaw)) == pytest.approx((1.0, 1.0))


def test_a_shift_a_lower_top_and_nothing_in_common():
    shifted = overlap(true(), found(center=(1.15, 2.0)))
    assert shifted == pytest.approx((0.45 / 0.75, 0.45 / 0.75))
    lower = overlap(true(), found(size=(0.6, 0.4, 0.25)))
    assert lower == pytest.approx((1.0, 0.5))
    assert overlap(true(), found(center=(3.0, 2.0))) == (0.0, 0.0)


def test_a_square_turned_by_an_eighth_is_an_octagon():
    side = 1.0
    octagon = 2.0 * (math.sqrt(2.0) - 1.0) * side**2
    told = overlap(true(size=(side, side, 1.0)), found(size=(side, side, 1.0), yaw=math.pi / 4))
    assert told == pytest.approx((octagon / (2.0 - octagon),) * 2)


def test_round_things_are_compared_as_round():
    turn = np.linspace(0.0, 2.0 * math.pi, 721)
    side = np.stack([1.0 + 0.2 * np.cos(turn), 2.0 + 0.2 * np.sin(turn), np.full(721, 0.5)], axis=1)
    points = np.concatenate([side, side * (1.0, 1.0, 0.0)])
    thing = true(size=(0.4, 0.4, 0.5), symmetry="round", points=points)
    assert overlap(thing, found(size=(0.4, 0.4, 0.5), shape="cylinder")) == pytest.approx((1.0, 1.0), abs=1e-3)
    assert overlap(thing, found(size=(0.2, 0.2, 0.5), shape="cylinder")).plan == pytest.approx(0.25, abs=1e-3)


def test_where_nothing_was_visible_there_is_nothing_to_compare():
    assert overlap(true(points=np.empty((0, 3))), found()) is None
