"""An agent that comes no farther: it notices, turns to the widest opening, and says so."""

import math

import numpy as np
import pytest

from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.chart import Chart
from flysim.nav.agents.recovery import Recovery
from flysim.nav.agents.surroundings import RANGE, SECTORS, sector_bearings
from flysim.nav.agents.vfh import VfhAgent

LIMITS = RobotLimits(radius=0.19, v_max=0.5, w_max=1.5, period=0.1)
STILL = np.zeros(2)
OPEN = np.full(SECTORS, RANGE)


def niche(opening):
    """Distances in a round niche of 0.35 m that is open about one bearing [rad]."""
    return np.where(np.abs(sector_bearings() - opening) < 0.7, 3.0, 0.35)


@pytest.fixture
def recovery():
    return Recovery(Chart(0.2, 0.1), 0.1, patience=2.0, stay=0.3, escape=0.5, most=1.0)


def test_who_stays_in_one_place_is_led_out_for_a_while(recovery):
    directions = sector_bearings()
    assert [recovery.due() for _ in range(25)] == [False] * 19 + [True] * 6
    run = np.where(np.abs(directions - 1.0) < 0.3, 1.5, 0.1)
    run[0] = 1.6  # alone it is no wide opening
    recovery.begin(directions, run)
    assert recovery.active
    assert recovery.count == 1
    assert not recovery.due()
    headings = []
    while recovery.active:
        headings.append(recovery.heading())
    assert headings == pytest.approx([1.0] * 10, abs=0.1)
    assert not recovery.due()  # its patience begins anew
    recovery.clear()
    assert recovery.count == 0


def test_what_was_seen_seldom_is_forgotten_and_the_place_is_avoided():
    chart = Chart(0.2, 0.1)
    once, often = OPEN.copy(), OPEN.copy()
    once[30], often[42] = 1.0, 1.0
    chart.update(STILL, once)
    for _ in range(4):
        chart.update(STILL, often)
    before = chart.taken(2.0)
    assert (before[:, 1] < 0).any()
    assert (before[:, 1] > 0).any()
    chart.forget()
    assert (chart.taken(2.0)[:, 1] > 0).all()
    chart.forget()
    assert len(chart.taken(2.0))


def test_a_way_goes_round_a_place_that_is_avoided():
    chart = Chart(0.2, 0.1)
    chart.avoid(1.5, 0.0)
    chart.plan(3.0, 0.0)
    assert chart.ahead(1.5)[0] * abs(math.sin(chart.ahead(1.5)[1])) > 0.3


@pytest.mark.parametrize("opening", [-2.0, 0.5, 2.0])
def test_vfh_does_not_stand_still_for_long(opening):
    agent = VfhAgent(LIMITS)
    agent.begin(np.random.default_rng(0))
    distances, recovered = np.full(SECTORS, 0.25), []
    for k in range(120):  # shut in, for a while; then it opens
        told = distances if k < 40 else niche(opening)
        act = agent.act({"obstacles": told, "velocity": STILL, "goal": np.array([3.0, 0.0])})
        recovered.append(agent.info["recovering"])
        assert np.isfinite(act).all()
    assert agent.info["recoveries"] >= 1
    assert any(recovered)
    agent.begin(np.random.default_rng(0))
    assert agent.info == {"recoveries": 0, "recovering": False}
