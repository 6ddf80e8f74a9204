import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.obstacles.gather import gather
from flysim.obstacles.parameters import ObstacleParams
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm

FLOOR = ObstacleParams(ground_clearance=0.0)
CAMERA = Camera(width=64, height=48, fx=50.0, fy=50.0, cx=31.5, cy=23.5)


def pair(level):
    image = np.full((48, 64, 3), level, np.uint8)
    image[10, 20] = (level, 7, 9)
    return ImagePair(left=image, right=image, rig=StereoRig.parallel(CAMERA, 0.1))


def swarm(n):
    points = np.tile(np.array([[0.1, -0.2, 2.0]], np.float32), (n, 1))
    uv = np.tile(np.array([[20, 10]], np.float32), (n, 1))
    return Swarm(
        points=points,
        normals=np.tile(np.array([[0, 0, -1]], np.float32), (n, 1)),
        spread=0.01 * points,
        fitness=np.arange(n, dtype=np.float32),
        uv=uv,
        uv_right=uv - np.array([2.5, 0], np.float32),
        region=np.zeros(n, np.int32),
        age=np.zeros(n, np.int32),
        history=(),
        converged=True,
        reason="",
    )


def frame(index, pair, T_world_left):
    return Frame(index=index, time=0.0, pair=pair, T_world_base=np.eye(4), T_base_left=T_world_left)


def test_nothing_gathered_is_an_empty_cloud():
    cloud = gather([], FLOOR)
    assert [getattr(cloud, name).shape for name in ("points", "normals", "spread", "arms", "ended", "rgb")] == [
        (0, 3),
        (0, 3),
        (0, 3),
        (0, 4, 3),
        (0, 4),
        (0, 3),
    ]
    again = gather([(frame(0, pair(1), np.eye(4)), swarm(0))], FLOOR)
    for name in set(cloud.__slots__) - {"again"}:
        assert getattr(again, name).shape == getattr(cloud, name).shape
        assert getattr(again, name).dtype == getattr(cloud, name).dtype or name in ("points",)


def test_flies_of_all_stops_come_into_one_frame():
    T0 = np.eye(4)
    T1 = pose6(1.0, 2.0, 3.0, 0.0, 0.0, np.pi / 2)  # x to y, y to -x
    cloud = gather([(frame(3, pair(100), T0), swarm(2)), (frame(5, pair(50), T1), swarm(1))], FLOOR)
    assert cloud.stop.tolist() == [3, 3, 5]
    np.testing.assert_allclose(cloud.points[:2], [[0.1, -0.2, 2.0]] * 2, atol=1e-6)
    np.testing.assert_allclose(cloud.points[2], [1.0 + 0.2, 2.0 + 0.1, 5.0], atol=1e-6)
    # Directions and differences turn, but are not shifted.
    np.testing.assert_allclose(cloud.spread[2], [0.002, 0.001, 0.02], atol=1e-6)
    np.testing.assert_allclose(cloud.normals[2], [0, 0, -1], atol=1e-6)
    # The first arm runs to the right in the image: a pixel's width along the world's y.
    np.testing.assert_allclose(cloud.steps[2, 0], [0.0, 0.04, 0.0], atol=1e-6)
    assert cloud.fitness.tolist() == [0.0, 1.0, 0.0]
    assert cloud.rgb.tolist() == [[100, 7, 9], [100, 7, 9], [50, 7, 9]]  # the colour at (u, v) = (20, 10)
    np.testing.assert_array_equal(cloud.uv_right[2], [17.5, 10.0])


@pytest.mark.parametrize("n", [0, 3])
def test_a_stop_without_flies_adds_none(n):
    cloud = gather([(frame(0, pair(9), np.eye(4)), swarm(n)), (frame(1, pair(9), np.eye(4)), swarm(0))], FLOOR)
    assert len(cloud.points) == n


def test_without_silhouettes_no_fly_has_arms():
    T = pose6(0.0, 0.0, 5.0, 0.0, 0.0, 0.0)
    with_arms = gather([(frame(0, pair(9), T), swarm(2))], FLOOR)
    assert (with_arms.steps != 0.0).any()
    cloud = gather([(frame(0, pair(9), T), swarm(2))], ObstacleParams(silhouettes=False))
    assert not cloud.ended.any() and not cloud.steps.any()
    np.testing.assert_array_equal(cloud.arms, np.repeat(cloud.points[:, None], 4, axis=1))
