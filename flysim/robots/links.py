"""The links of a URDF, checked: their masses, what they look like and what they touch with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from flysim.plain import shown
from flysim.robots.account import Account
from flysim.robots.meshes import Meshes, UnreadMeshError, hull
from flysim.robots.urdf import Origin, at_least_zero, attribute, named, numbers, origin, refusal, refused
from flysim.worlds.model import Material, Part
from flysim.worlds.shapes import Box, Cylinder, Mesh, Sphere

MAX_SOLIDS = 500  # visuals and collisions of a robot
CONTACT = ("lateral_friction", "rolling_friction", "spinning_friction", "restitution")  # Bullet's <contact>
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
# Bullet diagonalises a tensor to 1e-6 of itself and takes an inertia that then is impossible for zero. One that is
# possible by less than this part of itself, as that of a thin disc is, is made rounder by as much.
LEEWAY = 1e-5

BALL = 0.05  # [m] radius of the ball that stands for an inertia that no body has
LINK_TAGS = {"inertial", "visual", "collision", "contact"}

Hold = Literal["fixed", "moving", "root"]  # how a link hangs on another; a root on none
Colour = tuple[float, float, float, float]  # RGBA in [0, 1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertial:
    """Mass [kg], the six `MOMENTS` about the centre of mass [kg m^2], and where that lies in the link."""

    mass: float
    moments: tuple[float, ...]
    origin: Origin


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkShape:
    """A shape at its place in a link: a visual or a collision."""

    shape: Box | Cylinder | Sphere | Mesh
    origin: Origin
    colour: Colour | None = None  # of a visual that the file gives one

    def part(self, name: str) -> Part:
        """The shape as a world has them."""
        material = Material() if self.colour is None else Material(diffuse=self.colour[:3])
        return Part(name=name, shape=self.shape, T_link_part=self.origin.matrix, material=material)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLink:
    """A rigid piece of a robot.

    Attributes:
        inertial: None for a link that is a frame and no body.
        visuals: what it looks like.
        collisions: what it touches with.
        contact: those of `CONTACT` that the file gives, by name.
    """

    name: str
    inertial: Inertial | None
    visuals: tuple[LinkShape, ...]
    collisions: tuple[LinkShape, ...]
    contact: tuple[tuple[str, float], ...] = ()


def read_links(
    path: Path, root: Element, rigid: dict[str, Hold], account: Account, meshes: Meshes
) -> tuple[RobotLink, ...]:
    """Every link, in the order of the file.

    Args:
        path: of the file.
        root: its root element.
        rigid: how links hang on others; those that hang on none are not in it.
        account: what is approximated or left out is noted here.
        meshes: reads them.

    Raises:
        RobotError: a link says nonsense, or nothing where it must say something.
    """
    elements = named(path, root, "link")
    count = sum(len(element.findall(kind)) for element in elements.values() for kind in ("visual", "collision"))
    if count > MAX_SOLIDS:
        raise refusal(path, f"{count} visuals and collisions; at most {MAX_SOLIDS} are simulated")
    for name, element in elements.items():
        for tag in element:
            if tag.tag not in LINK_TAGS:
                account.note("unknown", f"<{tag.tag}> of link {shown(name)}")
    read = _Solids(path, _colours(path, root), account, meshes)
    return tuple(
        RobotLink(
            name=name,
            inertial=_inertial(path, name, element, rigid.get(name, "root"), account),
            visuals=read.of(name, element, "visual"),
            collisions=read.of(name, element, "collision"),
            contact=_contact(path, name, element),
        )
        for name, element in elements.items()
    )


def _inertial(path: Path, name: str, link: Element, held: Hold, account: Account) -> Inertial | None:
    """None for a frame; every mass and inertia there is must be physical, but where it is carried rigidly."""
    tag, where = link.find("inertial"), f"link {shown(name)}"
    carried = held == "fixed" and name != "base_link"  # which may say nonsense about its mass
    if tag is None:
        return _without_mass(path, link, where, held, account)
    mass = tag.find("mass")
    kilograms = numbers(path, mass.get("value") if mass is not None else None, 1, f"mass of {where}")[0]
    if carried and kilograms == 0.0:
        return _without_mass(path, link, where, held, account)
    if kilograms <= 0.0:
        raise refusal(path, f"mass of {where} must be > 0 kg, got {kilograms:g}")
    moments = _moments(path, tag, where, kilograms if carried else None, account)
    return Inertial(mass=kilograms, moments=moments, origin=origin(path, tag))


def _without_mass(path: Path, link: Element, where: str, held: Hold, account: Account) -> None:
    """Notes a body that weighs nothing; refuses one that moves."""
    if link.find("collision") is None:
        return
    if held == "moving":
        raise refusal(path, f"{where} has a body and no <inertial>: add its mass and inertia")
    account.note("massless", where)


def _moments(path: Path, tag: Element, where: str, ball: float | None, account: Account) -> tuple[float, ...]:
    """The six `MOMENTS`; of an inertia that no body has, those of a ball of the mass `ball`, or a refusal."""
    inertia = tag.find("inertia")
    entries = {
        key: numbers(path, inertia.get(key) if inertia is not None else None, 1, f"{key} of {where}")[0]
        for key in MOMENTS
    }
    tensor = np.array([[entries["".join(("i", *sorted((a, b))))] for b in "xyz"] for a in "xyz"])
    principal = np.linalg.eigvalsh(tensor)
    if principal[0] <= 0.0 or principal[2] > (principal[0] + principal[1]) * (1.0 + 1e-6):
        if ball is not None:
            account.note("point mass", where)
            moment = 0.4 * ball * BALL**2
            return (moment, 0.0, 0.0, moment, 0.0, moment)
        text = ", ".join(f"{moment:.3g}" for moment in principal)
        raise refusal(path, f"inertia of {where}: moments must be > 0, each at most the sum of the others, got {text}")
    if principal[2] > (principal[0] + principal[1]) * (1.0 - LEEWAY):
        for key in ("ixx", "iyy", "izz"):
            entries[key] += LEEWAY * float(principal[2])
    return tuple(entries.values())


def _contact(path: Path, name: str, link: Element) -> tuple[tuple[str, float], ...]:
    tag = link.find("contact")
    found = []
    for what in CONTACT if tag is not None else ():
        element = tag.find(what) if tag is not None else None
        if element is not None:
            found.append((what, at_least_zero(path, element.get("value"), f"{what} of link {shown(name)}")))
    return tuple(found)


class _Solids:
    """Reads the visuals and collisions of links."""

    def __init__(self, path: Path, colours: dict[str, Colour], account: Account, meshes: Meshes) -> None:
        self._path, self._colours, self._account, self._meshes = path, colours, account, meshes

    def of(self, link: str, element: Element, kind: str) -> tuple[LinkShape, ...]:
        """Those of one link; a mesh that cannot be read is left out."""
        found = []
        for index, tag in enumerate(element.findall(kind)):
            where = f"{kind} {index} of link {shown(link)}"
            geometry = tag.find("geometry")
            shape = geometry[0] if geometry is not None and len(geometry) else None
            if shape is None or shape.tag not in ("box", "cylinder", "sphere", "capsule", "mesh"):
                raise refusal(self._path, f"{where} must be a box, a cylinder, a sphere, a capsule or a mesh")
            place = origin(self._path, tag)
            if shape.tag == "mesh":
                solid = self._mesh(shape, place, kind, where)
            else:
                made = refused(self._path, where, lambda s=shape, w=where: _shape(self._path, s, w))
                solid = LinkShape(shape=made, origin=place)
            if shape.tag == "capsule":
                self._account.note("capsule", where)
            dress = tag.find("material") if kind == "visual" else None
            if solid is not None and dress is not None:
                solid = replace(solid, colour=self._dress(dress, where))
            if solid is not None:
                found.append(solid)
        return tuple(found)

    def _mesh(self, tag: Element, place: Origin, kind: str, where: str) -> LinkShape | None:
        scale = numbers(self._path, tag.get("scale", "1 1 1"), 3, f"{where}, its scale,")
        x, y, z = scale
        if 0.0 in scale:
            raise refusal(self._path, f"{where}: the scale of a mesh must not be 0, got {shown(tag.get('scale', ''))}")
        uri = attribute(self._path, tag, "filename", 1000)
        try:
            mesh = self._meshes.read(uri, (x, y, z))
        except UnreadMeshError as error:
            self._account.note("lost mesh", f"{where}: {error}")
            return None
        if kind == "visual":
            return LinkShape(shape=mesh, origin=place)
        self._account.note("collision mesh", where)
        outer = hull(mesh)
        if isinstance(outer, Mesh):
            return LinkShape(shape=outer, origin=place)
        box, middle = outer
        a, b, c = (np.array(place.xyz) + place.matrix[:3, :3] @ middle).tolist()
        return LinkShape(shape=box, origin=Origin((a, b, c), place.rpy))

    def _dress(self, tag: Element, where: str) -> Colour | None:
        colour = _colour(self._path, tag) or self._colours.get(tag.get("name", ""))
        if tag.find("texture") is not None:
            self._account.note("picture", where)
        if colour is not None and colour[3] < 1.0:
            self._account.note("transparency", where)
        return colour


def _shape(path: Path, tag: Element, where: str) -> Box | Cylinder | Sphere:
    if tag.tag == "box":
        x, y, z = numbers(path, tag.get("size"), 3, f"{where}, its size,")
        return Box((x, y, z))
    radius = numbers(path, tag.get("radius"), 1, f"{where}, its radius,")[0]
    if tag.tag == "sphere":
        return Sphere(radius)
    length = numbers(path, tag.get("length"), 1, f"{where}, its length,")[0]
    return Cylinder(radius, length if tag.tag == "cylinder" else length + 2.0 * radius)


def _colours(path: Path, root: Element) -> dict[str, Colour]:
    """The colours of materials by name, those that a visual defines for others included."""
    found = {}
    for tag in (*root.findall("material"), *root.findall("link/visual/material")):
        colour = _colour(path, tag)
        if colour is not None and tag.get("name") is not None:
            found.setdefault(attribute(path, tag, "name"), colour)
    return found


def _colour(path: Path, material: Element) -> Colour | None:
    tag = material.find("color")
    if tag is None:
        return None
    where = f"the rgba of material {shown(material.get('name', ''))}"
    red, green, blue, alpha = rgba = numbers(path, tag.get("rgba"), 4, where)
    if not all(0.0 <= value <= 1.0 for value in rgba):
        raise refusal(path, f"{where} must be in [0, 1], got {shown(tag.get('rgba', ''))}")
    return red, green, blue, alpha


def friction(path: Path, root: Element, links: tuple[RobotLink, ...], account: Account) -> dict[str, float]:
    """Lateral friction by link name: Gazebo's mu1."""
    names = {link.name for link in links}
    found = {}
    for tag in root.findall("gazebo"):
        first, second = (_value(tag.find(name)) for name in ("mu1", "mu2"))
        if first is None:
            continue
        link = tag.get("reference", "")
        if link not in names:
            raise refusal(path, f"<gazebo> gives friction to {shown(link)}, which is no link")
        found[link] = at_least_zero(path, first, f"mu1 of link {shown(link)}")
        if second is not None and at_least_zero(path, second, f"mu2 of link {shown(link)}") != found[link]:
            account.note("mu2", f"link {shown(link)}")
    return found


def _value(tag: Element | None) -> str | None:
    """What a tag says, in it or in its value=."""
    return None if tag is None else tag.get("value") or tag.text or ""
