"""What a caller of `evolve` relies on, whatever the images hold."""

import numpy as np
import pyarrow.parquet
import pytest
import trimesh

from flysim.flies.compared import compare
from flysim.flies.evolution import evolve
from flysim.flies.generation import Selection, Workspace, preserve
from flysim.flies.parameters import FlyParams
from flysim.flies.regions import rectangles
from flysim.flies.state import FLY, REGION
from flysim.flies.threads import limited
from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.views import prepare

FIELDS = {
    "points": ((3,), np.float32),
    "normals": ((3,), np.float32),
    "spread": ((3,), np.float32),
    "fitness": ((), np.float32),
    "uv": ((2,), np.float32),
    "uv_right": ((2,), np.float32),
    "region": ((), np.int32),
    "age": ((), np.int32),
}


def content(swarm):
    arrays = {name: getattr(swarm, name).tobytes() for name in FIELDS}
    return {**arrays, "history": swarm.history, "converged": swarm.converged, "reason": swarm.reason}


def check_record(swarm, rig, params=None):
    """Shapes, types and finite figures, however many flies there are."""
    n = len(swarm.points)
    for name, (shape, dtype) in FIELDS.items():
        array = getattr(swarm, name)
        assert (array.shape, array.dtype) == ((n, *shape), dtype), name
        assert np.isfinite(array).all(), name
    assert swarm.iterations == len(swarm.history) >= 1
    assert all(np.isfinite((g.best, g.mean, g.settled)).all() and 0.0 <= g.settled <= 1.0 for g in swarm.history)
    assert swarm.reason
    half = (params or FlyParams()).window // 2
    # The whole window is in both images: a fly out of either view is rejected.
    assert rig.left.contains(swarm.uv, half).all()
    assert rig.right.contains(swarm.uv_right).all()
    assert (swarm.fitness > 0.0).all()


@pytest.fixture(params=["facing", "step"])
def scene(request):
    return request.getfixturevalue(request.param)


def test_the_figures_of_a_swarm_agree_with_each_other(scene):
    swarm, rig = scene.swarm, scene.pair.rig
    check_record(swarm, rig)
    left, right = rig.project(swarm.points)
    np.testing.assert_allclose(left, swarm.uv, atol=1e-3)
    np.testing.assert_allclose(right, swarm.uv_right, atol=1e-3)
    assert (np.diff(swarm.fitness) <= 0.0).all()  # fittest first
    assert (swarm.points[:, 2] >= 0.6).all() and (swarm.points[:, 2] <= 4.0).all()
    rects = rectangles(rig.left.width, rig.left.height, 4)[swarm.region]
    u, v = swarm.uv.T
    assert ((rects[:, 0] <= u) & (u < rects[:, 1]) & (rects[:, 2] <= v) & (v < rects[:, 3])).all()
    assert swarm.age.min() >= 0 and swarm.age.max() < swarm.iterations


def test_normals_are_unit_and_look_at_the_camera(scene):
    swarm = scene.swarm
    np.testing.assert_allclose(np.linalg.norm(swarm.normals, axis=1), 1.0, atol=1e-5)
    assert ((swarm.normals * swarm.points).sum(axis=1) < 0.0).all()


def test_spread_is_a_tenth_of_a_pixel_along_the_line_of_sight(scene):
    swarm, rig = scene.swarm, scene.pair.rig
    z = swarm.points[:, 2]
    np.testing.assert_allclose(np.abs(swarm.spread[:, 2]), 0.1 * z**2 / (rig.left.fx * rig.baseline), rtol=1e-4)
    sine = np.linalg.norm(np.cross(swarm.spread, swarm.points), axis=1)
    assert (sine < 1e-4 * np.linalg.norm(swarm.spread, axis=1) * np.linalg.norm(swarm.points, axis=1)).all()


def test_to_world_moves_the_flies(facing):
    T_world_left = pose6(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    np.testing.assert_allclose(
        facing.swarm.to_world(T_world_left), transform(T_world_left, facing.swarm.points), atol=1e-12
    )


def test_the_same_seed_gives_the_same_bytes_and_another_one_others(stage, step):
    again, other = stage.run(step.pair, seed=1), stage.run(step.pair, seed=2)
    assert content(again) == content(step.swarm)
    assert content(other)["points"] != content(step.swarm)["points"]


def test_the_seed_is_the_generators_state_and_nothing_else(stage, facing):
    np.random.default_rng(99)
    rng = np.random.default_rng(1)
    params = FlyParams(population=1000, min_depth=0.6, max_depth=4.0)
    first = evolve(facing.pair, params, rng=rng)
    second = evolve(facing.pair, params, rng=rng)  # the same generator has moved on
    assert content(first) == content(facing.swarm)
    assert content(second)["points"] != content(first)["points"]


@pytest.mark.parametrize("change", [{}, {"mutation": "metric", "operators": "C", "regions": 1}], ids=str)
def test_any_number_of_threads_gives_the_same_bytes(stage, step, change):
    found = []
    for threads in (1, 2, 3):
        with limited(threads):
            found.append(content(stage.run(step.pair, **change)))
    assert found[0] == found[1] == found[2]
    with pytest.raises(ValueError, match="threads must be >= 1, got 0"), limited(0):
        pass


def test_prepared_views_give_the_same_bytes(facing):
    params = FlyParams(population=1000, min_depth=0.6, max_depth=4.0)
    ready = compare(facing.pair, params)
    swarms = [evolve(facing.pair, params, rng=np.random.default_rng(1), compared=one) for one in (ready, ready, None)]
    assert content(swarms[0]) == content(swarms[1]) == content(swarms[2])


CHOICES = [
    {"fitness": "louchet"},
    {"fitness": "zncc"},
    {"fitness": "product"},
    {"fitness": "paper"},
    {"crossover": "extrapolate"},
    {"tails": "heavy"},
    {"mutation": "metric"},
    {"regions": (3, 2)},
    {"window": 9},
    {"sharing_strength": 1.0, "sharing_cell": 8},
    {"left_right": 1.0},
    {"slant": 0.0, "polish": 0},
]


@pytest.mark.parametrize("change", CHOICES, ids=str)
def test_every_choice_finds_the_surfaces(stage, step, change):
    swarm = stage.run(step.pair, population=2000, **change)
    check_record(swarm, step.pair.rig, FlyParams(**change))
    error = stage.disparity_error(swarm, step.pair.rig, step.planes)
    error = error[np.isfinite(error)]
    assert len(error) > 150
    assert np.median(error) < 0.1 and np.mean(error < 1.0) > 0.95


def test_the_left_right_test_drops_what_the_right_camera_cannot_see(stage, step):
    """Behind the nearer wall's edge the left camera sees a strip that the right one does not."""
    off, on = (
        stage.run(step.pair, population=4000, uniqueness=0.0, misfit=0.0, settled_fitness=0.05, left_right=px)
        for px in (0.0, 1.0)
    )
    wrong = [np.mean(~(stage.disparity_error(swarm, step.pair.rig, step.planes) < 1.0)) for swarm in (off, on)]
    assert len(on.points) < len(off.points)
    assert wrong[1] < 0.5 * wrong[0]


def test_the_swarm_counts_its_evaluations(facing):
    swarm = facing.swarm  # 1000 flies of set A: 600 children a generation, but for the rounding of each region's share
    assert 0 <= swarm.evaluations - (1000 + 600 * (swarm.iterations - 1)) < 4 * (swarm.iterations - 1)


def test_the_input_is_left_as_it_was(stage, facing):
    left, right = facing.pair.left.copy(), facing.pair.right.copy()
    stage.run(facing.pair)
    assert (facing.pair.left == left).all() and (facing.pair.right == right).all()


def empty_pairs(stage):
    rng = np.random.default_rng(0)
    shape = (150, 200, 3)
    grey, black, white = (np.full(shape, level, np.uint8) for level in (77, 0, 255))
    spot = grey.copy()
    spot[75, 100] = 255
    noise = [rng.integers(0, 256, shape, dtype=np.uint8) for _ in range(2)]
    wide = StereoRig.parallel(stage.CAMERA, 10.0)
    away = StereoRig(left=stage.CAMERA, right=stage.CAMERA, T_right_left=pose6(-0.12, 0.0, 0.0, 0.0, 3.1, 0.0))
    return {
        "uniform": ImagePair(left=grey, right=grey, rig=stage.RIG),
        "black and white": ImagePair(left=black, right=white, rig=stage.RIG),
        "one side uniform": ImagePair(left=noise[0], right=grey, rig=stage.RIG),
        "unrelated noise": ImagePair(left=noise[0], right=noise[1], rig=stage.RIG),
        "a spot on one side": ImagePair(left=spot, right=grey, rig=stage.RIG),
        "views that do not meet": ImagePair(left=noise[0], right=noise[0], rig=wide),
        "back to back": ImagePair(left=noise[0], right=noise[0], rig=away),
    }


@pytest.mark.parametrize("fitness", ["epipolar", "paper"])
@pytest.mark.parametrize(
    "name",
    [
        "uniform",
        "black and white",
        "one side uniform",
        "unrelated noise",
        "a spot on one side",
        "views that do not meet",
        "back to back",
    ],
)
def test_where_nothing_can_settle_the_swarm_is_empty_and_says_why(stage, name, fitness):
    pair = empty_pairs(stage)[name]
    swarm = stage.run(pair, population=500, fitness=fitness)
    assert len(swarm.points) == 0
    assert not swarm.converged
    assert swarm.reason.startswith("no fly settled")
    assert swarm.iterations <= FlyParams().max_iterations
    check_record(swarm, pair.rig)


def test_the_lowest_threshold_makes_no_settled_flies_of_a_uniform_image(stage):
    pair = empty_pairs(stage)["uniform"]
    assert len(stage.run(pair, settled_fitness=1e-9).points) == 0


@pytest.mark.parametrize("settled_fitness", [0.0, 2.0 / 3.0, 1e6])
def test_every_allowed_threshold_works(stage, facing, settled_fitness):
    swarm = stage.run(facing.pair, settled_fitness=settled_fitness, max_iterations=3)
    check_record(swarm, facing.pair.rig)
    assert (len(swarm.points) > 0) == (settled_fitness < 1.0)


def test_the_limit_of_generations_is_kept_and_told(stage, facing):
    swarm = stage.run(facing.pair, max_iterations=2)
    assert (swarm.iterations, swarm.converged) == (2, False)
    assert swarm.reason.startswith("the limit of 2 generations came first")


def test_it_stops_once_the_settled_are_no_longer_growing_in_number(stage, facing):
    swarm = stage.run(facing.pair, population=800)
    settled = [generation.settled for generation in swarm.history]
    assert swarm.converged and settled[-3] >= 0.9 * settled[-1]
    assert all(settled[k - 2] < 0.9 * settled[k] for k in range(2, len(settled) - 1))
    assert swarm.reason.startswith(f"the number of settled flies levelled out after {len(settled)} generations")
    longer = stage.run(facing.pair, population=800, stop=0.999)
    assert longer.iterations > swarm.iterations
    # The same seed goes the same way for as long as it goes.
    assert longer.history[: swarm.iterations] == swarm.history
    assert stage.run(facing.pair, population=800, stop=1.0, max_iterations=25).iterations == 25


def test_it_stops_as_well_where_most_of_the_image_is_empty(stage, facing):
    """Fewer good places than flies that could be preserved: the share that settles is small, but it levels out."""
    left, right = facing.pair.left.copy(), facing.pair.right.copy()
    left[:120], right[:120] = 90, 90
    swarm = stage.run(type(facing.pair)(left=left, right=right, rig=facing.pair.rig), population=4000)
    assert swarm.converged and swarm.history[-1].settled < 0.9


def pair_of_size(width, height):
    image = np.random.default_rng(1).integers(0, 256, (height, width, 3), dtype=np.uint8)
    camera = Camera(width=width, height=height, fx=20.0, fy=20.0, cx=width / 2, cy=height / 2)
    return ImagePair(left=image, right=image, rig=StereoRig.parallel(camera, 0.12))


@pytest.mark.parametrize(("width", "height", "window"), [(6, 50, 7), (50, 6, 7), (30, 30, 31), (1, 1, 3)])
def test_an_image_smaller_than_the_window_is_refused_by_its_figures(stage, width, height, window):
    with pytest.raises(ValueError, match=f"image is {width}x{height} px, too small for a window of {window} px"):
        stage.run(pair_of_size(width, height), window=window)


@pytest.mark.parametrize("side_px", [10, 11, 12, 13, 16])
def test_the_smallest_images_are_taken(stage, side_px):
    swarm = stage.run(pair_of_size(side_px, side_px), population=100, min_depth=0.3)
    check_record(swarm, pair_of_size(side_px, side_px).rig)


@pytest.mark.parametrize("operators", ["A", "B", "C", (0.05, 0.95, 0.0, 0.0), (0.9, 0.0, 0.1, 0.0)])
@pytest.mark.parametrize("regions", [1, 4])
def test_the_smallest_population_runs(stage, facing, regions, operators):
    swarm = stage.run(facing.pair, population=10, regions=regions, operators=operators)
    check_record(swarm, facing.pair.rig)
    assert all(sum(generation.regions) == 10 for generation in swarm.history)


def test_a_right_image_of_another_size_is_fine(stage):
    right = Camera(width=120, height=90, fx=100.0, fy=100.0, cx=59.5, cy=44.5)
    rig = StereoRig(left=stage.CAMERA, right=right, T_right_left=pose6(-0.12, 0.0, 0.0, 0.0, 0.0, 0.0))
    plane = stage.Plane((0.0, 0.0, 1.0), 1.5)
    pair = stage.photograph(rig, [plane], wavelength=0.16)
    swarm = stage.run(pair)
    check_record(swarm, rig)
    assert len(swarm.points) > 100
    assert np.nanmedian(stage.disparity_error(swarm, rig, [plane])) < 0.1


def test_a_swarm_goes_to_other_programs(facing, tmp_path):
    swarm = facing.swarm
    swarm.to_parquet(tmp_path / "flies.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "flies.parquet")
    assert table.column_names == ["x", "y", "z", "fitness", "u", "v", "u_right", "v_right", "region", "age"]
    np.testing.assert_array_equal(np.column_stack([table[name] for name in "xyz"]), swarm.points)
    assert table["region"].to_pylist() == swarm.region.tolist()
    swarm.to_ply(tmp_path / "flies.ply")
    cloud = trimesh.load(tmp_path / "flies.ply")
    np.testing.assert_allclose(cloud.vertices, swarm.points)


def test_a_tiny_threshold_walls_no_child_out():
    """Fitness saturates towards the threshold: rounded to it, no fitness at all would seem to be enough."""
    flies, region = np.zeros(2, FLY), np.zeros(1, REGION)
    flies["u"], flies["v"], flies["fitness"] = (9, 30), (9, 30), (300.0, 200.0)
    region[["u1", "v1", "last", "places"]] = 40, 40, 2, 1
    preserve(
        flies, region[0], np.zeros(1, np.int32), Selection(8, np.ones(2, np.float32), 1e-6, 1e-9),
        Workspace(np.empty(2, np.uint64), np.empty(2, np.int32), np.empty((1, 37), np.int32)), np.empty(37, np.int32),
    )  # fmt: skip
    assert 0.0 < region["needed"][0] <= 200.0


def test_a_right_camera_on_the_left_finds_the_same_wall(stage, facing):
    rig = StereoRig(left=stage.CAMERA, right=stage.CAMERA, T_right_left=pose6(0.12, 0.0, 0.0, 0.0, 0.0, 0.0))
    pair = stage.photograph(rig, facing.planes)
    assert prepare(facing.pair).record[0].rectified and not prepare(pair).record[0].rectified
    swarm = stage.run(pair)
    assert len(swarm.points) > 0.9 * len(facing.swarm.points)
    assert np.median(np.abs(swarm.points[:, 2] - 1.5)) < 0.01
