"""The genetic operators, child by child: numbers drawn, places taken, shares of the slots."""

import numpy as np
import pytest
from rules import rules
from scipy.integrate import quad
from scipy.stats import chisquare, kstest, norm

from flysim.compute.randomness import gaussian, stream, uniform
from flysim.flies.fitness import plugged as measure
from flysim.flies.generation import BLOCK, Draws, Population, Selection, Workspace, generation
from flysim.flies.operators import CROSSOVER, IMMIGRATION, MUTATION, child, plugged
from flysim.flies.regions import rectangles, split
from flysim.flies.state import FLY, REGION
from flysim.flies.threads import limited, share
from flysim.stereo.views import prepare
from flysim.stereo.windows import warp

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
    draws = np.array([gaussian(np.uint64(stream(np.uint64(5), 0, slot)), 3, 0) for slot in range(5000)])
    assert np.isfinite(draws).all()
    assert kstest(draws, "norm").pvalue > 1e-3


def test_heavy_tails_are_those_of_the_slash_distribution():
    draws = np.array([gaussian(np.uint64(stream(np.uint64(5), 0, slot)), 3, 1) for slot in range(8000)])
    assert kstest(draws[np.abs(draws) < 8.0], truncated_slash).pvalue > 1e-3
    assert 0.02 < np.mean(np.abs(draws) > 8.0) < 0.12 and np.abs(draws).max() < 16.0 * 6.0


def truncated_slash(x):
    """Distribution function within +-8 of a normal over a uniform one that is 1/16 at least."""

    def cdf(y):
        return quad(lambda u: norm.cdf(y * max(u, 1.0 / 16.0)), 0.0, 1.0, points=[1.0 / 16.0])[0]

    grid = np.linspace(-8.0, 8.0, 161)
    values = np.array([cdf(y) for y in grid])
    return np.interp(x, grid, (values - values[0]) / (values[-1] - values[0]))


EQ1 = measure("epipolar")
OPERATORS = plugged("crossover", "interpolate"), plugged("mutation", "image")


class Brood:
    """Children of given parents, `n` of a kind."""

    def __init__(
        self,
        stage,
        *,
        regions=1,
        metric=False,
        mutation=5.0,
        mutation_disparity=1.0,
        slant=0.0,
        beyond=0.0,
        heavy=0,
        contest=0,
    ):
        self.views = prepare(stage.ramp(stage.RIG))
        self.gain = float(self.views.record.gain[0])
        self.rects = rectangles(200, 150, regions)
        self.rules = rules(
            norm=1, half=HALF, q_near=Q_NEAR, q_far=Q_FAR, beyond=beyond, contest=contest, metric=metric, heavy=heavy,
            mutation=mutation, mutation_q=mutation_disparity / self.gain, mutation_slope=0.1 * slant / self.gain,
            steepest=slant / self.gain, polish=0, promising=1.0, sharp=1.0,
        )  # fmt: skip

    def __call__(self, kind, n, pixels=(), genes=(), *, region=0, seed=1, fitness=()):
        """`[n, 5]` u, v, q, qu, qv; the parents' genes are (q, qu, qv), or q alone."""
        pixels = np.array(pixels, np.int32).reshape(-1, 2)
        given = np.array(genes, np.float32).reshape(len(pixels), -1) if len(pixels) else np.empty((0, 3))
        flies = np.zeros(len(pixels), FLY).view(np.recarray)
        flies["u"], flies["v"] = pixels.T
        for name, values in zip(("q", "qu", "qv"), given.T, strict=False):
            flies[name] = values
        flies["fitness"] = fitness or 0.0
        parents = np.arange(len(pixels), dtype=np.int32)
        regions = self.regions()
        regions["kept"] = len(pixels)
        born = []
        for slot in range(n):
            state = np.uint64(stream(np.uint64(seed), 0, slot))
            views, rules = self.views.record[0], self.rules[0]
            *genes, w = child(views, rules, *OPERATORS, regions[region], kind, parents, flies, state)
            assert w == warp(views, *genes)
            born.append(genes)
        return np.array(born)

    def regions(self):
        regions = np.zeros(len(self.rects), REGION).view(np.recarray)
        for name, values in zip(("u0", "u1", "v0", "v1"), self.rects.T, strict=True):
            regions[name] = values
        return regions


@pytest.mark.parametrize("region", range(4))
def test_immigrants_lie_in_their_region_in_the_depths_and_in_view(stage, region):
    born = Brood(stage, regions=4)(IMMIGRATION, 2000, region=region)
    u0, u1, v0, v1 = rectangles(200, 150, 4)[region]
    assert (born[:, 0] >= max(u0, HALF)).all() and (born[:, 0] < min(u1, 200 - HALF)).all()
    assert (born[:, 1] >= max(v0, HALF)).all() and (born[:, 1] < min(v1, 150 - HALF)).all()
    assert (born[:, 2] >= Q_FAR).all() and (born[:, 2] <= Q_NEAR).all()
    right = born[:, 0] - 180.0 * 0.12 * born[:, 2]
    assert (right - HALF >= -1e-9).all()


def test_immigrants_lean_every_way(stage):
    brood = Brood(stage, slant=0.8)
    slopes = brood(IMMIGRATION, 3000)[:, 3:] * brood.gain  # [px/px]
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


@pytest.mark.parametrize("kind", [MUTATION, CROSSOVER])
def test_in_a_tournament_the_fitter_of_two_is_a_parent(stage, kind):
    pixels = [(40 + 20 * k, 75) for k in range(6)]
    brood = Brood(stage, mutation=1e-6, mutation_disparity=0.0, contest=1)
    born = brood(kind, 3000, pixels, np.full(6, 0.5), fitness=[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    if kind == MUTATION:
        parent = np.round((born[:, 0] - 40) / 20).astype(int)
        # Of the 36 pairs the k-th of six is the fitter in 2 k - 1.
        assert chisquare(np.bincount(parent, minlength=6), 3000 / 36 * np.arange(1, 12, 2)).pvalue > 1e-3
    else:  # the middle of two such parents
        assert born[:, 0].mean() == pytest.approx(40 + 20 * (161 / 36 - 1), abs=2.0)


def test_image_mutation_is_gaussian_in_pixels_and_disparity(stage):
    born = Brood(stage, mutation=6.0, mutation_disparity=1.5)(MUTATION, 4000, [(110, 75)], [0.8])
    disparity = (born[:, 2] - 0.8) * 180.0 * 0.12
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


def test_a_quarter_of_mutations_folds_onto_a_face_with_another_slant(stage):
    """The others keep to their parent's, but for a tenth of the steepest."""
    brood = Brood(stage, mutation=1e-6, mutation_disparity=0.0, slant=0.5)
    parent = np.array([0.21, -0.13]) / brood.gain
    slopes = brood(MUTATION, 6000, [(110, 75)], [(0.8, *parent)])[:, 3:] * brood.gain
    folds = (slopes == 0.0).any(axis=1)  # every face of those leans one way at most
    assert folds.mean() == pytest.approx(0.25, abs=0.018)
    assert (slopes[folds] == 0.0).all(axis=1).mean() == pytest.approx(1.0 / 3.0, abs=0.04)
    changes = (slopes[~folds] - parent * brood.gain) / 0.05
    assert changes.std() == pytest.approx(1.0, rel=0.04) and abs(changes.mean()) < 0.05
    assert kstest(changes.ravel(), "norm").pvalue > 1e-3


def test_a_fold_is_half_way_between_its_parent_and_the_child(stage):
    brood = Brood(stage, mutation=4.0, mutation_disparity=0.0, slant=0.5)
    u0, v0, q0, qu0, qv0 = 110, 75, 0.8, 0.2 / brood.gain, -0.1 / brood.gain
    u, v, q, qu, qv = brood(MUTATION, 500, [(u0, v0)], [(q0, qu0, qv0)]).T
    half_way = q0 + (qu0 + qu) / 2.0 * (u - u0) + (qv0 + qv) / 2.0 * (v - v0)
    # But for the rounding of the pixel, by half a one on either axis.
    assert (np.abs(q - half_way) <= 0.25 * (np.abs(qu0 + qu) + np.abs(qv0 + qv)) + 1e-6).all()


def test_a_pixel_beyond_the_window_is_left_free(stage):
    born = Brood(stage)(IMMIGRATION, 6000)
    assert (born[:, 0].max(), born[:, 1].min(), born[:, 1].max()) == (200 - HALF - 2, HALF + 1, 150 - HALF - 2)
    assert born[:, 0].min() >= HALF + 1 + round(180.0 * 0.12 * Q_FAR)  # or the right view does not hold it


def test_a_child_that_cannot_be_placed_becomes_an_immigrant(stage):
    # Parents in another region: none of their crossings lies in the child's.
    brood = Brood(stage, regions=2)
    born = brood(CROSSOVER, 300, [(20, 20), (30, 120)], [0.5, 0.5], region=1)
    assert (born[:, 0] >= 100).all()
    assert born[:, 0].std() > 15.0 and born[:, 2].std() > 0.2
    # No parents at all: likewise.
    assert (brood(MUTATION, 50, region=1)[:, 0] >= 100).all()


def test_extrapolating_crossover_reaches_half_their_distance_beyond_the_parents(stage):
    pixels, z = [(90, 70), (110, 80)], np.array([1.5, 2.0])
    born = Brood(stage, beyond=0.5)(CROSSOVER, 3000, pixels, 1.0 / z)
    share = (2.0 - 1.0 / born[:, 2]) / 0.5
    two = (np.abs(share) > 1e-3) & (np.abs(share - 1.0) > 1e-3)  # the same parent twice stays where it is
    assert share.min() < -0.45 and share.max() > 1.45
    assert kstest(share[two], "uniform", args=(-0.5, 2.0)).pvalue > 1e-3


@pytest.mark.parametrize("operators", ["A", "B", "C", (0.37, 0.21, 0.11, 0.31), (0.5, 0.5, 0.0, 0.0)])
@pytest.mark.parametrize("regions", [1, 2, 4])
@pytest.mark.parametrize("lanes", [1, 3])
def test_the_slots_of_every_region_are_bred_by_exactly_their_shares(stage, operators, regions, lanes):
    """Two parents a region and mutations too small to see: whose child a slot is can be told from where it lies."""
    shares = {"A": (0.4, 0.1, 0.4, 0.1), "B": (0.5, 0.2, 0.2, 0.1), "C": (0.4, 0.2, 0.2, 0.2)}
    shares = np.array(shares[operators] if isinstance(operators, str) else operators)
    brood = Brood(stage, regions=regions, mutation=1e-6, mutation_disparity=0.0)
    quotas = np.array([403, 97, 250, 311][:regions])
    counts = np.array([split(int(quota), shares) for quota in quotas])
    starts = np.concatenate([[0], np.cumsum(quotas)])
    n = int(starts[-1])
    spots = np.array([((r[0] + r[1]) // 2 + d, (r[2] + r[3]) // 2 + d) for r in brood.rects for d in (-9, 9)], np.int32)
    flies, out, state = np.zeros(2 * regions, FLY), np.zeros(n, FLY), brood.regions().view(np.ndarray)
    flies["u"], flies["v"], flies["q"], flies["age"], out["age"] = *spots.T, np.tile([0.4, 0.9], regions), 5, -1
    state["first"], state["last"], state["places"] = starts[:-1], starts[1:], counts[:, 0]
    state["crossed"], state["mutated"], state["kept"] = counts[:, 1], counts[:, 2], 2
    # The old generation's two parents stand where the new one's will begin.
    state["parents"] = np.cumsum(counts[:, 0]) - counts[:, 0]
    parents = np.zeros(counts[:, 0].sum(), np.int32)
    parents[state["parents"]], parents[state["parents"] + 1] = (
        np.arange(0, 2 * regions, 2),
        np.arange(1, 2 * regions, 2),
    )
    todo = np.concatenate([[0], -(-quotas // BLOCK)])
    with limited(lanes):
        share(
            generation, todo, brood.views.record, brood.rules, EQ1, *OPERATORS, Draws(np.uint64(3), 1),
            Population(state, parents, flies, out), Selection(16, np.ones(n, np.float32), 3.0, 2.0),
            Workspace(np.empty(n, np.uint64), np.empty(n, np.int32), np.empty((regions, 200), np.int32)),
        )  # fmt: skip
    assert (todo[1:] == 0).all()
    assert (state["kept"] == np.minimum(counts[:, 0], (out["fitness"] >= 0.0).sum())).all()
    pixels, age = np.stack([out["u"], out["v"]], axis=1), out["age"]
    for r in range(regions):
        _, crossed, mutated, _ = counts[r]
        here = slice(starts[r], starts[r + 1])
        place, ages = pixels[here], age[here]
        same = (place[:, None] == spots[2 * r : 2 * r + 2]).all(axis=2).any(axis=1)
        assert ages.tolist() == [6, 6] + [0] * (quotas[r] - 2)  # of what may be preserved there were only two
        ends = 2, 2 + crossed, 2 + crossed + mutated
        assert same[: ends[0]].all() and same[ends[1] : ends[2]].all()
        across = np.diff(place - spots[2 * r], axis=1)[:, 0]  # off the diagonal between the two
        assert (np.abs(across[ends[0] : ends[1]]) <= 1).all()
        immigrants = same[ends[2] :]
        assert len(immigrants) == quotas[r] - ends[2] and immigrants.mean() < 0.05
        assert (np.abs(across[ends[2] :]) > 1).mean() > 0.8
