"""Every engine by one signature, on a rendered pair whose truth is known."""

import numpy as np
import pytest

from flysim.engines.choose import ENGINES, engine, warm
from flysim.engines.engine import alone
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.frames import rotation_rpy, se3
from flysim.geometry.rig import ImagePair, StereoRig

NAMES = ENGINES.builtin
PARAMS = FlyParams(population=2000, operators="A")


@pytest.fixture(scope="module")
def swarms(scene):
    return {name: alone(engine(name), scene.pair, PARAMS, rng=np.random.default_rng(0)) for name in NAMES}


def errors(scene, swarm):
    """[px] of those points whose pixel both cameras see."""
    u, v = np.rint(swarm.uv).astype(int).T
    off = np.abs(swarm.uv[:, 0] - swarm.uv_right[:, 0] - scene.disparity[v, u])
    return off[np.isfinite(off) & scene.seen[v, u]]


@pytest.mark.parametrize("name", NAMES)
def test_all_give_swarms_that_hang_together(scene, swarms, name):
    swarm, rig = swarms[name], scene.pair.rig
    n = len(swarm.points)
    assert 300 < n <= 1000 or name in ("sgbm", "bm")
    for field, shape in (
        ("points", (n, 3)), ("fitness", (n,)), ("uv", (n, 2)), ("normals", (n, 3)), ("spread", (n, 3)),
        ("uv_right", (n, 2)), ("region", (n,)), ("age", (n,)),
    ):  # fmt: skip
        value = getattr(swarm, field)
        assert value.shape == shape and np.isfinite(value).all(), field
    left, right = rig.project(swarm.points.astype(float))
    assert np.abs(left - swarm.uv).max() < 0.01
    assert np.abs(right - swarm.uv_right).max() < 0.01
    assert (swarm.points[:, 2] >= PARAMS.min_depth - 1e-3).all()
    assert (swarm.points[:, 2] <= PARAMS.max_depth + 1e-3).all()
    assert np.linalg.norm(swarm.normals, axis=1) == pytest.approx(np.ones(n), abs=1e-5)
    assert swarm.reason
    assert (np.diff(swarm.fitness) <= 0).all(), "the fittest come first"


def test_an_engine_repeats_itself_and_only_some_ask_for_luck(scene, swarms):
    for name in NAMES:
        again = alone(engine(name), scene.pair, PARAMS, rng=np.random.default_rng(0))
        assert np.array_equal(again.points, swarms[name].points)
        other = alone(engine(name), scene.pair, PARAMS, rng=np.random.default_rng(1))
        assert np.array_equal(other.points, swarms[name].points) == (name not in ("flies", "chance"))


@pytest.mark.parametrize("name", ["sgbm", "bm"])
def test_a_matchers_points_sit_on_surfaces_and_know_how_they_lie(scene, swarms, name):
    swarm = swarms[name]
    assert (errors(scene, swarm) < 1.0).mean() > 0.97
    # At least as many as flies may be preserved, and no crowd: the clusterer's thresholds count points.
    assert 800 <= len(swarm.points) < 2 * 800
    u, v = np.rint(swarm.uv).astype(int).T
    at_floor = scene.link[v, u] == scene.link[-10, scene.link.shape[1] // 2]
    assert at_floor.sum() > 100
    up = -swarm.normals[at_floor][:, 1]  # the camera looks level: up is -y
    assert np.median(up) > 0.8


def test_chance_knows_nothing(scene, swarms):
    swarm = swarms["chance"]
    assert (errors(scene, swarm) < 1.0).mean() < 0.1
    gain = scene.pair.rig.left.fx * scene.pair.rig.baseline
    share = (1.0 / swarm.points[:, 2] - 1.0 / PARAMS.max_depth) / (1.0 / PARAMS.min_depth - 1.0 / PARAMS.max_depth)
    counts = np.histogram(share[swarm.uv[:, 0] > gain / PARAMS.min_depth + 5], bins=4, range=(0, 1))[0]
    assert counts.min() > 0.7 * counts.mean()  # uniform in disparity where the right camera sees all depths
    assert len(swarm.points) == 800


def test_exhaustive_is_at_least_as_good_as_the_flies(scene, swarms):
    flies, best = (errors(scene, swarms[name]) for name in ("flies", "exhaustive"))
    assert (best < 1.0).mean() >= (flies < 1.0).mean() - 0.005
    assert np.median(best) <= 1.25 * np.median(flies)
    cells = {name: len(np.unique(swarms[name].uv // 16, axis=0)) for name in ("flies", "exhaustive")}
    assert cells["exhaustive"] >= cells["flies"]


def test_an_engine_that_is_not_there():
    with pytest.raises(EngineError, match=r"no engine 'sgmb'. Did you mean 'sgbm'\?"):
        engine("sgmb")


@pytest.mark.parametrize("name", NAMES)
def test_all_can_be_warmed(name):
    warm(name)


@pytest.mark.parametrize("name", ["flies", "chance", "exhaustive"])
def test_turned_cameras_are_no_obstacle_but_to_the_matchers(scene, name):
    camera = Camera(width=96, height=64, fx=80.0, fy=80.0, cx=47.5, cy=31.5)
    turned = StereoRig(left=camera, right=camera, T_right_left=se3(rotation_rpy(0.0, 0.02, 0.0), (-0.1, 0.0, 0.0)))
    image = np.random.default_rng(0).integers(0, 256, (64, 96, 3), np.uint8)
    pair = ImagePair(left=image, right=np.roll(image, -8, axis=1), rig=turned)
    params = FlyParams(population=200, max_iterations=3)
    swarm = alone(engine(name), pair, params, rng=np.random.default_rng(0))
    assert np.isfinite(swarm.points).all()
    with pytest.raises(EngineError, match="engine sgbm gives disparities, which need a rectified pair"):
        alone(engine("sgbm"), pair, params, rng=np.random.default_rng(0))
