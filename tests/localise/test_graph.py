"""A graph of poses: what agrees is kept, what does not is outvoted, and how sure it is grows with the way."""

import math
from itertools import pairwise

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.localise.graph import Tie, covariances, solved
from flysim.localise.path import between, onwards

UNSURE = np.diag([0.1**2, 0.1**2, 0.05**2])
SURE = np.diag([0.01**2, 0.01**2, math.radians(0.2) ** 2])


def square():
    """Eight poses round a square of 2 m, back at the first one's side."""
    poses = [np.zeros(3)]
    for k in range(7):
        poses.append(onwards(poses[-1], Pose2(1.0, 0.0, math.pi / 2 if k % 2 else 0.0)))
    return np.array(poses)


def ties(poses, pairs, how_sure=SURE, robust=True):
    return [Tie(a, b, between(poses[a], poses[b]), how_sure, robust=robust) for a, b in pairs]


def chained(poses, off):
    """The path by hops that are each off by so much."""
    found = [poses[0]]
    for a, b in pairwise(poses):
        hop = between(a, b)
        found.append(onwards(found[-1], Pose2(hop.x + off[0], hop.y + off[1], hop.yaw + off[2])))
    return np.array(found)


def test_hops_that_agree_are_the_path():
    true = square()
    row = [(k, k + 1) for k in range(7)]
    found, H = solved(chained(true, (0.02, -0.01, 0.05)), ties(true, row))
    covariance = covariances(H)
    np.testing.assert_allclose(found[:, :2], true[:, :2], atol=1e-6)
    assert (covariance[0] == 0.0).all()
    deviations = np.sqrt(covariance[:, 2, 2])
    # Headings add up by their squares: after seven hops the square root of seven times that of one.
    assert deviations[7] == pytest.approx(math.sqrt(7.0) * math.radians(0.2), rel=1e-6)
    assert (np.diff(deviations) > 0.0).all()


def test_a_loop_that_is_closed_takes_drift_back():
    true = square()
    drift = chained(true, (0.0, 0.0, 0.03))
    odometry = ties(drift, [(k, k + 1) for k in range(7)], UNSURE, robust=False)
    open_ended, unsure = solved(drift, odometry)
    closed, sure = solved(drift, [*odometry, *ties(true, [(0, 7)])])
    assert np.hypot(*(open_ended - true)[7, :2]) > 0.1
    assert np.hypot(*(closed - true)[7, :2]) < 0.01
    assert np.hypot(*(closed - true)[3, :2]) < np.hypot(*(open_ended - true)[3, :2])
    assert np.trace(covariances(sure)[7]) < np.trace(covariances(unsure)[7])


def test_a_hop_that_nothing_agrees_with_is_outvoted():
    true = square()
    wrong = Tie(0, 7, Pose2(5.0, 5.0, 1.0), SURE, robust=True)
    pairs = [(k, k + 1) for k in range(7)] + [(k, k + 2) for k in range(6)]
    found, _ = solved(true, [*ties(true, pairs), wrong])
    assert np.abs(found - true)[:, :2].max() < 0.01


def test_a_path_of_one_frame_is_where_it_is():
    found, H = solved(np.array([[1.0, 2.0, 3.0]]), [])
    np.testing.assert_array_equal(found, [[1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(covariances(H), np.zeros((1, 3, 3)))
