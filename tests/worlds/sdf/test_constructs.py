"""Every row of the table in docs/worlds.md, read: the table and the reader say the same."""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest

from flysim.errors import WorldError
from flysim.worlds.ground import refuse_weightless
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.surface.texture import write_png

DOCS = Path(__file__).resolve().parents[3] / "docs" / "worlds.md"
BOX = "<geometry><box><size>1 1 1</size></box></geometry>"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def visual(extra="", geometry=BOX):
    return f'<visual name="v">{geometry}{extra}</visual>'


def collision(extra):
    return f'<collision name="c">{BOX}{extra}</collision>'


def contact(text):
    return visual() + collision(f"<surface><contact>{text}</contact></surface>")


def link(inside=None, name="l", extra=""):
    return f'<link name="{name}">{visual() if inside is None else inside}{extra}</link>'


def model(inside=None, name="m", static=True, extra=""):
    fixed = "<static>true</static>" if static else ""
    return f'<model name="{name}" {extra}>{fixed}{link() if inside is None else inside}</model>'


def shape(text):
    return model(link(visual(geometry=f"<geometry>{text}</geometry>")))


def mesh(name, extra=""):
    return shape(f"<mesh><uri>{name}</uri>{extra}</mesh>")


def include(uri, extra=""):
    return f"<include><uri>{uri}</uri>{extra}</include>"


def moving(inertial):
    return model(link(extra=f"<inertial>{inertial}</inertial>"), static=False)


def joint(kind, parent):
    return f'<joint name="j" type="{kind}"><parent>{parent}</parent><child>l</child></joint>'


def state(inside):
    return model() + f'<state world_name="w">{inside}</state>'


def pose(text, attributes=""):
    return f"<pose {attributes}>{text}</pose>"


MOMENTS = "<mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz>{}</inertia>"
RELATIVE = link() + link(name="k", extra=pose("1 0 0 0 0 0", 'relative_to="{}"'))
# Of each row: what is in the world, how many links are read of it, and a word of each warning.
ROWS = {
    "`<model>`, nested": (model(model()), 1, ()),
    "`<static>`": (model(), 1, ()),
    "`<link>` `<pose>`": (model(link(extra=pose("1 2 3 0 0 0"))), 1, ()),
    "pose in degrees, as a quaternion": (model(link(extra=pose("1 2 3 0 0 90", 'degrees="true"'))), 1, ()),
    "pose `relative_to` a link, frame, joint, model, `a::b`": (model(RELATIVE.format("l")), 2, ()),
    "pose `frame` (to 1.6)": (model(link(extra=pose("1 0 0 0 0 0", 'frame="gone"'))), 1, ("frame is not known",)),
    "pose relative to a frame that there is none of": (model(RELATIVE.format("gone")), None, ("no such frame",)),
    "`<frame>` `attached_to`": (model('<frame name="f" attached_to="l"/>' + RELATIVE.format("f")), 2, ()),
    "`placement_frame`": (model(extra='placement_frame="l"'), 1, ()),
    "`<include>`": (include("model://crate"), 1, ()),
    "`<include>` `merge`": (
        model(link() + include("model://other").replace("<include>", '<include merge="true">')),
        *(2, ()),
    ),
    "`<include>` of `model://sun`": (include("model://sun"), 0, ()),
    "`<include>` of `model://ground_plane`": (include("model://ground_plane"), 1, ()),
    "`<include>` of what is not at hand": (include("model://gone"), 0, ("model://gone",)),
    "`<include>` of an address": (include("https://example.org/tree"), 0, ("https://example.org/tree",)),
    '`<include>` of the "Ground Plane" of an address': (
        include("https://example.org/1.0/a/models/Ground%20Plane/2"),
        *(1, ("is not fetched",)),
    ),
    "`<include>` that leads back to itself": (include("model://round"), None, ("includes itself",)),
    "included models of one name": (include("model://crate") * 2, 2, ("'crate_1'",)),
    "`model.config`": (include("model://named"), 1, ()),
    "`<state>` poses": (state('<model name="m"><pose>1 2 3 0 0 0</pose></model>'), 1, ()),
    "`<state>` `<insertions>`, `<deletions>`": (state("<deletions><name>m</name></deletions>"), 0, ()),
    "`<state>` `<scale>`": (state('<model name="m"><scale>2 2 2</scale></model>'), 1, ("saved <scale>",)),
    "`<state>` of a model that there is none of, a second `<state>`": (
        state('<model name="x"><pose>1 2 3 0 0 0</pose></model>') + "<state/>",
        *(1, ("only the first <state>", "'x'")),
    ),
    "`<box>`, `<cylinder>`, `<sphere>`": (shape("<sphere><radius>1</radius></sphere>"), 1, ()),
    "`<plane>`": (shape("<plane><size>1000 10</size></plane>"), 1, ("cut to 100 m",)),
    "`<capsule>`, `<cone>`, `<ellipsoid>`": (shape("<capsule><radius>1</radius><length>2</length></capsule>"), 1, ()),
    "`<mesh>` OBJ": (mesh("m.obj"), 1, ()),
    "`<mesh>` STL": (mesh("m.stl"), 1, ()),
    "`<mesh>` Collada": (mesh("m.dae"), 1, ()),
    "`<mesh>` glTF": (mesh("m.glb"), 1, ()),
    "pictures inside a .glb": (mesh("inside.glb"), 1, ("a picture inside",)),
    "`<mesh>` of another format, damaged, missing": (mesh("m.fbx"), 0, ("m.fbx",)),
    "`<submesh>`": (mesh("m.obj", "<submesh><name>a</name></submesh>"), 0, ("<submesh>",)),
    "`<heightmap>`, `<polyline>`, `<image>`": (shape("<heightmap/>"), 0, ("<heightmap>",)),
    "`<empty>`": (shape("<empty/>"), 0, ()),
    "`<transparency>` 1, `<visibility_flags>` 0": (model(link(visual("<transparency>1</transparency>"))), 0, ()),
    "`<transparency>` between 0 and 1": (model(link(visual("<transparency>.5</transparency>"))), 1, ("drawn solid",)),
    "`<collide_bitmask>`, `<category_bitmask>` without a bit": (
        model(link(contact("<collide_bitmask>0x00</collide_bitmask>"))),
        *(1, ()),
    ),
    "`<collide_without_contact>`, `<max_contacts>` 0": (
        model(link(contact("<collide_without_contact>true</collide_without_contact>"))),
        *(1, ()),
    ),
    "`<diffuse>`": (model(link(visual("<material><diffuse>1 0 0 1</diffuse></material>"))), 1, ()),
    "`<diffuse>` with an alpha below 1": (
        model(link(visual("<material><diffuse>1 0 0 0.3</diffuse></material>"))),
        *(1, ("drawn solid: '0.3'",)),
    ),
    "`<pbr>` `<albedo_map>`": (
        model(link(visual("<material><pbr><metal><albedo_map>t.png</albedo_map></metal></pbr></material>"))),
        *(1, ()),
    ),
    "a picture that is none": (
        model(link(visual("<material><pbr><metal><albedo_map>m.obj</albedo_map></metal></pbr></material>"))),
        *(1, ("its visual is bare",)),
    ),
    "`<script>` of Gazebo's ten plain colours": (
        model(link(visual("<material><script><name>Gazebo/Red</name></script></material>"))),
        *(1, ()),
    ),
    "`<script>` of another name": (
        model(link(visual("<material><script><name>My/Own</name></script></material>"))),
        *(1, ("My/Own",)),
    ),
    "`<inertial>` of what moves": (moving(MOMENTS.format("")), 1, ()),
    "`<inertial>` of what stands still": (
        model(link(extra="<inertial><mass>-1</mass><inertia><ixx>1e9</ixx></inertia></inertial>")),
        *(1, ()),
    ),
    "products of inertia, `<pose>` of an `<inertial>`": (
        moving(MOMENTS.format("<ixy>0.1</ixy>")),
        *(1, ("products of inertia",)),
    ),
    "`<inertial>` that cannot be, of what moves": (moving("<mass>0</mass>"), None, ("must be > 0 kg",)),
    "`<kinematic>`": (model(link(extra="<kinematic>true</kinematic>"), static=False), 1, ()),
    "`<joint>` that is fixed to the world": (model(link() + joint("fixed", "world"), static=False), 1, ()),
    "`<joint>` in a static model": (model(link() + joint("revolute", "world")), 1, ()),
    "`<joint>` else": (model(link() + joint("revolute", "world"), static=False), 1, ("<joint>",)),
    "`<gravity>` of the world": ("<gravity>0 0 0</gravity>" + model(), 1, ()),
    "`<gravity>` of a link": (
        model(link(extra="<gravity>false</gravity>"), static=False),
        *(1, ("<gravity> of a single link",)),
    ),
    "`<plugin>`, `<sensor>`, `<actor>`, `<road>`, `<population>`": ('<actor name="a"/>', 0, ("<actor>",)),
    "`<plugin>` of the simulator itself": ('<plugin name="p" filename="gz-sim-physics-system"/>', 0, ()),
    "`<light>`, `<scene>`, `<physics>`, `<gui>`, `<wind>`": ("<light/><scene/><physics/><gui/><wind/>", 0, ()),
    "elements and attributes with a prefix, declared or not": ('<gz:a gz:b="1"/>', 0, ()),
    "`--` in comments, byte order marks, UTF-16 with its mark": ("<!-- a -- b --->" + model(), 1, ()),
    "`<!DOCTYPE>`, entities": ("<!DOCTYPE", None, ("DTD",)),
    "more than the first `<world>`": ("</world><world name='b'>", 0, ("only the first <world>",)),
}


def glb(picture):
    """A .glb of one triangle, with a picture in its buffer or none."""
    numbers = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(numbers)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(numbers)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    if picture:
        tree["images"], tree["textures"] = [{"bufferView": 0, "mimeType": "image/png"}], [{"source": 0}]
        tree["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
        tree["accessors"].append({"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"})
        tree["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 1
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(numbers), 0x4E4942) + numbers
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    import trimesh

    home = tmp_path_factory.mktemp("constructs")
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    (home / "m.obj").write_text(TRIANGLE)
    (home / "m.stl").write_bytes(trimesh.exchange.stl.export_stl(box))
    (home / "m.dae").write_bytes(trimesh.exchange.dae.export_collada(box))
    (home / "m.glb").write_bytes(glb(picture=False))
    (home / "inside.glb").write_bytes(glb(picture=True))
    write_png(np.full((4, 4, 3), 90, np.uint8), home / "t.png")
    for name, inside in (
        ("crate", model(name="crate")),
        ("other", model(link(name="k"), name="other")),
        ("round", model(include("model://round"), name="round")),
    ):
        (home / name).mkdir()
        (home / name / "model.sdf").write_text(f"<sdf>{inside}</sdf>")
    (home / "named").mkdir()
    (home / "named" / "mine.sdf").write_text(f"<sdf>{model()}</sdf>")
    (home / "named" / "model.config").write_text("<model><sdf version='1.6'>mine.sdf</sdf></model>")
    return home


def table():
    section = DOCS.read_text(encoding="utf-8").split("## Every construct")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (.*?) \| (.*?) \|$", section, re.MULTILINE)
    return {row: fate for row, fate in rows if row not in ("construct", "---")}


def test_the_table_and_these_rows_are_the_same():
    assert list(table()) == list(ROWS)


@pytest.mark.parametrize("row", ROWS)
def test_a_construct_is_read_as_the_table_says(folder, row):
    inside, count, words = ROWS[row]
    fate = table()[row]
    head = "<!DOCTYPE sdf>" if inside == "<!DOCTYPE" else ""
    inside = "" if head else inside
    path = folder / "w.sdf"
    path.write_text(f'{head}<sdf version="1.9"><world name="w">{inside}</world></sdf>')
    if count is None:
        assert fate.startswith("refused")
        with pytest.raises(WorldError, match=words[0]):
            read_world(path)
        return
    world = read_world(path)
    assert len(world.links) == count
    assert len(world.warnings) == len(words), world.warnings
    for word, warning in zip(words, world.warnings, strict=True):
        assert word in warning
    told = fate.startswith(("approximated", "left out")) and "silent" not in fate
    assert told <= bool(words)
    assert fate.startswith(("read", "approximated", "left out"))
    if "refused" in fate:
        with pytest.raises(WorldError, match="without gravity"):
            refuse_weightless(world)
