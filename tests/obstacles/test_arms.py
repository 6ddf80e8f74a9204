"""An arm, pixel by pixel: what is compared, when pixels are alike, and when the surface has ended."""

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.obstacles.flat import compared
from flysim.obstacles.reach import LONGEST, _differ, _stretch, reach
from flysim.products.swarm import Swarm

WIDTH, HEIGHT = 40, 30
DISPARITY_PX = 5.0
LEVEL = np.array([[1.0, 0.0, 0.0, -1.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])  # inverse depth in pixels
FACING = np.array([[0.0, 0.0, DISPARITY_PX]])
ROOM = np.zeros((HEIGHT, WIDTH, 3), np.uint8)


def at(left, right, u, v, to_right=LEVEL, plane=FACING):
    return compared(left, right, np.asarray(to_right, float), np.asarray(plane, float), 0, u, v)


def test_a_pixel_is_compared_with_the_bilinear_one_on_its_plane():
    rng = np.random.default_rng(0)
    left, right = rng.integers(0, 256, (2, HEIGHT, WIDTH, 3), dtype=np.uint8)
    to_right = [[1.0, 0.01, 0.3, -1.0], [0.02, 1.0, 0.4, 0.1], [1e-3, 2e-3, 1.0, 0.01]]
    plane = np.array([[0.03, -0.02, 4.0]])
    for u, v in rng.integers((12, 6), (WIDTH - 6, HEIGHT - 6), (40, 2)):
        q = plane[0] @ (u, v, 1.0)
        x, y, z = np.array(to_right) @ (u, v, 1.0, q)
        x, y = x / z, y / z
        i, j = int(x), int(y)
        a, b = x - i, y - j
        square = right[j : j + 2, i : i + 2].astype(float)
        value = (1 - b) * ((1 - a) * square[0, 0] + a * square[0, 1]) + b * ((1 - a) * square[1, 0] + a * square[1, 1])
        different = ((left[v, u] - value) ** 2).sum()
        contrast = (((left[v, u + 1].astype(float) - left[v, u - 1]) / 2.0) ** 2).sum()
        assert at(left, right, u, v, to_right, plane) == pytest.approx((different, contrast))


@pytest.mark.parametrize(
    ("u", "v", "seen"),
    [
        (5, 10, True), (4, 10, False), (WIDTH - 2, 10, True), (WIDTH - 1, 10, False), (20, 0, True), (20, -1, False),
        (20, HEIGHT - 1, True), (20, HEIGHT, False),
    ],
)  # fmt: skip
def test_both_views_must_hold_it(u, v, seen):
    assert at(ROOM, ROOM, u, v) == ((0.0, 0.0) if seen else (-1.0, 0.0))


@pytest.mark.parametrize(
    ("shift", "seen"), [((18.9, 0.0), True), ((19.0, 0.0), False), ((0.0, 19.0), True), ((0.0, 19.1), False),
                        ((-20.0, 0.0), True), ((-20.1, 0.0), False), ((0.0, -10.0), True), ((0.0, -10.1), False)]
)  # fmt: skip
def test_on_the_right_it_has_its_neighbours_but_at_the_lower_border(shift, seen):
    to_right = np.array([[1.0, 0.0, shift[0], 0.0], [0.0, 1.0, shift[1], 0.0], [0.0, 0.0, 1.0, 0.0]])
    assert (at(ROOM, ROOM, 20, 10, to_right)[0] >= 0.0) == seen


def test_its_slope_needs_both_neighbours_on_the_left():
    beside = LEVEL.copy()
    beside[0, 2] = 8.0  # all of the left image is in the right one
    assert at(ROOM, ROOM, 1, 10, beside)[0] == 0.0 and at(ROOM, ROOM, 0, 10, beside)[0] == -1.0


def test_what_lies_behind_a_camera_is_not_seen():
    assert at(ROOM, ROOM, 20, 10, plane=[[0.0, 0.0, 0.0]])[0] == -1.0
    assert at(ROOM, ROOM, 20, 10, plane=[[0.0, 0.0, 0.01]])[0] == 0.0
    behind = LEVEL.copy()
    behind[2, 3] = -0.2  # one divided by five pixels
    assert at(ROOM, ROOM, 20, 10, behind)[0] == -1.0


def alike(left=0, ramp=0):
    """A pair that matches at 5 px of disparity, of so many levels a column."""
    image = np.broadcast_to((left + ramp * np.arange(WIDTH + 5))[None, :, None], (HEIGHT, WIDTH + 5, 3)).astype(
        np.uint8
    )
    return image[:, :WIDTH].copy(), image[:, 5:].copy()


def stretch(left, right, u, v, allowed=0.0, plane=FACING):
    last, ended = np.zeros((1, 4), np.int64), np.zeros((1, 4), np.bool_)
    pixels = np.array([[u, v]])
    _stretch(0, np.zeros(1, np.int64), left, right, LEVEL, pixels, np.asarray(plane, float), allowed, last, ended)
    return last[0].tolist(), ended[0].tolist()


def test_arms_go_right_left_down_and_up_as_far_as_they_may():
    assert stretch(*alike(), 20, 15) == ([LONGEST, LONGEST, LONGEST, LONGEST], [False] * 4)
    # At the borders of both views: 3 columns to the right, 5 + 3 to the left, 2 rows down, 4 up.
    assert stretch(*alike(), WIDTH - 5, 15)[0][0] == 3
    assert stretch(*alike(), 8, 15)[0][1] == 3
    assert stretch(*alike(), 20, HEIGHT - 3)[0][2] == 2
    assert stretch(*alike(), 20, 4)[0][3] == 4
    # Across an arm three pixels are judged: at the very border one is missing.
    assert stretch(*alike(), 20, 1) == ([LONGEST, LONGEST, LONGEST, 1], [False] * 4)
    assert stretch(*alike(), 20, 0)[0] == [0, 0, LONGEST, 0]


@pytest.mark.parametrize(("arm", "way"), [(0, (1, 0)), (1, (-1, 0)), (2, (0, 1)), (3, (0, -1))])
def test_two_unlike_pixels_in_a_row_end_it_before_the_first(arm, way):
    left, right = alike()

    def spoil(*steps):
        there = left.copy()
        for step in steps:
            u, v = 20 + step * way[0], 15 + step * way[1]
            there[v - abs(way[0]) : v + abs(way[0]) + 1, u - abs(way[1]) : u + abs(way[1]) + 1] = 90
        return there

    last, ended = stretch(spoil(6, 7), right, 20, 15)
    assert (last[arm], ended[arm]) == (5, True)
    last, ended = stretch(spoil(6), right, 20, 15)  # one alone may be noise
    assert (last[arm], ended[arm]) == (LONGEST, False)
    last, ended = stretch(spoil(6, 8), right, 20, 15)
    assert (last[arm], ended[arm]) == (LONGEST, False)
    last, ended = stretch(spoil(LONGEST), right, 20, 15)  # the next one is not asked
    assert (last[arm], ended[arm]) == (LONGEST - 1, False)


@pytest.mark.parametrize(("brighter", "goes"), [((2, 2, 3), True), ((3, 3, 1), False)])
def test_pixels_may_differ_by_what_half_a_pixel_explains(brighter, goes):
    # On a ramp of 5 levels a column half a pixel explains 2.5: over three colours 18.75 levels^2, of 17 and of 19.
    left, right = alike(10, ramp=5)
    assert (stretch(left + np.array(brighter, np.uint8), right, 20, 15)[0][1] > 0) == goes


@pytest.mark.parametrize(("allowed", "goes"), [(12.1, True), (11.9, False)])
def test_they_may_differ_by_what_is_allowed_beside(allowed, goes):
    # Two levels in each of three colours, where nothing contrasts.
    left, right = alike(10)
    assert (stretch(left + np.uint8(2), right, 20, 15, allowed)[0][0] > 0) == goes


def test_a_flys_own_difference_is_the_mean_over_five_pixels_square():
    left, right = alike(10)
    left[13:18, 18:23] += 2  # round (20, 15): 12 in three colours
    left[12], left[18], left[:, 17], left[:, 23] = 200, 200, 200, 200
    own = np.zeros(2)
    pixels = np.array([[20, 15], [0, -9]])
    _differ(0, np.zeros(1, np.int64), left, right, LEVEL, pixels, np.repeat(FACING, 2, axis=0), own)
    assert own.tolist() == [12.0, 0.0]  # of one in no view nothing is known
    # At the border of a view those that are in it count.
    left, right = alike(10)
    left[:, :6] += 2
    _differ(0, np.zeros(1, np.int64), left, right, LEVEL, np.array([[5, 15]]), FACING, own[:1])
    assert own[0] == pytest.approx(12.0 / 3.0)


@pytest.mark.parametrize(
    ("own", "pixels", "around", "goes"),
    [
        # Half as much again as the flies' own pixels differ by, 40 levels^2, and one of each colour: 63.
        ((6, 2, 0), 25, (7, 3, 1), True), ((6, 2, 0), 25, (8, 1, 0), False),
        # Nothing of their own: 3. Of 13 pixels in 25 one: 3.78.
        ((0, 0, 0), 25, (1, 1, 1), True), ((1, 0, 0), 13, (2, 0, 0), False),
    ],
)  # fmt: skip
def test_arms_go_on_where_pixels_differ_little_more_than_the_flies_own(own, pixels, around, goes):
    left, right = alike(100)
    there = left.copy()
    left += np.array(around, np.uint8)
    left[13:18, 18:23] = there[13:18, 18:23]
    rows, columns = np.unravel_index(np.arange(pixels), (5, 5))
    left[13 + rows, 18 + columns] += np.array(own, np.uint8)
    camera = Camera(width=WIDTH, height=HEIGHT, fx=50.0, fy=50.0, cx=20.0, cy=15.0)
    rig = StereoRig.parallel(camera, 0.1)  # 5 px at 1 m
    one, none = np.zeros((1, 3), np.float32), np.zeros(1, np.int32)
    swarm = Swarm(
        points=one + np.array([0, 0, 1], np.float32), normals=one - np.array([0, 0, 1], np.float32), spread=one,
        fitness=one[:, 0], uv=np.array([[20, 15]], np.float32), uv_right=np.array([[15, 15]], np.float32),
        region=none, age=none, history=(), converged=True, reason="",
    )  # fmt: skip
    ends, _, ended = reach(ImagePair(left=left, right=right, rig=rig), swarm, np.array([0]))
    assert camera.project(ends[0])[0, 0] == pytest.approx(20 + (LONGEST if goes else 2))
    assert ended[0, 0] == (not goes)
