"""The genetic operators, child by child: numbers drawn, places taken, shares of the slots."""

import inspect

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

import flysim.flies.evolution as evolution
from flysim.flies.operators import CROSSOVER, IMMIGRATION, MUTATION, child
from flysim.flies.randomness import gaussian, stream, uniform
from flysim.flies.regions import equal_quotas, rectangles, split, steered_quotas
from flysim.flies.views import disparity_per_inverse_depth, prepare

Q_NEAR, Q_FAR = 1.0 / 0.6, 1.0 / 4.0
HALF = 3


def test_the_numbers_are_those_of_splitmix64():
    # The published sequence of seed 1234567.
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431]
    drawn = [uniform(np.uint64(1234567), draw) for draw in range(4)]
    assert drawn == [(number >> 11) * 2.0**-53 for number in published]


def test_draws_of_slots_generations_and_seeds_are_independent():
    def first_draws(seeds, generations, slots):
        return np.array(
            [
                uniform(np.uint64(stream(np.uint64(s), g, i)), 0)
                for s in range(seeds)
                for g in range(generations)
                for i in range(slots)
            ]
        )

    draws = first_draws(4, 10, 500)
    assert len(set(draws)) == len(draws)
    assert kstest(draws, "uniform").pvalue > 1e-3
    by_slot = draws.reshape(-1, 500)
    assert np.abs(np.corrcoef(by_slot)[np.triu_indices(40, 1)]).max() < 0.25
    assert np.abs(np.corrcoef(by_slot[:, :-1].ravel(), by_slot[:, 1:].ravel())[0, 1]) < 0.03


def test_gaussians_are_normal():
    draws = np.array([gaussian(np.uint64(stream(np.uint64(5), 0, slot)), 3) for slot in range(5000)])
    assert np.isfinite(draws).all()
    assert kstest(draws, "norm").pvalue > 1e-3


class Brood:
    """Children of given parents, `n` of a kind."""

    def __init__(self, stage, *, regions=1, metric=False, mutation=5.0, mutation_disparity=1.0, slant=0.0):
        self.rig = stage.RIG
        self.views = prepare(stage.ramp(stage.RIG), "paper")
        self.gain = disparity_per_inverse_depth(stage.RIG)
        self.rects = rectangles(200, 150, regions)
        self.how = (metric, float(mutation), mutation_disparity, slant)

    def __call__(self, kind, n, pixels=(), genes=(), *, region=0, seed=1):
        """`[n, 5]` u, v, q, qu, qv; the parents' genes are (q, qu, qv), or q alone."""
        pixels = np.array(pixels, np.int32).reshape(-1, 2)
        given = np.array(genes, np.float32).reshape(len(pixels), -1) if len(pixels) else np.empty((0, 3))
        genes = np.zeros((len(pixels), 3), np.float32)
        genes[:, : given.shape[1]] = given
        parents = np.arange(len(pixels), dtype=np.int64)
        born = []
        for slot in range(n):
            state = np.uint64(stream(np.uint64(seed), 0, slot))
            born.append(
                child(
                    state, kind, region, self.rects, parents, 0, len(parents), pixels, genes, self.views.to_right,
                    self.views.shift, HALF, (200, 150), (200, 150), Q_NEAR, Q_FAR, self.gain, self.rig.left.K,
                    *self.how,
                )
            )  # fmt: skip
        return np.array(born)


@pytest.mark.parametrize("region", range(4))
def test_immigrants_lie_in_their_region_in_the_depths_and_in_view(stage, region):
    born = Brood(stage, regions=4)(IMMIGRATION, 2000, region=region)
    u0, u1, v0, v1 = rectangles(200, 150, 4)[region]
    assert (born[:, 0] >= max(u0, HALF)).all() and (born[:, 0] < min(u1, 200 - HALF)).all()
    assert (born[:, 1] >= max(v0, HALF)).all() and (born[:, 1] < min(v1, 150 - HALF)).all()
    assert (born[:, 2] >= Q_FAR).all() and (born[:, 2] <= Q_NEAR).all()
    right = born[:, 0] - disparity_per_inverse_depth(stage.RIG) * born[:, 2]
    assert (right - HALF >= -1e-9).all()


def test_immigrants_lean_every_way(stage):
    gain = disparity_per_inverse_depth(stage.RIG)
    slopes = Brood(stage, slant=0.8)(IMMIGRATION, 3000)[:, 3:] * gain  # [px/px]
    sideways, forth, facing = slopes[:, 0] != 0, slopes[:, 1] != 0, (slopes == 0).all(axis=1)
    # A third each; those whose slant leaves the view face the camera instead.
    assert 0.25 < sideways.mean() < 0.36 and 0.25 < forth.mean() < 0.36 and 0.3 < facing.mean() < 0.5
    assert np.abs(slopes).max() <= 0.8
    assert kstest(slopes[forth, 1] / 0.8, "uniform", args=(-1, 2)).pvalue > 1e-3
    assert (Brood(stage, slant=0.0)(IMMIGRATION, 200)[:, 3:] == 0.0).all()


def test_crossover_lies_on_the_segment_between_two_parents_uniformly(stage):
    pixels, z = [(60, 40), (160, 120)], np.array([1.0, 3.0])
    born = Brood(stage)(CROSSOVER, 4000, pixels, 1.0 / z)
    lens = stage.CAMERA
    F1, F2 = lens.unproject(pixels, z)
    F = lens.unproject(born[:, :2], 1.0 / born[:, 2])
    share = (3.0 - F[:, 2]) / 2.0  # z is linear along the segment
    assert share.min() >= -1e-6 and share.max() <= 1.0 + 1e-6
    on_segment = lens.project(share[:, None] * F1 + (1.0 - share[:, None]) * F2)
    assert np.abs(on_segment - born[:, :2]).max() <= 0.5 + 1e-4  # a left pixel is whole
    two = (share > 1e-6) & (share < 1.0 - 1e-6)
    assert two.mean() == pytest.approx(0.5, abs=0.04)  # both parents are drawn from two: half are one twice
    assert kstest(share[two], "uniform").pvalue > 1e-3


def test_parents_are_drawn_uniformly(stage):
    pixels = [(40 + 20 * k, 75) for k in range(6)]
    born = Brood(stage, mutation=0.5, mutation_disparity=0.0)(MUTATION, 3000, pixels, np.full(6, 0.5))
    parent = np.round((born[:, 0] - 40) / 20).astype(int)
    assert chisquare(np.bincount(parent, minlength=6)).pvalue > 1e-3


def test_image_mutation_is_gaussian_in_pixels_and_disparity(stage):
    born = Brood(stage, mutation=6.0, mutation_disparity=1.5)(MUTATION, 4000, [(110, 75)], [0.8])
    disparity = (born[:, 2] - 0.8) * disparity_per_inverse_depth(stage.RIG)
    assert kstest(disparity / 1.5, "norm").pvalue > 1e-3
    for moved in (born[:, 0] - 110, born[:, 1] - 75):
        # Rounding to whole pixels adds a twelfth to the variance.
        assert moved.std() == pytest.approx(np.sqrt(36 + 1 / 12), rel=0.04)
        assert abs(moved.mean()) < 0.4


def test_metric_mutation_is_gaussian_in_space(stage):
    lens = stage.CAMERA
    born = Brood(stage, metric=True, mutation=0.05)(MUTATION, 4000, [(110, 75)], [1.0 / 2.0])
    parent = lens.unproject([(110, 75)], [2.0])[0]
    moved = lens.unproject(born[:, :2], 1.0 / born[:, 2]) - parent
    assert kstest(moved[:, 2] / 0.05, "norm").pvalue > 1e-3
    pixel = 2.0 / 180.0
    for axis in (0, 1):
        assert moved[:, axis].std() == pytest.approx(np.sqrt(0.05**2 + pixel**2 / 12), rel=0.05)
        assert abs(moved[:, axis].mean()) < 0.004


def test_on_a_slanted_parent_a_mutation_keeps_to_the_parents_plane(stage):
    """Sideways steps follow the slope: most children lie on the parent's plane or on one that folds off it."""
    brood = Brood(stage, mutation=4.0, mutation_disparity=0.0, slant=1.0)
    gain = brood.gain
    born = brood(MUTATION, 1000, [(110, 75)], [(0.8, 0.3 / gain, -0.2 / gain)])
    off = gain * (born[:, 2] - 0.8) - 0.3 * (born[:, 0] - 110) + 0.2 * (born[:, 1] - 75)  # [px] of disparity
    assert np.median(np.abs(off)) < 0.5  # flat children would be about 1 px off


def test_a_child_that_cannot_be_placed_becomes_an_immigrant(stage):
    # Parents in another region: none of their crossings lies in the child's.
    brood = Brood(stage, regions=2)
    born = brood(CROSSOVER, 300, [(20, 20), (30, 120)], [0.5, 0.5], region=1)
    assert (born[:, 0] >= 100).all()
    assert born[:, 0].std() > 15.0 and born[:, 2].std() > 0.2
    # No parents at all: likewise.
    assert (brood(MUTATION, 50, region=1)[:, 0] >= 100).all()


@pytest.mark.parametrize("operators", ["A", "B", "C", (0.37, 0.21, 0.11, 0.31), (0.5, 0.5, 0.0, 0.0)])
@pytest.mark.parametrize("regions", [1, 2, 4])
def test_the_slots_of_every_region_are_bred_by_exactly_their_shares(stage, facing, monkeypatch, operators, regions):
    shares = {"A": (0.4, 0.1, 0.4, 0.1), "B": (0.5, 0.2, 0.2, 0.1), "C": (0.4, 0.2, 0.2, 0.2)}
    shares = np.array(shares[operators] if isinstance(operators, str) else operators)
    breed, layouts = evolution.breed, []
    signature = inspect.signature(breed.py_func)

    def watched(*args):
        bound = signature.bind(*args).arguments
        layouts.append((bound["kinds"].copy(), bound["regions"].copy(), bound["first"]))
        return breed(*args)

    monkeypatch.setattr(evolution, "breed", watched)
    stage.run(facing.pair, population=1003, operators=operators, regions=regions, stop=1.0, max_iterations=4)
    assert len(layouts) == 4
    steered = steered_quotas(1003, facing.pair.left, rectangles(200, 150, regions))
    for generation, (kinds, region, first) in enumerate(layouts):
        assert len(kinds) == len(region) == 1003
        quotas = equal_quotas(1003, regions) if generation == 0 else steered
        assert np.bincount(region, minlength=regions).tolist() == quotas.tolist()
        for r, quota in enumerate(quotas):
            preserved, crossover, mutation, immigration = split(int(quota), shares)
            kept = int((region[:first] == r).sum())
            slots = kinds[first:][region[first:] == r]
            counts = np.bincount(slots, minlength=3)
            if generation:
                # Until a region's selection has filled its new quota, immigrants take what it could not.
                assert kept == preserved or (generation == 1 and kept < preserved)
            assert counts[[CROSSOVER, MUTATION]].tolist() == [crossover, mutation]
            assert counts[IMMIGRATION] == immigration + preserved - kept
