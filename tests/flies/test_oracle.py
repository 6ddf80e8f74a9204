"""Each compiled kernel against a plain numpy version of what its docstring says, on random pairs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.flies.descent import SLOPE_DAMPING, descend
from flysim.flies.finish import gradient_energy, has_rival
from flysim.flies.fitness import NOISE, fitness_of, mean_squared_difference, visible, warp
from flysim.flies.selection import select, shared_fitness
from flysim.flies.views import disparity_per_inverse_depth, prepare
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6, se3
from flysim.geometry.rig import ImagePair, StereoRig

WIDTH, HEIGHT = 48, 40
LENS = Camera(width=WIDTH, height=HEIGHT, fx=45.0, fy=47.0, cx=23.0, cy=20.5)
OTHER = Camera(width=WIDTH + 5, height=HEIGHT - 3, fx=44.0, fy=48.0, cx=25.5, cy=18.0)
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


def bilinear(image, x, y):
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - x0, y - y0
    if image.ndim == 3:
        fx, fy = fx[..., None], fy[..., None]
    x1, y1 = np.minimum(x0 + 1, image.shape[1] - 1), np.minimum(y0 + 1, image.shape[0] - 1)
    top = (1 - fx) * image[y0, x0] + fx * image[y0, x1]
    bottom = (1 - fx) * image[y1, x0] + fx * image[y1, x1]
    return (1 - fy) * top + fy * bottom


def inside(w, rig, half):
    """Whether every sample of the warped window and its four neighbours lie in the right image."""
    if not np.isfinite(w[:2]).all():
        return False
    x, y = warped_window(w, half)
    width, height = rig.right.width, rig.right.height
    return bool(x.min() >= 0 and y.min() >= 0 and x.max() < width - 1 and y.max() < height - 1)


def difference(pair, u, v, w, half):
    """Denominator of eq. (1), as the mean over window and colours."""
    i, j = window(half)
    left = pair.left[v + j, u + i].astype(float)
    return float(((left - bilinear(pair.right.astype(float), *warped_window(w, half))) ** 2).mean())


def sobel(image):
    """gx, gy of Sobel's 3x3 kernels, the border repeated."""
    p = np.pad(image.astype(float), ((1, 1), (1, 1), (0, 0)), mode="edge")
    across, down = p[:, 2:] - p[:, :-2], p[2:] - p[:-2]
    gx = across[:-2] + 2 * across[1:-1] + across[2:]
    gy = down[:, :-2] + 2 * down[:, 1:-1] + down[:, 2:]
    return gx / 8.0, gy / 8.0  # levels per pixel: a ramp of 1 level/px has gradient 1


@few
@given(rigs, fly)
def test_warp_is_the_projection_of_the_flys_plane_and_its_derivative(rig, fly):
    u, v, q, qu, qv = fly
    views = prepare(random_pair(rig, 0), "paper")
    ur, vr, a, b, c, d = warp(u, v, q, qu, qv, views.to_right, views.shift)
    np.testing.assert_allclose((ur, vr), right_pixel(rig, u, v, q), atol=1e-9)
    step = 1e-4
    for (i, j), (x, y) in {(step, 0): (a, c), (0, step): (b, d)}.items():
        ahead = right_pixel(rig, u + i, v + j, q + qu * i + qv * j)
        behind = right_pixel(rig, u - i, v - j, q - qu * i - qv * j)
        np.testing.assert_allclose((x, y), (ahead - behind) / (2 * step), atol=1e-5)


def test_warp_has_no_pixel_behind_the_right_camera():
    rig = StereoRig(left=LENS, right=LENS, T_right_left=se3(np.eye(3), (0.0, 0.0, -1.0)))  # 1 m ahead
    views = prepare(random_pair(rig, 0), "paper")
    w = warp(23, 20, 2.0, 0.0, 0.0, views.to_right, views.shift)  # a fly at 0.5 m
    assert math.isnan(w[0]) and math.isnan(w[1])
    assert not visible(w, WIDTH, HEIGHT, 3)


@few
@given(rigs, fly, halves)
def test_visible_means_that_every_sample_has_its_neighbours(rig, fly, half):
    views = prepare(random_pair(rig, 0), "paper")
    w = warp(*fly, views.to_right, views.shift)
    assert visible(w, rig.right.width, rig.right.height, half) == inside(w, rig, half)


@few
@given(rigs, fly, halves, seeds)
def test_the_mean_squared_difference_is_that_of_a_bilinear_warped_window(rig, fly, half, seed):
    pair = random_pair(rig, seed)
    views = prepare(pair, "paper")
    u, v, *_ = fly
    w = warp(*fly, views.to_right, views.shift)
    if not inside(w, rig, half):
        return
    expected = difference(pair, u, v, w, half)
    assert mean_squared_difference(pair.left, pair.right, u, v, w, half, np.inf) == pytest.approx(expected, rel=1e-4)
    # Given up early, it is only promised to be above the limit.
    assert mean_squared_difference(pair.left, pair.right, u, v, w, half, 0.5 * expected) > 0.5 * expected
    above = mean_squared_difference(pair.left, pair.right, u, v, w, half, 1.01 * expected)
    assert above == pytest.approx(expected, rel=1e-4)


@few
@given(rigs, seeds)
def test_paper_gradients_are_sobels_norm(rig, seed):
    pair = random_pair(rig, seed)
    views = prepare(pair, "paper")
    for image, gradient in ((pair.left, views.gradient_left), (pair.right, views.gradient_right)):
        gx, gy = sobel(image)
        np.testing.assert_allclose(gradient, np.sqrt((gx**2 + gy**2).mean(axis=2)), rtol=1e-4, atol=1e-4)


@few
@given(rigs, seeds)
def test_epipolar_gradients_are_sobels_part_along_the_line_to_the_epipole(rig, seed):
    pair = random_pair(rig, seed)
    views = prepare(pair, "epipolar")
    R, t = rig.T_right_left[:3, :3], rig.T_right_left[:3, 3]
    cases = (
        (pair.left, views.gradient_left, rig.left.K @ (-R.T @ t)),
        (pair.right, views.gradient_right, rig.right.K @ t),
    )
    for image, gradient, epipole in cases:
        v, u = np.mgrid[: image.shape[0], : image.shape[1]]
        # The epipolar line through a pixel joins it to the epipole, also one at infinity.
        line = np.cross(np.stack([u, v, np.ones_like(u)], axis=-1), epipole)
        along = np.stack([-line[..., 1], line[..., 0]], axis=-1)
        length = np.linalg.norm(along, axis=-1, keepdims=True)
        along = along / np.maximum(length, 1e-12)
        gx, gy = sobel(image)
        part = gx * along[..., :1] + gy * along[..., 1:]
        defined = length[..., 0] > 1e-6 * np.linalg.norm(epipole)
        expected = np.sqrt((part**2).mean(axis=2))
        np.testing.assert_allclose(gradient[defined], expected[defined], rtol=1e-4, atol=1e-3)


def test_a_ramp_of_one_level_a_pixel_has_gradient_one():
    image = np.broadcast_to(np.arange(WIDTH, dtype=np.uint8)[None, :, None], (HEIGHT, WIDTH, 3))
    pair = ImagePair(left=image, right=image, rig=StereoRig.parallel(LENS, 0.1))
    for fitness in ("paper", "epipolar"):
        np.testing.assert_allclose(prepare(pair, fitness).gradient_left[:, 1:-1], 1.0)


@few
@given(rigs, fly, halves, seeds, st.sampled_from(["paper", "epipolar"]))
def test_fitness_is_equation_1(rig, fly, half, seed, form):
    pair = random_pair(rig, seed)
    views = prepare(pair, form)
    u, v, *_ = fly
    w = warp(*fly, views.to_right, views.shift)
    if not inside(w, rig, half):
        return
    ur, vr = math.floor(w[0] + 0.5), math.floor(w[1] + 0.5)
    gradients = float(views.gradient_left[v, u]) * float(views.gradient_right[vr, ur])
    expected = gradients / (difference(pair, u, v, w, half) + NOISE)
    found = fitness_of(pair.left, pair.right, views.gradient_left, views.gradient_right, u, v, w, half)
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-6)


@few
@given(fly, halves, seeds)
def test_the_fast_path_of_a_rectified_pair_is_the_general_one(fly, half, seed):
    """The same pair with its rows a billionth of a pixel off has to interpolate in both directions."""
    rig = StereoRig.parallel(LENS, 0.1)
    pair = random_pair(rig, seed)
    u, v, q, qu, qv = fly
    views = prepare(pair, "epipolar")
    w = (u - 4.5 * q, float(v), 1.0 + qu, qv, 0.0, 1.0)
    general = (w[0], v + 1e-9, *w[2:])
    if not inside(general, rig, half):
        return
    values = [
        fitness_of(pair.left, pair.right, views.gradient_left, views.gradient_right, u, v, each, half)
        for each in (w, general)
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-4)


@few
@given(rigs, fly, st.integers(2, 4), seeds, st.booleans())
def test_a_step_of_the_descent_is_the_least_squares_step(rig, fly, half, seed, slanted):
    pair = random_pair(rig, seed, smooth=True)
    views = prepare(pair, "epipolar")
    u, v, q, qu, qv = fly
    w = warp(*fly, views.to_right, views.shift)
    if not inside(w, rig, half + 1):
        return
    left, right = views.grey_left.astype(float), views.grey_right.astype(float)
    i, j = window(half)
    x, y = warped_window(w, half)
    gx, gy = np.zeros_like(right), np.zeros_like(right)
    gx[:, 1:-1], gy[1:-1] = (right[:, 2:] - right[:, :-2]) / 2, (right[2:] - right[:-2]) / 2
    gx[:, 0], gx[:, -1] = (right[:, 1] - right[:, 0]) / 2, (right[:, -1] - right[:, -2]) / 2
    gy[0], gy[-1] = (right[1] - right[0]) / 2, (right[-1] - right[-2]) / 2
    lx = (left[v + j, u + i + 1] - left[v + j, u + i - 1]) / 2
    ly = (left[v + j + 1, u + i] - left[v + j - 1, u + i]) / 2
    moved = np.subtract(warp(u, v, 1.01 * q, qu, qv, views.to_right, views.shift)[:2], w[:2]) / (0.01 * q)
    speed = np.hypot(*moved)
    nu, nv = moved / speed
    # Slopes are interpolated along their own axis alone; across it the pixel before stands in.
    slope = ((bilinear(gx, x, np.floor(y)) + lx) * nu + (bilinear(gy, np.floor(x), y) + ly) * nv) / 2
    e = left[v + j, u + i] - bilinear(right, x, y)
    columns = [slope, slope * i, slope * j] if slanted else [slope]
    A = np.stack([column.ravel() for column in columns], axis=1)
    normal = A.T @ A
    if normal[0, 0] < 100.0:
        return  # nothing to see in this window
    if slanted:
        normal[[1, 2], [1, 2]] += SLOPE_DAMPING * normal[0, 0] * half**2
    step = np.zeros(3)
    step[: len(columns)] = np.linalg.solve(normal, A.T @ e.ravel())
    reach = max(abs(step[0]), half * abs(step[1]), half * abs(step[2]))
    step *= min(1.0, 1.5 / max(reach, 1e-12)) / speed
    q_near, q_far = q + 10.0, q / 100.0
    if not q_far <= q + step[0] <= q_near:
        return
    found = descend(
        views.grey_left, views.grey_right, u, v, q, qu, qv, views.to_right, views.shift, half, q_near, q_far, slanted, 1
    )
    np.testing.assert_allclose((np.array(found) - (q, qu, qv)) * speed, step * speed, atol=2e-3)  # [px]


@few
@given(seeds, st.integers(2, 4), st.integers(6, WIDTH - 7), st.integers(6, HEIGHT - 7))
def test_gradient_energy_is_of_the_window_and_of_its_emptiest_half(seed, half, u, v):
    gradient = np.random.default_rng(seed).uniform(0, 50, (HEIGHT, WIDTH)).astype(np.float32)
    i, j = window(half)
    e = gradient[v + j, u + i].astype(float) ** 2
    emptiest = min(e[i < -1].mean(), e[i > 1].mean(), e[j < -1].mean(), e[j > 1].mean())
    np.testing.assert_allclose(gradient_energy(gradient, u, v, half), (e.mean(), emptiest), rtol=1e-4)


def test_a_window_of_three_pixels_has_halves_too():
    gradient = np.full((HEIGHT, WIDTH), 5.0, np.float32)
    np.testing.assert_allclose(gradient_energy(gradient, 20, 20, 1), (25.0, 25.0))


@few
@given(rigs, fly, seeds, st.floats(0.5, 1.5))
def test_a_rival_is_another_place_on_the_epipolar_line_that_differs_less(rig, fly, seed, factor):
    pair = random_pair(rig, seed)
    views = prepare(pair, "epipolar")
    u, v, q, qu, qv = fly
    half, q_near, q_far, gain = 2, 2.5, 0.2, disparity_per_inverse_depth(rig)
    differences = []
    steps = math.ceil((q_near - q_far) * gain) + 1
    for there in np.linspace(q_far, q_near, steps):
        w = warp(u, v, there, qu, qv, views.to_right, views.shift)
        if abs(there - q) * gain >= 2.5 and inside(w, rig, half):
            differences.append(difference(pair, u, v, w, half))
    limit = factor * min(differences) if differences else 1e9
    expected = bool(differences) and factor > 1.0
    if differences and abs(factor - 1.0) < 1e-3:
        return
    found = has_rival(
        pair.left, pair.right, views.grey_left, views.grey_right, u, v, q, qu, qv, views.to_right, views.shift, half,
        q_near, q_far, gain, limit, 0.0,
    )  # fmt: skip
    assert found == expected


@few
@given(seeds, st.integers(1, 200), st.integers(1, 40), st.sampled_from([0.0, 1.0, 2.0]))
def test_sharing_divides_by_the_rank_in_the_cell(seed, n, cell, strength):
    rng = np.random.default_rng(seed)
    pixels = np.stack([rng.integers(0, WIDTH, n), rng.integers(0, HEIGHT, n)], axis=1).astype(np.int32)
    fitness = rng.choice([-1.0, 0.0, 0.5, 2.0, 7.0, 300.0], n).astype(np.float32)
    enough = 3.0
    shared = shared_fitness(pixels, fitness, cell, WIDTH, strength, enough)
    seen: dict[tuple[int, int], int] = {}
    for slot in sorted(range(n), key=lambda k: -fitness[k]):  # stable: equal ones by slot
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
    slots = np.sort(rng.permutation(2 * n)[:n]).astype(np.int64)
    expected = [slot for slot in sorted(slots, key=lambda k: -shared[k]) if shared[slot] >= 0.0][:count]
    assert select(shared, slots, count).tolist() == expected
