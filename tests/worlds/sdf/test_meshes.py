"""Meshes of other programs: their units, axes, materials and pictures; and what they may not do."""

import json

import numpy as np
import pytest
from PIL import Image

from flysim.errors import WorldError
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Mesh

NUMBERS = "-1 -2 -3 1 -2 -3 1 2 -3 -1 2 -3 -1 -2 3 1 -2 3 1 2 3 -1 2 3"
FACES = "0 2 1 0 3 2 4 5 6 4 6 7 0 1 5 0 5 4 2 3 7 2 7 6 1 2 6 1 6 5 0 4 7 0 7 3"


def dae(asset="", nodes='<node><instance_geometry url="#g"/></node>', library="", numbers=NUMBERS):
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset>{asset}</asset>{library}<library_geometries><geometry id='g'><mesh><source id='p'>"
        f"<float_array id='pa' count='24'>{numbers}</float_array><technique_common>"
        "<accessor source='#pa' count='8' stride='3'><param name='X' type='float'/><param name='Y' type='float'/>"
        "<param name='Z' type='float'/></accessor></technique_common></source><vertices id='v'>"
        "<input semantic='POSITION' source='#p'/></vertices><triangles count='12' material='m'>"
        f"<input semantic='VERTEX' source='#v' offset='0'/><p>{FACES}</p></triangles></mesh></geometry>"
        f"</library_geometries><library_visual_scenes><visual_scene id='s'>{nodes}</visual_scene>"
        "</library_visual_scenes><scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    )


@pytest.fixture
def read(tmp_path):
    def make(name, content, extra=""):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        geometry = f"<geometry><mesh><uri>{name}</uri>{extra}</mesh></geometry>"
        parts = f'<collision name="c">{geometry}</collision><visual name="v">{geometry}</visual>'
        body = f'<model name="m"><static>true</static><link name="l">{parts}</link></model>'
        (tmp_path / "w.sdf").write_text(f'<sdf version="1.9"><world name="w">{body}</world></sdf>')
        return read_world(tmp_path / "w.sdf")

    return make


def span(world):
    (link,) = world.links
    (part,) = link.collisions
    assert isinstance(part.shape, Mesh)
    return np.ptp(part.shape.vertices, axis=0)


@pytest.mark.parametrize(
    ("asset", "size"),
    [
        ("<unit meter='0.01'/><up_axis>Z_UP</up_axis>", (0.02, 0.04, 0.06)),
        ("<unit name='inch' meter='0.0254'/><up_axis>Y_UP</up_axis>", (0.0508, 0.1524, 0.1016)),
        ("<up_axis>X_UP</up_axis>", (4.0, 6.0, 2.0)),
        ("", (2.0, 6.0, 4.0)),  # the format's own default is y up
    ],
)
def test_collada_has_its_unit_and_its_axis(read, asset, size):
    world = read("crate.DAE", dae(asset), "<scale>1 1 1</scale>")
    assert world.warnings == ()
    assert span(world) == pytest.approx(size, rel=1e-5)


def test_collada_stays_right_handed(read):
    (link,) = read("a.dae", dae("<up_axis>Y_UP</up_axis>")).links
    mesh = link.visuals[0].shape
    corners = mesh.vertices[mesh.faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert volume == pytest.approx(48.0, rel=1e-5)


def test_collada_nodes_are_placed_by_their_transforms(read):
    nodes = (
        "<node><translate>0 0 9</translate><scale>2 1 1</scale><instance_geometry url='#g'/>"
        "<node><translate>5 0 0</translate><instance_geometry url='#g'/></node></node>"
    )
    assert span(read("a.dae", dae("<up_axis>Z_UP</up_axis>", nodes))) == pytest.approx([14.0, 4.0, 6.0], rel=1e-5)


TWICE = "<node id='n{0}'><instance_node url='#n{1}'/><instance_node url='#n{1}'/></node>"
BOMB = "".join(["<library_nodes>", *(TWICE.format(k, k + 1) for k in range(40)), "</library_nodes>"])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (dae(nodes="<node><instance_node url='#n0'/></node>", library=BOMB), "instances"),
        (dae(nodes="<node id='a'><instance_node url='#a'/></node>"), "stand for each other"),
        (dae("<unit meter='nan'/>"), "the unit nan"),
        (dae("<unit meter='0'/>"), "the unit 0"),
        (dae("<up_axis>W_UP</up_axis>"), "the axis W_UP"),
        (dae(numbers="1 2 x"), "mesh"),
        (dae().replace("<asset>", "<!DOCTYPE a [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><asset>"), "mesh"),
    ],
)  # fmt: skip
def test_collada_that_cannot_be_is_left_out(read, content, said):
    world = read("a.dae", content)
    assert world.links == ()
    assert said in world.warnings[0]


def test_a_glb_is_turned_to_z_up_and_a_count_from_nowhere_is_left_out(read):
    import trimesh

    data = trimesh.Scene(trimesh.creation.box((1.0, 2.0, 3.0))).export(file_type="glb")
    assert span(read("a.glb", data)) == pytest.approx([1.0, 3.0, 2.0], rel=1e-5)
    tree = {"asset": {"version": "2.0"}, "accessors": [{"count": 10**9, "componentType": 5126, "type": "VEC3"}]}
    assert "without a count that can be" in read("b.gltf", json.dumps(tree)).warnings[0]


OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def test_an_obj_has_its_own_materials_and_pictures(read, tmp_path):
    (tmp_path / "skins").mkdir()
    Image.new("RGB", (4, 4), (200, 10, 10)).save(tmp_path / "skins" / "a.jpg")
    (tmp_path / "m.mtl").write_text(
        "newmtl skin\nKd 1 1 1\nmap_Kd -s 1 1 1 skins\\a.jpg\nnewmtl plain\nKd 0 0.5 1\nnewmtl lost\nmap_Kd gone.png\n"
    )
    faces = "usemtl skin\nf 1/1 2/2 3/3\nusemtl plain\nf 1/1 3/3 4/4\nusemtl lost\nf 1/1 2/2 4/4\n"
    world = read("m.obj", f"mtllib m.mtl\n{OBJ}{faces}")
    (link,) = world.links
    assert [part.name for part in link.visuals] == ["v", "v#2", "v#3"]
    first, second, third = (part.material for part in link.visuals)
    assert first.texture == (tmp_path / "skins" / "a.jpg").resolve()
    assert (second.texture, second.diffuse) == (None, (0.0, 0.5, 1.0))
    assert third.texture is None
    (whole,) = link.collisions  # hit as one
    assert isinstance(whole.shape, Mesh)
    assert len(whole.shape.faces) == 3
    (said,) = world.warnings
    assert "gone.png" in said


def test_a_visuals_own_material_goes_before_the_meshs(read, tmp_path):
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\n{OBJ}usemtl a\nf 1 2 3\n")
    material = "<material><diffuse>0 1 0 1</diffuse></material>"
    visual = f"<visual name='v'><geometry><mesh><uri>m.obj</uri></mesh></geometry>{material}</visual>"
    body = f"<model name='m'><link name='l'>{visual}</link></model>"
    (tmp_path / "w.sdf").write_text(f"<sdf><world name='w'>{body}</world></sdf>")
    assert read_world(tmp_path / "w.sdf").links[0].visuals[0].material.diffuse == (0.0, 1.0, 0.0)


BOUND = (
    "<node><instance_geometry url='#g'><bind_material><technique_common><instance_material symbol='m' target='#mm'/>"
    "</technique_common></bind_material></instance_geometry></node>"
)


def pictured(name):
    """The libraries of a Collada file whose material is a picture."""
    return (
        f"<library_images><image id='i'><init_from>{name}</init_from></image></library_images>"
        "<library_effects><effect id='e'><profile_COMMON><newparam sid='f'><surface type='2D'><init_from>i</init_from>"
        "</surface></newparam><newparam sid='s'><sampler2D><source>f</source></sampler2D></newparam>"
        "<technique sid='t'><lambert><diffuse><texture texture='s' texcoord='u'/></diffuse></lambert></technique>"
        "</profile_COMMON></effect></library_effects>"
        "<library_materials><material id='mm'><instance_effect url='#e'/></material></library_materials>"
    )


@pytest.mark.parametrize("picture", ["/etc/hostname", "../secret.png", "link.png", "https://example.org/a.png"])
def test_no_mesh_leads_out_of_the_folder(tmp_path, picture):
    home = tmp_path / "home"
    home.mkdir()
    Image.new("RGB", (4, 4)).save(tmp_path / "secret.png")
    (home / "link.png").symlink_to(tmp_path / "secret.png")
    (home / "m.mtl").write_text(f"newmtl a\nmap_Kd {picture}\n")
    (home / "m.obj").write_text(f"mtllib m.mtl\n{OBJ}usemtl a\nf 1/1 2/2 3/3\n")
    (home / "m.dae").write_text(dae(library=pictured(picture), nodes=BOUND))
    for name in ("m.obj", "m.dae"):
        visual = f"<visual name='v'><geometry><mesh><uri>{name}</uri></mesh></geometry></visual>"
        body = f"<model name='m'><link name='l'>{visual}</link></model>"
        (home / "w.sdf").write_text(f"<sdf><world name='w'>{body}</world></sdf>")
        world = read_world(home / "w.sdf")
        assert world.links[0].visuals[0].material.texture is None
        assert picture in world.warnings[0]


def test_a_collada_picture_is_read(tmp_path, read):
    Image.new("RGB", (4, 4), (1, 2, 3)).save(tmp_path / "t.png")
    (link,) = read("m.dae", dae(library=pictured("t.png"), nodes=BOUND)).links
    assert link.visuals[0].material.texture == (tmp_path / "t.png").resolve()


def test_models_are_found_beside_worlds_and_where_they_are_said_to_be(tmp_path, monkeypatch):
    def crate(folder, name="crate"):
        (folder / name).mkdir(parents=True)
        link = "<link name='l'><visual name='v'><geometry><box><size>1 1 1</size></box></geometry></visual></link>"
        (folder / name / "model.sdf").write_text(f"<sdf><model name='{name}'>{link}</model></sdf>")

    worlds = tmp_path / "pkg" / "worlds" / "indoor"
    worlds.mkdir(parents=True)
    crate(tmp_path / "pkg" / "models")
    crate(tmp_path / "more", "barrel")
    crate(tmp_path / "fuel", "tree")
    names = "".join(f"<include><uri>model://{name}</uri></include>" for name in ("crate", "barrel", "tree"))
    (worlds / "w.sdf").write_text(f"<sdf><world name='w'>{names}</world></sdf>")

    def found(*models):
        return [link.model for link in read_world(worlds / "w.sdf", models).links]

    assert found() == ["crate"]
    assert found(tmp_path / "more") == ["crate", "barrel"]
    monkeypatch.setenv("GAZEBO_MODEL_PATH", f"/not/there:{tmp_path / 'more'}")
    monkeypatch.setenv("GZ_SIM_RESOURCE_PATH", str(tmp_path / "fuel"))
    assert found() == ["crate"]
    assert found("env") == ["crate", "barrel", "tree"]
    with pytest.raises(WorldError, match="there is no such folder"):
        found(tmp_path / "none")


def test_models_beside_worlds_may_not_lead_elsewhere(tmp_path):
    (tmp_path / "pkg" / "worlds").mkdir(parents=True)
    (tmp_path / "secret" / "crate").mkdir(parents=True)
    (tmp_path / "secret" / "crate" / "model.sdf").write_text("<sdf><model name='m'><link name='l'/></model></sdf>")
    (tmp_path / "pkg" / "models").symlink_to(tmp_path / "secret")
    (tmp_path / "pkg" / "worlds" / "w.sdf").write_text(
        "<sdf><world name='w'><include><uri>model://crate</uri></include></world></sdf>"
    )
    world = read_world(tmp_path / "pkg" / "worlds" / "w.sdf")
    assert "model://crate" in world.warnings[0]
