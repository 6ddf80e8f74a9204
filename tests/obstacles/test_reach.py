"""Arms on a pair made by hand: a textured board in front of a textured wall."""

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.obstacles.reach import LONGEST, reach
from flysim.products.swarm import Swarm

WIDTH, HEIGHT, FOCAL, BASELINE = 320, 240, 250.0, 0.12
CAMERA = Camera(width=WIDTH, height=HEIGHT, fx=FOCAL, fy=FOCAL, cx=159.5, cy=119.5)
BOARD_Z, WALL_Z = 1.5, 3.0  # 20 and 10 px of disparity
BOARD = (100, 180, 80, 160)  # u0, u1, v0, v1 of the left image, ends left out


def noise(rng):
    """A smooth texture, 400 px wide."""
    import cv2

    image = cv2.resize(rng.integers(0, 256, (HEIGHT // 4, 100, 3)).astype(np.uint8), (400, HEIGHT))
    return cv2.GaussianBlur(image, (0, 0), 1.5)


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(4)
    wall, board = noise(rng), noise(rng)
    left, right = wall[:, :WIDTH].copy(), wall[:, 10 : WIDTH + 10].copy()
    u0, u1, v0, v1 = BOARD
    left[v0:v1, u0:u1] = board[v0:v1, u0:u1]
    right[v0:v1, u0 - 20 : u1 - 20] = board[v0:v1, u0:u1]
    return ImagePair(left=left, right=right, rig=StereoRig.parallel(CAMERA, BASELINE))


def swarm(pixels, z):
    uv = np.array(pixels, float)
    points = CAMERA.unproject(uv, np.full(len(uv), z))
    n = len(uv)
    return Swarm(
        points=points.astype(np.float32),
        normals=np.tile(np.array([[0, 0, -1]], np.float32), (n, 1)),
        spread=np.zeros((n, 3), np.float32),
        fitness=np.ones(n, np.float32),
        uv=uv.astype(np.float32),
        uv_right=uv.astype(np.float32),
        region=np.zeros(n, np.int32),
        age=np.zeros(n, np.int32),
        history=(),
        converged=True,
        reason="",
    )


def lengths(pair, flies, chosen=None):
    """`[n, 4]` pixels of each arm: right, left, down, up; and whether they ended."""
    chosen = np.arange(len(flies.points)) if chosen is None else chosen
    ends, _, ended = reach(pair, flies, chosen)
    uv = CAMERA.project(ends.reshape(-1, 3)).reshape(-1, 4, 2)
    return np.abs(uv - flies.uv[chosen][:, None]).sum(axis=2), ended


def test_arms_end_where_the_board_does(pair):
    pixels = [(u, v) for u in range(104, 178, 7) for v in range(84, 158, 7)]
    went, ended = lengths(pair, swarm(pixels, BOARD_Z))
    u, v = np.array(pixels).T
    room = np.stack([BOARD[1] - 1 - u, u - BOARD[0], BOARD[3] - 1 - v, v - BOARD[2]], axis=1)
    near = room <= LONGEST - 2
    assert ended[near].mean() > 0.95
    off = (went - room)[near]
    assert np.median(np.abs(off)) < 0.01  # no pixel off
    assert (np.abs(off) <= 1.01).mean() > 0.9
    free = room >= LONGEST
    assert not ended[free].any()
    np.testing.assert_allclose(went[free], LONGEST, atol=1e-3)


def test_a_fly_at_the_wrong_depth_reaches_nowhere(pair):
    good, bad = ([(u, v) for u in range(115, 165, 5)] for v in (110, 130))
    flies = swarm(good + bad[:4], BOARD_Z)
    flies.points[len(good) :] *= 1.3 / BOARD_Z
    went, _ = lengths(pair, flies)
    assert np.median(went[: len(good)]) == pytest.approx(LONGEST, abs=1e-3)
    assert np.median(went[len(good) :]) <= 4


def test_arms_stop_unended_at_the_border_of_a_view(pair):
    went, ended = lengths(pair, swarm([(WIDTH - 5, 120), (160, 3), (13, 20)], WALL_Z))
    assert not ended[0, 0] and went[0, 0] <= 4
    assert not ended[1, 3] and went[1, 3] <= 3
    assert not ended[2, 1] and went[2, 1] <= 3 + 1e-3  # 10 px of disparity: beyond u = 10 the right view ends


def test_steps_are_a_pixel_on_the_surface(pair):
    _, steps, _ = reach(pair, swarm([(140, 120)], BOARD_Z), np.array([0]))
    pixel = BOARD_Z / FOCAL
    np.testing.assert_allclose(steps[0], [(pixel, 0, 0), (-pixel, 0, 0), (0, pixel, 0), (0, -pixel, 0)], atol=1e-9)


def test_only_the_chosen_flies_are_asked(pair):
    flies = swarm([(120, 100), (140, 120), (150, 130)], BOARD_Z)
    all_ends, _, all_ended = reach(pair, flies, np.arange(3))
    ends, _, ended = reach(pair, flies, np.array([2]))
    np.testing.assert_array_equal(ends[0], all_ends[2])
    np.testing.assert_array_equal(ended[0], all_ended[2])
    none, _, _ = reach(pair, flies, np.array([], np.int64))
    assert none.shape == (0, 4, 3)


def test_cameras_may_stand_anyhow_to_each_other(pair):
    """The same pair as one whose right camera is turned by nothing, and whose frame is moved along: the same arms."""
    flies = swarm([(120, 100), (140, 120), (104, 90)], BOARD_Z)
    turned = StereoRig(left=CAMERA, right=CAMERA, T_right_left=pose6(-BASELINE, 0.0, 0.0, 0.0, 0.0, 1e-12))
    straight, _ = lengths(pair, flies)
    other, _ = lengths(ImagePair(left=pair.left, right=pair.right, rig=turned), flies)
    np.testing.assert_allclose(straight, other, atol=1e-6)
