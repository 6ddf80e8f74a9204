"""Hundreds of drawn SDF files against a plain reading of the specification, written here a second time and slowly.

The oracle knows no scopes and caches: it turns every frame of a file into one entry "model::frame -> (parent, pose)"
and multiplies matrices up to the world.
"""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from flysim.worlds.sdf.reader import read_world

EXACT = 1e-9
NAMES = ("a", "b", "c", "d")


def matrix(x, y, z, roll, pitch, yaw):
    """The pose of the specification: about the fixed axes x, then y, then z."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rz @ ry @ rx, (x, y, z)
    return T


numbers = st.tuples(
    *[st.integers(-300, 300).map(lambda n: n / 100.0)] * 3, *[st.integers(-314, 314).map(lambda n: n / 100.0)] * 3
)


@st.composite
def pose(draw, relative=()):
    """A `<pose>` in one of its spellings, its matrix, and the frame it names (None: the default)."""
    values = draw(numbers)
    frame = draw(st.one_of(st.none(), st.sampled_from(relative))) if relative else None
    spelling = draw(st.sampled_from(("radians", "degrees", "quaternion", "spaced", "none")))
    attributes = {} if frame is None else {"relative_to": frame}
    if spelling == "none":
        return ([], np.eye(4), None) if frame is None else ([("pose", attributes, "")], np.eye(4), frame)
    T = matrix(*values)
    if spelling == "degrees":
        attributes["degrees"] = "true"
        text = " ".join([repr(v) for v in values[:3]] + [repr(math.degrees(v)) for v in values[3:]])
    elif spelling == "quaternion":
        attributes["rotation_format"] = "quat_xyzw"
        (cr, sr), (cp, sp), (cy, sy) = ((math.cos(v / 2), math.sin(v / 2)) for v in values[3:])
        q = (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
        text = " ".join(repr(v) for v in (*values[:3], *q))
    else:
        text = ("\n   " if spelling == "spaced" else " ").join(repr(v) for v in values)
    return [("pose", attributes, text)], T, frame


SHAPES = (
    ("box", [("size", "0.3 0.4 0.5")]),
    ("cylinder", [("radius", "0.2"), ("length", "0.6")]),
    ("sphere", [("radius", "0.25")]),
    ("plane", [("normal", "0 0 1"), ("size", "2 3")]),
    ("capsule", [("radius", "0.1"), ("length", "0.4")]),
    ("ellipsoid", [("radii", "0.1 0.2 0.3")]),
)
UNREAD = ("heightmap", "polyline", "image")


class Oracle:
    """What the file says, flat: frames by whole name, bodies with their parts, and what has to be named."""

    def __init__(self):
        self.frames = {}  # whole name -> (parent's whole name, T)
        self.bodies = []  # (model, link, [(tag, part, kind, frame or None: the link, T)])
        self.named = set()
        self.saved_models, self.saved_links = {}, {}

    def place(self, whole):
        """Where a model stands: as it was saved, else as the file has it, or carried along by the one it stands in."""
        if whole in self.saved_models:
            return self.saved_models[whole]
        above = whole.rpartition("::")[0]
        if not above:
            return self.unsaved(whole)
        return self.place(above) @ inverted(self.unsaved(above)) @ self.unsaved(whole)

    def unsaved(self, name):
        if name == "":
            return np.eye(4)
        parent, T = self.frames[name]
        return self.unsaved(parent) @ T


def add(parent, found):
    for tag, attributes, text in found:
        ET.SubElement(parent, tag, attributes).text = text


def join(*names):
    return "::".join(name for name in names if name)


@st.composite
def model(draw, oracle, name, above, depth, folder, held=False):
    """A `<model>` with links, frames, joints, visuals and models in it, told to the oracle."""
    element = ET.Element("model", {"name": name})
    whole = join(above, name)
    static = draw(st.booleans())
    if static:
        ET.SubElement(element, "static").text = draw(st.sampled_from(("true", "1")))
    links, known = [], []  # names a later pose may be relative to
    inside = []
    for k in range(draw(st.integers(1, 3))):
        link = ET.SubElement(element, "link", {"name": f"{NAMES[k]}_link"})
        found, T, frame = draw(pose((*known, "__model__")))
        add(link, found)
        own = f"{NAMES[k]}_link"
        inside.append((own, "" if frame in (None, "__model__") else frame, T))
        known.append(own)
        links.append((link, own))
        if draw(st.booleans()):
            attached = draw(st.sampled_from(known))
            extra = ET.SubElement(element, "frame", {"name": f"{own}_frame", "attached_to": attached})
            found, T, frame = draw(pose(tuple(known)))
            add(extra, found)
            inside.append((f"{own}_frame", frame or attached, T))
            known.append(f"{own}_frame")
        if len(links) > 1 and draw(st.booleans()):
            joint = ET.SubElement(element, "joint", {"name": f"{own}_joint", "type": "revolute"})
            ET.SubElement(joint, "parent").text, ET.SubElement(joint, "child").text = links[0][1], own
            found, T, frame = draw(pose(tuple(known)))
            add(joint, found)
            inside.append((f"{own}_joint", frame or own, T))
            known.append(f"{own}_joint")
            if not (static or held):
                oracle.named.add("<joint> is not read")
    for own, parent, T in inside:
        oracle.frames[join(whole, own)] = (join(whole, parent), T)
    for link, own in links:
        parts = []
        for k in range(draw(st.integers(1, 2))):
            parts += draw(part(link, k, own, known, oracle, whole))
        if parts:
            oracle.bodies.append((whole, own, parts))
    if depth < 3 and draw(st.booleans()):
        child = f"{name}{depth}"
        made = draw(model(oracle, child, whole, depth + 1, folder, static or held))
        found, T, frame = draw(pose(tuple(known)))
        target, placed = made, draw(st.sampled_from((None, "a_link")))
        if draw(st.booleans()):  # the same by an include
            file = folder / f"{whole.replace('::', '_')}_{child}.sdf"
            root = ET.Element("sdf", {"version": "1.9"})
            root.append(made)
            file.write_bytes(ET.tostring(root))
            target = ET.SubElement(element, "include")
            ET.SubElement(target, "uri").text = draw(st.sampled_from(("", "model://", "file://"))) + file.name
            if placed and found:
                ET.SubElement(target, "placement_frame").text = placed
        else:
            element.append(made)
            if placed:
                made.set("placement_frame", placed)
        add(target, found)
        if target is not made and not found:
            placed = None
        back = np.eye(4)
        if placed:  # the pose is that of the link in the model
            oracle.frames[join(whole, child)] = ("", np.eye(4))
            of_model = np.linalg.inv(oracle.unsaved(join(whole, child))) @ oracle.unsaved(join(whole, child, placed))
            back = np.linalg.inv(of_model)
        oracle.frames[join(whole, child)] = (join(whole, frame or ""), T @ back)
    if draw(st.integers(0, 9)) == 0:
        ET.SubElement(element, "plugin", {"name": "p", "filename": "libown.so"})
        oracle.named.add("<plugin> is not read")
    return element


@st.composite
def part(draw, link, k, own, known, oracle, whole):
    tag = draw(st.sampled_from(("visual", "collision")))
    element = ET.SubElement(link, tag, {"name": f"{tag}{k}"})
    found, T, frame = draw(pose((*known, "__model__", own)))
    add(element, found)
    geometry = ET.SubElement(element, "geometry")
    if draw(st.integers(0, 11)) == 0:
        kind = draw(st.sampled_from(UNREAD))
        ET.SubElement(geometry, kind)
        oracle.named.add(f"<{kind}> geometry is not read")
        return []
    kind, sizes = draw(st.sampled_from(SHAPES))
    shape = ET.SubElement(geometry, kind)
    for name, text in sizes:
        ET.SubElement(shape, name).text = text
    unseen = draw(st.integers(0, 9)) == 0
    if tag == "visual":
        if unseen:
            ET.SubElement(element, "transparency").text = "1.0"
    elif unseen:
        contact = ET.SubElement(ET.SubElement(element, "surface"), "contact")
        ET.SubElement(contact, "collide_bitmask").text = draw(st.sampled_from(("0", "0x00", "0x0000", "0x10000")))
    if unseen:
        return []
    return [(tag, f"{tag}{k}", kind, None if frame in (None, own) else ("" if frame == "__model__" else frame), T)]


@st.composite
def world_file(draw, folder):
    """The bytes of a world file, and its oracle."""
    oracle = Oracle()
    sdf = ET.Element("sdf", {"version": draw(st.sampled_from(("1.6", "1.7", "1.9", "1.12")))})
    world = ET.SubElement(sdf, "world", {"name": "w"})
    known = []
    if draw(st.booleans()):
        frame = ET.SubElement(world, "frame", {"name": "map"})
        found, T, _ = draw(pose())
        add(frame, found)
        oracle.frames["map"] = ("", T)
        known.append("map")
    for k in range(draw(st.integers(1, 3))):
        made = draw(model(oracle, NAMES[k], "", 0, folder))
        found, T, frame = draw(pose((*known, "world")))
        add(made, found)
        oracle.frames[NAMES[k]] = ("" if frame in (None, "world") else frame, T)
        known.append(NAMES[k])
        known.append(f"{NAMES[k]}::a_link")
        world.append(made)
    if draw(st.booleans()):
        state = ET.SubElement(world, "state", {"world_name": "w"})
        for name in draw(st.lists(st.sampled_from(NAMES), unique=True)):
            saved = ET.SubElement(state, "model", {"name": name})
            values = draw(numbers)
            ET.SubElement(saved, "pose").text = " ".join(map(repr, values))
            oracle.saved_models[name] = matrix(*values)
            if name not in known:
                oracle.named.add(f"'{name}'")
            if draw(st.booleans()):
                link = ET.SubElement(saved, "link", {"name": "a_link"})
                values = draw(numbers)
                ET.SubElement(link, "pose").text = " ".join(map(repr, values))
                oracle.saved_links[f"{name}::a_link"] = matrix(*values)
    if draw(st.integers(0, 4)) == 0:
        include = ET.SubElement(world, "include")
        uri = draw(st.sampled_from(("model://not_there", "https://example.org/1.0/models/Tree", "../away")))
        ET.SubElement(include, "uri").text = uri
        oracle.named.add(uri)
    data = ET.tostring(sdf)
    if draw(st.booleans()):
        data = data.replace(b'<world name="w">', b'<world name="w" gz:v="1"><!-- a -- b --><gz:more on="1"/>')
    mark = draw(st.sampled_from((b"", b"\xef\xbb\xbf", b"\n")))
    return mark + b'<?xml version="1.0"?>\n' + data, oracle


def inverted(T):
    R = T[:3, :3].T
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = R, -R @ T[:3, 3]
    return out


def hold(path, oracle):
    """Every body where the oracle has it, to 1e-9; and all that was not read by name."""
    world = read_world(path)
    found = {}
    for link in world.links:  # one with both structure and things on it is two, and what stands apart is another one
        visuals, collisions = found.setdefault((link.model, link.name.partition("#")[0]), ({}, {}))
        for parts, own in ((visuals, link.visuals), (collisions, link.collisions)):
            parts.update({part.name: link.T_world_link @ part.T_link_part for part in own})
    assert set(found) == {(model, link) for model, link, _ in oracle.bodies}
    for whole, own, parts in oracle.bodies:
        saved = oracle.saved_links.get(f"{whole}::{own}")
        T_world_model = oracle.place(whole)
        T_model_link = inverted(oracle.unsaved(whole)) @ oracle.unsaved(join(whole, own))
        T_world_link = saved if saved is not None else T_world_model @ T_model_link
        visuals, collisions = found[whole, own]
        for tag, name, _, frame, T in parts:
            T_link_part = T
            if frame is not None:
                T_model_frame = inverted(oracle.unsaved(whole)) @ oracle.unsaved(join(whole, frame))
                T_link_part = inverted(T_model_link) @ T_model_frame @ T
            got = (visuals if tag == "visual" else collisions)[name]
            assert np.abs(got - T_world_link @ T_link_part).max() <= EXACT * max(1.0, np.abs(T_world_link).max())
        assert len(visuals) + len(collisions) == len(parts)
    text = "\n".join(world.warnings)
    for words in oracle.named:
        assert words in text, (words, text)


def drawn_files(tmp_path_factory, count):
    slow = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]

    @settings(
        max_examples=count,
        deadline=None,
        derandomize=True,
        database=None,
        phases=[Phase.generate],  # a file is small as it is, and each try writes files
        suppress_health_check=slow,
    )
    @given(data=st.data())
    def check(data):
        folder = tmp_path_factory.mktemp("corpus")
        content, oracle = data.draw(world_file(folder))
        (folder / "w.sdf").write_bytes(content)
        hold(folder / "w.sdf", oracle)

    return check


def test_drawn_files_read_as_the_specification_has_them(tmp_path_factory):
    drawn_files(tmp_path_factory, 15)()


@pytest.mark.accuracy
def test_hundreds_of_drawn_files_read_as_the_specification_has_them(tmp_path_factory):
    drawn_files(tmp_path_factory, 400)()
