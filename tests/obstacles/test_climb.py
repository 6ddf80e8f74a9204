"""An upright board before a plain sky or a wall, seen level and from a pitched camera: how high it is told to be."""

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.obstacles.reach import LONGEST, UP, reach
from flysim.products.swarm import Swarm

CAMERA = Camera(width=320, height=240, fx=250.0, fy=250.0, cx=159.5, cy=119.5)
BASELINE, DISTANCE, WIDTH = 0.12, 2.0, 0.12  # of a board before the left camera [m]
FINE = 1000.0  # texels in a metre


def texture(seed, *, plain=()):
    """2 m wide, 3 m high; `plain` is a span [m] up it that shows nothing."""
    import cv2

    rng = np.random.default_rng(seed)
    fine = cv2.resize(rng.integers(30, 220, (120, 80, 3)).astype(np.uint8), (2000, 3000), interpolation=cv2.INTER_CUBIC)
    if plain:
        fine[int(plain[0] * FINE) : int(plain[1] * FINE)] = 120
    return fine


def looked_up(image, x, z):
    """Colours at `x` [m] across and `z` [m] up."""
    return image[np.clip(z * FINE, 0, 2999).astype(int), np.clip((x + 1.0) * FINE, 0, 1999).astype(int)]


def drawn(image, top, pitch, eye_x, *, wall=None, side=0.0):
    """A camera 0.5 m up that looks along y, pitched down [rad]: the board, before a wall 5 m away or a sky."""
    down = np.array([0.0, -np.sin(pitch), -np.cos(pitch)])
    forward = np.array([0.0, np.cos(pitch), -np.sin(pitch)])
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    rays = (
        ((u - CAMERA.cx) / CAMERA.fx)[..., None] * np.array([1.0, 0.0, 0.0])
        + ((v - CAMERA.cy) / CAMERA.fy)[..., None] * down
        + forward
    )
    out = np.full((CAMERA.height, CAMERA.width, 3), 190, np.uint8)
    for far, high, wide, picture in ((5.0, 3.0, 2.0, wall), (DISTANCE, top, WIDTH, image)):
        if picture is None:
            continue
        x, z = eye_x + far * rays[..., 0] / rays[..., 1], 0.5 + far * rays[..., 2] / rays[..., 1]
        middle = side if far == DISTANCE else 0.0
        hit = (np.abs(x - middle) <= wide / 2.0) & (z >= 0.0) & (z <= high) & (rays[..., 1] > 0.0)
        out[hit] = looked_up(picture, x[hit] - middle, z[hit])
    return out


def height(top, *, pitch=0.0, fly=0.3, wall=None, side=0.0, plain=(), tilt=0.0):
    """How high the board is told to be by one fly `fly` metres up it [m], and whether it ends there.

    `tilt` [rad] is how far the fly's normal looks up.
    """
    image = texture(1, plain=plain)
    left, right = (drawn(image, top, pitch, x, wall=wall, side=side) for x in (0.0, BASELINE))
    R = np.array([[1.0, 0.0, 0.0], [0.0, -np.sin(pitch), -np.cos(pitch)], [0.0, np.cos(pitch), -np.sin(pitch)]])
    uv = np.rint(CAMERA.project((R @ np.array([side, DISTANCE, fly - 0.5]))[None]))
    ray = CAMERA.unproject(uv, np.ones(1))[0] @ R
    point = R @ (ray * DISTANCE / ray[1])
    normal = R @ np.array([0.0, -np.cos(tilt), np.sin(tilt)])
    one, none = np.ones(1, np.float32), np.zeros(1, np.int32)
    swarm = Swarm(
        points=point[None].astype(np.float32), normals=normal[None].astype(np.float32),
        spread=np.zeros((1, 3), np.float32), fitness=one, uv=uv.astype(np.float32), uv_right=uv.astype(np.float32),
        region=none, age=none, history=(), converged=True, reason="",
    )  # fmt: skip
    pair = ImagePair(left=left, right=right, rig=StereoRig.parallel(CAMERA, BASELINE))
    ends, steps, ended = reach(pair, swarm, np.array([0]), R @ np.array([0.0, 0.0, 1.0]))
    up = (R.T @ steps[0, UP])[2] / np.linalg.norm(steps[0, UP])
    return 0.5 + (R.T @ ends[0, UP])[2], bool(ended[0, UP]), up


@pytest.mark.parametrize(
    ("pitch", "side", "tops"),
    [(0.0, 0.0, (0.8, 1.0, 1.3)), (0.26, 0.0, (0.6, 0.8)), (0.2, 0.5, (0.6, 0.9)), (0.2, -0.5, (0.6, 0.9))],
)
def test_a_board_before_a_plain_sky_is_as_high_as_it_is(pitch, side, tops):
    for top in tops:
        told, ended, up = height(top, pitch=pitch, side=side)
        assert ended and told == pytest.approx(top, abs=2.0 * DISTANCE / CAMERA.fy)
        assert up == pytest.approx(1.0, abs=1e-6)


def test_before_a_wall_as_well():
    told, ended, _ = height(0.9, wall=texture(2))
    assert ended and told == pytest.approx(0.9, abs=2.0 * DISTANCE / CAMERA.fy)


def test_one_that_leaves_the_view_does_not_end_there():
    told, ended, _ = height(1.9)
    highest = 0.5 + DISTANCE * CAMERA.cy / CAMERA.fy
    assert not ended and highest - 0.05 <= told <= highest


def test_a_top_just_within_the_view_before_a_sky_is_not_sure_and_seen_all_the_same():
    highest = 0.5 + DISTANCE * CAMERA.cy / CAMERA.fy
    told, ended, _ = height(highest - 0.03)  # less than 5 cm of sky: it might be plain there
    assert not ended and told == pytest.approx(highest - 0.03, abs=2.0 * DISTANCE / CAMERA.fy)


@pytest.mark.parametrize(("plain", "ends_at"), [((0.5, 0.53), 0.9), ((0.5, 0.62), 0.5)])
def test_a_plain_patch_is_passed_and_a_longer_one_ends_it(plain, ends_at):
    told, ended, _ = height(0.9, plain=plain)
    assert ended and told == pytest.approx(ends_at, abs=2.0 * DISTANCE / CAMERA.fy)


def test_what_slopes_is_not_followed():
    told, _, up = height(0.9, tilt=0.5)
    assert told < 0.3 + 2.0 * LONGEST * DISTANCE / CAMERA.fy and up < 0.95


def test_what_faces_up_a_little_is():
    assert height(0.9, tilt=0.2)[0] == pytest.approx(0.9, abs=2.0 * DISTANCE / CAMERA.fy)
