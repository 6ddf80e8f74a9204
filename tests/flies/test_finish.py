"""The tests at the end, each at its threshold: a fly just inside stays, one just outside goes."""

import math

import numpy as np
import pytest
from rules import rules as ruled

from flysim.flies.finish import (
    GOOD,
    OUT_OF_VIEW,
    Finished,
    all_columns,
    comes_back,
    finish,
    gradient_energy,
    has_rival,
    judge,
    mean_difference,
    most_columns,
    slow_curve,
)
from flysim.flies.rules import RULES
from flysim.flies.survivors import _exchanged
from flysim.flies.threads import share
from flysim.flies.tuning import RefineParams
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.views import prepare
from flysim.stereo.windows import parallax, warp

LENS = Camera(width=90, height=40, fx=50.0, fy=50.0, cx=44.5, cy=19.5)
RIG, SWAPPED = StereoRig.parallel(LENS, 0.2), StereoRig(left=LENS, right=LENS, T_right_left=pose6(0.2, 0, 0, 0, 0, 0))
GAIN = 50.0 * 0.2
TRUE_PX = 10  # disparity of the wall


def rules(**given):
    return ruled(**{"half": 3, "q_near": 30.0 / GAIN, "q_far": 4.0 / GAIN, **given})[0]


def wall(brighter=0, shift_px=0.0):
    """(left, right): smooth noise, seen 10 px further left on the right, brighter, and some parts of a pixel beside."""
    rng = np.random.default_rng(3)
    noise = rng.integers(30, 226, (40, 130)).astype(float)
    kernel = np.exp(-0.5 * (np.arange(-4, 5) / 1.5) ** 2)
    smooth = np.apply_along_axis(np.convolve, 1, noise, kernel / kernel.sum(), "same")
    smooth = 128 + 2.2 * (smooth - smooth.mean())
    u = np.arange(90)
    left = smooth[:, 20:110]
    right = np.stack([np.interp(u + 20 + TRUE_PX - shift_px, np.arange(130), line) for line in smooth]) + brighter
    return [np.repeat(image.round().clip(0, 255).astype(np.uint8)[..., None], 3, axis=2) for image in (left, right)]


def both(left, right):
    """The views of a pair and of the one with left and right exchanged."""
    there = prepare(ImagePair(left=left, right=right, rig=RIG))
    return there, prepare(ImagePair(left=right, right=left, rig=SWAPPED))


def rival(views, px, limit, allowance=1e4):
    room = np.empty(400, np.float32)
    return has_rival(views.record[0], rules(), 45, 20, px / GAIN, limit, allowance, room)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_match_two_and_a_half_pixels_off_is_another_one(side):
    views = both(*wall())[0]
    assert not rival(views, TRUE_PX + side * 2.4, limit=5.0)
    assert rival(views, TRUE_PX + side * 2.6, limit=5.0)


def test_a_rival_differs_by_less_than_the_limit():
    views = both(*wall(brighter=4))[0]  # by 16 levels^2
    assert rival(views, 20.0, limit=16.5)
    assert not rival(views, 20.0, limit=15.5)


def test_a_rival_between_two_pixels_is_moved_to_its_own_least_before_it_is_judged():
    views, found = both(*wall(shift_px=0.5))[0], np.empty(400, np.float32)
    n, _ = all_columns(views.record[0], rules(), 45, 20, found)
    valley = float(found[:n].min())
    assert valley > 100.0  # at a whole column; between two it differs by 17
    assert rival(views, 20.0, limit=18.0, allowance=valley - 17.9)
    assert not rival(views, 20.0, limit=18.0, allowance=valley - 18.1)
    assert not rival(views, 20.0, limit=16.0, allowance=1e4)


@pytest.mark.parametrize("depths", [(10.5, 30.0), (4.0, 9.5)])
def test_a_rival_lies_in_the_depths_that_are_searched(depths):
    views, room = both(*wall())[0], np.empty(400, np.float32)
    how = rules(q_far=depths[0] / GAIN, q_near=depths[1] / GAIN)
    assert not has_rival(views.record[0], how, 45, 20, 20.0 / GAIN, 5.0, 1e4, room)
    # At the very end of the depths it still counts.
    for near, far in ((TRUE_PX, 4.0), (30.0, TRUE_PX)):
        how = rules(q_far=far / GAIN, q_near=near / GAIN)
        assert has_rival(views.record[0], how, 45, 20, 20.0 / GAIN, 5.0, 1e4, room)


@pytest.mark.parametrize(("u", "far", "near"), [(45, 4.3, 30.6), (12, 1.0, 30.0), (80, 1.0, 20.5), (45, 4.0, 30.0)])
def test_the_curve_holds_every_whole_column_of_the_searched_depths_in_view(u, far, near):
    views = both(*wall())[0]
    found = np.full(400, np.nan, np.float32)
    n, q_first = all_columns(views.record[0], rules(q_far=far / GAIN, q_near=near / GAIN), u, 20, found)
    columns = [x for x in range(90) if u - near <= x <= u - far and 4 <= x <= 90 - 2 - 3]
    assert n == len(columns)
    assert q_first * GAIN == pytest.approx(u - columns[0])
    left, right = views.grey_left[17:24].astype(float), views.grey_right[17:24].astype(float)
    expected = [((left[:, u - 3 : u + 4] - right[:, x - 3 : x + 4]) ** 2).mean() for x in columns]
    np.testing.assert_allclose(found[:n], expected, rtol=1e-5)
    # The long way has the same columns, and those out of view beside.
    slow = np.full(400, np.nan, np.float32)
    general = prepare(ImagePair(left=views.left, right=views.right, rig=RIG), fast=False)
    n, q_first = all_columns(general.record[0], rules(q_far=far / GAIN, q_near=near / GAIN), u, 20, slow)
    assert q_first * GAIN == pytest.approx(u - math.ceil(u - near))
    assert n == math.floor(u - far) - math.ceil(u - near) + 1
    from_there = columns[0] - math.ceil(u - near)
    np.testing.assert_allclose(slow[from_there : from_there + len(columns)], expected, rtol=1e-5)


@pytest.mark.parametrize("gain_px", [20.0, 500.0])
def test_there_is_room_for_every_column(gain_px):
    wide = StereoRig.parallel(LENS, gain_px / 50.0)
    views = prepare(ImagePair(left=wall()[0], right=wall()[1], rig=wide)).record.view(np.ndarray)
    how = ruled(q_near=2.0, q_far=0.25)
    room = most_columns(views, how)
    # One more than whole pixels between both depths, or a whole row, filled up to a whole block of 16.
    assert room >= max(90, int(1.75 * gain_px) + 1) + 15
    assert room < max(90, int(1.75 * gain_px) + 1) + 30


@pytest.mark.parametrize("most", [0.25, 1.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_fly_comes_back_if_the_best_match_of_its_right_pixel_is_as_near_as_asked(most, side):
    there, back = both(*wall())
    for off, expected in ((most + 0.45, True), (most + 0.55, False)):  # half a pixel is the search's step
        q = (TRUE_PX + side * off) / GAIN
        w = warp(there.record[0], 45, 20, q, 0.0, 0.0)
        # Its right pixel's own match is 10 px away, wherever the fly came from.
        assert comes_back(there.record[0], back.record[0], rules(), 45, 20, q, w, most) == expected


@pytest.mark.parametrize(
    ("u", "v", "comes"),
    [(14, 20, True), (13, 20, False), (45, 4, True), (45, 3, False), (45, 35, True), (45, 36, False)],
)
def test_a_fly_whose_right_pixel_has_no_window_does_not_come_back(u, v, comes):
    there, back = both(*wall())
    q = TRUE_PX / GAIN
    w = warp(there.record[0], u, v, q, 0.0, 0.0)
    assert comes_back(there.record[0], back.record[0], rules(), u, v, q, w, 0.5) == comes


def test_out_of_view_a_curve_is_endless():
    views, found = both(*wall())[0], np.zeros(30, np.float32)
    slow_curve(views.record[0], 20, 20, 25.0 / GAIN, GAIN, 3, 30, found)
    # From disparity 25 on down: the window's first column is in view from 17 px on, but for rounding.
    assert np.isinf(found[:8]).all() and np.isfinite(found[9:]).all()


def test_a_difference_is_a_mean_over_window_and_colours():
    views = both(*wall(brighter=4))[0]
    w = warp(views.record[0], 45, 20, TRUE_PX / GAIN, 0.0, 0.0)
    assert mean_difference(views.record[0], 45, 20, w, 3, math.inf) == 16.0
    assert mean_difference(views.record[0], 45, 20, w, 3, 17.0) == 16.0
    assert mean_difference(views.record[0], 45, 20, w, 3, 8.0) > 8.0


def finished(px, uniqueness=0.0, left_right=0.0, images=None, **given):
    """(own, energy, good, disparities [px]) of flies at (45, 20) that differ in disparity."""
    there, back = both(*(images or wall()))
    n = len(px)
    genes = np.zeros((n, 3))
    genes[:, 0] = np.array(px) / GAIN
    done = Finished(genes, np.zeros(n, np.float32), np.zeros((n, 2), np.float32), np.zeros(n, np.int8))
    how = np.array([tuple(rules(**given))], RULES)
    scratch = np.empty((16, 400), np.float32)
    share(
        finish, np.zeros(1, np.int64), there.record.view(np.ndarray),
        back.record.view(np.ndarray) if left_right > 0.0 else None, how, scratch, np.full((n, 2), (45, 20), np.int32),
        done, uniqueness, left_right,
    )  # fmt: skip
    return done.own, done.energy, done.verdict == GOOD, genes[:, 0] * GAIN


def test_flies_are_refined_and_measured_where_they_then_are():
    own, energy, good, px = finished([9.2, 10.7, 12.0])
    np.testing.assert_allclose(px, TRUE_PX, atol=0.02)
    assert (own < 1.0).all() and good.all()
    views = both(*wall())[0]
    expected = gradient_energy(views.record[0], 45, 20, 3)
    np.testing.assert_allclose(energy, np.tile(expected, (3, 1)), rtol=1e-5)


def twice(brighter):
    """A pair whose wall is seen again 12 px of disparity further, so much brighter."""
    left, right = (image.copy() for image in wall())
    right[:, 45 - 22 - 6 : 45 - 22 + 7] = np.clip(left[:, 45 - 6 : 45 + 7].astype(int) + brighter, 0, 255)
    return left, right


@pytest.mark.parametrize(("brighter", "own_px", "uniqueness", "unique"), [
    # A quarter of a level^2 is added to the fly's own difference, which is none.
    (2, 10.0, 15.5, True), (2, 10.0, 17.0, False), (1, 10.0, 3.8, True), (1, 10.0, 4.4, False), (1, 10.0, 0.0, True),
])  # fmt: skip
def test_a_fly_is_dropped_if_another_place_is_as_good_as_so_many_times_its_own(brighter, own_px, uniqueness, unique):
    own, _, good, px = finished([own_px], uniqueness=uniqueness, images=twice(brighter))
    assert px[0] == pytest.approx(TRUE_PX, abs=0.01) and own[0] < 0.01
    assert good[0] == unique


def test_both_tests_must_be_passed():
    # The fly at 10 px comes back; that at 22 px, on the repetition, does not: its right pixel is that of another.
    for images, expected in ((wall(), [True]), (twice(1), [False])):
        assert finished([10.0], uniqueness=6.0, left_right=0.5, images=images)[2].tolist() == expected


def test_a_fly_out_of_view_is_no_good():
    own, _, good, _ = finished([10.0], q_near=60.0 / GAIN)
    assert good.all()
    own, _, good, _ = finished([44.0], q_near=60.0 / GAIN)
    assert np.isinf(own).all() and not good.any()


def kept(own, energy, emptiest=None, misfit=0.3):
    energy = np.array(energy, np.float32)
    halves = energy if emptiest is None else np.array(emptiest, np.float32)
    own = np.array(own, np.float32)
    verdict = np.where(np.isfinite(own), GOOD, OUT_OF_VIEW).astype(np.int8)  # as `finish` leaves it
    judge(Finished(np.empty(0), own, np.stack([energy, halves], axis=1), verdict), misfit, RefineParams())
    return (verdict == GOOD).tolist()


def test_a_window_may_differ_by_what_a_shift_explains_beside_the_noise_of_all():
    # The median difference is 2: 1.5 times that, 0.25 for rounding, and 0.3^2 of an energy of 100: 12.25.
    assert kept([2, 2, 2, 12.2, 12.3], [100.0] * 5) == [True, True, True, True, False]
    assert kept([2, 2, 12.2, 12.3], [100.0] * 4, misfit=0.4) == [True] * 4
    # Of an even number the middle of both middle ones: 1 and 3.
    assert kept([1, 3, 0, 12.2], [100.0] * 4)[3] and not kept([1, 3, 0, 12.3], [100.0] * 4)[3]
    # Little contrast explains little.
    assert kept([2, 2, 2, 3.3, 3.4], [1.0] * 5) == [True, True, True, True, False]


def test_every_half_of_a_window_holds_a_fiftieth_of_its_contrast():
    assert kept([1, 1], [100.0, 100.0], [2.1, 1.9]) == [True, False]


def test_without_the_test_only_what_is_out_of_view_goes():
    assert kept([1e6, np.inf, 1.0], [1.0] * 3, [0.0] * 3, misfit=0.0) == [True, False, True]
    assert kept([], []) == []
    assert kept([1.0, np.inf, 1.0], [1.0] * 3) == [True, False, True]


def test_a_fly_comes_back_to_a_camera_that_is_turned_and_moved_ahead(stage):
    """Its depth in the other camera is another than in its own."""
    rig = StereoRig(left=stage.CAMERA, right=stage.CAMERA, T_right_left=pose6(-0.12, 0.01, -0.1, 0.0, 0.15, 0.02))
    pair = stage.photograph(rig, [stage.Plane((0.0, 0.0, 1.0), 1.5)])
    there = prepare(pair)
    back = prepare(_exchanged(there, rig), fast=False)
    how = rules(q_near=1.0 / 0.6, q_far=1.0 / 4.0)
    seen = 0
    for u, v in ((120, 75), (140, 50), (160, 100), (180, 80)):
        w = warp(there.record[0], u, v, 1.0 / 1.5, 0.0, 0.0)
        if 10.0 < w[0] < 190.0 and 10.0 < w[1] < 140.0:
            seen += 1
            assert comes_back(there.record[0], back.record[0], how, u, v, 1.0 / 1.5, w, 0.5)
            px = parallax(back.record[0], round(w.u), round(w.v), 1.0 / 1.5)[2]
            wrong = 1.0 / 1.5 + 1.6 / px
            w = warp(there.record[0], u, v, wrong, 0.0, 0.0)
            assert not comes_back(there.record[0], back.record[0], how, u, v, wrong, w, 0.5)
    assert seen >= 2
