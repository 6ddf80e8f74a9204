import dataclasses

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.obstacles.edge import LEAST_ARMS, edge

X, Y = np.eye(3)[:2]


def all_of(cloud):
    return np.arange(len(cloud.points))


@pytest.mark.parametrize("direction", [X, -X])
def test_a_face_ends_at_the_silhouette_and_not_at_its_last_fly(flies, direction):
    cloud = flies.cloud_of(flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.0), ("-y",)))
    assert (cloud.points @ direction).max() < 0.295
    assert edge(cloud, all_of(cloud), direction) == pytest.approx(0.3, abs=0.002)


def test_arms_that_run_over_the_edge_do_not_move_it(flies):
    cloud = flies.cloud_of(flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.0), ("-y",)))
    over = cloud.arms.copy()
    astray = np.flatnonzero(cloud.ended[:, 0])[::12]
    over[astray, 0] += (0.02, 0.0, 0.0)
    moved = dataclasses.replace(cloud, arms=over)
    assert edge(moved, all_of(moved), X) == pytest.approx(0.3, abs=0.002)


def test_arms_that_stop_at_a_false_match_do_not_draw_it_in(flies):
    cloud = flies.cloud_of(flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.0), ("-y",)))
    ended, arms = cloud.ended.copy(), cloud.arms.copy()
    short = np.arange(0, len(ended), 3)
    ended[short, 0], arms[short, 0] = True, cloud.points[short]
    drawn = dataclasses.replace(cloud, arms=arms, ended=ended)
    assert edge(drawn, all_of(drawn), X) == pytest.approx(0.3, abs=0.003)


def test_long_pixels_count_for_less(flies):
    """Arms on a top seen at a low angle scatter by centimetres; those on the side beside it by millimetres."""
    cloud = flies.cloud_of(flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.0), ("-y", "top")))
    top = np.flatnonzero(cloud.normals[:, 2] > 0.7)
    arms, steps = cloud.arms.copy(), cloud.steps.copy()
    steps[top, 0] = (0.02, 0.0, 0.0)
    arms[top, 0] += (0.008, 0.0, 0.0)
    scattered = dataclasses.replace(cloud, arms=arms, steps=steps)
    assert edge(scattered, all_of(scattered), X) == pytest.approx(0.3, abs=0.003)


def test_without_arms_that_end_there_is_no_edge(flies):
    cloud = flies.cloud_of(flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.0), ("-y",)))
    endless = dataclasses.replace(cloud, ended=np.zeros_like(cloud.ended))
    assert edge(endless, all_of(endless), X) is None
    assert edge(cloud, np.flatnonzero(cloud.ended[:, 0])[: LEAST_ARMS - 1], X) is None
    assert edge(cloud, all_of(cloud), Y) is None  # nothing of the face runs that way
