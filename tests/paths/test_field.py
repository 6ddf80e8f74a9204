"""How far it still is, on a floor that costs nothing to work out by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from flysim.paths.field import Field


def ground(cost, step=0.5, hole=()):
    """Nodes on 5 by 5 places with a cost each; places of `hole` are no nodes."""
    places = [(step * j, step * i) for i in range(5) for j in range(5) if (j, i) not in hole]
    nodes = np.array(places)
    return SimpleNamespace(
        ways=SimpleNamespace(nodes=nodes), distances=lambda _goal: np.array([cost(*p) for p in places], float)
    )


def test_at_its_nodes_it_is_their_cost_and_between_them_the_mean():
    one = Field(ground(lambda x, y: 10.0 + x + 2.0 * y), (9.0, 9.0))
    assert one.at(1.0, 1.5) == pytest.approx(14.0)
    assert one.at(1.25, 0.7) == pytest.approx(10.0 + 1.25 + 1.4)  # a plane is told exactly
    assert one.at(0.0, 0.0) == pytest.approx(10.0)
    assert one.at(2.0, 2.0) == pytest.approx(16.0)


def test_beyond_its_nodes_it_is_that_of_the_border():
    one = Field(ground(lambda x, y: 10.0 + x), (9.0, 9.0))
    assert one.at(-5.0, 1.0) == pytest.approx(10.0)
    assert one.at(7.0, 40.0) == pytest.approx(12.0)


def test_near_the_goal_it_is_the_straight_line():
    one = Field(ground(lambda x, y: 99.0), (1.1, 1.2))
    assert one.at(1.1, 1.2) == 0.0
    assert one.at(1.4, 1.6) == pytest.approx(0.5)
    assert one.at(0.0, 0.0) == pytest.approx(99.0)


def test_where_nobody_can_be_the_nearest_place_tells():
    one = Field(ground(lambda x, y: 10.0 + x, hole={(2, 2)}), (9.0, 9.0))
    assert math.isfinite(one.at(1.0, 1.0))
    assert one.at(1.0, 1.0) == pytest.approx(11.0, abs=0.51)
    walled = Field(ground(lambda x, y: math.inf if x > 1.2 else 10.0 + x), (9.0, 9.0))
    assert walled.at(2.0, 1.0) == pytest.approx(11.0)  # no way from there: as from the nearest with one
