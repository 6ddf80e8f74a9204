from dataclasses import replace

import numpy as np
import pytest

from flysim.truth.sight import Sight, seen_by_both, sights
from flysim.worlds.shapes import Box, Plane


def test_a_point_on_the_wall_is_seen_by_both_unless_the_right_camera_looks_past_it(by_hand):
    wall = by_hand.body("wall", Box((0.1, 20.0, 6.0)), 3.05, 0.0, 0.0, structure=True)
    stop = by_hand.stop(by_hand.world(wall), 0.0, 0.0, 0.0, down=0.0)
    seen = seen_by_both(stop.views, 6.0)
    disparity = by_hand.CAMERA.fx * by_hand.BASELINE / 3.0
    lost = np.flatnonzero(~seen[120])
    assert lost.tolist() == list(range(round(disparity)))  # the left rim, as wide as the disparity
    assert not seen_by_both(stop.views, 2.9).any()  # out of range


def test_what_a_near_thing_hides_from_the_right_camera_is_not_seen_by_both(by_hand):
    wall = by_hand.body("wall", Box((0.1, 20.0, 6.0)), 3.05, 0.0, 0.0, structure=True)
    post = by_hand.body("post", Box((0.1, 0.2, 6.0)), 1.05, 0.0)
    stop = by_hand.stop(by_hand.world(wall, post), 0.0, 0.0, 0.0, down=0.0)
    seen, link = seen_by_both(stop.views, 6.0)[120], stop.views[0].link[120]
    first = int(np.flatnonzero(link == 1)[0])
    assert seen[link == 1].all()
    # Left of the post the wall's strip is in the post's shadow, as wide as the difference of the disparities.
    shadow = by_hand.CAMERA.fx * by_hand.BASELINE * (1 / 1.0 - 1 / 3.0)
    hidden = np.flatnonzero(~seen[:first])
    assert len(hidden[hidden > 60]) == pytest.approx(shadow, abs=1.5)
    assert hidden[-1] == first - 1


def test_another_body_at_the_same_depth_is_not_the_same_point(by_hand):
    world = by_hand.world(by_hand.body("wall", Box((0.1, 20.0, 6.0)), 3.05, 0.0, 0.0, structure=True))
    left, right = by_hand.stop(world, 0.0, 0.0, 0.0, down=0.0).views
    assert seen_by_both((left, right), 6.0).any()
    assert not seen_by_both((left, replace(right, link=right.link + 1)), 6.0).any()


def test_the_points_lie_on_the_surface_and_a_slanted_floor_is_seen_far_out(by_hand):
    world = by_hand.world(by_hand.body("floor", Plane((40.0, 40.0)), structure=True))
    stop = by_hand.stop(world, 1.0, -2.0, 0.7)
    (sight,) = sights([stop], 6.0)
    assert isinstance(sight, Sight)
    points = sight.points()
    assert np.abs(points[:, 2]).max() < 1e-5
    away = np.linalg.norm(points[:, :2] - (1.0, -2.0), axis=1)
    assert away.max() > 5.5
    # All but the left rim of what is in range: a slanted surface is not lost to the rounding of pixels.
    in_range = (stop.views[0].link == 0) & (stop.views[0].depth <= 6.0)
    assert sight.seen[:, 120:].sum() == in_range[:, 120:].sum()


def test_the_robot_itself_and_the_sky_are_no_surface(by_hand):
    world = by_hand.world(by_hand.body("floor", Plane((40.0, 40.0)), structure=True))
    stop = by_hand.stop(world, 0.0, 0.0, 0.0, down=0.0)
    sky = stop.views[0].link < 0
    assert sky.any()
    assert not seen_by_both(stop.views, 6.0)[sky].any()
