"""What wheels tell is apart from the way that is driven, by as much as the figures say, and the same by each seed."""

import math

import numpy as np
import pytest

from flysim.geometry.frames import Pose2, wrap_angle
from flysim.sim.driving import drive_to
from flysim.sim.encoders import EXACT, Encoders, OdometryParams
from flysim.sim.odometry import Odometry

RADIUS, TRACK, STEP = 0.05, 0.30, 1.0 / 240.0


def believed(params, metres=1.0, turn=0.0, seed=0, steps=240):
    """Where odometry ends of a robot that truly drives so far straight and then turns so far on the spot, by hand."""
    encoders = Encoders(params, seed=seed)
    read = encoders.begin(RADIUS, TRACK, (0.0, 0.0))
    odometry = Odometry(pose=Pose2(0.0, 0.0, 0.0), wheels=read, radius=encoders.radius, track=encoders.track)
    angle, half = metres / RADIUS, turn * TRACK / 2.0 / RADIUS
    for k in range(1, steps + 1):
        odometry = odometry.advanced(*encoders.read(angle * k / steps, angle * k / steps, STEP))
    for k in range(1, steps + 1) if turn else ():
        odometry = odometry.advanced(*encoders.read(angle - half * k / steps, angle + half * k / steps, STEP))
    return odometry.pose


def test_of_a_perfect_robot_they_read_what_the_wheels_turned():
    encoders = Encoders(EXACT)
    assert encoders.begin(RADIUS, TRACK, (0.25, -1.5)) == (0.25, -1.5)
    assert (encoders.radius, encoders.track, encoders.turn_step, encoders.push(1.0)) == (RADIUS, TRACK, 0.0, 0.0)
    assert encoders.read(0.1234567891234, -7.0, STEP) == (0.1234567891234, -7.0)


def test_wrong_figures_of_the_wheels_stretch_ways_and_turns():
    assert believed(OdometryParams(wheel_radius_error=0.02)).x == pytest.approx(1.02, abs=1e-9)
    # Half a radian of a track that is believed 25 % too wide is 0.4 radians.
    assert believed(OdometryParams(track_error=0.25), 0.0, 0.5).yaw == pytest.approx(0.4, abs=1e-9)


def test_random_errors_are_as_large_as_asked_for_and_a_seeds_own():
    params = OdometryParams(distance_std=0.02, yaw_std_deg_per_m=2.0)
    ends = [believed(params, seed=seed, steps=8) for seed in range(400)]
    assert np.std([pose.x for pose in ends]) == pytest.approx(0.02, rel=0.15)
    assert np.std([math.degrees(pose.yaw) for pose in ends]) == pytest.approx(2.0, rel=0.15)
    assert abs(np.mean([pose.yaw for pose in ends])) < 0.005
    assert believed(params, seed=7) == believed(params, seed=7) != believed(params, seed=8)
    # Each metre for itself: of four the deviation is twice that of one, not four times.
    far = [math.degrees(believed(params, 4.0, seed=seed, steps=32).yaw) for seed in range(400)]
    assert np.std(far) == pytest.approx(4.0, rel=0.15)
    assert believed(params, 0.0, 0.5).yaw == pytest.approx(0.5, abs=1e-9)  # the way makes them, not the turn


def test_ticks_are_counted_whole():
    encoders = Encoders(OdometryParams(ticks_per_turn=100))
    encoders.begin(RADIUS, TRACK, (0.0, 0.0))
    tick = math.tau / 100
    assert encoders.read(0.99 * tick, -0.01 * tick, STEP) == (0.0, -tick)
    assert encoders.read(3.5 * tick, 2.0001 * tick, STEP) == pytest.approx((3 * tick, 2 * tick))
    assert encoders.turn_step == pytest.approx(tick * RADIUS / TRACK)


def test_slip_and_a_floor_that_drags():
    # At an even speed there is no load but at the first step: 1 m in a second from rest is 240 m/s^2 for 1/240 of it.
    assert believed(OdometryParams(load_slip=0.001)).x == pytest.approx(1.001, abs=1e-6)
    assert believed(OdometryParams(turn_slip=0.1), 0.0, 0.5).yaw == pytest.approx(0.525, abs=1e-6)
    left, right = believed(OdometryParams(drag=0.01)), believed(OdometryParams(drag=-0.01))
    assert left.yaw < 0.0 < right.yaw == pytest.approx(-left.yaw, abs=1e-9)
    assert right.yaw == pytest.approx((1 / 0.99 - 1) / TRACK, rel=1e-6)


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"distance_std": -0.1}, "distance_std must be a number in"),
        ({"yaw_std_deg_per_m": float("nan")}, "yaw_std_deg_per_m must be"),
        ({"ticks_per_turn": 2.5}, "ticks_per_turn must be a whole number"),
        ({"ticks_per_turn": 3}, "at least 8, got 3"),
    ],
)
def test_nonsense_is_refused(wrong, why):
    with pytest.raises(ValueError, match=why):
        OdometryParams(**wrong)


def driven(made, *, goal=Pose2(1.0, 0.0, 0.0), seed=3, **wrong):
    with made.simulation(encoders=Encoders(OdometryParams(**wrong), seed=seed)) as simulation:
        leg = drive_to(simulation, goal)
        return leg.blocked, simulation.odometry.pose, simulation.true_pose()


def test_the_robot_drives_to_where_its_wheels_say_and_truly_stands_elsewhere(made):
    blocked, told, true = driven(made, distance_std=0.05, yaw_std_deg_per_m=5.0)
    assert blocked is None
    assert told.distance(Pose2(1.0, 0.0, 0.0)) < 0.01
    assert abs(math.degrees(wrap_angle(true.yaw - told.yaw))) > 0.2
    assert true.distance(told) > 0.005
    assert driven(made, distance_std=0.05, yaw_std_deg_per_m=5.0) == (blocked, told, true)


def test_coarse_encoders_still_arrive(made):
    blocked, told, _ = driven(made, goal=Pose2(0.3, 0.0, 0.5), ticks_per_turn=64)
    assert blocked is None
    assert told.distance(Pose2(0.3, 0.0, 0.0)) < 0.02
    assert abs(told.yaw - 0.5) < 1.1 * math.tau * RADIUS / 64 / TRACK


def test_a_push_moves_the_robot_and_no_wheel_tells(made):
    blocked, told, true = driven(made, push_n=45.0, push_at_s=0.5, push_for_s=0.2)
    assert blocked is None
    assert abs(told.y) < 0.01
    assert true.y > 0.02
