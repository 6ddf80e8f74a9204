"""What the SDF reader makes of a world file, by hand arithmetic."""

import gzip
import math
import shutil
import time
from pathlib import Path

import numpy as np
import pytest

from flysim.errors import WorldError
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere
from flysim.worlds.surface.texture import write_png

BARN = Path(__file__).resolve().parents[4] / "shared" / "data" / "barn"
BOX = "<geometry><box><size>1 2 3</size></box></geometry>"


def write(folder, body, *, world="", xmlns='xmlns:flysim="urn:flysim:sdf"'):
    path = folder / "world.sdf"
    path.write_text(f'<sdf version="1.9" {xmlns}><world name="w">{world}{body}</world></sdf>', encoding="utf-8")
    return path


def model(inside, name="m", static=True, pose=""):
    fixed = "<static>true</static>" if static else ""
    return f'<model name="{name}">{fixed}{pose and f"<pose>{pose}</pose>"}{inside}</model>'


def link(geometry, name="l", pose="", extra=""):
    shape = f"<geometry>{geometry}</geometry>"
    return (
        f'<link name="{name}">{pose and f"<pose>{pose}</pose>"}{extra}'
        f'<collision name="c">{shape}</collision><visual name="v">{shape}</visual></link>'
    )


def shape_of(folder, geometry):
    (found,) = read_world(write(folder, model(link(geometry)))).links
    return found.collisions[0].shape


def test_each_shape_has_the_size_of_the_file(tmp_path):
    assert shape_of(tmp_path, "<box><size>1 2 3</size></box>") == Box((1.0, 2.0, 3.0))
    assert shape_of(tmp_path, "<sphere><radius>0.25</radius></sphere>") == Sphere(0.25)
    cylinder = "<cylinder><radius>0.075</radius><length>1e0</length></cylinder>"
    assert shape_of(tmp_path, cylinder) == Cylinder(0.075, 1.0)
    assert shape_of(tmp_path, "<plane><size>4 5</size></plane>") == Plane((4.0, 5.0))


def test_a_wide_plane_is_cut_and_the_cut_is_told(tmp_path):
    world = read_world(write(tmp_path, model(link("<plane><size>1000 30</size></plane>"))))
    assert world.links[0].visuals[0].shape == Plane((100.0, 30.0))
    assert "100 m" in world.warnings[0]


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 0, 0), (0, -2, 0), (0, 0, -1), (1, 2, -3), (0.1, 0, -0.9999)])
def test_a_planes_normal_turns_it(tmp_path, normal):
    text = "<plane><normal>{} {} {}</normal><size>1 1</size></plane>".format(*normal)
    (found,) = read_world(write(tmp_path, model(link(text)))).links
    R = found.visuals[0].T_link_part[:3, :3]
    np.testing.assert_allclose(R @ [0, 0, 1], np.array(normal) / np.linalg.norm(normal), atol=1e-12)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_nested_poses_by_hand(tmp_path):
    # A quarter turn left at (1, 2, 0); in it 1 m ahead (+y of the world), another quarter turn; in it the
    # link 0.5 m ahead (-x of the world) and 0.25 up; in it the visual 0.1 m ahead (-x again).
    turned = f"0 0 {math.pi / 2:.15f}"
    part = f'<visual name="v"><pose>0.1 0 0 0 0 0</pose>{BOX}</visual>'
    inner = model(
        f'<link name="l"><pose>0.5 0 0.25 0 0 0</pose>{part}</link>',
        name="inner",
        pose="1 0 0 " + turned,
    )
    (found,) = read_world(write(tmp_path, model(inner, name="outer", pose="1 2 0 " + turned))).links
    assert found.model == "outer::inner"
    assert found.T_world_link[:3, 3] == pytest.approx([0.5, 3.0, 0.25])
    assert found.T_world_link[:3, :3] == pytest.approx(np.diag([-1.0, -1.0, 1.0]))
    T_world_part = found.T_world_link @ found.visuals[0].T_link_part
    assert T_world_part[:3, 3] == pytest.approx([0.4, 3.0, 0.25])


def test_roll_pitch_yaw_are_about_fixed_axes(tmp_path):
    # Roll a quarter first: z to -y; then yaw a quarter: -y to +x.
    half = f"{math.pi / 2:.15f}"
    text = link("<sphere><radius>1</radius></sphere>", pose=f"0 0 0 {half} 0 {half}")
    (found,) = read_world(write(tmp_path, model(text))).links
    assert found.T_world_link[:3, :3] @ [0, 0, 1] == pytest.approx([1.0, 0.0, 0.0])


def test_degrees_and_quaternions(tmp_path):
    body = link("<sphere><radius>1</radius></sphere>")
    a = f'<model name="a"><pose degrees="true">1 2 3 0 0 90</pose>{body}</model>'
    quaternion = '<pose rotation_format="quat_xyzw">1 2 3 0 0 0.70710678 0.70710678</pose>'
    b = f'<model name="b">{quaternion}{body}</model>'
    first, second = read_world(write(tmp_path, a + b)).links
    assert first.T_world_link == pytest.approx(second.T_world_link, abs=1e-7)
    assert first.T_world_link[:3, :3] @ [1, 0, 0] == pytest.approx([0, 1, 0])


@pytest.mark.parametrize("attribute", ['frame=""', 'relative_to="m"', 'relative_to="__model__"'])
def test_a_pose_relative_to_its_parent_is_read(tmp_path, attribute):
    text = f'<link name="l"><pose {attribute}>0 0 2 0 0 0</pose><visual name="v">{BOX}</visual></link>'
    (found,) = read_world(write(tmp_path, model(text, pose="0 1 0 0 0 0"))).links
    assert found.T_world_link[:3, 3] == pytest.approx([0, 1, 2])


def test_a_pose_relative_to_something_else_is_refused(tmp_path):
    text = f'<link name="l"><pose relative_to="other">0 0 2 0 0 0</pose><visual name="v">{BOX}</visual></link>'
    with pytest.raises(
        WorldError, match=r"model 'm', link 'l': its pose is relative to 'other', and there is no such frame"
    ):
        read_world(write(tmp_path, model(text)))


def test_structure_is_what_the_element_says_else_what_a_thing_is(tmp_path):
    solid, flat = link("<sphere><radius>1</radius></sphere>"), link("<plane><size>1 1</size></plane>")
    slab, wall = link("<box><size>6 6 0.1</size></box>"), link("<box><size>0.1 4 1</size></box>")

    def mark(text):
        return f"<flysim:structure>{text}</flysim:structure>"

    body = (
        model(solid, "ground_lamp")
        + model(solid, "Wall_1")
        + model(slab, "arena", pose="0 0 -0.05 0 0 0")
        + model(wall, "partition", pose="2 0 0.5 0 0 0")
        + model(flat, "sheet")
        + model(mark("false") + flat, "floor2")
        + model(mark("true") + solid, "ramp")
        + model(mark("1") + model(solid, "inner"), "outer")
    )
    structure = {found.model: found.structure for found in read_world(write(tmp_path, body)).links}
    assert structure == {
        "ground_lamp": False,
        "Wall_1": False,
        "arena": True,
        "partition": True,
        "sheet": True,
        "floor2": False,
        "ramp": True,
        "outer::inner": True,
    }


def test_a_structure_element_of_another_namespace_is_named(tmp_path):
    inside = "<flysim:structure>true</flysim:structure>" + link("<sphere><radius>1</radius></sphere>")
    world = read_world(write(tmp_path, model(inside), xmlns='xmlns:flysim="urn:other"'))
    assert not world.links[0].structure
    assert "urn:flysim:sdf" in world.warnings[0]


def test_static_and_dynamic_with_mass_and_inertia(tmp_path):
    inertial = "<inertial><mass>2.5</mass><inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia></inertial>"
    sphere = "<sphere><radius>1</radius></sphere>"
    body = (
        model(link(sphere, extra=inertial), "ball", static=False)
        + model(link(sphere), "light", static=False)
        + model(model(link(sphere), "inner", static=False), "outer")
    )
    ball, light, inner = read_world(write(tmp_path, body)).links
    assert (ball.static, ball.mass, ball.inertia) == (False, 2.5, (0.1, 0.2, 0.25))
    assert (light.static, light.mass, light.inertia) == (False, 1.0, None)
    assert inner.static  # all that is in a static model is


def test_materials(tmp_path):
    (tmp_path / "textures").mkdir()
    write_png(np.full((4, 6, 3), 90, np.uint8), tmp_path / "textures" / "a.png")

    def visual(name, material):
        return f'<visual name="{name}">{BOX}<material>{material}</material></visual>'

    def pbr(uri, workflow="metal"):
        return f"<pbr><{workflow}><albedo_map>{uri}</albedo_map></{workflow}></pbr>"

    script = "<script><uri>x</uri><name>{}</name></script>"
    text = (
        visual("plain", "")
        + visual("red", "<diffuse>1 0.5 0 1</diffuse>")
        + visual("gazebo", script.format("Gazebo/White"))
        + visual("unknown", script.format("My/Own"))
        + visual("path", pbr("textures/a.png"))
        + visual("file", pbr("file://textures/a.png", "specular"))
        + visual("model", pbr("model://textures/a.png") + "<diffuse>0 0 1</diffuse>")
        + visual("own", pbr(f"model://{tmp_path.name}/textures/a.png"))
    )
    world = read_world(write(tmp_path, model(f'<link name="l">{text}</link>')))
    found = {part.name: part.material for part in world.links[0].visuals}
    assert found["plain"].diffuse == (0.7, 0.7, 0.7)
    assert found["red"].diffuse == (1.0, 0.5, 0.0)
    assert found["gazebo"].diffuse == (1.0, 1.0, 1.0)
    assert found["model"].diffuse == (0.0, 0.0, 1.0)
    png = (tmp_path / "textures" / "a.png").resolve()
    textures = {name: material.texture for name, material in found.items() if material.texture}
    assert textures == dict.fromkeys(("path", "file", "model", "own"), png)
    assert len(world.warnings) == 1
    assert "My/Own" in world.warnings[0]


def test_links_keep_what_they_have_and_get_names(tmp_path):
    links = f"<link><visual>{BOX}</visual></link><link><collision>{BOX}</collision></link><link/>"
    body = f"<model><static>1</static>{links}</model>"
    first, second = read_world(write(tmp_path, body)).links
    assert (first.model, first.name, first.visuals[0].name) == ("model_0", "link_0", "visual_0")
    assert first.collisions == ()
    assert (second.name, second.visuals, second.collisions[0].name) == ("link_1", (), "collision_0")


def test_a_saved_state_says_where_things_stand(tmp_path):
    sphere = link("<sphere><radius>1</radius></sphere>")
    inner = model(sphere, "inner", pose="0 0 1 0 0 0")
    lone = model(sphere + link("<sphere><radius>1</radius></sphere>", "k", pose="0 1 0 0 0 0"), pose="4 0 0 0 0 0")
    text = lone + model(inner, "outer") + model(sphere, "gone")
    turned = f"9 8 7 0 0 {math.pi / 2:.15f}"
    state = (
        f'<state world_name="w"><model name="m"><pose frame="">{turned}</pose>'
        '<link name="l"><pose>1 2 3 0 0 0</pose></link></model>'
        '<model name="outer"><pose>0 0 5 0 0 0</pose><scale>2 2 2</scale></model>'
        f"<insertions>{model(sphere, 'new', pose='7 0 0 0 0 0')}</insertions>"
        "<deletions><name>gone</name></deletions></state>"
    )
    world = read_world(write(tmp_path, text + state))
    places = {(found.model, found.name): found.T_world_link[:3, 3].tolist() for found in world.links}
    assert places[("m", "l")] == [1.0, 2.0, 3.0]  # of a link in the world, as Gazebo saves it
    assert places[("m", "k")] == pytest.approx([8.0, 8.0, 7.0])  # carried along by its model: turned to the left
    assert places[("outer::inner", "l")] == [0.0, 0.0, 6.0]
    assert places[("new", "l")] == [7.0, 0.0, 0.0]
    assert len(world.links) == 4
    assert next(found for found in world.links if found.model == "outer::inner").visuals[0].shape == Sphere(2.0)
    assert "a saved <scale>" in world.warnings[0]


def test_gravity(tmp_path):
    assert read_world(write(tmp_path, "")).gravity == -9.81
    assert read_world(write(tmp_path, "<gravity>0 0 -1.62</gravity>")).gravity == -1.62
    assert read_world(write(tmp_path, "<physics><gravity>0 0 -3</gravity></physics>")).gravity == -3.0


def test_what_is_skipped_is_named_once_a_kind(tmp_path):
    sphere = link("<sphere><radius>1</radius></sphere>")
    odd = '<link name="{}"><visual name="v"><geometry><heightmap/></geometry></visual></link>'
    body = (
        model(
            sphere + '<joint name="hinge" type="revolute"/><joint name="rail" type="prismatic"/>', "door", static=False
        )
        + model(odd.format("a") + odd.format("b"), "hill")
        + model(sphere.replace("</link>", '<sensor name="eye"/></link>'), "robot")
        + '<plugin name="p" filename="libmine.so"/>'
        + '<plugin name="q" filename="gz-sim-physics-system"/><light name="sun"/><scene/><physics/>'
        + "<include><uri>model://elsewhere</uri></include><include><uri>model://sun</uri></include>"
    )
    warnings = read_world(write(tmp_path, body)).warnings
    assert len(warnings) == 5
    joined = "\n".join(warnings)
    for words in (
        "<joint>",
        "'hinge'",
        "<heightmap>",
        "<sensor>",
        "'eye'",
        "<plugin>",
        "'p'",
        "'model://elsewhere'",
    ):
        assert words in joined
    assert all(w.endswith(".") and "\n" not in w for w in warnings)


def test_an_include_in_the_worlds_folder_is_read(tmp_path):
    (tmp_path / "crate" / "materials").mkdir(parents=True)
    write_png(np.full((4, 4, 3), 90, np.uint8), tmp_path / "crate" / "materials" / "c.png")
    album = "<material><pbr><metal><albedo_map>materials/c.png</albedo_map></metal></pbr></material>"
    part = f'<link name="l"><visual name="v">{BOX}{album}</visual></link>'
    inside = f'<model name="crate"><pose>0 0 7 0 0 0</pose>{part}</model>'
    (tmp_path / "crate" / "model.sdf").write_text(f'<sdf version="1.9">{inside}</sdf>')
    include = "<include><uri>model://crate</uri>{}</include>"
    body = include.format("") + include.format("<name>two</name><static>true</static><pose>1 0 0 0 0 0</pose>")
    world = read_world(write(tmp_path, body))
    first, second = world.links
    assert (first.model, first.static, first.T_world_link[2, 3]) == ("crate", False, 7.0)
    assert (second.model, second.static) == ("two", True)
    assert second.T_world_link[:3, 3] == pytest.approx([1, 0, 0])
    assert first.visuals[0].material.texture == (tmp_path / "crate/materials/c.png").resolve()
    assert world.warnings == ()


def test_gzipped_and_with_a_byte_order_mark(tmp_path):
    plain = write(tmp_path, model(link("<sphere><radius>1</radius></sphere>"))).read_bytes()
    (tmp_path / "a.world.gz").write_bytes(gzip.compress(plain))
    (tmp_path / "b.world").write_bytes(b"\xef\xbb\xbf" + plain)
    assert len(read_world(tmp_path / "a.world.gz").links) == 1
    assert len(read_world(tmp_path / "b.world").links) == 1


OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 2\nvt 0 0\nvt 1 0\nvt 0 1\n"


def test_an_obj_mesh(tmp_path):
    (tmp_path / "m.obj").write_text(f"mtllib /etc/passwd\n{OBJ}f 1/1 2/2 3/3 4/1 # a quad\nf -5/1 -4/2 -1/3\n")
    mesh = shape_of(tmp_path, "<mesh><uri>m.obj</uri><scale>2 1 0.5</scale></mesh>")
    assert isinstance(mesh, Mesh)
    assert len(mesh.faces) == 3
    assert mesh.uv is not None
    corners = mesh.vertices[mesh.faces[2]]
    assert corners == pytest.approx(np.array([[0, 0, 0], [2, 0, 0], [0, 0, 1]]))
    assert mesh.uv[mesh.faces[2]] == pytest.approx(np.array([[0, 0], [1, 0], [0, 1]]))


def test_a_mirrored_mesh_stays_outward(tmp_path):
    (tmp_path / "m.obj").write_text(OBJ + "f 1 2 3\n")
    mesh = shape_of(tmp_path, "<mesh><uri>m.obj</uri><scale>-1 1 1</scale></mesh>")
    assert isinstance(mesh, Mesh)
    a, b, c = mesh.vertices[mesh.faces[0]]
    assert np.cross(b - a, c - a)[2] > 0.0


def test_text_and_binary_stl_are_the_same_mesh(tmp_path):
    import trimesh

    box = trimesh.creation.box((1.0, 2.0, 3.0))
    (tmp_path / "b.stl").write_bytes(trimesh.exchange.stl.export_stl(box))
    (tmp_path / "t.stl").write_text(trimesh.exchange.stl.export_stl_ascii(box))
    for name in ("b.stl", "t.stl"):
        mesh = shape_of(tmp_path, f"<mesh><uri>{name}</uri></mesh>")
        assert isinstance(mesh, Mesh)
        found = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        assert len(mesh.vertices) == 8
        assert found.is_watertight
        assert found.volume == pytest.approx(6.0)


def test_one_mesh_file_is_read_once(tmp_path):
    (tmp_path / "m.obj").write_text(OBJ + "f 1 2 3\n")
    (found,) = read_world(write(tmp_path, model(link("<mesh><uri>m.obj</uri></mesh>")))).links
    assert found.visuals[0].shape is found.collisions[0].shape


@pytest.mark.skipif(not BARN.is_dir(), reason="the BARN worlds are not beside the repository")
def test_barn_worlds():
    began = time.perf_counter()
    counts = []
    for path in sorted(BARN.glob("world_*.world.gz"))[::6]:
        world = read_world(path)
        assert world.warnings == ()
        (ground,) = (found for found in world.links if found.structure)
        assert ground.model == "ground_plane"
        cylinders = [found for found in world.links if not found.structure]
        counts.append(len(cylinders))
        # Each file holds exactly so many models: <state> repeats them without a <static>.
        assert len(cylinders) + 1 == gzip.decompress(path.read_bytes()).count(b"<static>")
        for found in cylinders:
            assert found.static
            assert found.collisions[0].shape == found.visuals[0].shape == Cylinder(0.075, 1.0)
            assert found.T_world_link[2, 3] == 0.0
            x, y = found.T_world_link[:2, 3]
            assert -4.6 < x < 0.0
            assert -0.1 < y < 15.1
    assert len(counts) == 5
    assert min(counts) >= 181
    assert max(counts) <= 365
    print(f"{len(counts)} BARN worlds of {counts} cylinders in {time.perf_counter() - began:.2f} s")


def test_the_world_does_not_need_its_folders_name(tmp_path):
    write(tmp_path, "")
    other = tmp_path / "a b"
    other.mkdir()
    shutil.copy(tmp_path / "world.sdf", other / "yard.world")
    assert read_world(other / "yard.world").name == "w"
    assert read_world(other / "yard.world").path == other / "yard.world"
