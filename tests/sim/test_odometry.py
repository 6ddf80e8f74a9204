import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.geometry.frames import Pose2
from flysim.sim.odometry import Odometry

RADIUS, TRACK = 0.05, 0.30
START = Odometry(pose=Pose2(0.0, 0.0, 0.0), wheels=(0.0, 0.0), radius=RADIUS, track=TRACK)
turns = st.floats(-20.0, 20.0)


def test_forty_centimetres_a_second_for_five_seconds_are_two_metres():
    speed = 0.4 / RADIUS  # 8 rad/s
    odometry = START
    for step in range(1, 5 * 240 + 1):
        odometry = odometry.advanced(speed * step / 240, speed * step / 240)
    assert odometry.pose.x == pytest.approx(2.0, abs=1e-12)
    assert (odometry.pose.y, odometry.pose.yaw) == (0.0, 0.0)
    assert odometry.wheels == pytest.approx((40.0, 40.0))


def test_wheels_that_turn_against_each_other_turn_on_the_spot():
    # A quarter turn: each wheel runs a quarter of a circle of radius 0.15 m, 0.2356 m, or 4.712 rad of a 5 cm wheel.
    angle = math.pi / 2 * (TRACK / 2) / RADIUS
    pose = START.advanced(-angle, angle).pose
    assert (pose.x, pose.y) == (0.0, 0.0)
    assert pose.yaw == pytest.approx(math.pi / 2, abs=1e-12)


def test_a_half_circle_is_driven_exactly_in_one_step():
    # About a centre 1 m to the left: the wheels run on circles of 0.85 and 1.15 m.
    pose = START.advanced(math.pi * 0.85 / RADIUS, math.pi * 1.15 / RADIUS).pose
    assert (pose.x, pose.y) == pytest.approx((0.0, 2.0), abs=1e-12)
    assert abs(pose.yaw) == pytest.approx(math.pi, abs=1e-12)


def test_left_wheel_ahead_turns_right():
    pose = START.advanced(1.0, 0.0).pose
    assert pose.yaw < 0.0
    assert pose.y < 0.0 < pose.x


@given(turns, turns)
def test_driving_back_comes_back(left, right):
    there = START.advanced(left, right)
    back = there.advanced(0.0, 0.0).pose
    assert (back.x, back.y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert math.sin(back.yaw) == pytest.approx(0.0, abs=1e-9)
    assert math.cos(back.yaw) == pytest.approx(1.0, abs=1e-9)


@given(turns, turns, st.integers(2, 7))
def test_an_arc_in_pieces_is_the_same_arc(left, right, pieces):
    whole, odometry = START.advanced(left, right).pose, START
    for k in range(1, pieces + 1):
        odometry = odometry.advanced(left * k / pieces, right * k / pieces)
    assert (odometry.pose.x, odometry.pose.y) == pytest.approx((whole.x, whole.y), abs=1e-9)


@given(turns, turns)
def test_the_heading_stays_in_half_a_turn_either_way(left, right):
    assert -math.pi <= START.advanced(10 * left, 10 * right).pose.yaw < math.pi
