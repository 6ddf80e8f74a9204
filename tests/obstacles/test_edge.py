import dataclasses

import numpy as np
import pytest

from flysim.geometry.frames import Pose2
from flysim.obstacles.edge import LEAST_ARMS, edge, supported

X, Y, UP = np.eye(3)


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


def followed(flies, heights, stops):
    """A cloud whose flies sit 0.2 m up and were followed to `heights` [m] at `stops`."""
    cloud = flies.cloud_of(flies.faces((0.6, 0.3, 0.4), Pose2(0.0, 0.0, 0.0), ("-y",)))
    n = len(heights)
    points = np.tile((0.0, -0.15, 0.2), (n, 1))
    arms = np.repeat(points[:, None], 4, axis=1)
    arms[:, 3, 2] = heights
    steps = np.zeros((n, 4, 3))
    steps[:, :3], steps[:, 3] = (0.004, 0.0, 0.0), (0.0, 0.0, 0.004)
    fields = {
        "points": points,
        "arms": arms,
        "steps": steps,
        "ended": np.zeros((n, 4), bool),
        "stop": np.array(stops, np.int32),
    }
    rest = {
        f.name: getattr(cloud, f.name)[:n]
        for f in dataclasses.fields(cloud)
        if f.name not in fields and f.name != "again"
    }
    return dataclasses.replace(cloud, **rest, **fields)


def test_one_stop_that_sees_high_is_enough(flies):
    near, far = [0.7] * 40, [1.1, 1.1, 1.1, 0.5]
    cloud = followed(flies, near + far, [0] * 40 + [1] * 4)
    # Two pixels lower: so far may an arm run over a silhouette.
    assert supported(cloud, all_of(cloud), UP) == pytest.approx(1.1 - 0.008)


def test_three_arms_of_a_stop_and_a_third_of_them_are_needed(flies):
    cloud = followed(flies, [0.7] * 6 + [1.1] * 2, [0] * 6 + [1] * 2)
    assert supported(cloud, all_of(cloud), UP) == pytest.approx(0.692)
    for over, high in ((3, 0.692), (4, 1.092)):
        cloud = followed(flies, [0.7] * (10 - over) + [1.1] * over, [0] * 10)
        assert supported(cloud, all_of(cloud), UP) == pytest.approx(high)


def test_where_nothing_was_followed_up_nothing_is_told(flies):
    cloud = followed(flies, [0.7] * 8, [0] * 8)
    flat = cloud.steps.copy()
    flat[:, 3] = (0.001, 0.0, 0.004)
    assert supported(dataclasses.replace(cloud, steps=flat), all_of(cloud), UP) is None
