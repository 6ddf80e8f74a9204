"""Each compiled kernel against a plain numpy version of what its docstring says, on random pairs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rules import rules as ruled

from flysim.flies.finish import comes_back, curve, gradient_energy, has_rival, slow_curve
from flysim.flies.fitness import NOISE, evaluate, plugged
from flysim.flies.measure import MEASURES
from flysim.flies.selection import select, shared_fitness
from flysim.flies.state import FLY, REGION
from flysim.flies.tuning import RefineParams
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6, se3
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.descent import descend
from flysim.stereo.views import prepare
from flysim.stereo.windows import gradient_left, gradient_right, squared_difference, sums, visible, warp

WIDTH, HEIGHT = 48, 40
LENS = Camera(width=WIDTH, height=HEIGHT, fx=45.0, fy=47.0, cx=23.0, cy=20.5)
OTHER = Camera(width=WIDTH + 5, height=HEIGHT - 3, fx=44.0, fy=48.0, cx=25.5, cy=18.0)
ROOM = 512  # of the scratch in which rivals are sought
few = settings(max_examples=60, deadline=None)

turn, shift = st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)
rigs = st.one_of(
    st.floats(0.05, 0.3).map(lambda baseline: StereoRig.parallel(LENS, baseline)),
    st.builds(
        lambda x, y, z, roll, pitch, yaw: StereoRig(
            left=LENS, right=OTHER, T_right_left=pose6(x, y, z, roll, pitch, yaw)
        ),
        st.floats(-0.3, -0.05), shift, shift, turn, turn, turn,
    ),
)  # fmt: skip
seeds = st.integers(0, 2**32 - 1)
halves = st.integers(1, 4)
slopes = st.floats(-0.02, 0.02)  # [1/m/px]
fly = st.tuples(st.integers(6, WIDTH - 7), st.integers(6, HEIGHT - 7), st.floats(0.3, 2.0), slopes, slopes)


def random_pair(rig, seed, smooth=False):
    """Two unrelated noisy images, or (`smooth`) two of slow waves that are nearly alike."""
    rng = np.random.default_rng(seed)
    images = []
    wave = rng.uniform(-0.5, 0.5, (3, 6, 2)), rng.uniform(0, 6, (3, 6))
    for camera in (rig.left, rig.right):
        u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        if smooth:
            image = np.stack([128 + sum(20 * np.sin(a * u + b * v + p) for (a, b), p in zip(w, ps, strict=True))
                              for w, ps in zip(*wave, strict=True)], axis=-1)  # fmt: skip
            image = (image + rng.normal(size=image.shape)).clip(0, 255).astype(np.uint8)
        else:
            image = rng.integers(0, 256, (camera.height, camera.width, 3), dtype=np.uint8)
        images.append(image)
    return ImagePair(left=images[0], right=images[1], rig=rig)


def right_pixel(rig, u, v, q):
    """Where the point at left pixel (u, v) and inverse depth q is seen on the right."""
    return rig.project(LENS.unproject(np.array([[u, v]]), [1.0 / q]))[1][0]


def window(half):
    j, i = np.mgrid[-half : half + 1, -half : half + 1]
    return i, j


def warped_window(w, half):
    """`[n, n]` x and y of the warped window in the right image."""
    ur, vr, a, b, c, d = w
    i, j = window(half)
    return ur + a * i + b * j, vr + c * i + d * j


def rules(**given):
    """A record of what the kernels read of the parameters."""
    return ruled(**{"half": 3, "q_near": 2.5, "q_far": 0.2, **given})[0]


def fixed(start, step, n):
    """`[n]` places from `start` on in 1/65536 px, as whole numbers."""
    return int(start * 65536.0) + np.arange(n) * int(step * 65536.0)


def fixed_window(w, half):
    """`[n, n]` x and y of the warped window [1/65536 px], row by row."""
    ur, vr, a, b, c, d = w
    rows = range(-half, half + 1)
    x = np.stack([fixed(ur + b * j - a * half, a, 2 * half + 1) for j in rows])
    y = np.stack([fixed(vr + d * j - c * half + 0.5 / 65536, c, 2 * half + 1) for j in rows])
    return x, y


def sample(image, x, y):
    """256 times the bilinear value at places in 1/65536 px, each interpolation cut to a whole number."""
    image = image.astype(np.int64)
    x0, y0 = x >> 16, y >> 16
    f, g = (x >> 8) & 255, (y >> 8) & 255
    if image.ndim == 3:
        f, g = f[..., None], g[..., None]
    x1, y1 = np.minimum(x0 + 1, image.shape[1] - 1), np.minimum(y0 + 1, image.shape[0] - 1)
    over = 256 * image[y0, x0] + f * (image[y0, x1] - image[y0, x0])
    under = 256 * image[y1, x0] + f * (image[y1, x1] - image[y1, x0])
    return over + ((g * (under - over)) >> 8)


def windows(pair, u, v, w, half):
    """Both windows `[n, n, 3]` in grey levels."""
    i, j = window(half)
    left = pair.left[v + j, u + i].astype(float)
    return left, sample(pair.right, *fixed_window(w, half)) / 256.0


def inside(w, rig, half):
    """Whether every sample of the warped window and its four neighbours lie in the right image."""
    if not np.isfinite(w[:2]).all():
        return False
    x, y = warped_window(w, half)
    width, height = rig.right.width, rig.right.height
    return bool(x.min() >= 0 and y.min() >= 0 and x.max() < width - 1 and y.max() < height - 1)


def difference(pair, u, v, w, half):
    """Denominator of eq. (1), as the mean over window and colours."""
    left, right = windows(pair, u, v, w, half)
    return float(((left - right) ** 2).mean())


def sobel(image):
    """gx, gy of Sobel's 3x3 kernels, the border repeated."""
    p = np.pad(image.astype(float), ((1, 1), (1, 1), (0, 0)), mode="edge")
    across, down = p[:, 2:] - p[:, :-2], p[2:] - p[:-2]
    gx = across[:-2] + 2 * across[1:-1] + across[2:]
    gy = down[:, :-2] + 2 * down[:, 1:-1] + down[:, 2:]
    return gx / 8.0, gy / 8.0  # levels per pixel: a ramp of 1 level/px has gradient 1


def gradients(pair, norm):
    """`[H, W]` of both images: Sobel's gradient norm, or its part along the line to the epipole."""
    rig = pair.rig
    R, t = rig.T_right_left[:3, :3], rig.T_right_left[:3, 3]
    out = []
    for image, epipole in ((pair.left, rig.left.K @ (-R.T @ t)), (pair.right, rig.right.K @ t)):
        gx, gy = sobel(image)
        v, u = np.mgrid[: image.shape[0], : image.shape[1]]
        # The epipolar line through a pixel joins it to the epipole, also one at infinity.
        line = np.cross(np.stack([u, v, np.ones_like(u)], axis=-1), epipole)
        along = np.stack([-line[..., 1], line[..., 0]], axis=-1)
        along = along / np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-12)
        part = gx**2 + gy**2 if norm else (gx * along[..., :1] + gy * along[..., 1:]) ** 2
        out.append(np.sqrt(part.mean(axis=2)))
    return out


@few
@given(rigs, fly)
def test_warp_is_the_projection_of_the_flys_plane_and_its_derivative(rig, fly):
    u, v, q, qu, qv = fly
    views = prepare(random_pair(rig, 0)).record[0]
    ur, vr, a, b, c, d = warp(views, u, v, q, qu, qv)
    np.testing.assert_allclose((ur, vr), right_pixel(rig, u, v, q), atol=1e-9)
    step = 1e-4
    for (i, j), (x, y) in {(step, 0): (a, c), (0, step): (b, d)}.items():
        ahead = right_pixel(rig, u + i, v + j, q + qu * i + qv * j)
        behind = right_pixel(rig, u - i, v - j, q - qu * i - qv * j)
        np.testing.assert_allclose((x, y), (ahead - behind) / (2 * step), atol=1e-5)


def test_warp_has_no_pixel_behind_the_right_camera():
    rig = StereoRig(left=LENS, right=LENS, T_right_left=se3(np.eye(3), (0.0, 0.0, -1.0)))  # 1 m ahead
    prepared = prepare(random_pair(rig, 0))
    views = prepared.record[0]
    w = warp(views, 23, 20, 2.0, 0.0, 0.0)  # a fly at 0.5 m
    assert math.isnan(w[0]) and math.isnan(w[1])
    assert not visible(views, w, 3)


@few
@given(rigs, fly, halves)
def test_visible_means_that_every_sample_has_its_neighbours(rig, fly, half):
    views = prepare(random_pair(rig, 0)).record[0]
    w = warp(views, *fly)
    if visible(views, w, half):
        assert inside(w, rig, half)
        x, y = fixed_window(w, half)
        assert x.min() >= 0 and y.min() >= 0
        assert (x >> 16).max() + 1 < rig.right.width and (y >> 16).max() + 1 < rig.right.height
    else:  # no more than the thousandth of a pixel that rounding is allowed is lost
        assert not inside(w, rig, half) or not inside(w, rig, half + 0.01)


@few
@given(rigs, fly, halves, seeds)
def test_the_squared_difference_is_that_of_a_bilinear_warped_window(rig, fly, half, seed):
    pair = random_pair(rig, seed)
    prepared = prepare(pair)
    views = prepared.record[0]
    u, v, *_ = fly
    w = warp(views, *fly)
    if not visible(views, w, half):
        return
    unit = 3 * (2 * half + 1) ** 2 * 65536
    expected = round(difference(pair, u, v, w, half) * unit)
    assert squared_difference(views, u, v, w, half, 1 << 62) == pytest.approx(expected, rel=1e-12)
    # Given up early, it is only promised to be above the limit.
    assert squared_difference(views, u, v, w, half, expected // 2) > expected // 2
    assert squared_difference(views, u, v, w, half, expected + 1) == pytest.approx(expected, rel=1e-12)


@few
@given(rigs, fly, halves, seeds)
def test_places_in_256ths_of_a_pixel_are_fine_enough(rig, fly, half, seed):
    """Beside true bilinear interpolation, on images as smooth as a lens leaves them."""
    pair = random_pair(rig, seed, smooth=True)
    prepared = prepare(pair)
    views = prepared.record[0]
    u, v, *_ = fly
    w = warp(views, *fly)
    if not visible(views, w, half):
        return
    x, y = warped_window(w, half)
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    f, g = (x - x0)[..., None], (y - y0)[..., None]
    image = pair.right.astype(float)
    y1 = np.minimum(y0 + 1, rig.right.height - 1)
    over = (1 - f) * image[y0, x0] + f * image[y0, x0 + 1]
    under = (1 - f) * image[y1, x0] + f * image[y1, x0 + 1]
    i, j = window(half)
    exact = ((pair.left[v + j, u + i] - ((1 - g) * over + g * under)) ** 2).mean()
    found = squared_difference(views, u, v, w, half, 1 << 62) / (3 * (2 * half + 1) ** 2 * 65536)
    assert math.sqrt(found) == pytest.approx(math.sqrt(exact), abs=0.2)  # grey levels


@few
@given(rigs, fly, halves, seeds)
def test_the_sums_are_those_of_both_windows(rig, fly, half, seed):
    pair = random_pair(rig, seed)
    prepared = prepare(pair)
    views = prepared.record[0]
    u, v, *_ = fly
    w = warp(views, *fly)
    if not visible(views, w, half):
        return
    left, right = windows(pair, u, v, w, half)
    expected = [left.sum(), right.sum(), (left**2).sum(), (right**2).sum(), (left * right).sum()]
    np.testing.assert_allclose(sums(views, u, v, w, half), expected, rtol=1e-12)


@few
@given(rigs, seeds, st.booleans())
def test_gradients_are_sobels(rig, seed, norm):
    pair = random_pair(rig, seed)
    prepared = prepare(pair)
    views = prepared.record[0]
    for image, gradient, expected in zip(
        (pair.left, pair.right), (gradient_left, gradient_right), gradients(pair, norm), strict=True
    ):
        rng = np.random.default_rng(seed)
        height, width = image.shape[:2]
        spots = np.stack([rng.integers(0, width, 30), rng.integers(0, height, 30)], 1).tolist()
        for u, v in [*spots, (0, 0), (width - 1, height - 1)]:
            assert gradient(views, u, v, norm) == pytest.approx(expected[v, u], rel=1e-4, abs=1e-3)


def test_a_ramp_of_one_level_a_pixel_has_gradient_one():
    image = np.broadcast_to(np.arange(WIDTH, dtype=np.uint8)[None, :, None], (HEIGHT, WIDTH, 3))
    prepared = prepare(ImagePair(left=image, right=image, rig=StereoRig.parallel(LENS, 0.1)))
    for norm in (False, True):
        assert gradient_left(prepared.record[0], 20, 20, norm) == pytest.approx(1.0)


def expected_fitness(form, gl, gr, left, right):
    squared = ((left - right) ** 2).mean()
    zero_mean = ((left - left.mean() - right + right.mean()) ** 2).mean()
    covariance = ((left - left.mean()) * (right - right.mean())).mean()
    zncc = max(covariance, 0.0) / math.sqrt((left.var() + NOISE) * (right.var() + NOISE))
    eq1 = gl * gr / (squared + NOISE)
    return {
        "epipolar": eq1,
        "paper": eq1,
        "louchet": math.log(1.0 + gl * gr / (zero_mean + NOISE)),
        "zncc": zncc,
        "product": eq1 * zncc,
    }[form]


def expected_trust(rig, w):
    """Of what moves a quarter as fast as it would side by side, all counts; of what moves half of that, a quarter."""
    ahead = rig.right.K @ rig.T_right_left[:3, 3]
    speed = math.hypot(ahead[0] - w.u * ahead[2], ahead[1] - w.v * ahead[2])
    return min(1.0, (speed / (0.25 * rig.left.fx * rig.baseline)) ** 2)


@pytest.mark.parametrize("form", MEASURES.builtin)
@few
@given(rig=rigs, fly=fly, half=halves, seed=seeds, smooth=st.booleans())
def test_fitness_is_its_formula(form, rig, fly, half, seed, smooth):
    pair = random_pair(rig, seed, smooth)
    prepared = prepare(pair)
    views = prepared.record[0]
    u, v, *_ = fly
    w = warp(views, *fly)
    if not visible(views, w, half):
        return
    both = gradients(pair, norm=form == "paper")
    gl, gr = both[0][v, u], both[1][int(w[1] + 0.5), int(w[0] + 0.5)]
    left, right = windows(pair, u, v, w, half)
    expected = expected_trust(rig, w) * expected_fitness(form, gl, gr, left, right)
    found = evaluate(views, form == "paper", plugged(form), u, v, w, half, 0.0)
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6)
    # What is enough is exact; what cannot be enough is no number between.
    assert evaluate(views, form == "paper", plugged(form), u, v, w, half, 0.99 * found) == found
    assert evaluate(views, form == "paper", plugged(form), u, v, w, half, 1.01 * found + 1e-9) in (0.0, found)


@few
@given(fly, halves, seeds, st.sampled_from(MEASURES.builtin))
def test_the_fast_path_of_a_rectified_pair_is_the_general_one(fly, half, seed, form):
    pair = random_pair(StereoRig.parallel(LENS, 0.1), seed, smooth=seed % 2 == 0)
    fast, slow = prepare(pair), prepare(pair, fast=False)
    assert fast.record[0].rectified and not slow.record[0].rectified
    u, v, q, qu, qv = fly
    results = []
    for prepared in (fast, slow):
        views, how = prepared.record[0], rules(half=half, steepest=1.0)
        w = warp(views, *fly)
        if not visible(views, w, half + 1):
            return
        results.append(
            (
                evaluate(views, form == "paper", plugged(form), u, v, w, half, 0.0),
                *descend(views, how, u, v, q, qu, qv, 2, 1),
                *gradient_energy(views, u, v, half),
                has_rival(views, how, u, v, q, 1500.0, 500.0, np.empty(ROOM, np.float32)),
            )
        )
    np.testing.assert_allclose(results[0], results[1], rtol=1e-4, atol=1e-9)


@few
@given(rigs, fly, st.integers(2, 4), seeds, st.booleans(), st.sampled_from([1, 2]))
def test_a_step_of_the_descent_is_the_least_squares_step(rig, fly, half, seed, slanted, stride):
    pair = random_pair(rig, seed, smooth=True)
    prepared = prepare(pair)
    views = prepared.record[0]
    u, v, q, qu, qv = fly
    w = warp(views, *fly)
    if not visible(views, w, half + 1):
        return
    left, right = prepared.grey_left.astype(float), prepared.grey_right.astype(float)
    i, j = (grid[::stride] for grid in window(half))
    x, y = (grid[::stride] for grid in fixed_window(w, half))
    x0, y0, f, g = x >> 16, y >> 16, (x >> 8 & 255) / 256, (y >> 8 & 255) / 256
    if x0.min() < 1:
        return  # beside the image's first column the short way reads a pixel of the row above
    gx, gy = np.zeros_like(right), np.zeros_like(right)
    gx[:, 1:-1], gy[1:-1] = (right[:, 2:] - right[:, :-2]) / 2, (right[2:] - right[:-2]) / 2
    gx[:, 0], gx[:, -1] = (right[:, 1] - right[:, 0]) / 2, (right[:, -1] - right[:, -2]) / 2
    gy[0], gy[-1] = (right[1] - right[0]) / 2, (right[-1] - right[-2]) / 2
    lx = (left[v + j, u + i + 1] - left[v + j, u + i - 1]) / 2
    ly = (left[v + j + 1, u + i] - left[v + j - 1, u + i]) / 2
    moved = np.subtract(right_pixel(rig, u, v, q * 1.0001), right_pixel(rig, u, v, q)) / (0.0001 * q)
    speed = np.hypot(*moved)
    nu, nv = moved / speed
    # Slopes are interpolated along their own axis alone; across it the pixel before stands in.
    across = (1 - f) * gx[y0, x0] + f * gx[y0, x0 + 1] + lx
    down = (1 - g) * gy[y0, x0] + g * gy[np.minimum(y0 + 1, rig.right.height - 1), x0] + ly
    slope = (across * nu + down * nv) / 2
    e = left[v + j, u + i] - sample(prepared.grey_right, x, y) / 256
    columns = [slope, slope * i, slope * j] if slanted else [slope]
    A = np.stack([column.ravel() for column in columns], axis=1)
    normal = A.T @ A
    if normal[0, 0] < 100.0:
        return  # nothing to see in this window
    if slanted:
        normal[[1, 2], [1, 2]] += RefineParams().slope_damping * normal[0, 0] * half**2
    step = np.zeros(3)
    step[: len(columns)] = np.linalg.solve(normal, A.T @ e.ravel())
    reach = max(abs(step[0]), half * abs(step[1]), half * abs(step[2]))
    step *= min(1.0, 1.5 / max(reach, 1e-12)) / speed
    how = rules(half=half, q_near=q + 10.0, q_far=q / 100.0, steepest=float(slanted))
    if not how.q_far <= q + step[0] <= how.q_near:
        return
    found = descend(views, how, u, v, q, qu, qv, 1, stride)
    np.testing.assert_allclose((np.array(found) - (q, qu, qv)) * speed, step * speed, atol=2e-3)  # [px]


@few
@given(rigs, seeds, st.integers(2, 4), st.integers(6, WIDTH - 7), st.integers(6, HEIGHT - 7))
def test_gradient_energy_is_of_the_window_and_of_its_emptiest_half(rig, seed, half, u, v):
    pair = random_pair(rig, seed)
    prepared = prepare(pair)
    gx, gy = sobel(prepared.grey_left[..., None])
    t = rig.T_right_left
    epipole = rig.left.K @ (-t[:3, :3].T @ t[:3, 3])
    line = np.cross((u, v, 1), epipole)  # through the middle of the window
    along = np.array([-line[1], line[0]]) / np.hypot(*line[:2])
    i, j = window(half)
    e = (gx[v + j, u + i, 0] * along[0] + gy[v + j, u + i, 0] * along[1]) ** 2
    emptiest = min(e[i < -1].mean(), e[i > 1].mean(), e[j < -1].mean(), e[j > 1].mean())
    np.testing.assert_allclose(gradient_energy(prepared.record[0], u, v, half), (e.mean(), emptiest), rtol=1e-4)


def test_a_window_of_three_pixels_has_halves_too():
    image = np.broadcast_to(5 * np.arange(WIDTH, dtype=np.uint8)[None, :, None], (HEIGHT, WIDTH, 3))
    prepared = prepare(ImagePair(left=image, right=image, rig=StereoRig.parallel(LENS, 0.1)))
    np.testing.assert_allclose(gradient_energy(prepared.record[0], 20, 20, 1), (25.0, 25.0))


@few
@given(st.floats(0.05, 0.3), st.integers(6, WIDTH - 7), st.integers(6, HEIGHT - 7), st.integers(1, 3), seeds)
def test_both_curves_are_the_grey_difference_at_each_column(baseline, u, v, half, seed):
    pair = random_pair(StereoRig.parallel(LENS, baseline), seed)
    prepared = prepare(pair)
    views, grey = prepared.record[0], prepared.grey_right.astype(float)
    i, j = window(half)
    here = prepared.grey_left[v + j, u + i].astype(float)
    columns = np.arange(half, WIDTH - half - 1)
    expected = [((here - grey[v + j, x + i]) ** 2).mean() for x in columns]
    fast, slow = np.empty(ROOM, np.float32), np.empty(len(columns), np.float32)
    curve(views, u, v, half, half, len(columns), fast)
    np.testing.assert_allclose(fast[: len(columns)], expected, rtol=1e-5)
    slow_curve(views, u, v, (u - columns[0]) / views.gain, views.gain, half, len(slow), slow)
    seen = np.isfinite(slow)
    assert seen[1:].all()  # of the first, rounding may put a sample out of view
    np.testing.assert_allclose(slow[seen], np.array(expected)[seen], rtol=1e-4)


def test_a_repeated_texture_has_rivals_and_a_fly_on_it_comes_back():
    wave = 128 + 60 * np.sin(2 * np.pi * np.arange(90) / 8.0)
    rng = np.random.default_rng(0)
    for repeated in (True, False):
        row = wave if repeated else rng.integers(40, 216, 90)
        image = np.repeat(np.broadcast_to(row, (HEIGHT, 90))[..., None], 3, axis=2).astype(np.uint8)
        left, right = image[:, 20 : 20 + WIDTH], image[:, 26 : 26 + WIDTH]  # 6 px of disparity
        rig = StereoRig.parallel(LENS, 0.2)
        prepared = prepare(ImagePair(left=left, right=right, rig=rig))
        swapped = StereoRig(left=LENS, right=LENS, T_right_left=se3(np.eye(3), (0.2, 0.0, 0.0)))
        back = prepare(ImagePair(left=right, right=left, rig=swapped))
        views, how = prepared.record[0], rules(q_near=22.0 / prepared.record[0].gain, q_far=1.0 / 45.0)
        u, v, q = 30, 20, 6.0 / views.gain
        found = has_rival(views, how, u, v, q, 1.0, 50.0, np.empty(ROOM, np.float32))
        assert found == repeated
        w = warp(views, u, v, q, 0.0, 0.0)
        if not repeated:
            assert comes_back(views, back.record[0], how, u, v, q, w, 0.5)
            elsewhere = 11.0 / views.gain
            assert not comes_back(
                views, back.record[0], how, u, v, elsewhere, warp(views, u, v, elsewhere, 0.0, 0.0), 0.5
            )


@few
@given(seeds, st.integers(1, 200), st.integers(1, 40), st.sampled_from([0.5, 1.0, 2.0]))
def test_sharing_divides_by_the_rank_in_the_cell(seed, n, cell, strength):
    rng = np.random.default_rng(seed)
    first, last = 3, 3 + n
    region = np.zeros(1, REGION).view(np.recarray)
    region[["first", "last", "u0", "u1", "v0", "v1"]] = first, last, 5, WIDTH, 2, HEIGHT
    pixels = np.stack([rng.integers(5, WIDTH, last), rng.integers(2, HEIGHT, last)], axis=1).astype(np.int32)
    fitness = rng.choice([-1.0, 0.0, 0.5, 2.0, 7.0, 300.0], last).astype(np.float32)
    enough = 3.0
    weights = (np.arange(1, n + 1) ** -strength).astype(np.float32)
    flies = np.zeros(last, FLY).view(np.recarray)
    flies["u"], flies["v"], flies["fitness"], flies["shared"] = *pixels.T, fitness, 77.0
    shared = flies["shared"]
    scratch = np.empty(last, np.uint64), np.empty(last, np.int32), np.empty(WIDTH * HEIGHT + 1, np.int32)
    shared_fitness(flies, region[0], cell, weights, enough, *scratch)
    assert (shared[:first] == 77.0).all()
    seen: dict[tuple[int, int], int] = {}
    for slot in sorted(range(first, last), key=lambda k: -fitness[k]):  # stable: equal ones by slot
        if fitness[slot] < 0.0:
            assert shared[slot] == fitness[slot]
            continue
        place = (pixels[slot, 0] // cell, pixels[slot, 1] // cell)
        seen[place] = seen.get(place, 0) + 1
        expected = fitness[slot] / (1.0 + fitness[slot] / enough) / seen[place] ** strength
        assert shared[slot] == pytest.approx(expected, rel=1e-5)


@few
@given(seeds, st.integers(1, 100), st.integers(0, 120))
def test_selection_takes_the_best_in_view(seed, n, count):
    rng = np.random.default_rng(seed)
    shared = rng.choice([-1.0, 0.0, 0.1, 0.2, 0.7], 2 * n).astype(np.float32)
    first, last = n // 2, n // 2 + n
    best = [slot for slot in sorted(range(first, last), key=lambda k: -shared[k]) if shared[slot] >= 0.0][:count]
    flies, region = np.zeros(2 * n, FLY).view(np.recarray), np.zeros(1, REGION).view(np.recarray)
    chosen = np.full(count + 4, -1, np.int32)
    flies["shared"] = shared
    region[["first", "last", "places", "parents"]] = first, last, count, 2
    found = select(flies, region[0], chosen, np.empty(last, np.uint64))
    assert sorted(chosen[2 : 2 + found].tolist()) == sorted(best)
    assert (chosen[:2] == -1).all() and (chosen[2 + found :] == -1).all()
