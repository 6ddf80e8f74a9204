"""An agent's chart: where it has been, what it has seen, and a way over what is left, in its own reckoning."""

import math

import numpy as np
import pytest

from flysim.nav.agents.chart import Chart, ChartParams
from flysim.nav.agents.surroundings import RANGE, SECTORS, sector_bearings

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


def driven(*, obstacles=(), looks=1, **params):
    """A chart after some looks of a robot that stands."""
    chart = Chart(0.25, 0.1, ChartParams(**params))
    for _ in range(looks):
        chart.update(STILL, seen(*obstacles))
    return chart


def test_it_takes_as_much_evidence_as_it_is_told(chart):
    chart.update(STILL, seen(*WALL))
    assert len(chart.taken(2.0)) > 0  # one look is enough
    assert len(driven(obstacles=WALL, taken=2.5, looks=2).taken(2.0)) == 0
    assert len(driven(obstacles=WALL, taken=2.5, looks=3).taken(2.0)) > 0
    assert len(driven(obstacles=WALL, taken=2.5, most=2.0, looks=9).taken(2.0)) == 0  # there is never so much


def test_what_is_beside_the_view_is_not_given_up():
    aside = [(sector, 1.5) for sector in range(44, 50)]  # 40 to 70 degrees to the left

    def left(**params):
        chart = driven(obstacles=aside, **params)
        for _ in range(8):
            chart.update(STILL, seen(*((sector, 3.0) for sector, _ in aside)))
        near = np.hypot(*chart.taken(2.0).T) < 2.0
        return int(near.sum())

    assert left() > left(view_deg=90.0)


def test_a_finer_chart_has_more_cells_on_the_same_wall():
    coarse, fine = driven(obstacles=WALL).taken(3.0), driven(obstacles=WALL, cell=0.025).taken(3.0)
    assert len(fine) > len(coarse)
    assert np.median(fine[:, 0]) == pytest.approx(1.5, abs=0.05)


def test_a_berth_is_kept_where_it_is_worth_its_price():
    wall = [(sector, 1.0) for sector in range(26, 36)]  # to the right of the way

    def nearest(**params):
        chart = driven(obstacles=wall, looks=3, **params)
        chart.plan(3.0, 0.0)
        return min(np.hypot(*(chart._way - point).T).min() for point in chart.taken(3.0))

    assert nearest(dear=0.0) < nearest() - 0.02
    assert nearest(berth=1.5, dear=40.0) > nearest() + 0.1


def test_floor_that_was_in_view_is_worth_a_detour():
    def known(**params):
        """Share of the way to a goal aside that lies on floor which has been in view."""
        chart = driven(obstacles=[(sector, 2.4) for sector in range(36, 42)], **params)
        chart.plan(2.0, math.radians(35.0))
        i, j = chart._cells(chart._way[:, 0], chart._way[:, 1])
        return chart._known[i, j].mean()

    assert known(unseen_dear=20.0) > known(unseen_dear=0.0)


def test_it_goes_on_beyond_its_edge():
    chart = driven(reach=3.0)
    for _ in range(60):  # 6 m ahead: twice as far as it reaches
        chart.update(np.array([1.0, 0.0]), seen(*WALL))
        chart.plan(3.0, 0.4)
    assert chart.x == pytest.approx(6.0)
    assert chart.ahead(1.0) is not None


def test_who_is_walled_in_goes_through_the_wall_as_the_last_resort():
    ring = [(sector, 1.0) for sector in range(SECTORS)]
    chart = driven(obstacles=ring, looks=3)
    chart.plan(3.0, 0.0)
    assert chart.ahead(2.9)[0] == pytest.approx(2.9, abs=0.2)
    gap = [one for one in ring if one[0] not in range(50, 64)]  # a way out to the left
    chart = driven(obstacles=gap, looks=3)
    chart.plan(3.0, 0.0)
    assert min(np.hypot(*(chart._way - point).T).min() for point in chart.taken(3.0)) > 0.2
