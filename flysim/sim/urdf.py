"""Values out of a URDF: links, joints, shapes, masses. Every refusal is one line that names the file."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from flysim.errors import RobotError
from flysim.geometry.frames import Array, pose6
from flysim.world.elements import shown, shown_path
from flysim.world.model import Material, Part
from flysim.world.shapes import Box, Cylinder, Sphere

MAX_BYTES = 4_000_000
MAX_LINKS = 100  # pybullet takes 128 joints
MAX_DEPTH = 64  # nested XML elements: pybullet's reader calls itself for each
MAX_NUMBER = 1e6  # metres, kilograms, anything: beyond it is a typing error
MAX_NAME = 200  # characters

T = TypeVar("T")


def parse(path: Path) -> Element:
    """The root element of a URDF."""
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise refusal(path, f"cannot read the robot: {reason}. Give the path of a URDF") from error
    if len(data) > MAX_BYTES:
        raise refusal(path, f"a URDF of more than {MAX_BYTES} bytes; at most that much is read")
    try:
        root = fromstring(data, forbid_dtd=True)
    except DefusedXmlException:
        raise refusal(path, "declares a DTD or entities, which are not read: remove the <!DOCTYPE ...>") from None
    except (ParseError, ValueError, LookupError) as error:  # LookupError: an encoding that nobody knows
        raise refusal(path, f"not a readable URDF: {error}: correct it") from error
    if root.tag != "robot":
        raise refusal(path, f"the root element is <{root.tag[:60]}>; a URDF has <robot>")
    level = [root]
    for _ in range(MAX_DEPTH):
        level = [child for element in level for child in element]
    if level:
        raise refusal(path, f"XML elements nested deeper than {MAX_DEPTH}: flatten it")
    return root


def refusal(path: Path, what: str) -> RobotError:
    """A `RobotError` of one line."""
    return RobotError(f"{shown_path(path)}: {''.join(c if c.isprintable() else '?' for c in what)}.")


def refused(path: Path, where: str, make: Callable[[], T]) -> T:
    """What `make` makes; its ValueError as a `RobotError`."""
    try:
        return make()
    except ValueError as error:
        raise refusal(path, f"{where}: {error}") from error


def named(path: Path, root: Element, tag: str) -> dict[str, Element]:
    """The links or joints of a robot by name."""
    found: dict[str, Element] = {}
    for element in root.findall(tag):
        name = attribute(path, element, "name")
        if name in found:
            raise refusal(path, f"two {tag}s are named {shown(name)}: give each its own name")
        found[name] = element
    if len(found) > MAX_LINKS:
        raise refusal(path, f"{len(found)} {tag}s; at most {MAX_LINKS} are simulated")
    return found


def attribute(path: Path, element: Element, name: str) -> str:
    """A name in an attribute."""
    value = element.get(name)
    if value is None:
        raise refusal(path, f"<{element.tag}> has no {name}=: add it")
    if not value.isprintable() or len(value) > MAX_NAME:
        raise refusal(path, f"{name}={shown(value)}: a name is printable and has at most {MAX_NAME} characters")
    return value


def numbers(path: Path, text: str | None, count: int, where: str) -> list[float]:
    """`count` finite numbers of at most a million."""
    words = (text or "").split(maxsplit=16)
    try:
        values = [float(word) if "_" not in word else math.nan for word in words]
    except ValueError:
        values = []
    if len(values) != count or not all(abs(value) <= MAX_NUMBER for value in values):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise refusal(path, f"{where} must be {what}, got {'nothing' if text is None else shown(text)}")
    return values


def origin(path: Path, element: Element) -> Array:
    """`[4, 4]` transform of an `<origin>` child; the identity where there is none."""
    tag = element.find("origin")
    if tag is None:
        return np.eye(4)
    where = f"the origin of {_called(element)}"
    xyz = numbers(path, tag.get("xyz", "0 0 0"), 3, f"{where}, xyz,")
    return pose6(*xyz, *numbers(path, tag.get("rpy", "0 0 0"), 3, f"{where}, rpy,"))


def _called(element: Element) -> str:
    name = element.get("name")
    return f"<{element.tag}>" if name is None else f"{element.tag} {shown(name)}"


def link_poses(path: Path, links: dict[str, Element], joints: dict[str, Element]) -> dict[str, Array]:
    """`T_base_link` of every link, all joints at zero."""
    if "base_link" not in links:
        raise refusal(path, "no link 'base_link'. Name the robot's root link so (REP-105)")
    edges: dict[str, list[tuple[str, Array]]] = {}
    for name, joint in joints.items():
        ends = [joint.find(end) for end in ("parent", "child")]
        parent, child = (attribute(path, end, "link") if end is not None else "" for end in ends)
        if parent not in links or child not in links:
            raise refusal(path, f"joint '{name}' joins '{parent}' to '{child}', which are not both links")
        edges.setdefault(parent, []).append((child, origin(path, joint)))
    poses, queue = {"base_link": np.eye(4)}, ["base_link"]
    while queue:
        parent = queue.pop()
        for child, T_parent_child in edges.get(parent, []):
            if child in poses:
                raise refusal(path, f"link '{child}' has two parents. A robot is a tree")
            poses[child] = poses[parent] @ T_parent_child
            queue.append(child)
    lost = sorted(set(links) - set(poses))
    if lost:
        raise refusal(path, f"link '{lost[0]}' is not joined to base_link. Add a joint")
    return poses


def parts(path: Path, link: str, element: Element, kind: str, colours: dict[str, Material]) -> list[Part]:
    """The visuals or collisions of a link."""
    found = []
    for index, tag in enumerate(element.findall(kind)):
        where = f"{kind} {index} of link '{link}'"
        geometry = tag.find("geometry")
        shape = geometry[0] if geometry is not None and len(geometry) else None
        if shape is None or shape.tag not in ("box", "cylinder", "sphere"):
            raise refusal(path, f"{where} must be a box, a cylinder or a sphere")
        dress = tag.find("material")
        material = colours.get(dress.get("name", ""), Material()) if dress is not None else Material()
        made = refused(path, where, lambda s=shape, w=where: _shape(path, s, w))
        found.append(Part(name=where, shape=made, T_link_part=origin(path, tag), material=material))
    return found


def _shape(path: Path, tag: Element, where: str) -> Box | Cylinder | Sphere:
    if tag.tag == "box":
        x, y, z = numbers(path, tag.get("size"), 3, f"{where}, its size,")
        return Box((x, y, z))
    radius = numbers(path, tag.get("radius"), 1, f"{where}, its radius,")[0]
    if tag.tag == "sphere":
        return Sphere(radius)
    return Cylinder(radius, numbers(path, tag.get("length"), 1, f"{where}, its length,")[0])


def colours(path: Path, root: Element) -> dict[str, Material]:
    """The robot's named materials."""
    found = {}
    for tag in root.findall("material"):
        colour = tag.find("color")
        if colour is not None:
            name = attribute(path, tag, "name")
            r, g, b, _ = rgba = numbers(path, colour.get("rgba"), 4, f"the rgba of material '{name}'")
            if not all(0.0 <= value <= 1.0 for value in rgba):
                raise refusal(
                    path, f"the rgba of material '{name}' must be in [0, 1], got {shown(colour.get('rgba', ''))}"
                )
            found[name] = Material(diffuse=(r, g, b))
    return found


def friction(path: Path, root: Element, links: dict[str, Element]) -> dict[str, float]:
    """Lateral friction by link name: Gazebo's mu1."""
    found = {}
    for tag in root.findall("gazebo"):
        if tag.find("mu1") is None:
            continue
        link = tag.get("reference", "")
        if link not in links:
            raise refusal(path, f"<gazebo> gives friction to {shown(link)}, which is no link")
        found[link] = numbers(path, tag.findtext("mu1"), 1, f"mu1 of link '{link}'")[0]
        if found[link] < 0.0:
            raise refusal(path, f"mu1 of link '{link}' must be >= 0, got {found[link]:g}")
    return found


def frames(path: Path, links: dict[str, Element]) -> tuple[str, ...]:
    """The links without a mass of their own; every mass and inertia there is must be physical."""
    bare = []
    for name, link in links.items():
        inertial = link.find("inertial")
        if inertial is None:
            if name == "base_link" or link.find("collision") is not None:
                raise refusal(path, f"link '{name}' has a body and no <inertial>: add its mass and inertia")
            bare.append(name)
            continue
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        kilograms = numbers(path, mass.get("value") if mass is not None else None, 1, f"mass of link '{name}'")[0]
        if kilograms <= 0.0:
            raise refusal(path, f"mass of link '{name}' must be > 0 kg, got {kilograms:g}")
        entries = {
            key: numbers(path, inertia.get(key) if inertia is not None else None, 1, f"{key} of link '{name}'")[0]
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        }
        origin(path, inertial)
        tensor = np.array([[entries["".join(("i", *sorted((a, b))))] for b in "xyz"] for a in "xyz"])
        moments = np.linalg.eigvalsh(tensor)
        if moments[0] <= 0.0 or moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-6):
            text = ", ".join(f"{moment:.3g}" for moment in moments)
            raise refusal(
                path, f"inertia of link '{name}': moments must be > 0, each at most the sum of the others, got {text}"
            )
    return tuple(bare)
