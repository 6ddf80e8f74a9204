"""An agent's chart: where it has been, what it has seen, and a way over what is left, in its own reckoning."""

import math

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.nav.agents.chart import Chart
from flysim.nav.agents.surroundings import RANGE, SECTORS, Surroundings, exact_distances, sector_bearings

STILL = np.zeros(2)


def seen(*blocked):
    obstacles = np.full(SECTORS, RANGE)
    for sector, distance in blocked:
        obstacles[sector] = distance
    return obstacles


WALL = [(sector, 1.5 / math.cos(sector_bearings()[sector])) for sector in range(30, 42)]


@pytest.fixture
def chart():
    return Chart(0.25, 0.1)


def test_it_reckons_where_it_is_by_its_velocities(chart):
    for _ in range(10):
        chart.update(np.array([0.5, 0.0]), seen())
    assert (chart.x, chart.y, chart.yaw) == pytest.approx((0.5, 0.0, 0.0))
    for _ in range(10):
        chart.update(np.array([0.0, math.pi / 2.0]), seen())
    for _ in range(10):
        chart.update(np.array([0.3, 0.0]), seen())
    assert (chart.x, chart.y, chart.yaw) == pytest.approx((0.5, 0.3, math.pi / 2.0), abs=1e-9)
    chart.clear()
    assert (chart.x, chart.y, chart.yaw) == (0.0, 0.0, 0.0)


def test_what_is_seen_is_taken_where_it_is(chart):
    chart.update(STILL, seen(*WALL))
    taken = chart.taken(3.0)
    assert len(taken) > 20
    assert taken[:, 0] == pytest.approx(np.full(len(taken), 1.5), abs=0.12)
    assert len(chart.taken(1.0)) == 0
    for _ in range(10):  # half a metre on it is half a metre nearer
        chart.update(np.array([0.5, 0.0]), seen())
    assert chart.taken(3.0)[:, 0] == pytest.approx(np.full(len(chart.taken(3.0)), 1.0), abs=0.12)


def test_what_is_looked_through_is_given_up(chart):
    chart.update(STILL, seen(*WALL))
    before = len(chart.taken(2.0))
    beyond = [(sector, 3.0 / math.cos(sector_bearings()[sector])) for sector, _ in WALL]
    for _ in range(6):
        chart.update(STILL, seen(*beyond))
    # A look through a cell takes its evidence away; between two sectors' rays nobody looks.
    assert len(chart.taken(2.0)) < 0.75 * before


def test_the_way_is_straight_in_the_open_and_round_what_stands(chart):
    chart.update(STILL, seen())
    chart.plan(3.0, 0.0)
    distance, bearing = chart.ahead(1.0)
    assert distance == pytest.approx(1.0, abs=0.08)
    assert bearing == pytest.approx(0.0, abs=0.06)
    blocked = [(sector, 0.9) for sector in range(30, 44)]
    for _ in range(3):
        chart.update(STILL, seen(*blocked))
    chart.plan(3.0, 0.0)
    _, bearing = chart.ahead(0.9)
    assert 0.4 < abs(bearing) < 1.6
    way = chart._way
    for x, y in chart.taken(3.0):
        assert np.hypot(way[:, 0] - x, way[:, 1] - y).min() > 0.2


def test_what_was_seen_lately_is_told_by_sector():
    around = Surroundings(2)
    three = np.array([[1.0, 0.0], [1.02, 0.01], [1.01, -0.01]])
    around.add(three)
    assert around.distances(Pose2(0.0, 0.0, 0.0)).min() == pytest.approx(1.0, abs=1e-6)
    turned = around.distances(Pose2(0.0, 0.0, math.pi / 2.0))  # it is to the right now
    assert sector_bearings()[int(np.argmin(turned))] == pytest.approx(-math.pi / 2.0, abs=0.1)
    around.add(np.array([[2.0, 0.0]]))  # alone: nobody backs it
    around.add(np.zeros((0, 2)))  # and the first look is forgotten
    assert (around.distances(Pose2(0.0, 0.0, 0.0)) == RANGE).all()
    assert exact_distances(np.array([[2.0, 0.0]]), Pose2(0.5, 0.0, 0.0)).min() == pytest.approx(1.5)
