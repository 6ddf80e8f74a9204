"""Generated worlds: what a difficulty promises holds for every seed tried, measured on the file that is written."""

import collections
import hashlib
import math
import os
import subprocess
import sys
from itertools import combinations

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.errors import RecordError, WorldError
from flysim.geometry.frames import Pose2, inverse, transform
from flysim.robots.robot import read_robot
from flysim.sim.simulation import Simulation
from flysim.truth.gap import touching_groups
from flysim.truth.truth import Truth
from flysim.worlds.random.draft import ROBOT_RADIUS
from flysim.worlds.random.generate import describe, generate, write_random_world
from flysim.worlds.random.write import world_sdf
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Box, Cylinder, Sphere

SEEDS = range(10)
COUNTS = {"easy": (3, 5), "medium": (6, 9), "hard": (10, 15)}
GAPS = {"easy": 1.0, "medium": 0.6, "hard": 0.35}
CONTRASTS = {"easy": (0.32, 0.32), "medium": (0.20, 0.32), "hard": (0.10, 0.32)}
SIDES = {"easy": (4.3, 5.6), "medium": (5.2, 6.7), "hard": (6.2, 7.8)}
PLAIN = {"box", "cylinder", "sphere"}
CLUTTER = {"post", "kerb", "corner", "overhang"}


@pytest.fixture(scope="module")
def drawn():
    return {(difficulty, seed): generate(seed, difficulty) for difficulty in COUNTS for seed in SEEDS}


@pytest.fixture(scope="module")
def worlds(drawn, tmp_path_factory):
    """The drawn worlds as they read back, without their textures."""
    folder = tmp_path_factory.mktemp("worlds")
    found = {}
    for (difficulty, seed), models in drawn.items():
        text = world_sdf("w", models, made_by="a test")
        path = folder / f"{difficulty}-{seed}.sdf"
        path.write_text("".join(line for line in text.splitlines(True) if "albedo_map" not in line), encoding="utf-8")
        found[difficulty, seed] = read_world(path)
    return found


def obstacles(models):
    return [model for model in models if not model.structure]


def kind(model):
    return model.name.rpartition("_")[0]


def solid(link):
    (part,) = link.collisions
    return part.shape, link.T_world_link @ part.T_link_part


def floor_plan(links, points):
    """Distance [m] of `[N, 2]` points to the plan of links; 0 inside. Every body stands upright."""
    nearest = np.full(len(points), np.inf)
    for link in links:
        shape, T = solid(link)
        local = transform(inverse(T), np.c_[points, np.full(len(points), T[2, 3])])[:, :2]
        half = np.array(shape.size[:2]) / 2 if isinstance(shape, Box) else np.zeros(2)
        radius = 0.0 if isinstance(shape, Box) else shape.radius
        away = np.linalg.norm(np.maximum(np.abs(local) - half, 0.0), axis=1) - radius
        nearest = np.minimum(nearest, np.maximum(away, 0.0))
    return nearest


@pytest.mark.parametrize("difficulty", COUNTS)
def test_counts_contrasts_and_rooms_are_as_promised(drawn, difficulty):
    for seed in SEEDS:
        models = drawn[difficulty, seed]
        some = obstacles(models)
        assert COUNTS[difficulty][0] <= len(some) <= COUNTS[difficulty][1], seed
        contrasts = [body.contrast for model in some for body in model.bodies]
        assert CONTRASTS[difficulty][0] <= min(contrasts) <= max(contrasts) <= CONTRASTS[difficulty][1], seed
        assert models[0].name == "floor" and models[0].structure
        over = sum(kind(model) == "overhang" for model in some)
        assert {"easy": over == 0, "medium": over <= 1, "hard": 1 <= over <= 2}[difficulty], seed
        walls = [model for model in models if model.name == "walls"]
        assert difficulty == "easy" or len(walls[0].bodies) == 4
        length, width = models[0].bodies[0].shape.size
        beyond = 0.0 if walls and len(walls[0].bodies) == 4 else 3.0
        assert (
            SIDES[difficulty][0] <= min(length, width) - beyond <= max(length, width) - beyond <= SIDES[difficulty][1]
        )


def test_every_kind_occurs_and_easy_is_without_clutter(drawn):
    seen = {d: collections.Counter(kind(m) for s in SEEDS for m in obstacles(drawn[d, s])) for d in COUNTS}
    assert set(seen["easy"]) == PLAIN
    assert set(seen["medium"]) == set(seen["hard"]) == PLAIN | CLUTTER
    assert any(model.name.startswith("partition") for models in drawn.values() for model in models)
    assert any(len(m.bodies) < 4 for s in SEEDS for m in drawn["easy", s] if m.name == "walls")
    headings = {model.pose[5] for models in drawn.values() for model in obstacles(models)}
    assert len(headings) > 100


def test_sizes_are_those_of_their_kind(drawn):
    for models in drawn.values():
        for model in obstacles(models):
            first = model.bodies[0].shape
            match kind(model):
                case "box":
                    assert 0.2 <= first.size[1] <= first.size[0] <= 0.8 and 0.15 <= first.size[2] <= 1.0
                case "cylinder":
                    assert 0.08 <= first.radius <= 0.3 and 0.15 <= first.length <= 1.0
                case "sphere":
                    assert 0.12 <= first.radius <= 0.3
                case "post":
                    assert 0.03 <= first.radius <= 0.06 and 0.6 <= first.length <= 1.2
                case "kerb":
                    assert first.size[0] >= 0.6 and 0.08 <= first.size[2] <= 0.12
                case "overhang":
                    below = model.bodies[0].pose[2] - first.size[2] / 2
                    assert 0.25 - 1e-9 <= below <= 0.5 + 1e-9


def test_places_and_sizes_are_whole_millimetres_and_read_back_exactly(drawn, worlds):
    def whole(*values):
        return all(abs(v * 1000 - round(v * 1000)) < 1e-6 for v in values)

    for key, models in drawn.items():
        bodies = [(model, body) for model in models for body in model.bodies]
        links = worlds[key].links
        assert [(link.model, link.name) for link in links] == [(model.name, body.name) for model, body in bodies]
        for (model, body), link in zip(bodies, links, strict=True):
            assert solid(link)[0] == body.shape
            assert link.structure == model.structure
            assert whole(*model.pose[:3], *body.pose[:3])
            assert model.pose[5] == round(model.pose[5])
            size = body.shape.size if hasattr(body.shape, "size") else (body.shape.radius,)
            assert whole(*size)
            yaw = math.radians(model.pose[5])
            c, s = math.cos(yaw), math.sin(yaw)
            expected = (
                model.pose[0] + c * body.pose[0] - s * body.pose[1],
                model.pose[1] + s * body.pose[0] + c * body.pose[1],
                body.pose[2],
            )
            assert np.allclose(link.T_world_link[:3, 3], expected, atol=1e-9)


@pytest.mark.parametrize("difficulty", COUNTS)
def test_the_truth_counts_them_one_by_one(drawn, worlds, difficulty):
    for seed in SEEDS:
        some = obstacles(drawn[difficulty, seed])
        found = Truth.of(worlds[difficulty, seed], (), max_range=4.0).obstacles
        assert [truth.name for truth in found] == [model.name for model in some], seed
        for truth in found:
            assert abs(truth.center[2] - truth.size[2] / 2) < 1e-9, "it stands on the floor"


@pytest.mark.parametrize("difficulty", COUNTS)
def test_gaps_are_as_promised(worlds, difficulty):
    gap = GAPS[difficulty]
    for seed in SEEDS:
        world = worlds[difficulty, seed]
        links = [link for link in world.links if link.model != "floor"]
        by_model = collections.defaultdict(list)
        for link in links:
            by_model[link.model].append(solid(link))
        walls = [[solid(link)] for link in links if link.model == "walls"]
        free = {name: shapes for name, shapes in by_model.items() if name != "walls"}
        # In space, by the evaluator's own measure of distance.
        assert len(touching_groups(list(free.values()), gap - 1e-6)) == len(free), seed
        for name, shapes in free.items():
            assert len(touching_groups([shapes, *walls], 0.5 - 1e-6)) == 1 + len(walls) - touching(walls), (seed, name)
        # The bodies of one model hang together.
        for shapes in free.values():
            assert len(touching_groups([[one] for one in shapes], 1e-6)) == 1


def touching(walls):
    """How many fewer groups than walls there are, as walls meet in corners."""
    return len(walls) - len(touching_groups(walls, 0.5 - 1e-6))


@pytest.mark.parametrize("difficulty", COUNTS)
def test_the_bodies_of_a_model_do_not_lie_in_one_another(worlds, difficulty):
    for seed in SEEDS:
        by_model = collections.defaultdict(list)
        for link in worlds[difficulty, seed].links:
            by_model[link.model].append(solid(link))
        for name, bodies in by_model.items():
            for (a, T_a), (b, T_b) in combinations(bodies, 2):
                inside = samples(b) @ T_b[:3, :3].T + T_b[:3, 3]
                local = transform(inverse(T_a), inside)
                if isinstance(a, Box):
                    depth = (np.array(a.size) / 2 - np.abs(local)).min(axis=1)
                else:
                    assert isinstance(a, Cylinder)
                    depth = np.minimum(a.radius - np.hypot(*local[:, :2].T), a.length / 2 - np.abs(local[:, 2]))
                assert depth.max() < 1e-6, (seed, name)


def samples(shape):
    """`[N, 3]` points in a body."""
    half = np.array(shape.size) / 2 if isinstance(shape, Box) else np.array([shape.radius, shape.radius, 0.0])
    if isinstance(shape, Cylinder):
        half[2] = shape.length / 2
    assert not isinstance(shape, Sphere)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3), axis=-1).reshape(-1, 3)
    if isinstance(shape, Cylinder):
        grid = grid[np.hypot(grid[:, 0], grid[:, 1]) <= 1.0]
    return grid * half


@pytest.mark.parametrize("difficulty", COUNTS)
def test_the_rover_gets_from_the_start_to_all_that_is_free_and_round_to_see_each(drawn, worlds, difficulty):
    for seed in SEEDS:
        world = worlds[difficulty, seed]
        links = [link for link in world.links if link.model != "floor"]
        (x, y, *_), (length, width) = drawn[difficulty, seed][0].pose, drawn[difficulty, seed][0].bodies[0].shape.size
        step = 0.05
        xs, ys = np.arange(x - length / 2, x + length / 2, step), np.arange(y - width / 2, y + width / 2, step)
        points = np.stack(np.meshgrid(xs, ys), axis=-1)
        away = floor_plan(links, points.reshape(-1, 2)).reshape(points.shape[:2])
        start = np.unravel_index(np.argmin((points**2).sum(axis=-1)), away.shape)
        assert floor_plan(links, np.zeros((1, 2)))[0] >= 0.5 - 1e-9, "room to turn"
        reached = flood(away >= ROBOT_RADIUS + 0.03, start)
        # Behind the walls of an easy room is more of the floor.
        all_free = away >= ROBOT_RADIUS + 0.1
        if difficulty != "easy":
            assert not (all_free & ~reached).any(), seed
        for model in obstacles(drawn[difficulty, seed]):
            dx, dy = points[..., 0] - model.pose[0], points[..., 1] - model.pose[1]
            near = reached & (np.hypot(dx, dy) <= 2.5)
            quarters = {(bool(a), bool(b)) for a, b in zip((dx > 0)[near], (dy > 0)[near], strict=True)}
            assert len(quarters) >= 2, (seed, model.name)


def flood(free, start):
    """What hangs together with `start` over four neighbours, grown from there."""
    reached = np.zeros_like(free)
    reached[start] = free[start]
    while True:
        grown = reached.copy()
        grown[1:] |= reached[:-1]
        grown[:-1] |= reached[1:]
        grown[:, 1:] |= reached[:, :-1]
        grown[:, :-1] |= reached[:, 1:]
        grown &= free
        if (grown == reached).all():
            return reached
        reached = grown


@pytest.mark.parametrize(("difficulty", "seed"), [("easy", 4), ("hard", 7)])
def test_the_rover_stands_free_at_the_start_and_turns(worlds, difficulty, seed):
    robot = read_robot(find_robot("rover"))
    assert robot.radius <= ROBOT_RADIUS
    with Simulation(worlds[difficulty, seed], robot, Pose2(0.0, 0.0, 0.0)) as simulation:
        assert simulation.occupied(Pose2(0.0, 0.0, 0.0)) is None
        for _ in range(240):
            simulation.step(0.0, 2.0)
        assert simulation.bumped() is None
        assert abs(simulation.true_pose().yaw) > 1.0


def digests(folder):
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_a_seed_gives_the_same_bytes_in_every_process_and_another_seed_others(tmp_path):
    here = write_random_world(tmp_path / "here", seed=3, difficulty="easy")
    there = tmp_path / "there"
    code = (
        "import sys; from pathlib import Path; from flysim.worlds.random.generate import write_random_world; "
        "write_random_world(Path(sys.argv[1]), seed=3, difficulty='easy')"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "12345", "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run([sys.executable, "-c", code, str(there)], check=True, env=environment)
    assert digests(here.parent) == digests(there)
    assert generate(3, "easy") != generate(4, "easy")
    assert generate(3, "easy") != generate(3, "medium")


def test_the_folder_is_whole_small_textured_and_says_where_it_is_from(tmp_path):
    path = write_random_world(tmp_path / "deep" / "w", seed=1, difficulty="hard")
    assert path == tmp_path / "deep" / "w" / "world.sdf"
    assert "flysim world random, seed 1, difficulty hard" in path.read_text(encoding="utf-8").splitlines()[1]
    world = read_world(path)
    assert world.warnings == ()
    assert world.name == "random-hard-1"
    textures = {part.material.texture for link in world.links for part in link.visuals}
    assert textures == {p.resolve() for p in (path.parent / "textures").iterdir()}
    assert sum(p.stat().st_size for p in path.parent.rglob("*") if p.is_file()) <= 2 * 2**20
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["w"]


def test_weak_contrast_is_weak_in_the_texture(tmp_path):
    from flysim.worlds.random.write import body_texture

    models = [(model, model.bodies[0]) for seed in range(3) for model in obstacles(generate(seed, "hard"))]
    weak, strong = (f(models, key=lambda pair: pair[1].contrast) for f in (min, max))
    spread = [body_texture("w", *pair, object_texel=0.003).mean(axis=-1).std() for pair in (weak, strong)]
    assert weak[1].contrast <= 0.15 and strong[1].contrast >= 0.28
    assert spread[0] < 0.7 * spread[1]


def test_a_world_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "mine.txt").write_text("keep", encoding="utf-8")
    with pytest.raises(RecordError, match="not empty"):
        write_random_world(taken, seed=0, difficulty="easy")
    assert [p.name for p in taken.iterdir()] == ["mine.txt"]

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("flysim.worlds.random.write.write_png", full)
    with pytest.raises(RecordError, match="disk full"):
        write_random_world(tmp_path / "new", seed=0, difficulty="easy")
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def test_what_is_refused():
    with pytest.raises(WorldError, match="Did you mean 'hard'"):
        generate(0, "hrad")
    with pytest.raises(WorldError, match="the seed must be 0 to 2\\^63 - 1, got -1"):
        generate(-1, "easy")
    with pytest.raises(WorldError, match="the seed must be"):
        generate(2**63, "easy")


def test_description_is_that_of_the_model(drawn):
    (model,) = [m for m in obstacles(drawn["hard", 0]) if m.name == "overhang_1"]
    found = describe(model)
    assert found["shape"] == "overhang"
    assert (found["x_m"], found["y_m"], found["yaw_deg"]) == (model.pose[0], model.pose[1], model.pose[5])
    assert found["bodies"][0]["size_m"] == list(model.bodies[0].shape.size)
    assert found["bodies"][0]["z_m"] == model.bodies[0].pose[2]


def test_a_difficulty_s_worlds_do_not_depend_on_what_others_there_are(monkeypatch):
    from flysim.worlds.random import generate as module
    from flysim.worlds.random.difficulty import DIFFICULTIES

    before = {name: module.generate(5, name) for name in DIFFICULTIES}
    monkeypatch.setattr(module, "DIFFICULTIES", dict(reversed(DIFFICULTIES.items())))
    assert {name: module.generate(5, name) for name in DIFFICULTIES} == before
    assert len({rules.stream for rules in DIFFICULTIES.values()}) == len(DIFFICULTIES)
