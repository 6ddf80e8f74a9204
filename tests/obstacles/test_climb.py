"""An upright board before a plain sky or a wall, seen level and from a pitched camera: how high it is told to be.

By one fly on it at one stop; and by the flies of a near stop that does not see its top, and a far one that does.
"""

from dataclasses import replace

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.obstacles.find import find_obstacles
from flysim.obstacles.gather import gather
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.reach import LONGEST, UP, reach
from flysim.products.frame import Frame
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


def drawn(image, top, pitch, eye_x, *, wall=None, side=0.0, distance=DISTANCE):
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
    for far, high, wide, picture in ((distance + 3.0, 3.0, 2.0, wall), (distance, top, WIDTH, image)):
        if picture is None:
            continue
        x, z = eye_x + far * rays[..., 0] / rays[..., 1], 0.5 + far * rays[..., 2] / rays[..., 1]
        middle = side if far == distance else 0.0
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


def stop(index, distance, top, heights, *, wall):
    """A frame `distance` metres before the board, flies on it at `heights` [m], and `wall` more 3 m behind it."""
    left, right = (drawn(texture(1), top, 0.0, x, wall=texture(2), distance=distance) for x in (0.0, BASELINE))
    R = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # world from optical
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, (0.0, -distance, 0.5)
    pair = ImagePair(left=left, right=right, rig=StereoRig.parallel(CAMERA, BASELINE))
    frame = Frame(index=index, time=float(index), pair=pair, T_world_base=np.eye(4), T_base_left=T)
    rng = np.random.default_rng(index)
    places = [(x, distance, z) for z in heights for x in rng.uniform(-0.04, 0.04, 6)]
    places += [(x, distance + 3.0, z) for x, z in rng.uniform((-0.8, 0.3), (0.8, 1.9), (wall, 2))]
    uv = np.rint(CAMERA.project(np.array([(x, 0.5 - z, y) for x, y, z in places])))
    n, depth = len(uv), np.array([y for _, y, _ in places])
    points = CAMERA.unproject(uv, depth)
    none = np.zeros(n, np.int32)
    swarm = Swarm(
        points=points.astype(np.float32), normals=np.tile(np.float32([0, 0, -1]), (n, 1)),
        spread=(0.001 * points).astype(np.float32), fitness=np.ones(n, np.float32), uv=uv.astype(np.float32),
        uv_right=(uv - np.stack([CAMERA.fx * BASELINE / depth, 0 * depth], axis=1)).astype(np.float32),
        region=none, age=none, history=(), converged=True, reason="",
    )  # fmt: skip
    return frame, swarm


def board(swarms, *, again):
    cloud = gather(swarms, ObstacleParams())
    found = find_obstacles(cloud, ObstacleParams(), swarms if again else ())
    return min(found, key=lambda obstacle: abs(obstacle.center[1])).size[2]


def test_a_stop_that_sees_the_top_tells_it_though_none_of_its_flies_sits_there():
    near = stop(0, 0.9, 1.2, np.arange(0.1, 0.85, 0.05), wall=0)
    far = stop(1, 2.5, 1.2, (), wall=60)
    assert board([near, far], again=False) < 1.0
    assert board([near, far], again=True) == pytest.approx(1.2, abs=2.0 * 2.5 / CAMERA.fy)


def test_a_stop_that_is_too_far_away_is_not_asked():
    near = stop(0, 0.9, 1.2, np.arange(0.1, 0.85, 0.05), wall=0)
    assert board([near, stop(1, 4.5, 1.2, (), wall=60)], again=True) < 1.0


@pytest.mark.parametrize("off", ["silhouettes", "climb", "again"])
def test_who_does_not_want_it_asks_no_other_stop(off):
    swarms = [stop(0, 0.9, 1.2, np.arange(0.1, 0.85, 0.05), wall=0), stop(1, 2.5, 1.2, (), wall=60)]
    params = ObstacleParams(**{off: False})
    found = find_obstacles(gather(swarms, params), params, swarms)
    assert min(found, key=lambda obstacle: abs(obstacle.center[1])).size[2] < 1.0


def test_what_stands_behind_at_nearly_that_depth_is_not_climbed():
    """0.25 m behind, at 2.5 m: 1.2 px of disparity, and twice as high."""
    image = texture(1)
    tall = texture(5)

    def two(x):
        behind = drawn(tall, 2.0, 0.0, x, distance=2.75)
        front = drawn(image, 1.0, 0.0, x, distance=2.5)
        sky = (front == 190).all(axis=2)
        front[sky] = behind[sky]
        return front

    frame, swarm = stop(1, 2.5, 1.0, np.arange(0.3, 0.9, 0.05), wall=0)
    pair = ImagePair(left=two(0.0), right=two(BASELINE), rig=frame.pair.rig)
    frame = Frame(index=1, time=0.0, pair=pair, T_world_base=np.eye(4), T_base_left=frame.T_base_left)
    assert board([(frame, swarm)], again=True) == pytest.approx(1.0, abs=2.0 * 2.5 / CAMERA.fy)


def hidden_below(frame, swarm, height, distance):
    """The frame with something 1.5 m away before all that is lower than `height` at `distance` [m], and its flies."""
    row = round(CAMERA.cy + CAMERA.fy * (0.5 - height) / distance)
    shift = round(CAMERA.fx * BASELINE / 1.5)
    before = np.random.default_rng(9).integers(30, 220, (CAMERA.height, CAMERA.width + shift, 3)).astype(np.uint8)
    left, right = frame.pair.left.copy(), frame.pair.right.copy()
    left[row:], right[row:] = before[row:, :-shift], before[row:, shift:]
    pair = ImagePair(left=left, right=right, rig=frame.pair.rig)
    seen = swarm.uv[:, 1] < row - 3
    per_fly = ("points", "normals", "spread", "fitness", "uv", "uv_right", "region", "age")
    swarm = replace(swarm, **{name: getattr(swarm, name)[seen] for name in per_fly})
    return Frame(index=1, time=1.0, pair=pair, T_world_base=np.eye(4), T_base_left=frame.T_base_left), swarm


@pytest.mark.parametrize(("hidden", "told"), [(0.9, True), (1.15, False)])
def test_a_stop_that_sees_the_top_alone_tells_it_if_it_sees_enough_of_it(hidden, told):
    near = stop(0, 0.9, 1.2, np.arange(0.1, 0.85, 0.05), wall=0)
    found = board([near, hidden_below(*stop(1, 2.5, 1.2, (), wall=400), hidden, 2.5)], again=True)
    assert (found == pytest.approx(1.2, abs=2.0 * 2.5 / CAMERA.fy)) == told
    assert told or found < 1.0
