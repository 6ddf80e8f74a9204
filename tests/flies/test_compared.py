"""What flies compare: derivatives or levels, and that it makes them blind to how each eye was exposed."""

import numpy as np
import pytest

import flysim as fs
from flysim.flies.compared import Compared, compare, levels
from flysim.flies.evolution import evolve
from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.views import prepare

PARAMS = {"population": 1000, "min_depth": 0.6, "max_depth": 4.0}


def changed(pair, *, left=None, right=None):
    """The pair with one or both eyes' levels changed by a function of floats."""

    def made(image, change):
        return image if change is None else np.rint(np.clip(change(image.astype(float)), 0.0, 255.0)).astype(np.uint8)

    return ImagePair(left=made(pair.left, left), right=made(pair.right, right), rig=pair.rig)


def vignetted(levels):
    v, u = np.indices(levels.shape[:2])
    x, y = u / levels.shape[1] * 2.0 - 1.0, v / levels.shape[0] * 2.0 - 1.0
    return levels * (1.0 - 0.15 * (x * x + y * y))[..., None]  # 30 % in the corners


EXPOSED = {
    "gain 0.8": lambda levels: 0.8 * levels,
    "gain 1.2": lambda levels: 1.2 * levels,
    "offset +20": lambda levels: levels + 20.0,
    "offset -20": lambda levels: levels - 20.0,
    "gamma 0.8": lambda levels: 255.0 * (levels / 255.0) ** 0.8,
    "gamma 1.25": lambda levels: 255.0 * (levels / 255.0) ** 1.25,
    "vignetting": vignetted,
}


@pytest.fixture(scope="module")
def dim(stage, step):
    """A finely textured wall before another, with room above and below for levels that are changed."""
    pair = stage.photograph(stage.RIG, step.planes, wavelength=0.05)
    return changed(pair, left=lambda x: 40.0 + 0.6 * x, right=lambda x: 40.0 + 0.6 * x)


@pytest.fixture(scope="module")
def unchanged(dim):
    return fs.evolve(dim, fs.FlyParams(**PARAMS), rng=np.random.default_rng(1))


def within(stage, step, swarm, px):
    """The share of flies that are off by less, of those whose surface both eyes see."""
    error = stage.disparity_error(swarm, stage.RIG, step.planes)
    return np.mean(error[np.isfinite(error)] < px)


@pytest.mark.parametrize("eye", ["left", "right"])
@pytest.mark.parametrize("name", EXPOSED)
def test_an_eye_that_is_exposed_otherwise_costs_few_flies_and_no_accuracy(stage, step, dim, unchanged, name, eye):
    pair = changed(dim, **{eye: EXPOSED[name]})
    swarm = fs.evolve(pair, fs.FlyParams(**PARAMS), rng=np.random.default_rng(1))
    assert len(swarm.points) >= 0.8 * len(unchanged.points)
    for px, fewer in ((0.5, 0.05), (1.0, 0.02)):
        assert within(stage, step, swarm, px) >= within(stage, step, unchanged, px) - fewer


def test_levels_alone_do_not_bear_that(dim):
    """If they did, the tests above would show nothing."""
    raw = fs.FlyParams(**PARAMS, prefilter="none")
    before, after = (
        len(fs.evolve(pair, raw, rng=np.random.default_rng(1)).points)
        for pair in (dim, changed(dim, right=EXPOSED["gain 0.8"]))
    )
    assert after < 0.5 * before


@pytest.mark.parametrize(
    "params", [{"prefilter": "none"}, {"fitness": "paper"}, {"fitness": "paper", "prefilter": "none"}]
)
def test_who_asks_for_levels_or_for_the_printed_measure_gets_the_pictures_as_they_are(facing, params):
    pair, params = facing.pair, fs.FlyParams(**PARAMS, **params)
    compared = compare(pair, params)
    assert compared.blur == compared.noise == 0.0
    for name in ("left", "right", "grey_left", "grey_right"):
        assert np.array_equal(getattr(compared.views, name), getattr(prepare(pair), name))
    swarm = evolve(pair, params, rng=np.random.default_rng(1))
    plain = evolve(pair, params, rng=np.random.default_rng(1), compared=Compared(views=prepare(pair)))
    assert len(swarm.points) > 50
    assert np.array_equal(swarm.points, plain.points) and np.array_equal(swarm.uv_right, plain.uv_right)


def test_a_pair_whose_rows_do_not_meet_is_taken_as_it_is(stage, facing):
    rig = StereoRig(left=stage.CAMERA, right=stage.CAMERA, T_right_left=pose6(-0.12, 0.0, 0.0, 0.0, 0.0, 0.01))
    pair = ImagePair(left=facing.pair.left, right=facing.pair.right, rig=rig)
    assert np.array_equal(compare(pair, fs.FlyParams()).views.left, pair.left)


def test_smoothing_is_what_was_asked_for_or_what_noise_asks_for(stage, facing):
    clean, params = compare(facing.pair, fs.FlyParams()), fs.FlyParams(blur_px=1.7)
    assert clean.blur == 1.0 and clean.noise < 1.0
    assert compare(facing.pair, params).blur == 1.7
    assert compare(facing.pair, params, blur=2.5).blur == 2.5
    noisy = compare(stage.photograph(stage.RIG, facing.planes, noise=8.0), fs.FlyParams())
    assert noisy.noise == pytest.approx(8.0, rel=0.15) and noisy.blur > 1.1


def test_what_was_compared_stays_what_it_is_while_others_are(stage, facing, step):
    kept = compare(facing.pair, fs.FlyParams())
    views = kept.views
    held = (views.left, views.right, views.grey_left, views.grey_right)
    before = [image.copy() for image in held]
    first = evolve(facing.pair, fs.FlyParams(**PARAMS), rng=np.random.default_rng(3), compared=kept)
    for seed in range(4):
        evolve(step.pair, fs.FlyParams(**PARAMS), rng=np.random.default_rng(seed))
    assert all(np.array_equal(one, other) for one, other in zip(before, held, strict=True))
    again = evolve(facing.pair, fs.FlyParams(**PARAMS), rng=np.random.default_rng(3), compared=kept)
    assert np.array_equal(first.points, again.points)


def on_the_wall(facing, count=150):
    rng = np.random.default_rng(0)
    pixels = np.stack([rng.integers(30, 190, count), rng.integers(10, 140, count)], axis=1).astype(np.int32)
    return pixels, np.tile([1.0 / 1.5, 0.0, 0.0], (count, 1))


def test_levels_are_compared_at_the_end_where_both_eyes_can_be_made_alike(stage, facing):
    pixels, genes = on_the_wall(facing)
    compared = compare(facing.pair, fs.FlyParams())
    same = levels(facing.pair, compared, pixels, genes)
    assert same is not None and np.array_equal(same.left, facing.pair.left)
    assert np.array_equal(same.right, facing.pair.right)
    darker = changed(facing.pair, right=lambda x: 0.8 * x + 6.0)
    made = levels(darker, compare(darker, fs.FlyParams()), pixels, genes)
    assert made is not None
    assert np.median(np.abs(made.right.astype(float) - facing.pair.right)) < 1.5
    # Where nothing matches, where noise is smoothed away, and where there are no flies, derivatives have the last word.
    other = ImagePair(left=facing.pair.left, right=facing.pair.right[::-1].copy(), rig=facing.pair.rig)
    assert levels(other, compare(other, fs.FlyParams()), pixels, genes) is None
    assert levels(facing.pair, compare(facing.pair, fs.FlyParams(blur_px=2.0)), pixels, genes) is None
    assert levels(facing.pair, compared, pixels[:0], genes[:0]) is None
    assert levels(facing.pair, compare(facing.pair, fs.FlyParams(prefilter="none")), pixels, genes) is None


def test_levels_place_flies_more_exactly_than_derivatives_alone(stage):
    """On a slanted wall, which stretches derivatives."""
    planes = [stage.Plane((0.75, 0.0, 1.0), 1.5)]
    pair = stage.photograph(stage.RIG, planes)
    medians = {}
    for blur in (1.0, 1.001):  # with any more smoothing than the least, levels are not asked
        swarm = evolve(pair, fs.FlyParams(**PARAMS, blur_px=blur), rng=np.random.default_rng(1))
        medians[blur] = np.nanmedian(stage.disparity_error(swarm, stage.RIG, planes))
    assert medians[1.0] < 0.8 * medians[1.001]
