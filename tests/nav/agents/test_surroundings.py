"""What was seen lately about the robot: kept for a while, told by sector, where points back each other."""

import math

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.nav.agents.surroundings import RANGE, Surroundings, SurroundingsParams, exact_distances, sector_bearings

HERE = Pose2(0.0, 0.0, 0.0)


def test_what_was_seen_lately_is_told_by_sector():
    around = Surroundings(2)
    three = np.array([[1.0, 0.0], [1.02, 0.01], [1.01, -0.01]])
    around.add(three, HERE)
    assert around.distances(HERE).min() == pytest.approx(1.0, abs=1e-6)
    turned = around.distances(Pose2(0.0, 0.0, math.pi / 2.0))  # it is to the right now
    assert sector_bearings()[int(np.argmin(turned))] == pytest.approx(-math.pi / 2.0, abs=0.1)
    around.add(np.array([[2.0, 0.0]]), HERE)  # alone: nobody backs it
    around.add(np.zeros((0, 2)), HERE)  # and the first look is forgotten
    assert (around.distances(HERE) == RANGE).all()
    assert exact_distances(np.array([[2.0, 0.0]]), Pose2(0.5, 0.0, 0.0)).min() == pytest.approx(1.5)


def test_who_backs_whom_is_a_parameter():
    pair = np.array([[2.0, 0.0], [2.25, 0.02]])

    def nearest(**params):
        around = Surroundings(1, SurroundingsParams(**params))
        around.add(pair, HERE)
        return around.distances(HERE).min()

    assert nearest() == RANGE  # three are asked for
    assert nearest(backed=2) == RANGE  # and these two are three cells apart
    assert nearest(backed=2, cell=0.3) == pytest.approx(2.0)
    assert nearest(backed=1) == pytest.approx(2.0)


def test_of_a_look_no_more_than_it_keeps_is_remembered():
    around = Surroundings(2, SurroundingsParams(most=3))
    around.add(np.arange(10.0).reshape(5, 2), HERE)
    np.testing.assert_array_equal(around.points(), np.arange(6.0).reshape(3, 2))


def test_points_in_a_place_tell_as_the_robot_turns_and_goes():
    points = np.array([[1.0, 1.0]])
    for pose, bearing, distance in (
        (Pose2(0.0, 0.0, 0.0), math.pi / 4.0, math.sqrt(2.0)),
        (Pose2(0.0, 0.0, math.pi), -3.0 * math.pi / 4.0, math.sqrt(2.0)),
        (Pose2(1.0, 0.0, 0.0), math.pi / 2.0, 1.0),
    ):
        told = exact_distances(points, pose)
        assert told.min() == pytest.approx(distance)
        assert sector_bearings()[int(np.argmin(told))] == pytest.approx(bearing, abs=math.radians(2.6))
        assert (told < RANGE).sum() == 1


def test_a_stray_point_is_no_obstacle():
    seen = Surroundings(4)
    seen.add(np.array([[2.0, 0.0], [0.0, 1.0], [0.01, 1.0], [0.0, 1.02]]), HERE)
    found = seen.distances(HERE)
    near = np.flatnonzero(found < RANGE)
    assert np.degrees(sector_bearings()[near]) == pytest.approx(90.0, abs=5.0)
    assert found[near] == pytest.approx(1.0, abs=0.02)
    assert exact_distances(np.array([[2.0, 0.01]]), Pose2(1.0, 0.0, 0.0))[36] == pytest.approx(1.0, abs=1e-3)


def test_what_was_seen_too_long_ago_is_forgotten():
    seen = Surroundings(2)
    seen.add(np.full((5, 2), 1.0), HERE)
    for _ in range(2):
        assert seen.distances(HERE).min() < RANGE
        seen.add(np.zeros((0, 2)), HERE)
    assert seen.distances(HERE).min() == RANGE


def test_what_was_seen_from_near_needs_nobody_to_back_it():
    around = Surroundings(1)
    around.add(np.array([[0.8, 0.0], [2.4, 0.0]]), HERE)
    assert around.distances(HERE).min() == pytest.approx(0.8)
    around.add(np.array([[0.8, 0.0], [2.4, 0.0]]), Pose2(-1.0, 0.0, 0.0))  # from where it is 1.8 m off
    assert around.distances(HERE).min() == RANGE


def test_what_was_seen_from_afar_counts_for_a_few_looks():
    """Its depth is off: of many looks, the nearest error would stand in a way that is open."""
    around, afar = Surroundings(60, SurroundingsParams(far_looks=3)), Pose2(-3.0, 0.0, 0.0)
    around.add(np.array([[0.5, 0.0], [0.52, 0.0], [0.54, 0.0]]), afar)
    around.add(np.array([[0.0, 1.0]]), HERE)
    around.add(np.zeros((0, 2)), HERE)
    assert around.distances(HERE).min() == pytest.approx(0.5)
    around.add(np.zeros((0, 2)), HERE)
    assert around.distances(HERE).min() == pytest.approx(1.0)  # what was seen from near is told still
