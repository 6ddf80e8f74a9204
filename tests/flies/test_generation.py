"""Breeding and selecting, slot by slot: when a child is polished and what is kept of it, what is told of selection."""

import numpy as np
import pytest
from rules import rules as ruled

from flysim.flies.fitness import OUT_OF_VIEW, evaluate, plugged
from flysim.flies.generation import (
    BLOCK,
    Draws,
    Population,
    Selection,
    Workspace,
    blocks,
    breed,
    generation,
    polished,
    preserve,
)
from flysim.flies.operators import plugged as operator
from flysim.flies.rules import RULES
from flysim.flies.state import FLY, REGION
from flysim.flies.threads import limited, share
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.descent import descend
from flysim.stereo.views import prepare
from flysim.stereo.windows import visible, warp

HALF, DISPARITY_PX = 3, 6
LENS = Camera(width=64, height=48, fx=50.0, fy=50.0, cx=31.5, cy=23.5)
EQ1 = plugged("epipolar")
OPERATORS = operator("crossover", "interpolate"), operator("mutation", "image")
THIRD = np.int64(3)  # rows from one that polishing reads to the next


def rules(**given):
    usual = {"half": HALF, "q_near": 2.5, "q_far": 0.2, "steepest": 0.0, "polish": 1, "promising": 1e-6, "sharp": 1e9}
    return ruled(**{**usual, **given})[0]


@pytest.fixture(scope="module")
def wall():
    """The views of a wall 6 px nearer than the horizon, its texture smooth, with a little noise."""
    rng = np.random.default_rng(11)
    noise = rng.integers(0, 256, (48, 80, 3)).astype(float)
    smooth = sum(np.roll(noise, (dv, du), (0, 1)) for dv in (-1, 0, 1) for du in (-1, 0, 1)) / 9
    left, right = smooth[:, :64], smooth[:, DISPARITY_PX : DISPARITY_PX + 64] + rng.normal(size=(48, 64, 3))
    pair = ImagePair(
        left=left.astype(np.uint8), right=right.clip(0, 255).astype(np.uint8), rig=StereoRig.parallel(LENS, 0.2)
    )
    return prepare(pair)


def children(wall, n=120, far_px=3.0):
    """`[n]` of (u, v, q): pixels, and depths some pixels of disparity off the wall."""
    rng = np.random.default_rng(1)
    gain = float(wall.record.gain[0])
    return [
        (int(u), int(v), float((DISPARITY_PX + off) / gain))
        for u, v, off in zip(
            rng.integers(14, 58, n), rng.integers(5, 42, n), rng.uniform(-far_px, far_px, n), strict=True
        )
    ]


def fitness_of(views, u, v, q, qu=0.0, qv=0.0):
    return evaluate(views, 0, EQ1, u, v, warp(views, u, v, q, qu, qv), HALF, 0.0)


def polish(views, how, u, v, q, needed=0.0):
    return polished(views, how, EQ1, u, v, q, 0.0, 0.0, warp(views, u, v, q, 0.0, 0.0), needed)


def test_polishing_keeps_a_child_that_it_would_make_worse(wall):
    views, how = wall.record[0], rules()
    better = worse = 0
    for u, v, q in children(wall, n=200, far_px=5.5):
        before = fitness_of(views, u, v, q)
        there = descend(views, how, u, v, q, 0.0, 0.0, np.int64(1), THIRD)
        w = warp(views, u, v, *there)
        after = evaluate(views, 0, EQ1, u, v, w, HALF, 0.0) if visible(views, w, HALF) else -1.0
        *genes, fitness = polish(views, how, u, v, q)
        if after > before * (1.0 + 1e-9):
            better += 1
            assert (genes, fitness) == (list(there), pytest.approx(after))
        else:
            worse += there[0] != q
            assert (genes, fitness) == ([q, 0.0, 0.0], pytest.approx(before))
    assert better > 30 and worse > 10


@pytest.mark.parametrize(
    ("limits", "moved"),
    [
        # Of the child's fitness: from so much on it promises, from so much on there is nothing left to polish.
        ((0.99, 9.0), True), ((1.01, 9.0), False), ((0.5, 1.01), True), ((0.5, 0.99), False), ((1.0, 9.0), True),
        ((0.5, 1.0), False),
    ],
)  # fmt: skip
def test_a_child_is_polished_from_promising_on_and_below_sharp(wall, limits, moved):
    views = wall.record[0]
    for u, v, q in children(wall, n=40, far_px=1.0):
        f = fitness_of(views, u, v, q)
        if polish(views, rules(), u, v, q)[0] == q:
            continue  # polishing would not help it
        how = rules(promising=limits[0] * f, sharp=limits[1] * f)
        found = polish(views, how, u, v, q)
        assert (found[0] != q) == moved
        if limits[0] <= 1.0 and not moved:
            assert found[3] == f


def test_a_child_takes_as_many_steps_as_it_is_told_on_every_third_row(wall):
    views = wall.record[0]
    moved = 0
    for u, v, q in children(wall, n=40, far_px=1.5):
        for steps in (1, 2):
            found = polish(views, rules(polish=steps), u, v, q)
            if found[0] != q:
                expected = descend(views, rules(), u, v, q, 0.0, 0.0, np.int64(steps), THIRD)
                assert found[:3] == expected
                moved += expected != descend(views, rules(), u, v, q, 0.0, 0.0, np.int64(3 - steps), THIRD)
    assert moved > 10


def test_what_is_worth_less_than_a_seventh_of_what_promises_counts_for_nothing(wall):
    views = wall.record[0]
    u, v, q = children(wall, n=1)[0]
    f = fitness_of(views, u, v, q)
    assert polish(views, rules(promising=f / 0.16), u, v, q)[3] == f
    assert polish(views, rules(promising=f / 0.14), u, v, q)[3] == 0.0
    # More is needed where the region is full, but never more than what promises to get there by polishing.
    assert polish(views, rules(promising=f / 0.5), u, v, q, needed=0.95 * f)[3] == f
    assert polish(views, rules(promising=f / 0.5), u, v, q, needed=1.05 * f)[3] == 0.0
    assert polish(views, rules(promising=f / 1.05, sharp=0.0), u, v, q, needed=99.0 * f)[3] == f
    # Without polishing what is needed alone counts.
    for needed, found in ((0.0, f), (0.95 * f, f), (1.05 * f, 0.0)):
        assert polish(views, rules(polish=0, promising=99.0 * f), u, v, q, needed=needed)[3] == found


def scratch(n, regions):
    return Workspace(np.empty(n, np.uint64), np.empty(n, np.int32), np.empty((regions, 100), np.int32))


def bred(wall, number, region, parents, flies, out, slot):
    state = np.zeros(1, REGION)
    population = Population(state, np.array(parents, np.int32), flies, out)
    breed(wall.record[0], rules(), EQ1, *OPERATORS, Draws(np.uint64(5), number), region, population, slot)


def region_of(**given):
    record = np.zeros(1, REGION).view(np.recarray)
    for name, value in {"u1": 64, "v1": 48, **given}.items():
        record[name] = value
    return record


@pytest.mark.parametrize(("slots", "expected"), [(0, 1), (1, 1), (BLOCK, 1), (BLOCK + 1, 2), (2 * BLOCK, 2)])
def test_a_region_has_as_many_blocks_as_its_slots_fill_but_one_at_least(slots, expected):
    assert blocks(region_of(first=7, last=7 + slots)[0]) == expected


def test_survivors_come_first_and_keep_everything_but_their_age(wall):
    flies, out = np.zeros(3, FLY).view(np.recarray), np.zeros(9, FLY).view(np.recarray)
    flies[1] = (20, 21, 0.6, 0.01, 0.02, 3.5, 9.0, 4)
    region = region_of(first=2, last=9, kept=1, parents=1)[0]
    bred(wall, 3, region, [0, 1], flies, out, 2)
    assert list(out[2].item())[:6] == pytest.approx([20, 21, 0.6, 0.01, 0.02, 3.5])
    assert out[2].age == 5


@pytest.mark.parametrize("number", [0, 1])
def test_flies_of_another_pair_are_measured_anew_and_those_out_of_view_rejected(wall, number):
    flies, out = np.zeros(2, FLY).view(np.recarray), np.zeros(2, FLY).view(np.recarray)
    q = DISPARITY_PX / float(wall.record.gain[0])
    flies[0], flies[1] = (
        (30, 20, q, 0.0, 0.0, 77.0, 0.0, 0),
        (5, 20, q, 0.0, 0.0, 77.0, 0.0, 0),
    )  # left of the right view
    region = region_of(last=2, kept=2)[0]
    for slot in (0, 1):
        bred(wall, number, region, [0, 1], flies, out, slot)
    if number == 0:
        expected = polish(wall.record[0], rules(), 30, 20, float(np.float32(q)))
        assert (out[0].q, out[0].fitness) == pytest.approx((expected[0], expected[3]), rel=1e-5)
        assert out[1].fitness == OUT_OF_VIEW
    else:
        assert out[0].fitness == out[1].fitness == 77.0
    assert out[0].age == out[1].age == 1


@pytest.mark.parametrize("lanes", [1, 3])
def test_every_slot_of_every_region_is_bred_once_and_every_region_is_selected_in(wall, lanes):
    """Regions of one block and a slot, of none, and of two whole blocks."""
    sizes = np.array([BLOCK + 1, 0, 2 * BLOCK])
    state = np.zeros(3, REGION)
    state["u1"], state["v1"], state["last"] = 64, 48, np.cumsum(sizes)
    state["first"], state["places"], state["parents"] = state["last"] - sizes, [5, 0, 9], [0, 5, 5]
    state["kept"], state["best"] = 0, -1.0
    out, parents = np.zeros(sizes.sum(), FLY), np.full(14, -1, np.int32)
    out["age"] = -7
    how = np.array([tuple(rules())], RULES)
    todo = np.concatenate([[0], np.maximum(-(-sizes // BLOCK), 1)])
    with limited(lanes):
        share(
            generation, todo, wall.record.view(np.ndarray), how, EQ1, *OPERATORS, Draws(np.uint64(1), 1),
            Population(state, parents, np.zeros(1, FLY), out),
            Selection(8, np.ones(sizes.sum(), np.float32), 3.0, 2.0), scratch(sizes.sum(), 3),
        )  # fmt: skip
    assert (out["age"] == 0).all() and (todo[1:] == 0).all()
    assert state["kept"].tolist() == [5, 0, 9]
    assert (parents >= 0).all() and len(set(parents.tolist())) == 14
    assert (parents[:5] < BLOCK + 1).all() and (parents[5:] >= BLOCK + 1).all()
    assert (state["best"] >= 0.0).all()


def select(fitness, places, weights, spots=None, enough=3.0, settled=2.0):
    """The region after a selection among flies of a fitness, each in a cell of its own but where `spots` says so."""
    n = len(fitness)
    flies, region = np.zeros(n, FLY).view(np.recarray), region_of(last=n, places=places)
    flies["u"] = 8 * np.arange(n) if spots is None else spots
    flies["fitness"] = fitness
    parents = np.full(n, -1, np.int32)
    preserve(
        flies, region[0], parents, Selection(8, np.array(weights, np.float32), enough, settled), scratch(n, 1),
        np.empty(99, np.int32),
    )  # fmt: skip
    return region[0], sorted(parents[: int(region["kept"][0])].tolist()), flies


@pytest.mark.parametrize("weights", [[], [1.0, 0.5, 0.25, 0.2]])
def test_of_a_selection_its_best_its_sum_and_its_settled_are_told(weights):
    region, chosen, _ = select([4.0, 1.0, 2.0, -1.0], 3, weights)
    assert chosen == [0, 1, 2]
    assert (region.kept, region.best, region.total, region.settled) == (3, 4.0, 7.0, 2)  # settled from 2.0 on
    region, chosen, _ = select([4.0, 1.0, 2.0, 3.0], 3, weights)
    assert chosen == [0, 2, 3]
    # Whoever is to be preserved must be as fit as the last of them, alone in its cell.
    assert region.needed == pytest.approx(2.0, rel=1e-5)
    assert select([4.0, 1.0], 3, weights)[0].needed == 0.0  # there is room
    assert select([-1.0, -1.0], 2, weights)[0].kept == 0


def test_where_the_last_shares_its_cell_less_is_needed():
    # Both in one cell: 6 / (1 + 6 / 3) = 2, and half of that for the second.
    region, chosen, flies = select([6.0, 6.0], 2, [1.0, 0.5], spots=[0, 1])
    assert chosen == [0, 1] and flies["shared"].tolist() == [2.0, 1.0]
    assert region.needed == pytest.approx(1.5)  # 1.5 / (1 + 1.5 / 3) = 1
    assert select([0.0], 1, [1.0])[0].needed == 0.0
