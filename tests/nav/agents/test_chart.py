"""An agent's chart: where it has been, what it has seen, and a way over what is left, in its own reckoning."""

import math

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.nav.agents.chart import Chart
from flysim.nav.agents.surroundings import RANGE, SECTORS, exact_distances, sector_bearings

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


def test_exact_distances_all_round_leave_no_shadows():
    """What was entered over a sector's width from afar is gone where a nearer look sees past it."""
    post = Pose2(2.5, 0.3, 0.0)
    angle = np.linspace(0.0, math.tau, 40)
    outline = np.stack([post.x + 0.05 * np.cos(angle), post.y + 0.05 * np.sin(angle)], axis=1)
    wall = np.stack([np.full(200, -1.0), np.linspace(-2.0, 2.0, 200)], axis=1)  # behind: it is told all round
    chart, x = Chart(0.2, 0.1), 0.0
    for _ in range(36):
        chart.update(np.array([0.5, 0.0]), exact_distances(np.concatenate([outline, wall]), Pose2(x + 0.05, 0.0, 0.0)))
        x += 0.05
    ahead = chart.taken(1.5)
    assert len(ahead)
    assert np.hypot(ahead[:, 0] - (post.x - x), ahead[:, 1] - post.y).max() < 0.12


def test_cameras_do_not_give_up_what_they_cannot_see():
    chart = Chart(0.2, 0.1)
    low = [(36, 1.2), (37, 1.2)]
    for _ in range(4):
        chart.update(STILL, seen(*low))
    taken = len(chart.taken(2.0))
    for _ in range(16):  # until it is 0.4 m ahead, out of view, with a wall behind it
        chart.update(np.array([0.5, 0.0]), seen((36, 3.0), (37, 3.0)))
        if chart.x > 0.35:
            break
    for _ in range(20):
        chart.update(STILL, seen((36, 2.6), (37, 2.6)))
    assert len(chart.taken(2.0)) > 0.5 * taken


def test_floor_at_the_view_edge_needs_more_than_one_look():
    chart = Chart(0.2, 0.1)

    def hidden():
        near = chart.unseen(1.5)
        return (np.hypot(near[:, 0] - 1.2, near[:, 1]) < 0.1).any()

    chart.update(STILL, seen())
    assert hidden()
    for _ in range(2):
        chart.update(STILL, seen())
    assert not hidden()
    beside = chart.unseen(1.0)
    assert (np.hypot(beside[:, 0], beside[:, 1] - 0.8) < 0.1).any()  # it has not looked to its left


def test_what_is_far_makes_a_way_dear_and_does_not_shut_it():
    chart = Chart(0.2, 0.1)
    for _ in range(3):
        chart.update(STILL, seen(*[(sector, 3.0) for sector in range(34, 38)]))
    assert not len(chart.taken(4.0))
    chart.plan(6.0, 0.0)
    assert abs(chart.ahead(2.5)[1]) > 0.2


def test_where_it_stands_it_knows_no_more_floor_than_is_under_it():
    chart = Chart(0.2, 0.1, margin=0.1)
    for _ in range(20):  # what stands before its nose hides all floor
        chart.update(np.array([0.5, 0.0]), seen(*[(sector, 0.3) for sector in range(SECTORS)][30:42]))
    beside = np.abs(chart.unseen(0.5)[:, 1])
    assert chart.x == pytest.approx(1.0)
    assert 0.19 < beside[np.abs(chart.unseen(0.5)[:, 0]) < 0.03].min() < 0.26


def test_floor_behind_what_was_seen_is_hidden_until_it_is_looked_at():
    chart = Chart(0.2, 0.1)
    thing = [(sector, 1.0) for sector in range(34, 38)]
    for _ in range(3):
        chart.update(STILL, seen(*thing))
    hidden = chart.hidden(1.5, 0.2)
    assert len(hidden)
    assert (np.hypot(hidden[:, 0], hidden[:, 1]) > 1.0).all()  # before it and beside it the floor has been in view
    gaps = np.linalg.norm(hidden[:, None] - chart.taken(2.0), axis=2).min(axis=1)
    assert gaps.max() < 0.2
    assert len(chart.hidden(0.8, 0.2)) == 0
    assert len(Chart(0.2, 0.1).hidden(1.5, 0.2)) == 0
