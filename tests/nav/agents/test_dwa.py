"""DWA by hand: the window that the wheels can reach, where an arc leads, and what is never chosen."""

import math

import numpy as np
import pytest

from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.chart_params import ChartParams
from flysim.nav.agents.dwa import DwaAgent, DwaParams, _arcs
from flysim.nav.agents.surroundings import RANGE, SECTORS

LIMITS = RobotLimits(radius=0.2, v_max=0.5, w_max=1.5, period=0.1)


def seen(*blocked, goal=(3.0, 0.0), velocity=(0.0, 0.0)):
    obstacles = np.full(SECTORS, RANGE, np.float32)
    for sector, distance in blocked:
        obstacles[sector] = distance
    told = {"obstacles": obstacles, "goal": np.array(goal, np.float32)}
    return {**told, "velocity": np.array(velocity, np.float32)}


def act(*blocked, limits=LIMITS, looks=1, goal=(3.0, 0.0), velocity=(0.0, 0.0), **params):
    """The last of some commands as speed [m/s] and yaw rate [rad/s]."""
    agent = DwaAgent(limits, DwaParams(**params))
    agent.begin(np.random.default_rng(0))
    for _ in range(looks):
        v, w = agent.act(seen(*blocked, goal=goal, velocity=velocity))
    return float(v) * limits.v_max, float(w) * limits.w_max


def test_an_arc_ends_where_the_circle_has_it():
    x, y, yaw = _arcs(np.array([0.5, 0.5, 0.0]), np.array([0.0, math.pi / 2.0, 1.0]), 1.0, 4)
    assert (x[0, -1], y[0, -1], yaw[0, -1]) == pytest.approx((0.5, 0.0, 0.0))
    radius = 0.5 / (math.pi / 2.0)  # a quarter of a circle in a second
    assert (x[1, -1], y[1, -1], yaw[1, -1]) == pytest.approx((radius, radius, math.pi / 2.0))
    assert (x[2], y[2]) == (pytest.approx(np.zeros(4)), pytest.approx(np.zeros(4)))  # it turns on the spot
    assert x[0] == pytest.approx([0.125, 0.25, 0.375, 0.5])


def test_it_asks_for_no_more_than_its_wheels_can_do():
    dt = 2.0 * LIMITS.period
    for acceleration in (0.4, 1.0):
        v, _ = act(velocity=(0.1, 0.0), acceleration=acceleration)
        assert v == pytest.approx(0.1 + acceleration * dt)  # straight ahead, as fast as it gets
    v, _ = act(velocity=(0.5, 0.0))
    assert v == pytest.approx(0.5)  # and never faster than the robot is
    _, w = act(goal=(3.0, 2.0), velocity=(0.0, 0.0), turn_acceleration=1.0)
    assert 0.0 < w <= dt + 1e-6


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_turns_to_the_side_of_its_goal(side):
    assert side * act(goal=(3.0, side * 1.2))[1] > 0.2


def test_it_brakes_before_what_it_cannot_pass():
    wall = [(sector, 0.45) for sector in range(20, 52)]
    v, _ = act(*wall, velocity=(0.5, 0.0), looks=2)
    free, _ = act(velocity=(0.5, 0.0), looks=2)
    assert v < free - 0.05


def test_it_never_goes_too_fast_to_stop_however_little_it_cares_for_room():
    wall = [(sector, 0.42 / math.cos(math.radians(5.0 * (sector - 35.5)))) for sector in range(22, 50)]
    careless = {"w_clear": 0.0, "w_heading": 0.0, "w_speed": 5.0, "velocity": (0.5, 0.0)}
    assert act(**careless)[0] == pytest.approx(0.5)
    v, _ = act(*wall, **careless)
    # It stands before it touches: 0.22 m off its circle, at 0.8 of 0.8 m/s^2, after a period.
    assert v > 0.3
    assert v**2 / (2.0 * 0.8 * 0.8) + v * LIMITS.period < 0.22


def test_where_no_command_is_free_it_turns_on_the_spot():
    ring = [(sector, 0.21) for sector in range(SECTORS)]  # a centimetre off its circle, all round
    v, w = act(*ring, looks=2, velocity=(0.5, 0.0), margin=0.2, spin=0.5)
    assert v == 0.0
    assert abs(w) == pytest.approx(0.5 * LIMITS.w_max)


def test_what_is_too_near_already_may_be_left():
    """Inside of the margin it would otherwise stand for ever."""
    close = [(sector, 0.215) for sector in range(0, 6)]  # behind it, within its margin
    v, _ = act(*close, looks=2)
    assert v > 0.05


def test_a_new_episode_knows_nothing_of_the_last_one():
    agent = DwaAgent(LIMITS)
    wall = [(sector, 0.6) for sector in range(30, 42)]
    first = []
    for _ in range(2):
        agent.begin(np.random.default_rng(0))
        first.append(agent.act(seen()))
        for _ in range(5):
            agent.act(seen(*wall))
    np.testing.assert_array_equal(*first)


def test_its_chart_is_as_it_is_told():
    wall = [(sector, 0.8) for sector in range(33, 39)]
    blind = ChartParams(taken=50.0, unseen_dear=0.0)  # nothing is ever taken: as in the open
    assert act(*wall, looks=3, chart=blind) == pytest.approx(act(looks=3, chart=blind), abs=1e-6)
    assert act(*wall, looks=3) != pytest.approx(act(looks=3), abs=0.02)
