"""A robot that finds its way by what it sees looks on the way exactly where the next view would share too little."""

import math

import pytest

from flysim.geometry.frames import Pose2, wrap_angle
from flysim.sim.driving import SMOOTH
from flysim.sources.glances import Glance, glances

START = Pose2(0.0, 0.0, 0.0)


def stop(x, y, yaw_deg, *via):
    return Glance(pose=Pose2(x, y, math.radians(yaw_deg)), via=via)


def apart(one, other):
    turn = math.degrees(abs(wrap_angle(one.yaw - other.yaw))) / SMOOTH.look_turn_deg
    return math.hypot(one.distance(other) / SMOOTH.look_way, turn)


def test_a_hop_that_shares_its_view_needs_none():
    goal = stop(0.5, 0.0, 10.0)
    assert glances(START, goal, [START], SMOOTH) == [goal]


@pytest.mark.parametrize("goal", [stop(3.0, 0.0, 0.0), stop(0.0, 0.0, 180.0), stop(1.0, 1.0, -90.0, (1.0, 0.0))])
def test_no_look_shares_too_little_with_those_before(goal):
    found = glances(START, goal, [START], SMOOTH)
    assert found[-1].pose == goal.pose
    assert len(found) > 1
    seen = [START]
    for one in found:
        assert min(apart(one.pose, before) for before in seen) <= 1.0 + 1e-9
        seen.append(one.pose)
    assert [point for one in found for point in one.via] == list(goal.via)  # each point of the path once, in order


def test_where_it_has_looked_before_it_does_not_look_again():
    goal = stop(0.0, 0.0, 175.0)
    turned = [Pose2(0.0, 0.0, math.radians(yaw)) for yaw in (0, 30, 60, 90, 120, 150)]
    assert glances(START, goal, turned, SMOOTH) == [goal]
