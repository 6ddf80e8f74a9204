"""One camera whose wheels slip: the floor tells how it was moved between two pictures, before a fly is there."""

from types import SimpleNamespace

import cv2
import numpy as np

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Pose2, inverse, se3
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.localise.floor import laid
from flysim.localise.hop import FLOOR, Hop, hop
from flysim.localise.localiser import localiser_named, paired
from flysim.localise.path import ByFlies, between
from flysim.products.frame import Frame

CAMERA = Camera.from_fov(320, 240, 1.2)
HEIGHT, CELL = 0.4, 0.005  # [m] of the camera, and of a pixel of the floor
MOUNTED = se3(R_BODY_OPTICAL, (0.0, 0.0, HEIGHT))
START, END = Pose2(0.0, 0.0, 0.0), Pose2(0.30, 0.10, 0.30)
TOLD = Pose2(0.32, 0.09, 0.33)  # 2 cm and 1.7 degrees off


def grain(seed, size=1600):
    noise = np.random.default_rng(seed).integers(0, 256, (size, size, 3), np.uint8)
    return np.asarray(cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 4.0), None, 0, 255, cv2.NORM_MINMAX), np.uint8)


FLOOR_PICTURE = grain(0)


def shot(pose, floor=FLOOR_PICTURE):
    """A picture of a floor and of the sky above it."""
    u, v = np.meshgrid(np.arange(320.0), np.arange(240.0))
    rays = CAMERA.unproject(np.column_stack([u.ravel(), v.ravel()]), np.ones(u.size)) @ MOUNTED[:3, :3].T
    low = rays[:, 2] < -0.02
    far = np.where(low, -HEIGHT / np.where(low, rays[:, 2], -1.0), 0.0)
    world = (MOUNTED[:3, 3] + far[:, None] * rays) @ pose.matrix[:3, :3].T + pose.matrix[:3, 3]
    at = ((world[:, :2] + 4.0) / CELL).astype(np.float32).reshape(240, 320, 2)
    picture = cv2.remap(floor, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    picture[~low.reshape(240, 320)] = 180
    return np.asarray(picture, np.uint8)


def pair(index, other, told, pictures):
    """A frame of two stops as odometry has them; `told` are their poses."""
    T_right_left = inverse(told[other].matrix @ MOUNTED) @ told[index].matrix @ MOUNTED
    rig = StereoRig(left=CAMERA, right=CAMERA, T_right_left=T_right_left)
    return Frame(
        index=index,
        time=float(index),
        pair=ImagePair(left=pictures[index], right=pictures[other], rig=rig),
        T_world_base=told[index].matrix,
        T_base_left=MOUNTED,
        other=other,
        other_time=float(other),
    )


def off(pose, true):
    e = between(np.array([true.x, true.y, true.yaw]), np.array([pose.x, pose.y, pose.yaw]))
    return np.hypot(e.x, e.y), abs(np.degrees(e.yaw))


def no_flies():
    none = np.empty((0, 3))
    return SimpleNamespace(points=none, normals=none, spread=none, uv=none[:, :2])


def test_two_pictures_of_a_floor_tell_the_hop():
    there, here = (laid(shot(pose), CAMERA, MOUNTED) for pose in (START, END))
    found = hop(there, here, TOLD, rng=np.random.default_rng(0), effort=FLOOR)
    assert found is not None
    way, turn = off(found.pose, END)
    assert (way < 0.002, turn < 0.1) == (True, True)
    assert way < 4.0 * np.sqrt(np.trace(found.covariance[:2, :2]))


def test_two_floors_are_no_hop_and_nor_is_none():
    there = laid(shot(START), CAMERA, MOUNTED)
    for picture in (shot(END, grain(1)), np.full((240, 320, 3), 128, np.uint8)):
        here = laid(picture, CAMERA, MOUNTED)
        assert hop(there, here, TOLD, rng=np.random.default_rng(0), effort=FLOOR) is None


def test_a_pair_is_put_right_before_an_engine_looks():
    true, told = [START, END, Pose2(0.55, 0.3, 0.6)], [START, TOLD, Pose2(0.6, 0.3, 0.66)]
    pictures, localiser = [shot(pose) for pose in true], localiser_named("flies", 0)
    for index in (1, 2):
        frame = pair(index, index - 1, told, pictures)
        put_right = paired(localiser, frame)
        T = put_right.pair.rig.T_right_left
        np.testing.assert_array_equal(put_right.T_world_base, frame.T_world_base)  # odometry stays what it is
        ought = inverse(true[index - 1].matrix @ MOUNTED) @ true[index].matrix @ MOUNTED
        assert np.abs(frame.pair.rig.T_right_left - ought).max() > 0.01
        np.testing.assert_allclose(T, ought, atol=0.003)
        T_world_base = localiser.add(put_right, no_flies())
        np.testing.assert_allclose(T_world_base, true[index].matrix, atol=0.006)
    found = localiser.located()
    assert (found.stops, found.numbers, found.lost, found.hops) == ((0, 1, 2), (0, 1, 2), (), 3)
    np.testing.assert_allclose(found.times, [0.0, 1.0, 2.0])


def test_an_eye_that_is_older_than_pictures_before_it_has_its_place_in_time():
    poses = [START, Pose2(0.02, 0.0, 0.0), Pose2(0.2, 0.0, 0.1), Pose2(0.25, 0.05, 0.1)]
    pictures, localiser = [shot(pose) for pose in poses], ByFlies(rng=np.random.default_rng(0))
    for index, other in ((2, 0), (3, 1)):
        localiser.add(localiser.paired(pair(index, other, poses, pictures)), no_flies())
    found = localiser.located()
    assert (found.times.tolist(), found.numbers, found.lost) == ([0.0, 1.0, 2.0, 3.0], (0, 1, 2, 3), ())
    np.testing.assert_allclose(found.poses, [[p.x, p.y, p.yaw] for p in poses], atol=0.004)


def test_a_bare_floor_loses_the_place_and_odometry_is_kept():
    told, bare = [START, TOLD], [np.full((240, 320, 3), 128, np.uint8)] * 2
    localiser = ByFlies(rng=np.random.default_rng(0))
    frame = pair(1, 0, told, bare)
    kept = localiser.paired(frame)
    np.testing.assert_allclose(kept.pair.rig.T_right_left, frame.pair.rig.T_right_left, atol=1e-12)
    localiser.add(kept, no_flies())
    assert localiser.located().lost == (1,)


def test_a_hop_the_other_way_round():
    rng = np.random.default_rng(0)
    one = Hop(pose=Pose2(0.3, -0.2, 0.7), covariance=np.diag([1e-8, 4e-8, 9e-8]), agreed=20, found=30)
    back = one.inverted()
    np.testing.assert_allclose(back.pose.matrix, inverse(one.pose.matrix), atol=1e-12)
    drawn = np.array([0.3, -0.2, 0.7]) + rng.normal(size=(20000, 3)) * np.sqrt(np.diag(one.covariance))
    c, s = np.cos(drawn[:, 2]), np.sin(drawn[:, 2])
    turned = np.column_stack([-c * drawn[:, 0] - s * drawn[:, 1], s * drawn[:, 0] - c * drawn[:, 1], -drawn[:, 2]])
    np.testing.assert_allclose(back.covariance, np.cov(turned.T), atol=3e-9)
