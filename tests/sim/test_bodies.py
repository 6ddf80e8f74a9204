import math
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest

from flysim.errors import WorldError
from flysim.geometry.frames import inverse, pose6, transform
from flysim.sim.bodies import MAX_COMPOUND
from flysim.sim.bullet import pybullet as p
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere
from flysim.worlds.surface.texture import write_png

# A trough: two walls on a slab. Its hull would be a block.
TROUGH = (
    ((-0.4, -0.5, 0.0), (0.8, 1.0, 0.1)),
    ((-0.4, -0.5, 0.1), (0.2, 1.0, 0.4)),
    ((0.2, -0.5, 0.1), (0.2, 1.0, 0.4)),
)


def trough():
    vertices, faces = [], []
    for low, size in TROUGH:
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size + low
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        faces += [[len(vertices) + i for i in t] for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
        vertices += corners.tolist()
    return Mesh(np.array(vertices), np.array(faces), None, Path("trough.obj"))


SOLIDS = {"box": Box((0.5, 0.3, 0.7)), "cylinder": Cylinder(0.2, 0.6), "sphere": Sphere(0.25), "mesh": trough()}
TURNED = (2.0, 0.4, 1.0, 0.3, -0.5, 1.1)  # every way, and off the floor


def rays(simulation, starts, ends):
    """`[N]` body each ray meets and `[N, 3]` where."""
    found = [
        p.rayTest(list(a), list(b), physicsClientId=simulation.client)[0] for a, b in zip(starts, ends, strict=True)
    ]
    return np.array([ray[0] for ray in found]), np.array([ray[3] for ray in found])


def outside(shape, away=0.02, count=60):
    """`[N, 3]` points on all sides of a convex shape, `away` metres from its surface."""
    rng = np.random.default_rng(3)
    points = rng.normal(size=(count, 3))
    points *= 2.0 / np.linalg.norm(points, axis=1, keepdims=True)
    for _ in range(200):  # step towards the centre by what is free
        points -= points / np.linalg.norm(points, axis=1, keepdims=True) * (shape.distance(points) - away)[:, None]
    return points


def distances(simulation, body, points, radius=0.01):
    """`[N]` distance [m] that pybullet has between points and a body: of a small ball there, plus its radius."""
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=radius, physicsClientId=simulation.client)
    found = []
    for point in points:
        ball = p.createMultiBody(0.0, shape, basePosition=point.tolist(), physicsClientId=simulation.client)
        contacts = p.getClosestPoints(ball, body, 0.1, physicsClientId=simulation.client)
        found.append(min(contact[8] for contact in contacts) + radius)
        p.removeBody(ball, physicsClientId=simulation.client)
    return np.array(found)


@pytest.mark.parametrize("static", [True, False])
@pytest.mark.parametrize("name", ["box", "cylinder", "sphere"])
def test_what_is_touched_is_the_shapes_surface(made, name, static):
    shape = SOLIDS[name]
    points = outside(shape)
    assert shape.distance(points) == pytest.approx(0.02, abs=1e-9)
    with made.simulation(made.link("thing", shape, TURNED, static=static)) as simulation:
        T = simulation.T_world_links()[1]
        error = np.abs(distances(simulation, simulation.bodies[1][0], transform(T, points)) - 0.02)
    assert np.median(error) < 1e-5
    assert error.max() < 8e-4  # Bullet rounds edges and corners by 1 mm
    moved = np.abs(T - pose6(*TURNED)).max()
    assert moved == 0.0 if static else moved > 0.1  # what is not static has fallen meanwhile


def test_what_a_ray_meets_is_the_meshs_surface(made):
    shape = SOLIDS["mesh"]
    with made.simulation(made.link("thing", shape, TURNED)) as simulation:
        rng = np.random.default_rng(3)
        away = rng.normal(size=(200, 3))
        starts = np.array(TURNED[:3]) + 2.0 * away / np.linalg.norm(away, axis=1, keepdims=True)
        ends = starts + 2.0 * (np.array(TURNED[:3]) + rng.uniform(-0.3, 0.3, (200, 3)) - starts)
        body, met = rays(simulation, starts, ends)
    on = transform(inverse(pose6(*TURNED)), met[body == simulation.bodies[1][0]])
    assert len(on) > 100
    assert shape.distance(on).max() < 1e-5


def test_a_static_mesh_is_hollow_where_it_is_hollow(made):
    with made.simulation(made.link("trough", SOLIDS["mesh"], (2, 0, 0, 0, 0, 0))) as simulation:
        body, met = rays(simulation, [(2, 0, 3), (2.3, 0, 3)], [(2, 0, -1), (2.3, 0, -1)])
    assert (body == simulation.bodies[1][0]).all()
    assert met[:, 2] == pytest.approx([0.1, 0.5], abs=1e-5)


def test_a_mesh_that_moves_is_its_hull(made):
    link = made.link("trough", SOLIDS["mesh"], (2, 0, 0.01, 0, 0, 0), static=False, mass=5.0)
    with made.simulation(link) as simulation:
        _, met = rays(simulation, [(2, 0, 3)], [(2, 0, -1)])
    assert met[0, 2] == pytest.approx(0.5, abs=0.02)


def test_a_planes_collision_has_no_end(made):
    with made.simulation() as simulation:  # the floor is drawn on 8 x 8 m
        _, met = rays(simulation, [(50, -70, 1)], [(50, -70, -1)])
        assert met[0] == pytest.approx((50, -70, 0), abs=1e-6)
        assert np.abs(simulation.bounds()).max() < 10.0


def test_a_plane_that_is_turned(made):
    with made.simulation(made.link("ramp", Plane((1, 1)), (3, 0, 1, 0.3, 0.4, 0.2))) as simulation:
        T = simulation.T_world_links()[1]
        _, met = rays(simulation, [(3, 3, 5), (2.9, 0.1, 5)], [(3, 3, -5), (2.9, 0.1, -5)])
    assert transform(inverse(T), met)[:, 2] == pytest.approx([0, 0], abs=1e-5)


@pytest.mark.parametrize(
    ("shape", "height"), [(Box((0.3, 0.2, 0.4)), 0.2), (Cylinder(0.15, 0.3), 0.15), (Sphere(0.12), 0.12)]
)
def test_what_moves_falls_and_comes_to_rest_on_the_floor(made, shape, height):
    with made.simulation(made.link("thing", shape, (2, 0, 0.8, 0, 0, 0.4), static=False)) as simulation:
        high = simulation.T_world_links()[1, 2, 3]
        for _ in range(480):
            simulation.step(0.0, 0.0)
        rest = simulation.T_world_links()[1]
        for _ in range(48):
            simulation.step(0.0, 0.0)
        later = simulation.T_world_links()[1]
    assert high <= 0.8
    assert rest[2, 3] == pytest.approx(height, abs=1e-3)
    assert np.abs(later - rest).max() < 1e-4
    assert rest[2, 2] == pytest.approx(1.0, abs=1e-3)  # upright


def test_it_falls_as_fast_as_the_worlds_gravity(made):
    with made.simulation(made.link("ball", Sphere(0.1), (2, 0, 3, 0, 0, 0), static=False)) as simulation:
        assert simulation.T_world_links()[1, 2, 3] == pytest.approx(
            0.1, abs=0.01
        )  # before a robot drives it lies there
        made.lift(simulation, 1, 3.0)
        simulation.advance(0.0, 0.0, 128)
        fallen = 3.0 - simulation.T_world_links()[1, 2, 3]
        assert fallen == pytest.approx(9.81 * (128 / 240) ** 2 / 2.0, rel=0.02)


def test_mass_and_inertia_of_the_file_are_the_bodys(made):
    link = made.link("box", Box((0.2, 0.2, 0.2)), TURNED, static=False, mass=2.5, inertia=(0.1, 0.2, 0.25))
    with made.simulation(link) as simulation:
        mass, _, moments, *_ = p.getDynamicsInfo(simulation.bodies[1][0], -1, physicsClientId=simulation.client)
    assert mass == 2.5
    assert moments == pytest.approx((0.1, 0.2, 0.25))


def test_inertia_that_the_file_leaves_out_is_the_shapes(made):
    link = made.link("box", Box((0.2, 0.3, 0.4)), TURNED, static=False, mass=12.0)
    with made.simulation(link) as simulation:
        moments = p.getDynamicsInfo(simulation.bodies[1][0], -1, physicsClientId=simulation.client)[2]
    assert moments == pytest.approx((0.25, 0.20, 0.13), rel=1e-6)  # m (b^2 + c^2) / 12


def compound(count, *, static, visuals=True):
    """A row of small boxes 10 cm apart."""
    parts = tuple(
        Part(name=f"p{i}", shape=Box((0.05, 0.05, 0.05)), T_link_part=pose6(0.1 * i, 0, 0, 0, 0, 0.1 * i))
        for i in range(count)
    )
    return Link(
        name="body",
        model="rack",
        T_world_link=pose6(1.0, 0.5, 0.3, 0, 0, 0.5),
        visuals=parts if visuals else (),
        collisions=parts,
        static=static,
        structure=False,
    )


@pytest.mark.parametrize("static", [True, False])
def test_each_part_of_a_link_is_where_it_belongs(made, static):
    with made.simulation(compound(5, static=static)) as simulation:
        T = simulation.T_world_links()[1]
        for part in simulation.world.links[1].collisions:
            T_part = T @ part.T_link_part
            above = transform(T_part, (0.01, 0.02, 1.0)), transform(T_part, (0.01, 0.02, -1.0))
            _, met = rays(simulation, *[[end] for end in above])
            assert transform(inverse(T_part), met[0]) == pytest.approx((0.01, 0.02, 0.025), abs=1e-4)


def test_more_shapes_than_pybullet_moves_are_refused_and_static_ones_are_not(made):
    with made.simulation(compound(MAX_COMPOUND + 4, static=True)) as simulation:
        assert len(simulation.bodies[1]) == MAX_COMPOUND + 4
    made.simulation(compound(MAX_COMPOUND, static=False)).close()
    with pytest.raises(WorldError, match=r"model 'rack', link 'body': 17 collisions on a body that moves; at most 16"):
        made.simulation(compound(MAX_COMPOUND + 1, static=False))


def test_a_plane_cannot_move(made):
    with pytest.raises(WorldError, match=r"model 'rug', link 'body': a plane cannot move. Make it static"):
        made.simulation(made.link("rug", Plane((1.0, 1.0)), static=False))


def test_a_ghost_is_seen_and_blocks_nobody(made):
    solid = made.link("ghost", Box((0.4, 0.4, 0.4)), (1, 0, 0.2, 0, 0, 0))
    ghost = Link(
        name="body",
        model="ghost",
        T_world_link=solid.T_world_link,
        visuals=solid.visuals,
        collisions=(),
        static=True,
        structure=False,
    )
    corners = []
    for textured in (False, True):
        with made.simulation(ghost, textured=textured) as simulation:
            body, _ = rays(simulation, [(0.5, 0.3, 0.1)], [(3, -1.2, 0.1)])
            assert body[0] == -1
            corners.append(simulation.bounds())
    assert np.array_equal(*corners)
    assert corners[0] == pytest.approx(np.array([[0.8, -0.2, 0.0], [1.2, 0.2, 0.4]]))
    assert math.isclose(corners[0][1, 2], 0.4)


@pytest.mark.parametrize("static", [True, False])
def test_no_name_of_a_world_file_reaches_pybullet(made, tmp_path, monkeypatch, capfd, static):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    texture = tmp_path / "%n%s {x}.png"
    write_png(np.full((4, 4, 3), 99, np.uint8), texture)
    meshes = []
    for function in (
        "createCollisionShape",
        "createCollisionShapeArray",
        "createVisualShape",
        "createVisualShapeArray",
    ):

        def noted(*arguments, call=getattr(p, function), **named):
            meshes.extend(name for name in named.get("fileNames", [named.get("fileName")]) if name)
            return call(*arguments, **named)

        monkeypatch.setattr(p, function, noted)
    odd = ("%n%n%s", "../../x", "a\nb", "x" * 5000, "a b\\c:;$(d)", "")
    links = [
        made.link(name, SOLIDS["mesh"], (i, 3, 1, 0, 0, 0), static=static, texture=texture)
        for i, name in enumerate(odd)
    ]
    with made.simulation(*links, textured=True) as simulation:
        folder = Path(simulation._scratch.name)
        written = sorted(path.name for path in folder.iterdir())
        assert {path.suffix for path in folder.iterdir()} == {".obj", ".mtl", ".bmp", ".urdf"}
    assert len(meshes) == 13  # a collision and a visual each, and the floor's visual
    for path in map(Path, meshes):
        assert path.parent == folder
        assert path.name in written
    assert all(re.fullmatch(r"mesh_\d+\.(obj|mtl|bmp)|robot\.urdf", name) for name in written)
    assert capfd.readouterr() == ("", "")
