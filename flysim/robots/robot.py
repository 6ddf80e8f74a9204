"""A differential-drive robot as its URDF describes it: wheels by joint name, cameras by Gazebo's sensor tags."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from flysim.errors import RobotError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Array, frozen, inverse, pose6, se3, transform
from flysim.geometry.rig import StereoRig
from flysim.robots.joints import Joint, link_poses, read_joints
from flysim.robots.links import RobotLink, friction, read_links
from flysim.robots.urdf import attribute, numbers, parse, refusal, refused
from flysim.worlds.model import Part
from flysim.worlds.sdf.elements import shown
from flysim.worlds.shapes import Cylinder, Sphere

MAX_SIDE = 8192  # [px] of a camera image
NEAR_ENOUGH = 1e-3  # [m] how exactly base_link lies on the floor between the wheels


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """What a URDF says of a robot. Its file is not opened again.

    Attributes:
        wheel_radius: [m].
        track: distance between the wheels' planes [m].
        wheel_joints: names of the left and the right wheel's joint.
        camera: the left one, or the only one.
        pair: the stereo pair; None of a robot with one camera.
        T_base_left: `[4, 4]` optical frame of `camera` in base_link.
        radius: [m] of the smallest circle about base_link's axis that holds every collision shape.
        height: [m] of the highest collision shape.
        visuals: (URDF link name, shape at its place in that link) of each visual.
        T_base_links: `[4, 4]` of each URDF link in base_link, all joints at zero.
        friction: lateral friction by link name (Gazebo's mu1).
        links: every link, in the order of the file.
        joints: every joint, in the order of the file.
    """

    name: str
    path: Path
    wheel_radius: float
    track: float
    wheel_joints: tuple[str, str]
    camera: Camera
    pair: StereoRig | None
    T_base_left: Array
    radius: float
    height: float
    visuals: tuple[tuple[str, Part], ...]
    T_base_links: dict[str, Array]
    friction: dict[str, float]
    links: tuple[RobotLink, ...]
    joints: tuple[Joint, ...]

    @property
    def rig(self) -> StereoRig:
        """The stereo pair, for whoever needs two eyes at once.

        Raises:
            RobotError: the robot has one camera.
        """
        if self.pair is None:
            raise RobotError(
                f"robot {shown(self.name)} has one camera, and no pair at any one place: give it a scenario with "
                'pairs = "consecutive", or take a robot with two.'
            )
        return self.pair

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """All of them, the left one first."""
        return (self.camera,) if self.pair is None else (self.pair.left, self.pair.right)


def read_robot(path: Path) -> Robot:
    """Reads a URDF with joints `left_wheel_joint` and `right_wheel_joint` and two camera sensors, `left` and `right`,
    or one, `camera`.

    Raises:
        RobotError: the file is missing, malformed or unphysical, or lacks a wheel or a camera.
    """
    root = parse(path)
    links, joints = read_links(path, root), read_joints(path, root)
    T_base = link_poses(path, (link.name for link in links), joints)
    radius, track = _wheels(path, joints, {link.name: link for link in links}, T_base)
    camera, pair, T_base_left = _cameras(path, root, T_base)
    outlines = [
        transform(T_base[link.name] @ solid.origin.matrix, solid.shape.outline())
        for link in links
        for solid in link.collisions
    ]
    hull = np.concatenate(outlines)
    return Robot(
        name=path.parent.name if root.get("name") is None else attribute(path, root, "name"),
        path=path,
        wheel_radius=radius,
        track=track,
        wheel_joints=("left_wheel_joint", "right_wheel_joint"),
        camera=camera,
        pair=pair,
        T_base_left=frozen(T_base_left),
        radius=float(np.hypot(hull[:, 0], hull[:, 1]).max()),
        height=float(hull[:, 2].max()),
        visuals=tuple(
            (link.name, solid.part(f"visual {i} of link {shown(link.name)}"))
            for link in links
            for i, solid in enumerate(link.visuals)
        ),
        T_base_links=T_base,
        friction=friction(path, root, links),
        links=links,
        joints=joints,
    )


def parts_in_base(robot: Robot) -> tuple[Part, ...]:
    """The robot's visuals at their place in base_link, all joints at zero."""
    return tuple(replace(part, T_link_part=robot.T_base_links[link] @ part.T_link_part) for link, part in robot.visuals)


def _wheels(
    path: Path, joints: tuple[Joint, ...], links: dict[str, RobotLink], T_base: dict[str, Array]
) -> tuple[float, float]:
    """Radius and track [m] of two wheels that stand either side of base_link's origin and turn about its y axis."""
    radii, centers = [], []
    for side in ("left", "right"):
        joint = next((joint for joint in joints if joint.name == f"{side}_wheel_joint"), None)
        if joint is None or joint.kind != "continuous":
            raise refusal(path, f"no continuous joint '{side}_wheel_joint'. Name the driven wheels' joints so")
        name = joint.child
        shapes = [solid.shape for solid in links[name].collisions]
        if len(shapes) != 1 or not isinstance(shapes[0], Cylinder | Sphere):
            raise refusal(path, f"wheel {shown(name)} must have one collision, a cylinder or a sphere")
        turning = T_base[name][:3, :3] @ joint.axis
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


def _cameras(path: Path, root: Element, T_base: dict[str, Array]) -> tuple[Camera, StereoRig | None, Array]:
    """The left camera or the only one, the pair if there are two, and the optical frame of the first in base_link."""
    found = _found_cameras(path, root, T_base)
    if "camera" in found and not {"left", "right"} & found.keys():
        camera, T_camera = found["camera"]
        return camera, None, T_camera
    missing = [side for side in ("left", "right") if side not in found]
    if missing:
        raise refusal(
            path,
            f"no camera sensor '{missing[0]}'. Declare <gazebo reference=...><sensor type='camera' "
            f"name='{missing[0]}'>, or one named 'camera'; it has: "
            f"{', '.join(map(shown, sorted(found)[:5])) or 'none'}",
        )
    (left, T_left), (right, T_right) = found["left"], found["right"]
    T_right_left = inverse(T_right) @ T_left
    # Rounding would hide that the pair is rectified.
    T_right_left[np.abs(T_right_left) < 1e-12] = 0.0
    T_right_left[np.abs(T_right_left - 1.0) < 1e-12] = 1.0
    rig = refused(path, "its stereo pair", lambda: StereoRig(left=left, right=right, T_right_left=T_right_left))
    return left, rig, T_left


def _found_cameras(path: Path, root: Element, T_base: dict[str, Array]) -> dict[str, tuple[Camera, Array]]:
    """Every camera sensor by name, with its optical frame in base_link."""
    found: dict[str, tuple[Camera, Array]] = {}
    for tag in root.findall("gazebo"):
        for sensor in tag.findall("sensor"):
            camera = sensor.find("camera")
            if sensor.get("type") != "camera" or camera is None:
                continue
            name, link = attribute(path, sensor, "name"), tag.get("reference", "")
            where = f"camera {shown(name)}"
            if link not in T_base:
                raise refusal(path, f"{where} refers to link {shown(link)}, which there is none of")
            if name in found:
                raise refusal(path, f"two camera sensors are named {shown(name)}: give each its own name")
            pose = sensor.findtext("pose")
            T_link_sensor = pose6(*numbers(path, pose, 6, f"{where}, its pose,")) if pose else np.eye(4)
            T_base_optical = T_base[link] @ T_link_sensor @ se3(R_BODY_OPTICAL, (0, 0, 0))
            found[name] = _pinhole(path, camera, where), T_base_optical
    return found


def _pinhole(path: Path, camera: Element, where: str) -> Camera:
    fov = numbers(path, camera.findtext("horizontal_fov"), 1, f"{where}, its horizontal_fov,")[0]
    width, height = (
        numbers(path, camera.findtext(f"image/{side}"), 1, f"{where}, its {side},")[0] for side in ("width", "height")
    )
    if not (width.is_integer() and height.is_integer() and 1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise refusal(path, f"{where} has {width:g}x{height:g} px; whole numbers from 1 to {MAX_SIDE} are drawn")
    return refused(path, where, lambda: Camera.from_fov(int(width), int(height), fov))
