"""The links of a URDF, checked: their masses, what they look like and what they touch with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from flysim.robots.urdf import Origin, at_least_zero, attribute, named, numbers, origin, refusal, refused
from flysim.worlds.model import Material, Part
from flysim.worlds.sdf.elements import shown
from flysim.worlds.shapes import Box, Cylinder, Sphere

MAX_SOLIDS = 500  # visuals and collisions of a robot
CONTACT = ("lateral_friction", "rolling_friction", "spinning_friction", "restitution")  # Bullet's <contact>
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
# Bullet diagonalises a tensor to 1e-6 of itself and takes an inertia that then is impossible for zero. One that is
# possible by less than this part of itself, as that of a thin disc is, is made rounder by as much.
LEEWAY = 1e-5

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

    shape: Box | Cylinder | Sphere
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


def read_links(path: Path, root: Element) -> tuple[RobotLink, ...]:
    """Every link, in the order of the file.

    Raises:
        RobotError: a link says nonsense, or nothing where it must say something.
    """
    elements = named(path, root, "link")
    count = sum(len(element.findall(kind)) for element in elements.values() for kind in ("visual", "collision"))
    if count > MAX_SOLIDS:
        raise refusal(path, f"{count} visuals and collisions; at most {MAX_SOLIDS} are simulated")
    colours = _colours(path, root)
    return tuple(
        RobotLink(
            name=name,
            inertial=_inertial(path, name, element),
            visuals=_solids(path, name, element, "visual", colours),
            collisions=_solids(path, name, element, "collision", colours),
            contact=_contact(path, name, element),
        )
        for name, element in elements.items()
    )


def _inertial(path: Path, name: str, link: Element) -> Inertial | None:
    """None for a frame; every mass and inertia there is must be physical."""
    tag = link.find("inertial")
    if tag is None:
        if name == "base_link" or link.find("collision") is not None:
            raise refusal(path, f"link {shown(name)} has a body and no <inertial>: add its mass and inertia")
        return None
    mass, inertia = tag.find("mass"), tag.find("inertia")
    where = f"link {shown(name)}"
    kilograms = numbers(path, mass.get("value") if mass is not None else None, 1, f"mass of {where}")[0]
    if kilograms <= 0.0:
        raise refusal(path, f"mass of {where} must be > 0 kg, got {kilograms:g}")
    entries = {
        key: numbers(path, inertia.get(key) if inertia is not None else None, 1, f"{key} of {where}")[0]
        for key in MOMENTS
    }
    tensor = np.array([[entries["".join(("i", *sorted((a, b))))] for b in "xyz"] for a in "xyz"])
    principal = np.linalg.eigvalsh(tensor)
    if principal[0] <= 0.0 or principal[2] > (principal[0] + principal[1]) * (1.0 + 1e-6):
        text = ", ".join(f"{moment:.3g}" for moment in principal)
        raise refusal(path, f"inertia of {where}: moments must be > 0, each at most the sum of the others, got {text}")
    if principal[2] > (principal[0] + principal[1]) * (1.0 - LEEWAY):
        for key in ("ixx", "iyy", "izz"):
            entries[key] += LEEWAY * float(principal[2])
    return Inertial(mass=kilograms, moments=tuple(entries.values()), origin=origin(path, tag))


def _contact(path: Path, name: str, link: Element) -> tuple[tuple[str, float], ...]:
    tag = link.find("contact")
    found = []
    for what in CONTACT if tag is not None else ():
        element = tag.find(what) if tag is not None else None
        if element is not None:
            found.append((what, at_least_zero(path, element.get("value"), f"{what} of link {shown(name)}")))
    return tuple(found)


def _solids(path: Path, link: str, element: Element, kind: str, colours: dict[str, Colour]) -> tuple[LinkShape, ...]:
    found = []
    for index, tag in enumerate(element.findall(kind)):
        where = f"{kind} {index} of link {shown(link)}"
        geometry = tag.find("geometry")
        shape = geometry[0] if geometry is not None and len(geometry) else None
        if shape is None or shape.tag not in ("box", "cylinder", "sphere"):
            raise refusal(path, f"{where} must be a box, a cylinder or a sphere")
        made = refused(path, where, lambda s=shape, w=where: _shape(path, s, w))
        dress = tag.find("material") if kind == "visual" else None
        colour = None if dress is None else _colour(path, dress) or colours.get(dress.get("name", ""))
        found.append(LinkShape(shape=made, origin=origin(path, tag), colour=colour))
    return tuple(found)


def _shape(path: Path, tag: Element, where: str) -> Box | Cylinder | Sphere:
    if tag.tag == "box":
        x, y, z = numbers(path, tag.get("size"), 3, f"{where}, its size,")
        return Box((x, y, z))
    radius = numbers(path, tag.get("radius"), 1, f"{where}, its radius,")[0]
    if tag.tag == "sphere":
        return Sphere(radius)
    return Cylinder(radius, numbers(path, tag.get("length"), 1, f"{where}, its length,")[0])


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


def friction(path: Path, root: Element, links: tuple[RobotLink, ...]) -> dict[str, float]:
    """Lateral friction by link name: Gazebo's mu1."""
    names = {link.name for link in links}
    found = {}
    for tag in root.findall("gazebo"):
        if tag.find("mu1") is None:
            continue
        link = tag.get("reference", "")
        if link not in names:
            raise refusal(path, f"<gazebo> gives friction to {shown(link)}, which is no link")
        found[link] = at_least_zero(path, tag.findtext("mu1"), f"mu1 of link {shown(link)}")
    return found
