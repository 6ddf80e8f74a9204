"""SDF `<visual>` and `<collision>` elements as parts: shape, place and material."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flysim.geometry.frames import Array, se3
from flysim.plain import shown
from flysim.worlds.model import Material, Part
from flysim.worlds.sdf.elements import Where, child_numbers, numbers, pose_of, text_of
from flysim.worlds.sdf.folder import WorldFolder
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_PLANE = 100.0  # [m] a larger plane is cut to this
MAX_KINDS, OTHER_KINDS = 50, "other things are not read"
MIN_SIZE, MAX_SIZE = 1e-4, 1e4  # [m] of a solid shape

# The colours of Gazebo's own material scripts, which world files name without carrying them.
GAZEBO_COLOURS = {
    "Gazebo/Grey": (0.7, 0.7, 0.7),
    "Gazebo/DarkGrey": (0.175, 0.175, 0.175),
    "Gazebo/White": (1.0, 1.0, 1.0),
    "Gazebo/Black": (0.0, 0.0, 0.0),
    "Gazebo/FlatBlack": (0.1, 0.1, 0.1),
    "Gazebo/Red": (1.0, 0.0, 0.0),
    "Gazebo/Green": (0.0, 1.0, 0.0),
    "Gazebo/Blue": (0.0, 0.0, 1.0),
    "Gazebo/Yellow": (1.0, 1.0, 0.0),
    "Gazebo/Orange": (1.0, 0.51, 0.07),
}


@dataclass(slots=True)
class Skipped:
    """What the reader passed over, by kind: one sentence a kind in the end, of at most `MAX_KINDS` kinds."""

    _first: dict[str, str] = field(default_factory=dict)  # of each kind, the place
    _counts: Counter[str] = field(default_factory=Counter)

    def note(self, kind: str, where: Where, detail: str = "") -> None:
        """Counts one more of a kind, such as 'joint' or 'plugin'."""
        if kind not in self._first and len(self._first) >= MAX_KINDS:
            kind = OTHER_KINDS
        if kind not in self._first:
            self._first[kind] = " ".join(filter(None, (detail and shown(detail), f"in {where}")))
        self._counts[kind] += 1

    def sentences(self) -> tuple[str, ...]:
        """One a kind, in the order of first sight."""
        return tuple(
            f"{kind}: {self._counts[kind]}, the first {first}." if self._counts[kind] > 1 else f"{kind}: {first}."
            for kind, first in self._first.items()
        )


def read_part(
    element: Element,
    name: str,
    parents: tuple[str, ...],
    folder: WorldFolder,
    base: Path,
    where: Where,
    skipped: Skipped,
) -> Part | None:
    """A visual or collision; None where its geometry is empty or of a kind that is not read.

    `parents` are the link's names, for `relative_to`; `base` is the folder of the element's file.
    """
    geometry = element.find("geometry")
    if geometry is None or not len(geometry):
        raise where.error("has no <geometry> with a shape in it: add a box, cylinder, sphere, plane or mesh")
    read = _read_shape(geometry[0], folder, base, where, skipped)
    if read is None:
        return None
    shape, T_part_shape = read
    T_link_part = pose_of(element, parents, where) @ T_part_shape
    if element.tag != "visual":
        return Part(name=name, shape=shape, T_link_part=T_link_part)
    material = _read_material(element, folder, base, where, skipped)
    return Part(name=name, shape=shape, T_link_part=T_link_part, material=material)


def _read_shape(
    element: Element, folder: WorldFolder, base: Path, where: Where, skipped: Skipped
) -> tuple[Shape, Array] | None:
    """The shape and its pose in the part (a plane's normal turns it)."""
    upright = np.eye(4)
    if element.tag == "box":
        x, y, z = child_numbers(element, "size", 3, where, None)
        return Box((_size(x, where), _size(y, where), _size(z, where))), upright
    if element.tag == "cylinder":
        (radius,) = child_numbers(element, "radius", 1, where, None)
        (length,) = child_numbers(element, "length", 1, where, None)
        return Cylinder(_size(radius, where), _size(length, where)), upright
    if element.tag == "sphere":
        (radius,) = child_numbers(element, "radius", 1, where, None)
        return Sphere(_size(radius, where)), upright
    if element.tag == "plane":
        x, y = child_numbers(element, "size", 2, where, (1.0, 1.0))
        if max(x, y) > MAX_PLANE:
            skipped.note(f"a plane is cut to {MAX_PLANE:.0f} m a side", where)
        normal = child_numbers(element, "normal", 3, where, (0.0, 0.0, 1.0))
        size = (_size(min(x, MAX_PLANE), where), _size(min(y, MAX_PLANE), where))
        return Plane(size), _facing(normal, where)
    if element.tag == "mesh":
        mesh = _read_mesh(element, folder, base, where, skipped)
        return None if mesh is None else (mesh, upright)
    if element.tag != "empty":
        skipped.note(f"<{element.tag}> geometry is not read", where)
    return None


def _size(value: float, where: Where) -> float:
    if not MIN_SIZE <= value <= MAX_SIZE:
        raise where.error(f"a size must be from {MIN_SIZE:g} to {MAX_SIZE:g} m, got {value:g}")
    return value


def _facing(normal: tuple[float, ...], where: Where) -> Array:
    """`[4, 4]` the smallest turn that takes the z axis to `normal`."""
    length = math.hypot(*normal)
    if length < 1e-9:
        raise where.error("a plane's <normal> must not be zero: use 0 0 1 for a floor")
    x, y, z = (value / length for value in normal)
    if z < -1.0 + 1e-12:
        return se3(np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 0.0))
    # Rodrigues' formula about the axis z cross n = (-y, x, 0), whose length is the sine of the angle.
    cross = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
    return se3(np.eye(3) + cross + cross @ cross / (1.0 + z), (0.0, 0.0, 0.0))


def _read_mesh(element: Element, folder: WorldFolder, base: Path, where: Where, skipped: Skipped) -> Mesh | None:
    uri = text_of(element.find("uri"))
    if not uri:
        raise where.error("<mesh> has no <uri>: name an .obj or .stl file in the world's folder")
    if element.find("submesh") is not None:
        skipped.note("<submesh> geometry is not read", where)
        return None
    x, y, z = child_numbers(element, "scale", 3, where, (1.0, 1.0, 1.0))
    if 0.0 in (x, y, z):
        raise where.error("<scale> must not be 0: use 1 1 1 for the file's own size")
    return folder.mesh(uri, (x, y, z), base, where)


def _read_material(visual: Element, folder: WorldFolder, base: Path, where: Where, skipped: Skipped) -> Material:
    """The first colour and the first texture of a visual; the texture wins where both are drawn."""
    diffuse, texture = Material().diffuse, None
    colour = next((e for m in visual.findall("material") if (e := m.find("diffuse")) is not None), None)
    script = next((e for m in visual.findall("material") if (e := m.find("script")) is not None), None)
    if colour is not None:
        rgb = numbers(colour, (3, 4), where)[:3]
        if not all(0.0 <= value <= 1.0 for value in rgb):
            raise where.error(f"<diffuse> must be red green blue alpha from 0 to 1, got {shown(text_of(colour))}")
        diffuse = (rgb[0], rgb[1], rgb[2])
    elif script is not None:
        name = text_of(script.find("name"))
        if name in GAZEBO_COLOURS:
            diffuse = GAZEBO_COLOURS[name]
        else:
            skipped.note("a material script is not read and its visual is grey", where, name)
    for workflow in ("metal", "specular"):
        album = visual.find(f"material/pbr/{workflow}/albedo_map")
        if album is not None and texture is None:
            texture = folder.texture(text_of(album), base, where)
    return Material(diffuse=diffuse, texture=texture)


def read_inertial(
    link: Element, where: Where, dynamic: bool, skipped: Skipped
) -> tuple[float, tuple[float, float, float] | None]:
    """Mass [kg] and principal moments [kg m^2] of a link; None: not given, to be derived from its shape."""
    inertial = link.find("inertial")
    if inertial is None:
        return 1.0, None
    (mass,) = child_numbers(inertial, "mass", 1, where, (1.0,))
    inertia = inertial.find("inertia")
    moments = None
    if inertia is not None:
        ixx, iyy, izz = (child_numbers(inertia, tag, 1, where, (1.0,))[0] for tag in ("ixx", "iyy", "izz"))
        products = [child_numbers(inertia, tag, 1, where, (0.0,))[0] for tag in ("ixy", "ixz", "iyz")]
        moments = (ixx, iyy, izz)
        if dynamic and any(abs(p) > 1e-9 for p in products):
            skipped.note("products of inertia (ixy, ixz, iyz) are not read", where)
    T_link_inertial = pose_of(inertial, (link.get("name") or "",), where)
    if not dynamic:
        return mass, moments
    if mass <= 0.0:
        raise where.error(f"<mass> of a body that moves must be > 0 kg, got {mass:g}")
    if moments is not None and (min(moments) <= 0.0 or 2.0 * max(moments) > sum(moments) * (1.0 + 1e-6)):
        raise where.error(
            f"<inertia> must hold three moments > 0, each at most the sum of the others, got {moments}: "
            "correct them, or remove <inertia> to have it from the shape"
        )
    if not np.allclose(T_link_inertial, np.eye(4), atol=1e-9):
        skipped.note("the <pose> of an <inertial> is not read and its mass sits at the link's origin", where)
    return mass, moments
