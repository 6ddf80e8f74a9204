"""A world file is somebody else's file: what the reader refuses, each time with one line that helps."""

import gzip
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flysim.errors import WorldError
from flysim.foreign.image import PNG_SIGNATURE
from flysim.worlds.sdf import document, folder
from flysim.worlds.sdf import reader as sdf
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.surface.texture import write_png

BOX = "<geometry><box><size>1 2 3</size></box></geometry>"
SPHERE = "<geometry><sphere><radius>1</radius></sphere></geometry>"
OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def world_text(inside, head=""):
    return f'{head}<sdf version="1.9"><world name="w">{inside}</world></sdf>'


def visual(geometry, extra=""):
    return f'<model name="m"><link name="l"><visual name="v">{geometry}{extra}</visual></link></model>'


def album(uri):
    return visual(BOX, f"<material><pbr><metal><albedo_map>{uri}</albedo_map></metal></pbr></material>")


def mesh(uri, extra=""):
    return visual(f"<geometry><mesh><uri>{uri}</uri>{extra}</mesh></geometry>")


def refusal(path):
    """The message of the `WorldError`; it is one line and names the file."""
    with pytest.raises(WorldError) as caught:
        read_world(path)
    message = str(caught.value)
    assert "\n" not in message
    assert path.name[-100:] in message
    assert len(message) < 600
    return message


def refused(tmp_path, text):
    path = tmp_path / "world.sdf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return refusal(path)


def left_out(path):
    """The one warning of a world that is read without the part that is wrong."""
    world = read_world(path)
    assert world.links == () or all(part.material.texture is None for link in world.links for part in link.visuals)
    (warning,) = world.warnings
    assert "\n" not in warning
    assert len(warning) < 600
    return warning


def left(tmp_path, text):
    path = tmp_path / "world.sdf"
    path.write_text(text)
    return left_out(path)


def test_missing_file_folder_and_empty_file(tmp_path):
    assert "no such world file" in refusal(tmp_path / "none.sdf")
    (tmp_path / "sub.sdf").mkdir()
    assert "is a folder" in refusal(tmp_path / "sub.sdf")
    assert "is empty" in refused(tmp_path, "")
    os.mkfifo(tmp_path / "pipe.sdf")
    assert "does not exist" in refusal(tmp_path / "pipe.sdf")
    assert "cannot be" in refusal(tmp_path / ("x" * 5000))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<sdf><world>", "not well-formed UTF-8 XML"),
        ("just words", "not well-formed UTF-8 XML"),
        (b"<sdf>\xff\xfe</sdf>", "not well-formed UTF-8 XML"),
        ("<a:b/>", "begins with <sdf>"),
        ("<robot/>", "begins with <sdf>"),
        ("<sdf/>", "no <world>"),
        (world_text("", "<!DOCTYPE sdf>"), "DTD or entities"),
        (world_text("&a;", '<!DOCTYPE sdf [<!ENTITY a "x">]>'), "DTD or entities"),
        (world_text("&a;", '<!DOCTYPE sdf [<!ENTITY a SYSTEM "file:///etc/passwd">]>'), "DTD or entities"),
        ("<d>" * 70 + "</d>" * 70, "nested deeper than 64"),
    ],
)
def test_what_is_no_world_file(tmp_path, text, words):
    assert words in refused(tmp_path, text)


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        (visual(BOX.replace("1 2 3", "1 2")), "must hold 3 numbers, got '1 2'"),
        (visual(BOX.replace("1 2 3", "1 2 3 4")), "must hold 3 numbers"),
        (visual(BOX.replace("1 2 3", "1 2 nan")), "got 'nan'"),
        (visual(BOX.replace("1 2 3", "1 2 inf")), "got 'inf'"),
        (visual(BOX.replace("1 2 3", "1 2 1e999")), "got '1e999'"),
        (visual(BOX.replace("1 2 3", "1 2 3_0")), "got '3_0'"),
        (visual(BOX.replace("1 2 3", "1 2 wide")), "got 'wide'"),
        (visual(BOX.replace("1 2 3", "0 1 1")), "a size must be"),
        (visual(BOX.replace("1 2 3", "-1 1 1")), "a size must be"),
        (visual(BOX.replace("1 2 3", "1e5 1 1")), "a size must be"),
        (visual(BOX.replace("<size>1 2 3</size>", "")), "has no <size>"),
        (visual(SPHERE.replace(">1<", ">0<")), "a size must be"),
        (visual("<geometry><cylinder><radius>1</radius></cylinder></geometry>"), "has no <length>"),
        (visual("<geometry><plane><normal>0 0 0</normal></plane></geometry>"), "must not be zero"),
        (visual(""), "has no <geometry>"),
        (visual(BOX, "<pose>0 0 0 0 0</pose>"), "must hold 6 numbers"),
        (visual(BOX, "<pose>0 0 0 0 0 x</pose>"), "got 'x'"),
        (visual(BOX, "<pose>-inf 0 0 0 0 0</pose>"), "got '-inf'"),
        (visual(BOX, "<pose>0 -1e7 0 0 0 0</pose>"), "got '-1e7'"),
        (visual(BOX, '<pose rotation_format="quat_xyzw">0 0 0 1 1 0 0</pose>'), "unit quaternion"),
        (visual(BOX, '<pose rotation_format="matrix">0 0 0 0 0 0</pose>'), "euler_rpy or quat_xyzw"),
        (visual(BOX, '<pose degrees="maybe">0 0 0 0 0 0</pose>'), "true or false"),
        (visual(BOX, "<material><diffuse>2 0 0 1</diffuse></material>"), "from 0 to 1"),
        (visual(BOX, "<material><diffuse>red</diffuse></material>"), "got 'red'"),
        (visual(BOX) + visual(BOX), "model 'm': its name is taken"),
        ('<model name="m"><link name="l"/><link name="l"/></model>', "link 'l': its name is taken"),
        ('<model name="m"><static>perhaps</static></model>', "must be true or false, got 'perhaps'"),
        ('<model name="m" placement_frame="x"/>', "its placement_frame is 'x', and there is no such frame"),
        (
            '<model name="m"><frame name="a" attached_to="b"/><frame name="b" attached_to="a"/>'
            '<link name="l"><pose relative_to="a"/></link></model>',
            "is placed by way of it",
        ),
        ("<gravity>0 0</gravity>", "must hold 3 numbers"),
        (f'<model name="{"x" * 300}"/>', "at most 200 characters"),
        ('<model name="a&#10;b"/>', "printable"),
        (visual("<geometry><mesh/></geometry>"), "has no <uri>"),
    ],
)
def test_values_that_cannot_be(tmp_path, inside, words):
    message = refused(tmp_path, world_text(inside))
    assert words in message
    if inside.startswith('<model name="m"><link name="l"><visual name="v">') and "taken" not in words:
        assert "model 'm', link 'l', visual 'v'" in message


@pytest.mark.parametrize(
    ("inertial", "words"),
    [
        ("<mass>0</mass>", "<mass> of a body that moves must be > 0 kg, got 0"),
        ("<mass>-1</mass>", "must be > 0 kg"),
        ("<mass>x</mass>", "got 'x'"),
        ("<inertia><ixx>0</ixx><iyy>1</iyy><izz>1</izz></inertia>", "three moments > 0"),
        ("<inertia><ixx>5</ixx><iyy>1</iyy><izz>1</izz></inertia>", "at most the sum of the others"),
    ],
)
def test_bodies_that_cannot_move(tmp_path, inertial, words):
    inside = f'<model name="m"><link name="l"><inertial>{inertial}</inertial></link></model>'
    assert words in refused(tmp_path, world_text(inside))


WAYS_OUT = [
    "../secret.png",
    "textures/../../secret.png",
    "/etc/passwd",
    "file:///etc/passwd",
    "model://../secret.png",
    "http://example.org/a.png",
    "https://example.org/a.png",
    "package://a/b.png",
    "C:/a.png",
    "..\\secret.png",
    "out/secret.png",
    "out.png",
    "loop.png",
    "",
    " ",
    "x" * 5000,
]


@pytest.mark.parametrize("make", [album, mesh], ids=["texture", "mesh"])
@pytest.mark.parametrize("uri", WAYS_OUT)
def test_no_way_out_of_the_folder(tmp_path, uri, make, monkeypatch):
    home = tmp_path / "home"
    home.mkdir()
    write_png(np.zeros((2, 2, 3), np.uint8), tmp_path / "secret.png")
    (home / "inside").mkdir()
    write_png(np.zeros((2, 2, 3), np.uint8), home / "inside.png")
    (home / "out").symlink_to(tmp_path)
    (home / "out.png").symlink_to(tmp_path / "secret.png")
    (home / "loop.png").symlink_to(home / "loop.png")
    opened = []
    true_open = Path.open
    monkeypatch.setattr(Path, "open", lambda self, *a, **k: opened.append(self.resolve()) or true_open(self, *a, **k))
    (home / "world.sdf").write_bytes(world_text(make(uri)).encode())
    if make is mesh and not uri.strip():
        refusal(home / "world.sdf")
    else:
        assert uri[:20].strip() in left_out(home / "world.sdf")
    assert all(p.is_relative_to(home.resolve()) for p in opened)


@pytest.mark.parametrize("uri", ["../other", "/etc", "model://../other", "out"])
def test_no_way_out_by_an_include(tmp_path, uri):
    home, other = tmp_path / "home", tmp_path / "other"
    home.mkdir()
    other.mkdir()
    (other / "model.sdf").write_text(f"<sdf>{visual(BOX)}</sdf>")
    (home / "out").symlink_to(other)
    (home / "world.sdf").write_text(world_text(f"<include><uri>{uri}</uri></include>"))
    assert uri in left_out(home / "world.sdf")


def test_an_included_file_that_links_out_is_refused(tmp_path):
    home, other = tmp_path / "home", tmp_path / "other"
    (home / "in").mkdir(parents=True)
    other.mkdir()
    (other / "model.sdf").write_text(f"<sdf>{visual(BOX)}</sdf>")
    (home / "in" / "model.sdf").symlink_to(other / "model.sdf")
    (home / "world.sdf").write_text(world_text("<include><uri>model://in</uri></include>"))
    assert "leads out of the world's folder" in left_out(home / "world.sdf")


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, depth=8, pixels=b""):
    head = struct.pack(">IIBBBBB", width, height, depth, 2, 0, 0, 0)
    return PNG_SIGNATURE + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (None, "does not exist"),
        (b"", "is empty"),
        (b"GIF89a" + bytes(100), "or damaged"),
        (b"\xff\xd8\xff\xe0" + bytes(100), "or damaged"),
        (b"P3 9 9 255\n" + b"0 " * 2**21, "plain text of such a size"),
        (PNG_SIGNATURE, "damaged PNG"),
        (PNG_SIGNATURE + bytes(100), "damaged PNG"),
        (png(4, 4), "damaged PNG"),
        (png(4, 4, pixels=bytes(52))[:-20], "damaged PNG"),
        (png(4, 4, pixels=bytes(52)).replace(b"IDAT", b"IDAX"), "damaged PNG"),
        (png(0, 4), "damaged PNG"),
        (png(9000, 4), "9000x4 px"),
        (png(2**31 - 1, 2**31 - 1), "px"),
        (png(4, 4, depth=16), "16 bits a channel"),
    ],
)
def test_textures_that_are_none(tmp_path, data, words):
    if data is not None:
        (tmp_path / "t.png").write_bytes(data)
    message = left(tmp_path, world_text(album("t.png")))
    assert words in message
    assert "t.png" in message
    assert "visual 'v'" in message


def test_a_texture_that_is_a_folder(tmp_path):
    (tmp_path / "t.png").mkdir()
    assert "is a folder" in left(tmp_path, world_text(album("t.png")))


def test_the_textures_together_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "MAX_TEXTURE_PIXELS", 30)
    for name in "ab":
        write_png(np.zeros((4, 5, 3), np.uint8), tmp_path / f"{name}.png")
    two = album("a.png") + album("b.png").replace('"m"', '"n"')
    (tmp_path / "world.sdf").write_text(world_text(two))
    world = read_world(tmp_path / "world.sdf")
    assert [link.visuals[0].material.texture is not None for link in world.links] == [True, False]
    assert "'b.png: makes the textures more than 30 px in all'" in world.warnings[0]


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("m.obj", None, "does not exist"),
        ("m.obj", b"", "is empty"),
        ("m.obj", b"v 0 0 0\n", "has no faces"),
        ("m.obj", b"v 0 0\nf 1 1 1\n", "damaged in its line 1"),
        ("m.obj", OBJ.replace("3/3", "9/3").encode(), "damaged in its line 7"),
        ("m.obj", OBJ.replace("3/3", "3/-9").encode(), "damaged in its line 7"),
        ("m.obj", OBJ.replace("3/3", "0/3").encode(), "damaged in its line 7"),
        ("m.obj", OBJ.replace("v 1 0 0", "v 1 x 0").encode(), "damaged in its line 2"),
        ("m.obj", OBJ.replace("v 1 0 0", "v 1 nan 0").encode(), "NaN"),
        ("m.obj", OBJ.replace("v 1 0 0", "v 1e300 0 0").encode(), "NaN or more than"),
        ("m.obj", OBJ.replace("v 1 1 0", "v 2 0 0").encode(), "no triangle with an area"),
        ("m.obj", bytes(range(256)), "mesh"),
        ("m.stl", b"solid x\nendsolid\n", "has no faces"),
        ("m.stl", b"solid x\nvertex 1 2 3\n", "without three vertices"),
        ("m.stl", b"solid x\nvertex 1 2 x\n", "no three numbers"),
        ("m.stl", bytes(200), "is no STL"),
        ("m.stl", bytes(84), "has no faces"),
        ("m.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50), "is no STL"),
        ("m.dae", b"<COLLADA/>", "cannot be read"),
        ("m.dae", b"<a/>", "is no Collada file"),
        ("m.dae", b"<!DOCTYPE a><COLLADA/>", "declares a DTD"),
        ("m.glb", b"glTF" + bytes(20), "damaged"),
        ("m.gltf", b"{", "damaged"),
        ("m.gltf", b'{"accessors": [{"count": 100000000}]}', "without a count that can be"),
        ("m", b"x", "is not read"),
    ],
)
def test_meshes_that_are_none(tmp_path, name, data, words):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    message = left(tmp_path, world_text(mesh(name)))
    assert words in message
    assert "visual 'v'" in message


def test_a_mesh_scaled_to_nothing(tmp_path):
    (tmp_path / "m.obj").write_text(OBJ)
    assert "must not be 0" in refused(tmp_path, world_text(mesh("m.obj", "<scale>1 0 1</scale>")))


@pytest.mark.parametrize("suffix", ["obj", "stl"])
def test_the_meshes_together_are_bounded(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(folder, "MAX_FACES", 100)
    facet = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    text = OBJ + "f 1 2 3\n" * 59 if suffix == "obj" else "solid x\n" + facet * 60
    (tmp_path / f"m.{suffix}").write_text(text)
    once = mesh(f"m.{suffix}")
    (tmp_path / "world.sdf").write_text(world_text(once))
    read_world(tmp_path / "world.sdf")
    again = mesh(f"m.{suffix}", "<scale>2 2 2</scale>").replace('"m"', '"n"')
    (tmp_path / "world.sdf").write_text(world_text(once + again))
    world = read_world(tmp_path / "world.sdf")
    assert [link.model for link in world.links] == ["m"]
    assert "limit of triangles" in world.warnings[0]


def test_one_polygon_of_a_million_corners_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "MAX_FACES", 1000)
    (tmp_path / "m.obj").write_text(OBJ + "f" + " 1 2" * 5_000)
    assert "limit of triangles" in left(tmp_path, world_text(mesh("m.obj")))
    (tmp_path / "m.obj").write_text(OBJ + "f" + " 1 2" * 500_000)
    assert "a line of more than" in left(tmp_path, world_text(mesh("m.obj")))


def test_files_are_bounded_before_and_after_unpacking(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "MAX_FILE_BYTES", 2**20)
    (tmp_path / "bomb.world.gz").write_bytes(gzip.compress(bytes(2**26)))
    assert "unpacks to more than 1 MB" in refusal(tmp_path / "bomb.world.gz")
    assert "is larger than 1 MB" in refused(tmp_path, world_text(" " * 2**20))
    (tmp_path / "m.obj").write_bytes(bytes(2**20 + 1))
    assert "is larger than 1 MB" in left(tmp_path, world_text(mesh("m.obj")))
    (tmp_path / "cut.gz").write_bytes(gzip.compress(world_text("").encode())[:-12])
    assert "damaged gzip" in refusal(tmp_path / "cut.gz")
    (tmp_path / "none.gz").write_bytes(gzip.compress(b""))
    assert "empty once unpacked" in refusal(tmp_path / "none.gz")


def test_a_gzip_bomb_does_not_swell_memory(tmp_path):
    import tracemalloc

    (tmp_path / "bomb.world.gz").write_bytes(gzip.compress(bytes(2**28), 1))
    tracemalloc.start()
    try:
        assert "unpacks to more than 64 MB" in refusal(tmp_path / "bomb.world.gz")
        assert tracemalloc.get_traced_memory()[1] < 200 * 2**20
    finally:
        tracemalloc.stop()


def test_elements_attributes_and_links_are_bounded(tmp_path, monkeypatch):
    elements = world_text("<a/>" * 2_100_000)
    assert "more than 1000000 XML elements" in refused(tmp_path, elements)
    monkeypatch.setattr(document, "MAX_ATTRIBUTES", 100)
    attributes = " ".join(f'a{i}=""' for i in range(200))
    assert "too many attributes" in refused(tmp_path, world_text(f"<a {attributes}/>"))
    monkeypatch.setattr(document, "MAX_ATTRIBUTES", 10_000)
    monkeypatch.setattr(sdf, "MAX_LINKS", 3)
    links = "".join(f'<link name="{i}"><visual name="v">{BOX}</visual></link>' for i in range(4))
    assert "more than 3 links" in refused(tmp_path, world_text(f"<model>{links}</model>"))


def test_warnings_of_a_hostile_file_are_few(tmp_path):
    (tmp_path / "world.sdf").write_text(world_text("".join(f"<a{k}/>" for k in range(1000)) + "<a7/>"))
    warnings = read_world(tmp_path / "world.sdf").warnings
    assert warnings[7] == "<a7> is not read: 2, the first in the world."
    assert warnings[50:] == ("other things are not read: 950, the first in the world.",)


def test_repeated_includes_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "MAX_ELEMENTS", 1000)
    (tmp_path / "crate.sdf").write_text(f"<sdf>{visual(BOX)}</sdf>".replace("<link", "<frame/>" * 50 + "<link"))
    text = "".join(f"<include><uri>crate.sdf</uri><name>{i}</name></include>" for i in range(30))
    with pytest.raises(WorldError, match="more than 1000 XML elements with its includes"):
        (tmp_path / "world.sdf").write_text(world_text(text))
        read_world(tmp_path / "world.sdf")


def test_an_include_that_includes_is_followed_and_what_is_missing_is_named(tmp_path):
    for name, inside in (("sub", "<include><uri>model://deep</uri><pose>1 0 0 0 0 0</pose></include>"), ("deep", "")):
        (tmp_path / name).mkdir()
        inside += "<include><uri>model://other</uri></include>"
        link = f"<link name='l'><visual name='v'>{BOX}</visual></link>"
        (tmp_path / name / "model.sdf").write_text(f"<sdf><model name='{name}'>{link}{inside}</model></sdf>")
    (tmp_path / "world.sdf").write_text(world_text("<include><uri>model://sub</uri></include>"))
    world = read_world(tmp_path / "world.sdf")
    assert [(link.model, link.T_world_link[0, 3]) for link in world.links] == [("sub", 0.0), ("sub::deep", 1.0)]
    assert "'model://other'" in world.warnings[0]


@pytest.mark.parametrize("files", [("a.sdf",), ("a.sdf", "b.sdf"), ("world.sdf",)])
def test_a_file_that_includes_itself_is_refused(tmp_path, files):
    for file, included in zip(files, (*files[1:], files[0]), strict=True):
        model = f"<model name='m'><model name='n'><include><uri>{included}</uri></include></model></model>"
        (tmp_path / file).write_text(f"<sdf>{model}</sdf>")
    (tmp_path / "world.sdf").write_text(world_text(f"<include><uri>{files[0]}</uri></include>"))
    with pytest.raises(WorldError, match="includes itself: take the <include> out"):
        read_world(tmp_path / "world.sdf")


VALID = world_text(
    visual(BOX, "<pose>1 2 3 0 0 0.5</pose><material><diffuse>1 0 0 1</diffuse></material>")
    + album("t.png").replace('"m"', '"n"')
    + mesh("m.obj").replace('"m"', '"o"')
    + "<include><uri>model://crate</uri></include><gravity>0 0 -9.8</gravity>"
).encode()
STL = bytes(80) + struct.pack("<I", 1) + np.arange(12, dtype="<f4").tobytes() + b"\0\0"


@pytest.fixture(scope="module")
def good_folder(tmp_path_factory):
    home = tmp_path_factory.mktemp("fuzz")
    rng = np.random.default_rng(0)
    write_png(rng.integers(0, 255, (6, 5, 3), dtype=np.uint8), home / "t.png")
    (home / "m.obj").write_text(OBJ)
    (home / "m.stl").write_bytes(STL)
    (home / "crate.sdf").write_text(f"<sdf>{visual(BOX)}</sdf>")
    (home / "world.sdf").write_bytes(VALID)
    return home


@st.composite
def mutated(draw, data):
    """Some bytes of `data` replaced, removed, doubled or put elsewhere."""
    words = st.sampled_from(
        [
            b"nan",
            b"-1",
            b"1e400",
            b"<",
            b">",
            b"/",
            b'"',
            b"&",
            b"../",
            b"\0",
            b"\xff",
            b"//",
            b" ",
            b"<model>",
        ]
    )
    for _ in range(draw(st.integers(1, 6))):
        i, j = sorted((draw(st.integers(0, len(data))), draw(st.integers(0, len(data)))))
        j = min(j, i + 40)
        with_this = draw(st.one_of(st.just(b""), words, st.binary(max_size=6), st.just(data[i:j] * 2)))
        data = data[:i] + with_this + data[j:]
    return data


def only_world_errors(path):
    try:
        read_world(path)
    except WorldError as error:
        assert "\n" not in str(error)


FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@FUZZ
@given(data=mutated(VALID))
def test_a_mutated_world_raises_nothing_but_a_world_error(good_folder, data):
    path = good_folder / "mutated.sdf"
    path.write_bytes(data)
    only_world_errors(path)


@FUZZ
@given(data=st.data())
@pytest.mark.parametrize("name", ["t.png", "m.obj", "m.stl"])
def test_a_mutated_asset_raises_nothing_but_a_world_error(good_folder, name, data):
    file = good_folder / f"mutated{Path(name).suffix}"
    file.write_bytes(data.draw(mutated((good_folder / name).read_bytes())))
    path = good_folder / "asset.sdf"
    path.write_text(world_text(album(file.name) if name == "t.png" else mesh(file.name)))
    only_world_errors(path)


@FUZZ
@given(data=mutated(gzip.compress(VALID, mtime=0)))
def test_mutated_gzip_raises_nothing_but_a_world_error(good_folder, data):
    path = good_folder / "mutated.gz"
    path.write_bytes(data)
    only_world_errors(path)
