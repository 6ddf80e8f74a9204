"""Flies of an earlier pair are where the cameras' motion puts them, and are bred from."""

import numpy as np
import pytest

from flysim.flies.carry import Carried, carried
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import limited
from flysim.geometry.frames import pose6, transform

FEW = FlyParams(population=300, regions=1, max_iterations=1, min_depth=0.5, max_depth=5.0)


def test_flies_on_a_plane_keep_to_it_when_the_camera_moves(stage):
    rng = np.random.default_rng(0)
    normal = np.array([0.2, -0.3, -1.0]) / np.linalg.norm([0.2, -0.3, -1.0])
    offset = normal @ np.array([0.0, 0.0, 2.0])
    x, y = rng.uniform(-0.4, 0.4, (2, 50))
    points = np.stack([x, y, (offset - normal[0] * x - normal[1] * y) / normal[2]], axis=1)
    T = pose6(0.05, -0.02, -0.1, 0.02, 0.1, -0.03)
    found = carried(points, np.tile(normal, (50, 1)), stage.CAMERA, T)
    assert len(found.pixels) == 50
    now = T[:3, :3] @ normal
    away = now @ transform(T, points[:1])[0]
    u, v = found.pixels.T
    for du, dv in ((0, 0), (3, 0), (0, -4)):  # at the pixel and as far as its slopes lead
        rays = stage.CAMERA.unproject(np.stack([u + du, v + dv], axis=1), np.ones(50))
        expected = rays @ now / away
        q = found.genes[:, 0] + du * found.genes[:, 1] + dv * found.genes[:, 2]
        np.testing.assert_allclose(q, expected, rtol=1e-5)


def test_what_leaves_the_image_or_is_behind_is_not_carried(stage):
    points = np.array([[0.0, 0.0, 2.0], [9.0, 0.0, 2.0], [0.0, 0.0, -1.0]])
    found = carried(points, np.tile([0.0, 0.0, -1.0], (3, 1)), stage.CAMERA, np.eye(4))
    assert found.pixels.tolist() == [[100, 75]]
    assert found.genes[0, 0] == pytest.approx(0.5)


def test_one_generation_is_enough_for_flies_that_are_carried(stage, facing):
    first = evolve(facing.pair, FlyParams(population=300, regions=1, max_depth=5.0), rng=np.random.default_rng(1))
    before = carried(first.points.astype(float), first.normals.astype(float), facing.pair.rig.left, np.eye(4))
    fresh = evolve(facing.pair, FEW, rng=np.random.default_rng(2))
    again = evolve(facing.pair, FEW, rng=np.random.default_rng(2), carried=before)
    assert len(again.points) > 1.5 * len(fresh.points)
    assert again.age.max() == 1
    assert np.median(np.abs(again.points[:, 2] - 1.5)) < 0.01


def test_flies_that_are_carried_to_where_nothing_is_do_not_stay(stage, facing):
    pixels = np.stack(np.meshgrid(np.arange(60, 140, 8), np.arange(40, 110, 8)), axis=-1).reshape(-1, 2)
    genes = np.tile(np.array([1.0 / 3.0, 0.0, 0.0], np.float32), (len(pixels), 1))  # twice as far as the wall
    wrong = Carried(pixels=pixels.astype(np.int32), genes=genes)
    swarm = evolve(facing.pair, FEW, rng=np.random.default_rng(2), carried=wrong)
    assert (np.abs(swarm.points[:, 2] - 1.5) < 0.1).all()


@pytest.mark.parametrize("regions", [1, 4])
def test_carried_flies_give_the_same_bytes_on_any_number_of_threads(facing, regions):
    params = FlyParams(population=400, regions=regions, max_iterations=3, max_depth=5.0)
    first = evolve(facing.pair, params, rng=np.random.default_rng(1))
    before = carried(first.points.astype(float), first.normals.astype(float), facing.pair.rig.left, np.eye(4))
    found = []
    for threads in (1, 2, 3):
        with limited(threads):
            swarm = evolve(facing.pair, params, rng=np.random.default_rng(2), carried=before)
        found.append((swarm.points.tobytes(), swarm.age.tobytes(), swarm.evaluations))
    assert found[0] == found[1] == found[2]
    assert swarm.evaluations == 400 + 2 * (400 - 160)
