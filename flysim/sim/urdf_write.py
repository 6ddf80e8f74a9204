"""The URDF that Bullet loads: written here from checked records, so that no text of anybody's file reaches it.

Bullet's reader hands names, types and axes to printf as a format and follows null pointers where something is missing.
Here every name is `link_<number>` or `joint_<number>` and every number is Python's own: it reads back to the last bit.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, SubElement

from flysim.robots.joints import Joint
from flysim.robots.links import MOMENTS, Inertial, LinkShape, RobotLink
from flysim.robots.urdf import Origin
from flysim.worlds.shapes import Box, Mesh, Sphere
from flysim.worlds.surface.mesh import surface_mesh, write_obj

FRAME_MASS, FRAME_MOMENT = 1e-6, 1e-9  # [kg], [kg m^2] of a link that is a frame and no body
FRAME = Inertial(mass=FRAME_MASS, moments=(FRAME_MOMENT, 0.0, 0.0, FRAME_MOMENT, 0.0, FRAME_MOMENT), origin=Origin())


GREY = (0.7, 0.7, 0.7)  # of a mesh without a colour


def write_urdf(links: tuple[RobotLink, ...], joints: tuple[Joint, ...], path: Path, *, textured: bool = True) -> None:
    """Writes a robot whose links are `link_0`, `link_1` and so on in the order of `links`, its joints likewise.

    Meshes are written beside it, as files of flysim's own.

    Args:
        links: of the robot.
        joints: of the robot.
        path: of the file.
        textured: whether visuals that are meshes are written, which only TinyRenderer needs.

    Raises:
        OSError: a file cannot be written.
    """
    root = Element("robot", name="robot")
    meshes = (path.with_name(f"{path.stem}_mesh_{i}.obj") for i in itertools.count())
    number = {link.name: i for i, link in enumerate(links)}
    for i, link in enumerate(links):
        _link(SubElement(root, "link", name=f"link_{i}"), link, f"material_{i}", meshes, textured=textured)
    for i, joint in enumerate(joints):
        element = SubElement(root, "joint", name=f"joint_{i}", type=joint.kind)
        SubElement(element, "parent", link=f"link_{number[joint.parent]}")
        SubElement(element, "child", link=f"link_{number[joint.child]}")
        _origin(element, joint.origin)
        SubElement(element, "axis", xyz=_numbers(joint.axis))
        SubElement(element, "dynamics", damping=_number(joint.damping), friction=_number(joint.friction))
        if joint.limit is not None:
            limit = {name: _number(getattr(joint.limit, name)) for name in ("lower", "upper", "effort", "velocity")}
            SubElement(element, "limit", limit)
    with path.open("wb") as stream:
        ElementTree(root).write(stream)


def number_of(name: bytes) -> int:
    """Where in `links` or `joints` stands what pybullet calls by a name of ours."""
    return int(name.rpartition(b"_")[2])


def _link(element: Element, link: RobotLink, material: str, meshes: Iterator[Path], *, textured: bool) -> None:
    if link.contact:
        contact = SubElement(element, "contact")
        for name, value in link.contact:
            SubElement(contact, name, value=_number(value))
    body = link.inertial or FRAME
    inertial = SubElement(element, "inertial")
    _origin(inertial, body.origin)
    SubElement(inertial, "mass", value=_number(body.mass))
    SubElement(inertial, "inertia", {k: _number(v) for k, v in zip(MOMENTS, body.moments, strict=True)})
    for i, solid in enumerate(link.visuals):
        if isinstance(solid.shape, Mesh) and not textured:
            continue
        visual = _solid(element, "visual", solid, meshes)
        if solid.colour is not None:
            SubElement(SubElement(visual, "material", name=f"{material}_{i}"), "color", rgba=_numbers(solid.colour))
    for solid in link.collisions:
        _solid(element, "collision", solid, meshes)


def _solid(link: Element, kind: str, solid: LinkShape, meshes: Iterator[Path]) -> Element:
    element = SubElement(link, kind)
    _origin(element, solid.origin)
    geometry, shape = SubElement(element, "geometry"), solid.shape
    if isinstance(shape, Box):
        SubElement(geometry, "box", size=_numbers(shape.size))
    elif isinstance(shape, Sphere):
        SubElement(geometry, "sphere", radius=_number(shape.radius))
    elif isinstance(shape, Mesh):
        diffuse = GREY if solid.colour is None else solid.colour[:3]
        SubElement(geometry, "mesh", filename=write_obj(surface_mesh(shape), None, diffuse, next(meshes)).name)
    else:
        SubElement(geometry, "cylinder", radius=_number(shape.radius), length=_number(shape.length))
    return element


def _origin(element: Element, origin: Origin) -> None:
    SubElement(element, "origin", xyz=_numbers(origin.xyz), rpy=_numbers(origin.rpy))


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Iterable[float]) -> str:
    return " ".join(map(_number, values))
