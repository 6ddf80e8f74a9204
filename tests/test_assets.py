"""Lints the worlds that come with flysim, and holds their READMEs to what they say."""

import math
import re
import runpy
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest

from flysim.geometry.frames import inverse, transform
from flysim.worlds.random.write import OBJECT_COLOURS, body_texture, world_sdf
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.surface.texture import write_png

WORLDS = Path(__file__).resolve().parents[1] / "worlds"
NAMES = sorted(p.name for p in WORLDS.iterdir() if p.is_dir() and not p.name.startswith(("_", ".")))
MAX_WORLD_BYTES = 2 * 2**20
HALF_FOV = math.radians(65.0 / 2.0)
ROBOT_RADIUS = 0.25


def obstacles(world):
    return [link for link in world.links if not link.structure]


def distance_to(link, points):
    """Distance [m] of world points to a link's one shape."""
    (part,) = link.collisions
    return part.shape.distance(transform(inverse(link.T_world_link @ part.T_link_part), points))


def surface(link):
    (part,) = link.collisions
    return transform(link.T_world_link @ part.T_link_part, part.shape.outline())


def stops_in(readme):
    rows = re.findall(r"^\| \d+ \| (\S+) \| (\S+) \| (\S+) \|$", readme.read_text(encoding="utf-8"), re.M)
    return [tuple(map(float, row)) for row in rows]


def test_the_three_worlds_are_here():
    assert {"corridor", "paper", "yard"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_layout(name):
    folder = WORLDS / name
    for file in ("world.sdf", "README.md", "preview.png"):
        assert (folder / file).is_file(), f"worlds/{name}/{file} is missing"
    files = [p for p in folder.rglob("*") if p.is_file()]
    assert sum(p.stat().st_size for p in files) <= MAX_WORLD_BYTES
    allowed = {"world.sdf", "README.md", "preview.png"}
    assert all(p.name in allowed or p.parent.name in ("textures", "meshes") for p in files)
    assert (folder / "README.md").read_text(encoding="utf-8").startswith(f"# {name}\n")


@pytest.mark.parametrize("name", NAMES)
def test_loads_without_warnings_and_all_is_textured_and_solid(name):
    world = read_world(WORLDS / name / "world.sdf")
    assert world.warnings == ()
    assert world.name == name
    used = set()
    for link in world.links:
        assert link.static
        assert len(link.visuals) == len(link.collisions)
        for visual, collision in zip(link.visuals, link.collisions, strict=True):
            assert visual.shape == collision.shape
            assert np.array_equal(visual.T_link_part, collision.T_link_part)
            used.add(visual.material.texture)
    assert None not in used
    assert used == {p.resolve() for p in (WORLDS / name / "textures").iterdir()}


@pytest.mark.parametrize("name", NAMES)
def test_obstacles_stand_on_the_floor_apart_from_each_other(name):
    found = obstacles(read_world(WORLDS / name / "world.sdf"))
    assert len(found) == {"paper": 1, "yard": 8, "corridor": 4}.get(name, len(found))
    for link in found:
        assert abs(surface(link)[:, 2].min()) < 1e-9
    for a, b in combinations(found, 2):
        assert distance_to(a, surface(b)).min() >= 0.6, (a.model, b.model)
        assert distance_to(b, surface(a)).min() >= 0.6, (a.model, b.model)


def test_yard_obstacles_stand_away_from_the_walls():
    world = read_world(WORLDS / "yard" / "world.sdf")
    walls = [link for link in world.links if link.model == "walls"]
    assert len(walls) == 4
    assert min(distance_to(w, surface(o)).min() for w in walls for o in obstacles(world)) >= 1.9


@pytest.mark.parametrize(("name", "margin", "closed"), [("yard", 0.2, True), ("corridor", 0.1, False)])
def test_the_readmes_stops_can_be_driven_and_show_every_obstacle(name, margin, closed):
    world = read_world(WORLDS / name / "world.sdf")
    stops = stops_in(WORLDS / name / "README.md")
    assert len(stops) == 12
    assert stops[0] == (0.0, 0.0, 0.0)
    path = [
        (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), z)
        for a, b in pairwise([*stops, stops[0]] if closed else stops)
        for t in np.linspace(0.0, 1.0, 41)
        for z in (0.05, 0.3, 0.6)
    ]
    solid = [link for link in world.links if link.model != "floor"]
    nearest = {f"{link.model}/{link.name}": distance_to(link, np.array(path)).min() for link in solid}
    assert min(nearest.values()) >= ROBOT_RADIUS + margin, nearest

    for link in obstacles(world):
        seen = 0
        points = surface(link)
        for x, y, yaw_deg in stops:
            d = points[:, :2] - (x, y)
            bearing = np.arctan2(d[:, 1], d[:, 0]) - math.radians(yaw_deg)
            bearing = (bearing + math.pi) % (2.0 * math.pi) - math.pi
            near = np.hypot(*d.T).min()
            seen += bool((np.abs(bearing) < HALF_FOV).all() and 0.8 <= near <= 2.6)
        assert seen >= 2, link.model


def test_a_world_is_built_to_the_same_bytes(tmp_path, monkeypatch):
    build = runpy.run_path(str(WORLDS / "build.py"))
    obstacles = tuple(m for m in build["WORLDS"]["yard"] if m.name in ("post", "sphere"))
    monkeypatch.setitem(build["WORLDS"], "obstacles", obstacles)
    for folder in ("first", "second"):
        build["build"]("obstacles", tmp_path / folder)
    first = sorted(p for p in (tmp_path / "first").rglob("*") if p.is_file())
    assert len(first) == 3
    for path in first:
        assert path.read_bytes() == (tmp_path / "second" / path.relative_to(tmp_path / "first")).read_bytes()


@pytest.mark.parametrize("name", ["paper", "yard", "corridor"])
def test_the_committed_world_file_is_the_built_one(name):
    build = runpy.run_path(str(WORLDS / "build.py"))
    assert (WORLDS / name / "world.sdf").read_text(encoding="utf-8") == world_sdf(
        name, build["WORLDS"][name], made_by=build["MADE_BY"]
    )


def test_a_committed_texture_is_the_built_one(tmp_path):
    from PIL import Image

    build = runpy.run_path(str(WORLDS / "build.py"))
    (model,) = (m for m in build["WORLDS"]["paper"] if m.name == "box")
    built = tmp_path / "box.png"
    write_png(body_texture("paper", model, model.bodies[0]), built, colours=OBJECT_COLOURS)
    images = [Image.open(p).convert("RGB") for p in (built, WORLDS / "paper" / "textures" / "box.png")]
    a, b = (np.asarray(image, dtype=float) for image in images)
    # Another processor may round a sine differently: a level here and there, no more.
    assert a.shape == b.shape
    assert np.abs(a - b).mean() < 0.05
