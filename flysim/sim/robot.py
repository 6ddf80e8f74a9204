"""A differential-drive robot as its URDF describes it: wheels by joint name, cameras by Gazebo's sensor tags."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Array, frozen, inverse, pose6, se3, transform
from flysim.geometry.rig import StereoRig
from flysim.sim import urdf
from flysim.sim.urdf import numbers, refusal, refused
from flysim.world.elements import shown
from flysim.world.model import Part
from flysim.world.shapes import Cylinder, Sphere

MAX_SIDE = 8192  # [px] of a camera image
NEAR_ENOUGH = 1e-3  # [m] how exactly base_link lies on the floor between the wheels


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
        frames: links that are frames and no bodies: the URDF gives them no mass.
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
    frames: tuple[str, ...] = ()


def read_robot(path: Path) -> Robot:
    """Reads a URDF with joints `left_wheel_joint` and `right_wheel_joint` and two camera sensors, `left` and `right`.

    Raises:
        RobotError: the file is missing, malformed or unphysical, or lacks a wheel or a camera.
    """
    root = urdf.parse(path)
    links, joints = urdf.named(path, root, "link"), urdf.named(path, root, "joint")
    T_base = urdf.link_poses(path, links, joints)
    frames = urdf.frames(path, links)
    radius, track = _wheels(path, joints, links, T_base)
    rig, T_base_left = _cameras(path, root, T_base)
    outlines = [
        transform(T_base[name] @ part.T_link_part, part.shape.outline())
        for name, link in links.items()
        for part in urdf.parts(path, name, link, "collision", {})
    ]
    hull = np.concatenate(outlines)
    colours = urdf.colours(path, root)
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
        visuals=tuple((n, p) for n, link in links.items() for p in urdf.parts(path, n, link, "visual", colours)),
        T_base_links=T_base,
        friction=urdf.friction(path, root, links),
        frames=frames,
    )


def parts_in_base(robot: Robot) -> tuple[Part, ...]:
    """The robot's visuals at their place in base_link, all joints at zero."""
    return tuple(replace(part, T_link_part=robot.T_base_links[link] @ part.T_link_part) for link, part in robot.visuals)


def _wheels(
    path: Path, joints: dict[str, Element], links: dict[str, Element], T_base: dict[str, Array]
) -> tuple[float, float]:
    """Radius and track [m] of two wheels that stand either side of base_link's origin and turn about its y axis."""
    radii, centers = [], []
    for side in ("left", "right"):
        joint = joints.get(f"{side}_wheel_joint")
        child = joint.find("child") if joint is not None else None
        if joint is None or child is None or joint.get("type") != "continuous":
            raise refusal(path, f"no continuous joint '{side}_wheel_joint'. Name the driven wheels' joints so")
        name = urdf.attribute(path, child, "link")
        shapes = [part.shape for part in urdf.parts(path, name, links[name], "collision", {})]
        if len(shapes) != 1 or not isinstance(shapes[0], Cylinder | Sphere):
            raise refusal(path, f"wheel '{name}' must have one collision, a cylinder or a sphere")
        tag = joint.find("axis")
        axis = numbers(path, "1 0 0" if tag is None else tag.get("xyz"), 3, f"the axis of '{side}_wheel_joint'")
        turning = T_base[name][:3, :3] @ axis / max(float(np.linalg.norm(axis)), 1e-9)
        if turning[1] < 1.0 - NEAR_ENOUGH:
            raise refusal(
                path,
                f"'{side}_wheel_joint' must turn about base_link's y axis, got {(np.round(turning, 3) + 0.0).tolist()}",
            )
        radii.append(shapes[0].radius)
        centers.append(T_base[name][:3, 3])
    left, right = centers
    track = float(left[1] - right[1])
    if radii[0] != radii[1] or track <= 0.0:
        raise refusal(path, f"wheels need one radius and a positive track, got {radii} m and {track:g} m")
    if np.abs((left + right) / 2.0 - (0.0, 0.0, radii[0])).max() > NEAR_ENOUGH or abs(left[0]) > NEAR_ENOUGH:
        got = [np.round(center, 4).tolist() for center in centers]
        raise refusal(path, f"base_link must lie on the floor between the wheels, whose centres are at {got} m")
    return radii[0], track


def _cameras(path: Path, root: Element, T_base: dict[str, Array]) -> tuple[StereoRig, Array]:
    found: dict[str, tuple[Camera, Array]] = {}
    for tag in root.findall("gazebo"):
        for sensor in tag.findall("sensor"):
            camera = sensor.find("camera")
            if sensor.get("type") != "camera" or camera is None:
                continue
            name, link = urdf.attribute(path, sensor, "name"), tag.get("reference", "")
            where = f"camera '{name}'"
            if link not in T_base:
                raise refusal(path, f"{where} refers to link {shown(link)}, which there is none of")
            if name in found:
                raise refusal(path, f"two camera sensors are named '{name}': give each its own name")
            pose = sensor.findtext("pose")
            T_link_sensor = pose6(*numbers(path, pose, 6, f"{where}, its pose,")) if pose else np.eye(4)
            T_base_optical = T_base[link] @ T_link_sensor @ se3(R_BODY_OPTICAL, (0, 0, 0))
            found[name] = _pinhole(path, camera, where), T_base_optical
    missing = [side for side in ("left", "right") if side not in found]
    if missing:
        raise refusal(
            path,
            f"no camera sensor '{missing[0]}'. Declare <gazebo reference=...><sensor type='camera' "
            f"name='{missing[0]}'>; it has: {', '.join(sorted(found)) or 'none'}",
        )
    (left, T_left), (right, T_right) = found["left"], found["right"]
    T_right_left = inverse(T_right) @ T_left
    # Rounding would hide that the pair is rectified.
    T_right_left[np.abs(T_right_left) < 1e-12] = 0.0
    T_right_left[np.abs(T_right_left - 1.0) < 1e-12] = 1.0
    rig = refused(path, "its stereo pair", lambda: StereoRig(left=left, right=right, T_right_left=T_right_left))
    return rig, T_left


def _pinhole(path: Path, camera: Element, where: str) -> Camera:
    fov = numbers(path, camera.findtext("horizontal_fov"), 1, f"{where}, its horizontal_fov,")[0]
    width, height = (
        numbers(path, camera.findtext(f"image/{side}"), 1, f"{where}, its {side},")[0] for side in ("width", "height")
    )
    if not (width.is_integer() and height.is_integer() and 1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise refusal(path, f"{where} has {width:g}x{height:g} px; whole numbers from 1 to {MAX_SIDE} are drawn")
    return refused(path, where, lambda: Camera.from_fov(int(width), int(height), fov))
