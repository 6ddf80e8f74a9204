"""The evolution round its generations: when it ends, what it begins with, what it tells the kernels."""

import math

import numpy as np
import pytest

from flysim.flies.carry import Carried, carried
from flysim.flies.compared import compare
from flysim.flies.evolution import _calm, _check_size, _Evolution, _Layout
from flysim.flies.measure import MEASURES
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.swarm import Generation
from flysim.stereo.plane import normals

LENS = Camera(width=64, height=48, fx=50.0, fy=60.0, cx=31.5, cy=23.5)


def pair(left=LENS, right=LENS):
    rng = np.random.default_rng(0)
    images = [rng.integers(0, 256, (camera.height, camera.width, 3), dtype=np.uint8) for camera in (left, right)]
    rig = StereoRig(left=left, right=right, T_right_left=StereoRig.parallel(left, 0.2).T_right_left)
    return ImagePair(left=images[0], right=images[1], rig=rig)


def history(*settled):
    return [Generation(best=1.0, mean=1.0, settled=share, regions=(1,)) for share in settled]


@pytest.mark.parametrize(
    ("settled", "stop", "calm"),
    [
        ((0.46, 0.2, 0.5), 0.9, True), ((0.44, 0.6, 0.5), 0.9, False),  # nine tenths of now, two generations ago
        ((0.5, 0.5), 0.9, False), ((0.1, 0.5, 0.5, 0.5), 0.9, True), ((0.5, 0.1, 0.5, 0.5), 0.9, False),
        ((0.45, 0.4, 0.5), 0.9, True), ((0.5, 0.5, 0.5), 1.0, False), ((0.5, 0.5, 0.5), 0.999, True),
        # Of next to nothing it cannot be said.
        ((0.021, 0.021, 0.021), 0.9, True), ((0.019, 0.019, 0.019), 0.9, False), ((0.0, 0.0, 0.0), 0.9, False),
    ],
)  # fmt: skip
def test_it_is_calm_once_most_of_the_settled_were_there_two_generations_ago(settled, stop, calm):
    assert _calm(history(*settled), FlyParams(stop=stop)) == calm


@pytest.mark.parametrize(("width", "height", "fits"), [(10, 10, True), (9, 10, False), (10, 9, False)])
def test_a_window_needs_a_pixel_on_every_side_and_one_between(width, height, fits):
    small = Camera(width=width, height=height, fx=50.0, fy=50.0, cx=4.5, cy=4.5)
    for left, right in ((small, LENS), (LENS, small)):
        if fits:
            _check_size(pair(left, right), FlyParams(window=7))
        else:
            side = "left" if left is small else "right"
            with pytest.raises(ValueError, match=f"the {side} image is {width}x{height} px"):
                _check_size(pair(left, right), FlyParams(window=7))


def test_the_kernels_are_told_in_their_own_units():
    params = FlyParams(
        population=500, window=9, min_depth=0.5, max_depth=4.0, mutation_disparity_px=2.0, slant=0.6, polish=3,
        settled_fitness=8.0, sharing_strength=2.0, sharing_cell=11,
    )  # fmt: skip
    layout = _Layout(params, 64, 48, 10.0)
    told = layout.rules.view(np.recarray)[0]
    assert (told.norm, told.half, told.polish, told.contest, told.metric, told.heavy) == (0, 4, 3, 0, 0, 0)
    assert (told.q_near, told.q_far) == (2.0, 0.25)
    # 2 px and 0.6 px/px at 10 px a unit of inverse depth; a mutation goes as far as a cell.
    assert (told.mutation_q, told.steepest, told.mutation, told.beyond) == pytest.approx((0.2, 0.06, 11.0, 0.5))
    # A child that is a tenth as fit as a settled fly promises; one four times as fit is sharp.
    assert (told.promising, told.sharp) == pytest.approx((0.8, 32.0))
    assert layout.weights[:3] == pytest.approx([1.0, 1.0 / 4.0, 1.0 / 9.0]) and len(layout.weights) == 500
    other = {"parents": "tournament", "tails": "heavy", "fitness": "paper", "mutation": "metric", "mutation_m": 0.07}
    told = _Layout(FlyParams(crossover="interpolate", **other), 64, 48, 10.0).rules.view(np.recarray)[0]
    assert (told.norm, told.contest, told.metric, told.heavy, told.beyond) == (1, 1, 1, 1, 0.0)
    assert told.mutation == pytest.approx(0.07)
    assert _Layout(FlyParams(mutation_px=3.5), 64, 48, 10.0).rules["mutation"][0] == 3.5
    assert len(_Layout(FlyParams(sharing_strength=0.0), 64, 48, 10.0).weights) == 0


@pytest.mark.parametrize("cell", [7, 8, 16, 48, 100])
@pytest.mark.parametrize("regions", [1, 4, (3, 2)])
def test_there_is_room_for_the_cells_of_every_region(cell, regions):
    layout = _Layout(FlyParams(sharing_cell=cell, regions=regions), 64, 48, 10.0)
    for u0, u1, v0, v1 in layout.rects.tolist():
        cells = ((u1 - 1) // cell - u0 // cell + 1) * ((v1 - 1) // cell - v0 // cell + 1)
        assert layout.cells[1] >= cells + 1  # one more, which the count needs
    assert layout.cells[0] == len(layout.rects)


@pytest.mark.parametrize("form", MEASURES.builtin)
def test_a_fly_is_settled_from_the_fitness_of_its_measure_on(stage, facing, form):
    swarm = stage.run(facing.pair, fitness=form, polish=0, max_iterations=6, stop=1.0, misfit=0.0, uniqueness=0.0)
    settled = {"epipolar": 2.0, "paper": 2.0, "louchet": math.log(3.0), "zncc": 0.8, "product": 1.6}[form]
    # Some are hardly more than that, and none is less.
    assert settled <= swarm.fitness.min() < (1.06 if form != "zncc" else 1.03) * settled


def begun(params, pixels, q):
    genes = np.zeros((len(pixels), 3), np.float32)
    genes[:, 0], genes[:, 1] = q, np.arange(len(pixels)) / 1000.0
    evolution = _Evolution(pair(), compare(pair(), params), params, np.uint64(0))
    evolution.begin_with(Carried(pixels=np.array(pixels, np.int32), genes=genes))
    return evolution


@pytest.mark.parametrize(
    ("pixel", "q", "kept"),
    [
        ((4, 20), 1.0, True), ((3, 20), 1.0, False), ((59, 20), 1.0, True), ((60, 20), 1.0, False),
        ((20, 4), 1.0, True), ((20, 3), 1.0, False), ((20, 43), 1.0, True), ((20, 44), 1.0, False),
        ((20, 20), 2.0, True), ((20, 20), 2.01, False), ((20, 20), 0.25, True), ((20, 20), 0.249, False),
    ],
)  # fmt: skip
def test_of_carried_flies_those_whose_window_and_depth_fit_are_taken(pixel, q, kept):
    evolution = begun(FlyParams(population=40, regions=1, min_depth=0.5, max_depth=4.0), [pixel], [q])
    assert (evolution.begun, int(evolution.regions["kept"].sum())) == (kept, int(kept))


def test_carried_flies_go_to_their_regions_the_fittest_first_as_many_as_there_are_places():
    params = FlyParams(population=40, regions=4, operators="A", min_depth=0.5, max_depth=4.0)
    pixels = [(10, 10), (40, 10), (10, 30), (40, 30), (31, 23), (32, 24)] + [(12, 12)] * 40
    evolution = begun(params, pixels, [1.0] * len(pixels))
    places = evolution.counts[:, 0].tolist()
    assert evolution.regions["kept"].tolist() == [min(42, places[0]), 1, 1, 2]
    first = evolution.regions["kept"][0]
    expected = [0, 4, *range(6, 4 + first), 1, 2, 3, 5]
    slots = np.concatenate([evolution.parents[r["parents"] : r["parents"] + r["kept"]] for r in evolution.regions])
    assert slots.tolist() == list(range(len(expected)))
    assert (evolution.flies["qu"][slots] * 1000.0).round().astype(int).tolist() == expected
    assert [(int(f["u"]), int(f["v"])) for f in evolution.flies[slots]] == [pixels[k] for k in expected]


def test_it_counts_what_is_bred(stage, facing):
    swarm = stage.run(facing.pair, population=500, operators="A", regions=1, max_iterations=4, stop=1.0)
    assert swarm.evaluations == 500 + 3 * (500 - 200)
    assert [g.regions for g in swarm.history] == [(500,)] * 4
    assert all(g.mean <= g.best for g in swarm.history)


def test_a_fly_is_carried_by_its_plane_to_the_nearest_pixel():
    # At 2 m on a wall that leans: n . p = d with n = (0.6, 0, -0.8), seen by a camera that has gone 0.5 m ahead.
    n = np.array([0.6, 0.0, -0.8])
    T = np.eye(4)
    T[2, 3] = -0.5
    point = np.array([0.1, 0.05, 2.0])
    found = carried(point[None], n[None], LENS, T)
    now = point - (0.0, 0.0, 0.5)
    u, v = 50.0 * now[0] / 1.5 + 31.5, 60.0 * now[1] / 1.5 + 23.5  # 34.83, 25.5
    assert found.pixels.tolist() == [[35, 26]]
    slope = n / (n @ now)
    q = 1.0 / 1.5 + slope[0] / 50.0 * (35 - u) + slope[1] / 60.0 * (26 - v)
    assert found.genes[0] == pytest.approx([q, slope[0] / 50.0, slope[1] / 60.0], rel=1e-5)
    # The normal that belongs to these genes is the same.
    assert normals(LENS, found.pixels, found.genes.astype(float))[0] == pytest.approx(n, abs=1e-6)


@pytest.mark.parametrize(
    ("uv", "inside"),
    [
        ((0.0, 20.0), True), ((-0.4, 20.0), True), ((-0.6, 20.0), False), ((63.4, 20.0), True), ((63.6, 20.0), False),
        ((20.0, -0.4), True), ((20.0, -0.6), False), ((20.0, 47.4), True), ((20.0, 47.6), False),
    ],
)  # fmt: skip
def test_carried_flies_lie_in_the_image(uv, inside):
    points = LENS.unproject(np.array([uv]), np.array([2.0]))
    found = carried(points, np.array([[0.0, 0.0, -1.0]]), LENS, np.eye(4))
    assert len(found.pixels) == inside


def test_a_surface_seen_from_behind_is_not_carried():
    points = np.array([[0.0, 0.0, 2.0]])
    for normal, n in (((0.0, 0.0, -1.0), 1), ((0.0, 0.0, 1.0), 0), ((1.0, 0.0, 0.0), 0)):
        assert len(carried(points, np.array([normal]), LENS, np.eye(4)).pixels) == n
