"""Floors and walls are told from obstacles by what they are."""

import math

import numpy as np
import pytest

from flysim.paths.grid import survey
from flysim.worlds.ground import floor_level, grounded, middle_of
from flysim.worlds.sdf.reader import read_world

CRATE = "<box><size>0.4 0.4 0.4</size></box>"
SLAB = "<box><size>8 8 0.1</size></box>"


def part(geometry, pose=""):
    place = f"<pose>{pose}</pose>" if pose else ""
    return "".join(
        f'<{tag} name="{len(geometry)} {pose}">{place}<geometry>{geometry}</geometry></{tag}>'
        for tag in ("collision", "visual")
    )


def body(name, parts, pose="0 0 0 0 0 0", static=True):
    fixed = "<static>true</static>" if static else ""
    return f'<model name="{name}">{fixed}<pose>{pose}</pose><link name="l">{parts}</link></model>'


def boxes(*spans):
    """An OBJ of boxes (x0, x1, y0, y1, z0, z1)."""
    text, count = "", 0
    for x0, x1, y0, y1, z0, z1 in spans:
        text += "".join(f"v {x} {y} {z}\n" for x in (x0, x1) for y in (y0, y1) for z in (z0, z1))
        for face in ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)):
            text += "f " + " ".join(str(count + k) for k in face) + "\n"
        count += 8
    return text


def ring(half, thick=0.1, high=1.0, low=0.0):
    """The four walls of a square room."""
    a, b = half - thick / 2.0, half + thick / 2.0
    return (a, b, -b, b, low, high), (-b, -a, -b, b, low, high), (-b, b, a, b, low, high), (-b, b, -b, -a, low, high)


@pytest.fixture
def read(tmp_path):
    def make(inside, **files):
        for name, text in files.items():
            (tmp_path / f"{name}.obj").write_text(text)
        (tmp_path / "w.sdf").write_text(f'<sdf version="1.9"><world name="w">{inside}</world></sdf>')
        return read_world(tmp_path / "w.sdf")

    return make


def mesh(name):
    return part(f"<mesh><uri>{name}.obj</uri></mesh>")


def structure(world):
    return {link.model: link.structure for link in world.links}


@pytest.mark.parametrize("name", ["arena_floor", "x", "tisch", "obstacle"])
@pytest.mark.parametrize("geometry", [SLAB, "<cylinder><radius>4</radius><length>0.1</length></cylinder>"])
def test_a_floor_is_what_lies_wide_and_flat_underfoot(read, name, geometry):
    world = read(body(name, part(geometry), "0 0 -0.05 0 0 0") + body("crate", part(CRATE), "1.5 0 0.2 0 0 0"))
    assert structure(world) == {name: True, "crate": False}


def test_what_is_called_a_floor_is_none_for_that(read):
    world = read(body("g", part(SLAB), "0 0 -0.05 0 0 0") + body("floor_lamp", part(CRATE), "1.5 0 0.2 0 0 0"))
    assert structure(world)["floor_lamp"] is False


def test_a_table_is_no_floor_and_a_ceiling_no_obstacle(read):
    top = body("table", part("<box><size>2.5 2.5 0.05</size></box>"), "3 0 0.75 0 0 0")
    roof = body("roof", part(SLAB), "0 0 2.6 0 0 0")
    world = read(body("g", part(SLAB), "0 0 -0.05 0 0 0") + top + roof)
    assert structure(world) == {"g": True, "table": False, "roof": True}


def test_a_link_with_floor_walls_and_things_is_two(read):
    inside = part(SLAB, "0 0 -0.05 0 0 0") + part("<box><size>0.1 8 1</size></box>", "4 0 0.5 0 0 0")
    world = read(body("arena", inside + part(CRATE, "1.5 0 0.2 0 0 0")))
    assert [(link.model, link.structure, len(link.visuals)) for link in world.links] == [
        ("arena", True, 2),
        ("arena", False, 1),
    ]
    assert world.links[1].visuals[0].shape.size == (0.4, 0.4, 0.4)


@pytest.mark.parametrize(("name", "yaw"), [("wall_ring", 0.0), ("enclosure", 0.7)])
def test_a_room_in_one_mesh_is_structure_and_free_inside(read, name, yaw):
    world = read(
        body("g", part("<plane><size>20 20</size></plane>"))
        + body(name, mesh("room"), f"0 0 0 0 0 {yaw}")
        + body("crate", part(CRATE), "1.5 0 0.2 0 0 0"),
        room=boxes(*ring(2.0, high=0.5)),
    )
    assert structure(world) == {"g": True, name: True, "crate": False}
    clear = survey(world, 0.5).clear_of(np.array([[0.0, 0.0], [2.0 * math.cos(yaw), 2.0 * math.sin(yaw)]]))
    assert clear[0] > 1.2
    assert clear[1] == 0.0


def test_a_closed_crate_of_one_mesh_is_full_and_no_wall(read):
    world = read(
        body("g", part("<plane><size>20 20</size></plane>")) + body("crate", mesh("crate")),
        crate=boxes((1.0, 2.2, -0.6, 0.6, 0.0, 0.9)),
    )
    assert structure(world)["crate"] is False
    assert survey(world, 0.5).clear_of(np.array([[1.6, 0.0]]))[0] == 0.0


def test_a_ring_of_short_walls_is_a_room_and_what_stands_in_it_is_not(read):
    sides = [("a", "1.2 0.1 0.5", 0, 1.2), ("b", "1.2 0.1 0.5", 0, -1.2)]
    sides += [("c", "0.1 2.5 0.5", 1.2, 0), ("d", "0.1 2.5 0.5", -1.2, 0)]
    corners = [(f"e{x}{y}", "0.7 0.1 0.5", x * 0.9, y * 1.2) for x in (-1, 1) for y in (-1, 1)]
    walls = "".join(
        body(n, part(f"<box><size>{s}</size></box>"), f"{x} {y} 0.25 0 0 0") for n, s, x, y in sides + corners
    )
    beam = body("beam", part("<box><size>0.8 0.15 0.4</size></box>"), "0.3 0.5 0.2 0 0 0")
    found = structure(read(body("g", part("<plane><size>9 9</size></plane>")) + walls + beam))
    assert found == {"g": True, "beam": False, **{n: True for n, *_ in sides + corners}}


@pytest.mark.parametrize("z", [0.034, -12.0])
def test_a_floor_off_zero_is_found_and_put_there(read, z):
    world = read(body("g", mesh("hall")) + body("crate", part(CRATE), f"1.5 0 {z + 0.2} 0 0 0"),
                 hall=boxes((-2.5, 2.5, -2.5, 2.5, z - 0.1, z), *ring(2.5, low=z, high=z + 0.5)))  # fmt: skip
    assert floor_level(world.links) == pytest.approx(z)
    assert structure(world) == {"g": True, "crate": False}
    moved = grounded(world)
    assert moved.links[1].T_world_link[2, 3] == pytest.approx(0.2)
    assert f"the floor is at z = {z:.3f}" in moved.warnings[-1]
    assert survey(moved, 0.5).clear_of(np.zeros((1, 2)))[0] > 1.0


def test_a_floor_on_the_ground_carries_and_the_ground_round_it_does_not(read):
    world = grounded(read(body("g", part("<plane><size>20 20</size></plane>")) + body("f", part(SLAB))))
    grid = survey(world, 0.5)
    assert world.links[1].T_world_link[2, 3] == pytest.approx(-0.05)
    assert grid.clear_of(np.array([[0.0, 0.0], [5.0, 0.0]]))[0] > 3.0
    assert grid.clear_of(np.array([[5.0, 0.0]]))[0] == 0.0


def test_a_world_at_zero_stays_as_it_is(read):
    world = read(body("g", part("<plane><size>20 20</size></plane>")))
    assert grounded(world) is world


def test_a_world_in_map_coordinates_begins_in_its_own_middle(read):
    world = read(
        body("g", part("<plane><size>20 20</size></plane>"))
        + body("a", part(CRATE), "1201.5 800 0.2 0 0 0")
        + body("b", part(CRATE), "1200 801.5 0.2 0 0 0")
    )
    assert middle_of(world.links) == pytest.approx([1200.75, 800.75])
    grid = survey(world, 0.5)
    assert grid.cell == 0.025
    assert grid.clear_of(np.array([[1200.75, 800.75]]))[0] > 0.5


def test_things_of_one_link_that_stand_apart_are_so_many(read):
    crate, table = part(CRATE, "1.5 0 0.2 0 0 0"), part(CRATE, "2 2 0.2 0 0 0.5") + part(CRATE, "2.3 2 0.2 0 0 0")
    links = read(body("house", part(SLAB, "0 0 -0.05 0 0 0") + crate + table)).links
    assert [(one.name, one.structure, len(one.visuals), len(one.collisions)) for one in links] == [
        ("l", True, 1, 1),
        ("l", False, 1, 1),
        ("l#2", False, 2, 2),
    ]
    (moving,) = read(body("house", crate + table, static=False)).links
    assert len(moving.visuals) == 3


def test_a_saved_state_may_insert_an_include(read, tmp_path):
    (tmp_path / "drum.sdf").write_text(f"<sdf>{body('drum', part(CRATE))}</sdf>")
    world = read(
        "<state><insertions><include><uri>drum.sdf</uri><name>a</name></include></insertions>"
        '<model name="a"><pose>1 2 3 0 0 0</pose></model></state>'
    )
    assert world.links[0].T_world_link[:3, 3].tolist() == [1.0, 2.0, 3.0]
    assert world.warnings == ()
