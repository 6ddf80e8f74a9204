"""Where nothing is seen again the place is lost: odometry is kept for that hop, and one sentence says so."""

from types import SimpleNamespace

import numpy as np
import pytest

from flysim.evaluate.whereabouts import warning
from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Pose2, se3
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.localise.path import ByFlies
from flysim.products.frame import Frame
from flysim.products.located import Located

CAMERA = Camera.from_fov(320, 240, 1.2)
RIG = StereoRig.parallel(CAMERA, 0.12)
T_BASE_LEFT = se3(R_BODY_OPTICAL, (0.0, 0.0, 0.5))


def frame(index, pose, picture, glance=False):
    pair = ImagePair(left=picture, right=picture, rig=RIG)
    return Frame(
        index=index, time=float(index), pair=pair, T_world_base=pose.matrix, T_base_left=T_BASE_LEFT, glance=glance
    )


def flies(n=300):
    """Flies on what faces the camera, near and far."""
    rng = np.random.default_rng(1)
    uv = np.column_stack([rng.uniform(10, 310, n), rng.uniform(10, 230, n)])
    points = CAMERA.unproject(uv, rng.uniform(0.6, 3.0, n))
    normals = np.tile([0.0, 0.0, -1.0], (n, 1))
    return SimpleNamespace(points=points, normals=normals, spread=0.002 * points, uv=uv)


def noise(seed):
    import cv2

    grain = np.random.default_rng(seed).integers(0, 256, (240, 320, 3), np.uint8)
    return np.asarray(cv2.GaussianBlur(grain, (0, 0), 2.0), np.uint8)


def located(*frames):
    localiser = ByFlies(rng=np.random.default_rng(0))
    for one, swarm in frames:
        localiser.add(one, swarm)
    return localiser.located()


def test_another_picture_loses_the_place_and_keeps_odometry():
    poses = [Pose2(0.0, 0.0, 0.0), Pose2(0.1, 0.0, 0.05), Pose2(0.2, 0.0, 0.1)]
    found = located(*((frame(k, pose, noise(k)), flies()) for k, pose in enumerate(poses)))
    assert (found.hops, found.lost) == (0, (1, 2))
    np.testing.assert_allclose(found.poses, [[p.x, p.y, p.yaw] for p in poses], atol=1e-9)
    (said,) = warning(SimpleNamespace(located=found))
    assert said == (
        "localisation: the flies lost the place on the way to stop 2, 3 of 3: nothing was seen again there, and that "
        "way is odometry's; all 0 hops that were found are kept."
    )


def test_the_same_picture_is_the_same_place_whatever_odometry_says():
    told = Pose2(0.02, -0.03, 0.04)
    found = located((frame(0, Pose2(0.0, 0.0, 0.0), noise(5)), flies()), (frame(1, told, noise(5)), flies()))
    assert (found.hops, found.lost) == (1, ())
    np.testing.assert_allclose(found.poses[1], 0.0, atol=4e-3)
    assert warning(SimpleNamespace(located=found)) == ()


def test_a_swarm_of_no_flies_is_no_place():
    three, two = np.empty((0, 3)), np.empty((0, 2))
    none = SimpleNamespace(points=three, normals=three, spread=three, uv=two)
    assert located((frame(0, Pose2(0, 0, 0), noise(1)), none), (frame(1, Pose2(1, 0, 0), noise(1)), none)).lost == (1,)


def test_the_way_goes_through_what_was_found():
    # By odometry 2 m straight on; in truth as found, the end lies 10 cm to the left, and it looks 0.2 rad to the left.
    found = Located(
        by="flies",
        times=np.array([0.0, 2.0]),
        stops=(0, 1),
        numbers=(0, 1),
        odometry=np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
        poses=np.array([[0.0, 0.0, 0.0], [2.0, 0.1, 0.2]]),
        covariance=np.zeros((2, 3, 3)),
        hops=1,
        loops=0,
        lost=(),
        seconds=0.0,
    )
    times = np.array([0.0, 1.0, 2.0])
    way = found.way(times, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]))
    np.testing.assert_allclose(way[[0, 2]], found.poses, atol=1e-12)
    assert way[1, 2] == pytest.approx(0.1)
    np.testing.assert_allclose(found.moved(1, Pose2(2.0, 0.0, 0.0).matrix), Pose2(2.0, 0.1, 0.2).matrix, atol=1e-12)
    with pytest.raises(ValueError, match="as files bear it, got"):
        Located(**{name: getattr(found, name) for name in Located.__dataclass_fields__} | {"by": "../up"})
