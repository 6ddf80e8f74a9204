"""A differential-drive robot as its URDF describes it: where its wheels and its eyes are, what it looks like."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from flysim.errors import RobotError, did_you_mean
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, frozen, transform
from flysim.geometry.rig import StereoRig
from flysim.plain import shown
from flysim.robots.account import Account
from flysim.robots.cameras import read_sight
from flysim.robots.driven import bare, is_drive, read_drive
from flysim.robots.joints import Joint, read_joints
from flysim.robots.links import Hold, RobotLink, friction, read_links
from flysim.robots.meshes import Meshes
from flysim.robots.mounted import mounted
from flysim.robots.tree import body_of, hung_on, read_tree
from flysim.robots.urdf import attribute, parse
from flysim.robots.wheels import Wheel, read_axle
from flysim.worlds.model import Part

DEEPEST = 0.02  # [m] below the wheels; a caster may be a little low
CAMERAS = ("stereo",)  # that can be mounted on a robot
Mount = Literal["stereo"]
ROOT_TAGS = {"link", "joint", "material", "gazebo", "transmission", "ros2_control"}
GAZEBO_TAGS = {"sensor", "plugin", "mu1", "mu2"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """What a URDF says of a robot. Its file is not opened again.

    Its own frame, `base` in what follows, lies on the floor between the driven wheels: x forward, y left, z up.

    Attributes:
        wheel_radius: [m].
        track: distance between the wheels' planes [m].
        wheels: the driven ones, the left one first.
        camera: the left one, or the only one.
        pair: the stereo pair; None of a robot with one camera.
        T_base_left: `[4, 4]` optical frame of `camera` in base.
        radius: [m] of the smallest circle about base's z axis that holds every collision shape.
        height: [m] of the highest collision shape.
        visuals: (URDF link name, shape at its place in that link) of each visual.
        T_base_links: `[4, 4]` of each URDF link in base, all joints at zero.
        friction: lateral friction by link name (Gazebo's mu1).
        links: every link, in the order of the file.
        joints: every joint, in the order of the file, with `body` for their root.
        body: the name of the link that all others hang on.
        warnings: what the reader approximated or left out, one sentence each.
    """

    name: str
    path: Path
    wheel_radius: float
    track: float
    wheels: tuple[Wheel, ...]
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
    body: str
    warnings: tuple[str, ...] = ()

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


def mount(cameras: str | None) -> Mount | None:
    """The cameras to be mounted, of a name that a user typed.

    Raises:
        RobotError: there are none of that name.
    """
    if cameras is None or cameras == "stereo":
        return cameras
    raise RobotError(f"no cameras {shown(cameras)}. {did_you_mean(cameras, CAMERAS)}")


def read_robot(path: Path, wheels: tuple[str, str] | None = None, cameras: Mount | None = None) -> Robot:
    """Reads a URDF of a robot on two driven wheels, with a stereo pair or one camera.

    Args:
        path: of the file; of a xacro file, where the package `xacro` is installed.
        wheels: names of the left and the right wheel's joint; None: as the file says.
        cameras: "stereo": mounts the rover's pair in place of the file's cameras.

    Raises:
        RobotError: the file is missing, malformed or unphysical, or lacks a wheel or a camera.
    """
    return read_with_account(path, wheels, cameras)[0]


def read_with_account(
    path: Path, wheels: tuple[str, str] | None = None, cameras: Mount | None = None
) -> tuple[Robot, Account]:
    """As `read_robot`, with the account of what was approximated and what was left out.

    Raises:
        RobotError: as `read_robot`.
    """
    root, account = parse(path), Account()
    joints = read_joints(path, root, account)
    held: dict[str, Hold] = {joint.child: "fixed" if joint.kind == "fixed" else "moving" for joint in joints}
    links = read_links(path, root, held, account, Meshes(path))
    tree = read_tree(path, [link.name for link in links], joints)
    axle = read_axle(path, read_drive(path, root, tree, joints, wheels), tree, links, account)
    links, body = axle.links, body_of(path, tree, links)
    T_base = {name: axle.T_base_root @ T for name, T in tree.T_root_links.items()}
    outlines = [
        (link.name, transform(T_base[link.name] @ solid.origin.matrix, solid.shape.outline()))
        for link in links
        for solid in link.collisions
    ]
    _note_low(outlines, account)
    hull = np.concatenate([points for _, points in outlines])
    height = float(hull[:, 2].max())
    if cameras is None:
        sight = read_sight(path, root, T_base, account)
    else:
        sight, height = mounted(path, float(hull[:, 0].max()), height, account)
    _leave_out(root, cameras is not None, account)
    robot = Robot(
        name=path.parent.name if root.get("name") is None else attribute(path, root, "name"),
        path=path,
        wheel_radius=axle.radius,
        track=axle.track,
        wheels=axle.wheels,
        camera=sight.camera,
        pair=sight.pair,
        T_base_left=frozen(sight.T_base_left),
        radius=float(np.hypot(hull[:, 0], hull[:, 1]).max()),
        height=height,
        visuals=tuple(
            (link.name, solid.part(f"visual {i} of link {shown(link.name)}"))
            for link in links
            for i, solid in enumerate(link.visuals)
        ),
        T_base_links=T_base,
        friction=friction(path, root, links, account),
        links=links,
        joints=hung_on(body, joints),
        body=body,
    )
    return replace(robot, warnings=account.sentences()), account


def parts_in_base(robot: Robot) -> tuple[Part, ...]:
    """The robot's visuals at their place in its own frame, all joints at zero."""
    return tuple(replace(part, T_link_part=robot.T_base_links[link] @ part.T_link_part) for link, part in robot.visuals)


def _note_low(outlines: list[tuple[str, Array]], account: Account) -> None:
    """Notes what a robot may rest on in place of its wheels, which would turn in the air."""
    for name, points in outlines:
        low = -float(points[:, 2].min())
        if low > DEEPEST:
            account.note("low", f"link {shown(name)} by {low:.3f} m")


def _leave_out(root: Element, blind: bool, account: Account) -> None:
    """Notes what nobody reads."""
    for tag in root:
        if not isinstance(tag.tag, str) or bare(tag.tag) not in ROOT_TAGS:
            account.note("unknown", f"<{bare(str(tag.tag))[:60]}>")
    for tag in root.findall("gazebo"):
        for inside in tag:
            if inside.tag == "plugin" and not is_drive(inside):
                account.note("plugins", shown(inside.get("name") or inside.get("filename") or ""))
            if inside.tag == "sensor":
                for plugin in inside.findall("plugin"):
                    account.note("plugins", shown(plugin.get("name") or plugin.get("filename") or ""))
            if inside.tag == "sensor" and blind:
                account.note("sensors", shown(inside.get("name", "")))
            if inside.tag not in GAZEBO_TAGS:
                account.note("gazebo tags", f"<{bare(inside.tag)[:60]}>")
