"""SDF `<visual>` and `<collision>` elements as parts: shape and place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flysim.geometry.frames import Array, se3
from flysim.worlds.model import Material, Part
from flysim.worlds.sdf.elements import Unread, Where, child_numbers, flag, text_of, written_pose
from flysim.worlds.sdf.material import is_seen, own_material
from flysim.worlds.sdf.reading import Reading
from flysim.worlds.shapes import Box, Cylinder, Plane, Shape, Sphere
from flysim.worlds.surface.mesh_group import MeshGroup, merged
from flysim.worlds.surface.round_mesh import round_mesh

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_PLANE = 100.0  # [m] a larger plane is cut to this
MIN_SIZE, MAX_SIZE = 1e-4, 1e4  # [m] of a solid shape
ALL_BITS = 0xFFFF  # of a collision's masks, unless it says otherwise


def read_part(element: Element, name: str, link: str, reading: Reading) -> tuple[Part, ...]:
    """A visual or collision of a link; none where nothing sees or hits it, or its geometry is not read.

    A visual of a mesh with several materials is several parts.
    """
    where = reading.where
    geometry = element.find("geometry")
    if geometry is None or not len(geometry):
        raise where.error("has no <geometry> with a shape in it: add a box, cylinder, sphere, plane or mesh")
    visual = element.tag == "visual"
    if not (is_seen(element, reading) if visual else _hits(element, where)):
        return ()
    T = reading.scope.place_written(written_pose(element, where), link, where)
    material = own_material(element, reading) if visual else None
    if geometry[0].tag == "mesh":
        groups = _mesh(geometry[0], reading)
        if len(groups) > 1 and (not visual or material is not None):
            groups = (merged(groups),)
        return tuple(
            Part(
                name=name if n == 0 else f"{name}#{n + 1}",
                shape=group.mesh,
                T_link_part=T,
                material=material or (visual and group.material) or Material(),
            )
            for n, group in enumerate(groups)
        )
    read = _read_shape(geometry[0], reading)
    if read is None:
        return ()
    shape, T_part_shape = read
    return (Part(name=name, shape=shape, T_link_part=T @ T_part_shape, material=material or Material()),)


def _hits(collision: Element, where: Where) -> bool:
    """Whether a collision touches anything: not one whose masks share no bit with what others have."""
    contact = collision.find("surface/contact")
    if contact is not None:
        mask = _mask(contact, "collide_bitmask", ALL_BITS)
        if not (mask | _mask(contact, "category_bitmask", mask)) & ALL_BITS:
            return False
        if flag(contact, "collide_without_contact", where):
            return False
    most = text_of(collision.find("max_contacts"))
    return not (most.isdecimal() and int(most[:20]) == 0)


def _mask(contact: Element, tag: str, default: int) -> int:
    text = text_of(contact.find(tag))
    try:
        return int(text, 0) if len(text) < 64 else default
    except ValueError:
        return int(text) if text.isdecimal() and len(text) < 64 else default


def _read_shape(element: Element, reading: Reading) -> tuple[Shape, Array] | None:
    """The shape and its pose in the part (a plane's normal turns it)."""
    where, (sx, sy, sz), upright = reading.where, reading.scale, np.eye(4)
    if element.tag == "box":
        x, y, z = child_numbers(element, "size", 3, where, None)
        return Box((_size(x * sx, where), _size(y * sy, where), _size(z * sz, where))), upright
    if element.tag == "cylinder":
        (radius,) = child_numbers(element, "radius", 1, where, None)
        (length,) = child_numbers(element, "length", 1, where, None)
        return Cylinder(_size(radius * max(sx, sy), where), _size(length * sz, where)), upright
    if element.tag == "sphere":
        (radius,) = child_numbers(element, "radius", 1, where, None)
        return Sphere(_size(radius * max(sx, sy, sz), where)), upright
    if element.tag == "plane":
        x, y = child_numbers(element, "size", 2, where, (1.0, 1.0))
        x, y = x * sx, y * sy
        if max(x, y) > MAX_PLANE:
            reading.note(f"a plane is cut to {MAX_PLANE:.0f} m a side")
        normal = child_numbers(element, "normal", 3, where, (0.0, 0.0, 1.0))
        size = (_size(min(x, MAX_PLANE), where), _size(min(y, MAX_PLANE), where))
        return Plane(size), _facing(normal, where)
    if element.tag in ("capsule", "ellipsoid", "cone"):
        return round_mesh(element.tag, _round_sizes(element, reading), where.file), upright
    if element.tag != "empty":
        reading.note(f"<{element.tag[:40]}> geometry is not read")
    return None


def _round_sizes(element: Element, reading: Reading) -> tuple[float, float, float]:
    """Half the extent along x, y, z [m] of a capsule (without its caps), a cone or an ellipsoid."""
    where, (sx, sy, sz) = reading.where, reading.scale
    if element.tag == "ellipsoid":
        a, b, c = child_numbers(element, "radii", 3, where, (1.0, 1.0, 1.0))
        return _size(a * sx, where), _size(b * sy, where), _size(c * sz, where)
    (radius,) = child_numbers(element, "radius", 1, where, (0.5,))
    (length,) = child_numbers(element, "length", 1, where, (1.0,))
    radius = _size(radius * max(sx, sy), where)
    return radius, radius, _size(length * sz, where) / 2.0


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


def _mesh(element: Element, reading: Reading) -> tuple[MeshGroup, ...]:
    uri = text_of(element.find("uri"))
    if not uri:
        raise reading.where.error("<mesh> has no <uri>: name an .obj, .stl, .dae, .glb or .gltf file")
    if element.find("submesh") is not None:
        reading.note("<submesh> geometry is not read", text_of(element.find("submesh/name")))
        return ()
    scale = child_numbers(element, "scale", 3, reading.where, (1.0, 1.0, 1.0))
    if 0.0 in scale:
        raise reading.where.error("<scale> must not be 0: use 1 1 1 for the file's own size")
    x, y, z = (own * saved for own, saved in zip(scale, reading.scale, strict=True))
    try:
        return reading.folder.mesh(uri, (x, y, z), reading.base)
    except Unread as error:
        reading.skipped.leave_out(error, reading.where)
        return ()
