"""Where a face of a box is, rule by rule: a fly or a share just inside counts, one just outside does not."""

import math

import numpy as np
import pytest

from flysim.obstacles.box import _closeness, _low_end, _outermost, _side, _weighted_median, fit_box, top
from flysim.obstacles.edge import edge
from flysim.products.cloud import FlyCloud

X = np.array([1.0, 0.0, 0.0])


def cloud(x, *, tilt_deg=0.0, noise=0.0, ends=None, step=0.001, lean_deg=0.0, ended=True):
    """Flies at places along x whose normals lean so far from it, and arms that end at `ends`, in steps of `step`."""
    x = np.asarray(x, float)
    n = len(x)
    tilt = np.radians(np.broadcast_to(np.asarray(tilt_deg, float), n))
    points = np.stack([x, np.zeros(n), np.full(n, 0.2)], axis=1)
    arms, steps = np.repeat(points[:, None], 4, axis=1), np.zeros((n, 4, 3))
    has = np.zeros((n, 4), bool)
    if ends is not None:
        lean = np.radians(np.broadcast_to(np.asarray(lean_deg, float), n))
        arms[:, 0, 0] = ends
        length = np.broadcast_to(np.asarray(step, float), n)[:, None]
        steps[:, 0] = length * np.stack([np.cos(lean), np.sin(lean), np.zeros(n)], axis=1)
        has[:, 0] = ended
    return FlyCloud(
        points=points,
        normals=np.stack([np.cos(tilt), np.sin(tilt), np.zeros(n)], axis=1),
        spread=np.broadcast_to(np.asarray(noise, float), n)[:, None] * X,
        arms=arms,
        steps=steps,
        ended=has,
        fitness=np.ones(n, np.float32),
        stop=np.zeros(n, np.int32),
        uv=np.zeros((n, 2), np.float32),
        uv_right=np.zeros((n, 2), np.float32),
        rgb=np.zeros((n, 3), np.uint8),
    )


def face(flies, trim=0.0):
    return _side(flies, np.arange(len(flies.points)), X, trim)


@pytest.mark.parametrize(("tilt_deg", "on"), [(18.5, True), (21.5, False)])
def test_a_fly_lies_on_a_face_if_its_normal_is_within_twenty_degrees_of_it(tilt_deg, on):
    tilts = np.concatenate([np.full(200, 90.0), np.full(8, tilt_deg)])
    flies = cloud(np.concatenate([np.linspace(0.0, 0.2, 200), np.full(8, 0.3)]), tilt_deg=tilts)
    assert (face(flies, trim=0.1) > 0.25) == on  # else it is where most flies are


@pytest.mark.parametrize(("n", "found"), [(5, 0.30), (4, 0.5)])
def test_five_flies_make_a_side(n, found):
    x = np.concatenate([np.full(n, 0.3), [0.5], np.full(100, 0.1)])
    tilts = np.concatenate([np.zeros(n), np.full(101, 90.0)])
    assert face(cloud(x, tilt_deg=tilts)) == pytest.approx(found)


@pytest.mark.parametrize(("beyond", "found"), [(5, 0.3), (6, 0.5)])
def test_of_few_flies_five_may_lie_beyond_the_outermost_side(beyond, found):
    x = np.concatenate([np.full(10, 0.3), np.full(beyond, 0.5), np.full(50, 0.1)])
    tilts = np.concatenate([np.zeros(10), np.full(beyond + 50, 90.0)])
    assert face(cloud(x, tilt_deg=tilts)) == pytest.approx(found)


@pytest.mark.parametrize(("beyond", "found"), [(29, 0.3), (32, 0.5)])
def test_of_many_flies_three_in_a_hundred_may_lie_beyond(beyond, found):
    x = np.concatenate([np.full(10, 0.3), np.full(beyond, 0.5), np.full(990 - beyond, 0.1)])
    tilts = np.concatenate([np.zeros(10), np.full(990, 90.0)])
    assert face(cloud(x, tilt_deg=tilts)) == pytest.approx(found)


@pytest.mark.parametrize(("off", "found"), [(0.0095, 0.3), (0.0105, 0.3105)])
def test_what_lies_a_centimetre_beyond_a_face_is_beyond_it(off, found):
    x = np.concatenate([np.full(10, 0.3), np.full(20, 0.3 + off), np.full(100, 0.1)])
    tilts = np.concatenate([np.zeros(10), np.full(120, 90.0)])
    assert face(cloud(x, tilt_deg=tilts)) == pytest.approx(found)


def test_an_unsure_fly_does_not_push_a_face_out():
    # Forty flies 5 cm beyond, each of which may as well lie 5 cm further in.
    x = np.concatenate([np.full(10, 0.3), np.full(40, 0.35), np.full(100, 0.1)])
    tilts = np.concatenate([np.zeros(10), np.full(140, 90.0)])
    noise = np.concatenate([np.zeros(10), np.full(40, 0.05), np.zeros(100)])
    assert face(cloud(x, tilt_deg=tilts, noise=noise)) == pytest.approx(0.3)
    assert face(cloud(x, tilt_deg=tilts)) == pytest.approx(0.35)


def test_the_surer_flies_of_a_face_count_for_more():
    # Weights 1 / (noise + 1 mm)^2: three of 1 mm against five of 3 mm, 0.75 to 0.31.
    x = np.array([0.3] * 3 + [0.304] * 5)
    noise = np.array([0.001] * 3 + [0.003] * 5)
    assert face(cloud(x, noise=noise)) == pytest.approx(0.3)
    assert face(cloud(x, noise=0.001)) == pytest.approx(0.304)
    # One that seems to be without noise counts no more than the surest tenth.
    x, noise = np.array([0.304] + [0.3] * 19), np.array([0.0] + [0.004] * 19)
    assert face(cloud(x, noise=noise)) == pytest.approx(0.3)


def test_the_outermost_face_is_the_fullest_of_the_last_centimetre_that_holds_enough():
    reach = np.concatenate([np.full(60, 0.20), np.full(6, 0.30), [0.304, 0.4]])
    # A tenth of the fullest face, and five at least: six flies at 0.3 m and the one beside them.
    assert np.flatnonzero(_outermost(reach, 0.01)).tolist() == [60, 61, 62, 63, 64, 65, 66]
    assert np.flatnonzero(_outermost(reach, 0.003)).tolist() == list(range(60, 66))
    assert not _outermost(np.linspace(0.0, 1.0, 9), 0.01).any()
    for n, outermost in ((54, True), (66, False)):  # of which six is a tenth, and less
        reach = np.concatenate([np.full(n, 0.2), np.full(6, 0.3)])
        assert _outermost(reach, 0.01)[-1] == outermost
    assert _outermost(np.array([0.1] * 5), 0.01).all() and not _outermost(np.array([0.1] * 4), 0.01).any()


def test_a_face_is_as_deep_as_a_centimetre_beside_its_noise():
    x = np.array([0.3] * 6 + [0.312] * 6)
    assert face(cloud(x, noise=0.004)) == pytest.approx(0.3, abs=1e-9)  # all twelve: the first of the middle two
    x = np.array([0.3] * 6 + [0.3115] * 5)
    assert face(cloud(x, noise=0.0)) == pytest.approx(0.3115)
    assert face(cloud(x, noise=0.002)) == pytest.approx(0.3)


def test_a_weighted_median_by_hand():
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0])
    assert _weighted_median(values, weights) == 2.0
    assert _weighted_median(values, np.array([1.0, 3.0, 1.0])) == 1.0
    assert _weighted_median(values, np.array([9.0, 1.0, 1.0])) == 3.0


def test_flies_count_for_a_side_by_how_near_they_lie_to_it():
    # A square of 1 m; a fly 8 mm off its side counts exp(-1/2), one in the middle nothing.
    side = np.linspace(0.0, 1.0, 11)
    square = np.concatenate([np.stack([side, 0 * side], 1), np.stack([side, 0 * side + 1.0], 1)])
    assert _closeness(square, 0.0, 0.0) == pytest.approx(22.0)
    for off in (0.004, 0.008, 0.016):
        more = np.concatenate([square, [[0.5, off]]])
        assert _closeness(more, 0.0, 0.0) == pytest.approx(22.0 + math.exp(-0.5 * (off / 0.008) ** 2))
    assert _closeness(np.concatenate([square, [[0.5, 0.5]]]), 0.0, 0.0) == pytest.approx(22.0)
    turn = np.radians(30.0)
    turned = square @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    assert _closeness(turned, 30.0, 0.0) == pytest.approx(22.0)
    assert _closeness(turned, 20.0, 0.0) < 12.0


@pytest.mark.parametrize("astray", [0, 1, 2, 4])
def test_a_side_begins_where_most_flies_are_though_some_lie_astray(astray):
    stray = np.linspace(-0.5, -0.2, astray)
    ordered = np.concatenate([stray, np.full(50, 0.1), np.linspace(0.2, 1.0, 100 - 50 - astray + 1)])
    assert _low_end(ordered, 0.0) == pytest.approx(0.1)
    assert _low_end(ordered, 0.01) == pytest.approx(0.1)


def test_more_than_one_fly_in_twenty_five_astray_is_a_side():
    ordered = np.concatenate([np.linspace(-0.5, -0.2, 6), np.full(50, 0.1), np.linspace(0.2, 1.0, 45)])
    assert _low_end(ordered, 0.0) < 0.0


def test_a_heading_is_told_to_an_eighth_of_a_degree():
    side = np.linspace(-0.5, 0.5, 200)
    for true_deg in (0.1, 17.4, 44.9, 89.8):
        flies = cloud(np.tile(side, 2), tilt_deg=90.0)
        plan = np.stack([np.tile(side, 2), np.repeat([-0.2, 0.2], 200)], axis=1)
        c, s = math.cos(math.radians(true_deg)), math.sin(math.radians(true_deg))
        flies.points[:, :2] = plan @ np.array([[c, s], [-s, c]])
        yaw = math.degrees(fit_box(flies, np.arange(400), 0.0)[2])
        assert abs((yaw - true_deg + 90.0) % 180.0 - 90.0) < 0.15


def test_a_top_is_never_under_the_floor():
    flies = cloud(np.full(10, 0.3), tilt_deg=0.0)
    flies.points[:, 2] = -0.1
    assert top(flies, np.arange(10), 0.0) == 0.0


# The silhouettes of its neighbours.


def found(ends, **given):
    flies = cloud(np.zeros(len(ends)), ends=np.asarray(ends, float), **{"step": 1e-9, **given})
    return edge(flies, np.arange(len(ends)), X)


@pytest.mark.parametrize(("n", "speaks"), [(6, True), (5, False)])
def test_six_arms_tell_an_edge(n, speaks):
    assert (found([0.3] * n) is not None) == speaks


@pytest.mark.parametrize(("lean_deg", "speaks"), [(71.0, True), (74.0, False), (109.0, False)])
def test_an_arm_speaks_for_what_it_points_at(lean_deg, speaks):
    # Its cosine is 0.326, 0.276, -0.326.
    assert (found([0.3] * 8, lean_deg=lean_deg) is not None) == speaks
    assert found([0.3] * 8, ended=False) is None


def test_the_surface_ends_half_a_pixel_beyond_the_last_one():
    assert found([0.3] * 8, step=0.002) == pytest.approx(0.301)


def test_an_edge_is_the_outermost_place_with_half_as_many_arms_as_any():
    for outer, place in ((21, 0.30), (19, 0.27)):
        assert found([0.27] * 40 + [0.30] * outer) == pytest.approx(place)


@pytest.mark.parametrize(("back", "place"), [(0.048, 0.252), (0.053, 0.30)])
def test_it_is_sought_five_centimetres_from_the_outermost_arm(back, place):
    # Many arms end so far behind the last few: too far behind, and they are no edge of it.
    assert found([0.30 - back] * 40 + [0.30] * 8) == pytest.approx(place)


@pytest.mark.parametrize(("over", "place"), [(19, 0.3), (21, 0.36)])
def test_one_arm_in_fifty_may_run_over_it(over, place):
    # 1000 arms: of those beyond, so many are astray and the next is the outermost. Behind it lies nothing else.
    assert found([0.3] * (1000 - over) + [0.36] * over) == pytest.approx(place)


def test_arms_that_end_within_four_millimetres_end_together():
    # Two heaps of ten and seven: at 3 mm they are one peak between them, at 20 mm two.
    near = found([0.300] * 10 + [0.303] * 7)
    assert 0.300 < near < 0.303 and near == pytest.approx((10 * 0.300 + 7 * 0.303) / 17)
    assert found([0.300] * 10 + [0.320] * 7) == pytest.approx(0.320)
    # Averaged over 8 mm about the peak.
    assert found([0.300] * 20 + [0.2925] * 4) == pytest.approx((20 * 0.300 + 4 * 0.2925) / 24)
    assert found([0.300] * 20 + [0.2915] * 4) == pytest.approx(0.300)


def test_an_arm_of_three_millimetre_pixels_counts_for_half():
    # Weights 1 / (1 + (pixel / 3 mm)^2): ten of 3 mm against five of next to nothing make one mean.
    ends = np.array([0.300] * 10 + [0.303] * 5)
    pixels = np.array([0.003] * 10 + [1e-9] * 5)
    ends[:10] -= 0.0015  # half a pixel is added
    assert found(ends, step=pixels) == pytest.approx(0.3015)
    pixels[:10], ends[:10] = 0.006, 0.300 - 0.003
    assert found(ends, step=pixels) == pytest.approx((10 / 5 * 0.300 + 5 * 0.303) / 7)
