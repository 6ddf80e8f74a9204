"""A piece of a far wall whose disparities one stop got half a pixel wrong is no obstacle before the wall."""

from dataclasses import replace

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Pose2
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.obstacles.find import find_obstacles
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.unsure import sure
from flysim.products.frame import Frame

FACING_X = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # optical axes in the world
EYE = np.array([0.0, 0.0, 0.5])
GAIN = 502.0 * 0.12  # px m


def frame(index, moved=(-0.12, 0.0, 0.0)):
    camera = Camera(fx=502.0, fy=502.0, cx=319.5, cy=239.5, width=640, height=480)
    T_right_left = np.eye(4)
    T_right_left[:3, 3] = moved
    black = np.zeros((480, 640, 3), np.uint8)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = FACING_X, EYE
    pair = ImagePair(left=black, right=black, rig=StereoRig(left=camera, right=camera, T_right_left=T_right_left))
    return Frame(index=index, time=float(index), pair=pair, T_world_base=np.eye(4), T_base_left=T)


def patch(flies, x, y=0.0, *, width=0.2, high=0.8, density=2000.0):
    """A face that looks back at the eye from `x` metres."""
    return flies.faces((0.001, width, high), Pose2(x, y, 0.0), ["-x"], density=density)


def seen(flies, patch_x, wall_x, stops=(4,), wall_width=3.0, aside=0.0):
    """A cloud, its two clusters, and its swarms: a wall that stops 0 to 3 saw, and a patch that `stops` did."""
    before, wall = patch(flies, patch_x, aside), patch(flies, wall_x, width=wall_width, high=1.0)
    cloud = flies.cloud_of(before + wall)
    n = sum(len(part[0]) for part in before)
    stop = np.arange(len(cloud.points), dtype=np.int32) % 4
    stop[:n] = np.resize(stops, n)
    cloud = replace(cloud, stop=stop)
    return cloud, [np.arange(n, len(stop)), np.arange(n)], [(frame(k), None) for k in range(5)]


def misplaced(x, pixels):
    """Where what stands at x seems to stand with disparities that are so many pixels too large."""
    return GAIN / (GAIN / x + pixels)


@pytest.mark.parametrize("pixels", [0.5, 1.0, -0.7])
def test_what_a_pixel_puts_onto_a_wall_is_no_obstacle(flies, pixels):
    cloud, groups, swarms = seen(flies, misplaced(4.0, pixels), 4.0)
    kept = sure(cloud, groups, swarms, 0.09)
    assert len(kept) == 1
    np.testing.assert_array_equal(kept[0], groups[0])


def test_what_two_stops_saw_there_stands_there(flies):
    cloud, groups, swarms = seen(flies, misplaced(4.0, 0.6), 4.0, stops=(3, 4))
    assert len(sure(cloud, groups, swarms, 0.09)) == 2


def test_what_stands_farther_before_a_wall_than_a_pixel_stays(flies):
    cloud, groups, swarms = seen(flies, misplaced(4.0, 2.0), 4.0)
    assert len(sure(cloud, groups, swarms, 0.09)) == 2


def test_of_a_camera_that_drives_ahead_a_pixel_tells_less_near_where_it_drives_to(flies):
    """Side by side the patch is 2 px before the wall; where the camera drove 30 cm ahead, a pixel."""
    cloud, groups, swarms = seen(flies, 3.2, 3.55, aside=0.6)
    assert len(sure(cloud, groups, swarms, 0.09)) == 2
    ahead = [(frame(k, (0.0, 0.0, -0.3)), None) for k, _ in enumerate(swarms)]
    assert len(sure(cloud, groups, ahead, 0.09)) == 1
    sideways = [(frame(k, (-0.3, 0.0, 0.0)), None) for k, _ in enumerate(swarms)]
    assert len(sure(cloud, groups, sideways, 0.09)) == 2


def test_near_by_a_pixel_is_less_than_obstacles_lie_apart(flies):
    cloud, groups, swarms = seen(flies, 1.5, 1.62)
    assert len(sure(cloud, groups, swarms, 0.09)) == 2


def test_of_two_pieces_that_would_lie_on_each_other_the_larger_stays(flies):
    cloud, groups, swarms = seen(flies, misplaced(4.0, 0.5), 4.0, wall_width=0.22)
    cloud = replace(cloud, stop=np.full(len(cloud.points), 4, np.int32))
    kept = sure(cloud, groups, swarms, 0.09)
    assert [len(flies) for flies in kept] == [len(groups[0])]


def test_it_is_asked_where_the_frames_are_at_hand(flies):
    params = ObstacleParams(again=False)
    cloud, _, swarms = seen(flies, misplaced(4.0, 0.6), 4.0)
    assert len(find_obstacles(cloud, params, swarms)) == 1
    assert len(find_obstacles(cloud, params)) == 2
