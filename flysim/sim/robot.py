"""A differential-drive robot as its URDF describes it: wheels by joint name, cameras by Gazebo's sensor tags."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from flysim.errors import RobotError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Array, frozen, inverse, pose6, se3, transform
from flysim.geometry.rig import StereoRig
from flysim.world.model import Material, Part
from flysim.world.shapes import Box, Cylinder, Sphere

MAX_URDF_BYTES = 4_000_000
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """What flysim needs to know of a robot beside the URDF that pybullet loads.

    Attributes:
        wheel_radius: [m].
        track: distance between the wheels' planes [m].
        wheel_joints: names of the left and the right wheel's joint.
        rig: the stereo pair.
        T_base_left: `[4, 4]` left optical frame in base_link.
        radius: [m] of the smallest circle about base_link's axis that holds every collision shape.
        height: [m] of the highest collision shape.
        visuals: (URDF link name, shape at its place in that link) of each visual.
        T_base_links: `[4, 4]` of each URDF link in base_link, all joints at zero.
        friction: lateral friction by link name (Gazebo's mu1).
    """

    name: str
    path: Path
    wheel_radius: float
    track: float
    wheel_joints: tuple[str, str]
    rig: StereoRig
    T_base_left: Array
    radius: float
    height: float
    visuals: tuple[tuple[str, Part], ...]
    T_base_links: dict[str, Array]
    friction: dict[str, float]


def read_robot(path: Path) -> Robot:
    """Reads a URDF with joints `left_wheel_joint` and `right_wheel_joint` and two camera sensors, `left` and `right`.

    Raises:
        RobotError: the file is missing, malformed, or lacks a wheel or a camera.
    """
    root = _parse(path)
    links = {_attr(path, link, "name"): link for link in root.findall("link")}
    joints = {_attr(path, joint, "name"): joint for joint in root.findall("joint")}
    T_base = _link_poses(path, links, joints)
    radius, track = _wheels(path, joints, links, T_base)
    rig, T_base_left = _cameras(path, root, T_base)
    outlines = [
        transform(T_base[name] @ part.T_link_part, part.shape.outline())
        for name, link in links.items()
        for part in _parts(path, name, link, "collision", {})
    ]
    hull = np.concatenate(outlines)
    colours = _colours(path, root)
    return Robot(
        name=root.get("name", path.parent.name),
        path=path,
        wheel_radius=radius,
        track=track,
        wheel_joints=("left_wheel_joint", "right_wheel_joint"),
        rig=rig,
        T_base_left=frozen(T_base_left),
        radius=float(np.hypot(hull[:, 0], hull[:, 1]).max()),
        height=float(hull[:, 2].max()),
        visuals=tuple((n, p) for n, link in links.items() for p in _parts(path, n, link, "visual", colours)),
        T_base_links=T_base,
        friction=_friction(path, root),
    )


def parts_in_base(robot: Robot) -> tuple[Part, ...]:
    """The robot's visuals at their place in base_link, all joints at zero."""
    return tuple(replace(part, T_link_part=robot.T_base_links[link] @ part.T_link_part) for link, part in robot.visuals)


def _parse(path: Path) -> Element:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RobotError(f"{path}: cannot read the robot: {error.strerror}. Give the path of a URDF.") from error
    if len(data) > MAX_URDF_BYTES:
        raise RobotError(f"{path}: a URDF of {len(data)} bytes; at most {MAX_URDF_BYTES} are read.")
    try:
        root = fromstring(data, forbid_dtd=True)
    except (ParseError, DefusedXmlException, ValueError) as error:
        raise RobotError(f"{path}: not a readable URDF: {error}.") from error
    if root.tag != "robot":
        raise RobotError(f"{path}: the root element is <{root.tag}>, a URDF has <robot>.")
    return root


def _attr(path: Path, element: Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        raise RobotError(f"{path}: <{element.tag}> has no {name}=. Add it.")
    return value


def _numbers(path: Path, text: str | None, count: int, where: str) -> list[float]:
    try:
        values = [float(word) for word in (text or "").split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise RobotError(f"{path}: {where} must be {count} finite number(s), got {text!r}.")
    return values


def _origin(path: Path, element: Element) -> Array:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    xyz = _numbers(path, origin.get("xyz", "0 0 0"), 3, "origin xyz")
    return pose6(*xyz, *_numbers(path, origin.get("rpy", "0 0 0"), 3, "origin rpy"))


def _link_poses(path: Path, links: dict[str, Element], joints: dict[str, Element]) -> dict[str, Array]:
    """`T_base_link` of every link, all joints at zero."""
    if "base_link" not in links:
        raise RobotError(f"{path}: no link 'base_link'. Name the robot's root link so (REP-105).")
    edges: dict[str, list[tuple[str, Array]]] = {}
    for name, joint in joints.items():
        ends = [joint.find(end) for end in ("parent", "child")]
        parent, child = (_attr(path, end, "link") if end is not None else "" for end in ends)
        if parent not in links or child not in links:
            raise RobotError(f"{path}: joint '{name}' joins '{parent}' to '{child}', which are not both links.")
        edges.setdefault(parent, []).append((child, _origin(path, joint)))
    poses, queue = {"base_link": np.eye(4)}, ["base_link"]
    while queue:
        parent = queue.pop()
        for child, T_parent_child in edges.get(parent, []):
            if child in poses:
                raise RobotError(f"{path}: link '{child}' has two parents. A robot is a tree.")
            poses[child] = poses[parent] @ T_parent_child
            queue.append(child)
    lost = sorted(set(links) - set(poses))
    if lost:
        raise RobotError(f"{path}: link '{lost[0]}' is not joined to base_link. Add a joint.")
    return poses


def _wheels(
    path: Path, joints: dict[str, Element], links: dict[str, Element], T_base: dict[str, Array]
) -> tuple[float, float]:
    radii, sides = [], []
    for side in ("left", "right"):
        joint = joints.get(f"{side}_wheel_joint")
        child = joint.find("child") if joint is not None else None
        if joint is None or child is None or joint.get("type") != "continuous":
            raise RobotError(f"{path}: no continuous joint '{side}_wheel_joint'. Name the driven wheels' joints so.")
        name = _attr(path, child, "link")
        shapes = [part.shape for part in _parts(path, name, links[name], "collision", {})]
        if len(shapes) != 1 or not isinstance(shapes[0], Cylinder | Sphere):
            raise RobotError(f"{path}: wheel '{name}' must have one collision, a cylinder or a sphere.")
        radii.append(shapes[0].radius)
        sides.append(T_base[name][1, 3])
    track = float(sides[0] - sides[1])
    if radii[0] != radii[1] or track <= 0.0:
        raise RobotError(f"{path}: wheels need one radius and a positive track, got {radii} m and {track} m.")
    return radii[0], track


def _cameras(path: Path, root: Element, T_base: dict[str, Array]) -> tuple[StereoRig, Array]:
    found: dict[str, tuple[Camera, Array]] = {}
    for tag in root.findall("gazebo"):
        for sensor in tag.findall("sensor"):
            camera = sensor.find("camera")
            if sensor.get("type") != "camera" or camera is None:
                continue
            where, link = f"camera '{sensor.get('name')}'", tag.get("reference", "")
            if link not in T_base:
                raise RobotError(f"{path}: {where} refers to link '{link}', which there is none of.")
            width, height = (
                int(_numbers(path, camera.findtext(f"image/{n}"), 1, f"{where} {n}")[0]) for n in ("width", "height")
            )
            fov = _numbers(path, camera.findtext("horizontal_fov"), 1, f"{where} horizontal_fov")[0]
            if width * height > 64_000_000:
                raise RobotError(f"{path}: {where} has {width}x{height} px; at most 64 megapixels are drawn.")
            pinhole = _refused(path, where, lambda w=width, h=height, f=fov: Camera.from_fov(w, h, f))
            pose = sensor.findtext("pose")
            T_link_sensor = pose6(*_numbers(path, pose, 6, f"{where} pose")) if pose else np.eye(4)
            found[sensor.get("name", "")] = (
                pinhole,
                T_base[link] @ T_link_sensor @ se3(R_BODY_OPTICAL, (0, 0, 0)),
            )
    missing = [side for side in ("left", "right") if side not in found]
    if missing:
        raise RobotError(
            f"{path}: no camera sensor '{missing[0]}'. Declare <gazebo reference=...><sensor type='camera' "
            f"name='{missing[0]}'>; it has: {', '.join(sorted(found)) or 'none'}."
        )
    (left, T_left), (right, T_right) = found["left"], found["right"]
    T_right_left = inverse(T_right) @ T_left
    T_right_left[np.abs(T_right_left) < 1e-12] = 0.0  # rounding would hide that the pair is rectified
    rig = _refused(path, "its stereo pair", lambda: StereoRig(left=left, right=right, T_right_left=T_right_left))
    return rig, T_left


def _refused(path: Path, where: str, make: Callable[[], T]) -> T:
    try:
        return make()
    except ValueError as error:
        raise RobotError(f"{path}: {where}: {error}.") from error


def _parts(path: Path, link: str, element: Element, kind: str, colours: dict[str, Material]) -> list[Part]:
    parts = []
    for index, tag in enumerate(element.findall(kind)):
        where = f"{kind} {index} of link '{link}'"
        geometry = tag.find("geometry")
        shape = geometry[0] if geometry is not None and len(geometry) else None
        if shape is None or shape.tag not in ("box", "cylinder", "sphere"):
            raise RobotError(f"{path}: {where} must be a box, a cylinder or a sphere.")
        named = tag.find("material")
        material = colours.get(named.get("name", ""), Material()) if named is not None else Material()
        made = _refused(path, where, lambda s=shape, w=where: _shape(path, s, w))
        parts.append(Part(name=where, shape=made, T_link_part=_origin(path, tag), material=material))
    return parts


def _shape(path: Path, tag: Element, where: str) -> Box | Cylinder | Sphere:
    if tag.tag == "box":
        x, y, z = _numbers(path, tag.get("size"), 3, f"{where} size")
        return Box((x, y, z))
    radius = _numbers(path, tag.get("radius"), 1, f"{where} radius")[0]
    if tag.tag == "sphere":
        return Sphere(radius)
    return Cylinder(radius, _numbers(path, tag.get("length"), 1, f"{where} length")[0])


def _colours(path: Path, root: Element) -> dict[str, Material]:
    colours = {}
    for tag in root.findall("material"):
        colour = tag.find("color")
        if colour is not None:
            r, g, b, _ = _numbers(path, colour.get("rgba"), 4, "material rgba")
            colours[_attr(path, tag, "name")] = Material(diffuse=(r, g, b))
    return colours


def _friction(path: Path, root: Element) -> dict[str, float]:
    return {
        tag.get("reference", ""): _numbers(path, tag.findtext("mu1"), 1, "mu1")[0]
        for tag in root.findall("gazebo")
        if tag.find("mu1") is not None
    }
