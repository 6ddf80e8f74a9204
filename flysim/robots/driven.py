"""Which joints of a URDF are driven: as a user, a diff_drive plugin, ros2_control or their names say."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from flysim.plain import shown
from flysim.robots.joints import Joint
from flysim.robots.tree import LinkTree
from flysim.robots.urdf import numbers, refusal

NAMES = ("left_wheel_joint", "right_wheel_joint")
PLUGIN = re.compile(r"diff.?drive|skid.?steer|differential", re.IGNORECASE)
# left_joint, leftJoint, left_joint_name, left_rear_joint, leftFrontJoint: of Gazebo classic and gz, old and new
DRIVES = re.compile(r"(left|right)_?(front|rear|back|mid|middle)?_?joint(_?name)?", re.IGNORECASE)
RADIUS = re.compile(r"wheel_?(radius|diameter)", re.IGNORECASE)
TRACK = re.compile(r"wheel_?separation", re.IGNORECASE)
UPRIGHT = 0.4  # of an axis that points up or down: what turns about it steers and is no wheel
LISTED = 6  # joints that an error lists


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenPair:
    """What is driven.

    Attributes:
        joints: of the left and of the right wheel.
        radius: of the wheels [m], where a plugin tells it.
        track: between them [m], where a plugin tells it.
    """

    joints: tuple[Joint, Joint]
    radius: float | None = None
    track: float | None = None


def is_drive(plugin: Element) -> bool:
    """Whether a plugin is one that drives wheels."""
    named = (plugin.get("filename") or "") + " " + (plugin.get("name") or "")
    return bool(PLUGIN.search(named)) and any(DRIVES.fullmatch(bare(tag.tag)) for tag in plugin)


def bare(tag: str) -> str:
    """A tag without its namespace."""
    return tag.rpartition("}")[2]


def read_drive(
    path: Path, root: Element, tree: LinkTree, joints: tuple[Joint, ...], wheels: tuple[str, str] | None
) -> DrivenPair:
    """The two driven joints.

    Args:
        path: of the file.
        root: its root element.
        tree: of its links.
        joints: all of them.
        wheels: names of the left and the right one; None: by the file.

    Raises:
        RobotError: there are none, they are no continuous joints, or there are more than two.
    """
    known = {joint.name: joint for joint in joints}
    if wheels is not None:
        return DrivenPair(joints=_pair(path, known, wheels, "--wheels names"))
    plugins = [plugin for tag in root.findall("gazebo") for plugin in tag.findall("plugin") if is_drive(plugin)]
    if plugins:
        left, right, radius, track = _of_plugins(path, plugins)
        return DrivenPair(
            joints=_sides(path, known, left, right, "the diff_drive plugin drives"), radius=radius, track=track
        )
    for names in (_ros2_control(root), _transmissions(root)):
        turning = [known[name] for name in names if name in known and _is_wheel(tree, known[name])]
        if turning:
            left, right = _by_side(tree, turning)
            return DrivenPair(joints=_sides(path, known, left, right, "ros2_control or a transmission drives"))
    if NAMES[0] not in known and NAMES[1] not in known:
        raise refusal(
            path, f"no driven wheels: no diff_drive plugin, ros2_control or joint {shown(NAMES[0])}. {_hint(known)}"
        )
    return DrivenPair(joints=_pair(path, known, NAMES, "it needs"))


def _pair(path: Path, known: dict[str, Joint], names: tuple[str, str], who: str) -> tuple[Joint, Joint]:
    found = []
    for name in names:
        joint = known.get(name)
        if joint is None or joint.kind != "continuous":
            raise refusal(path, f"no continuous joint {shown(name)}, which {who}. {_hint(known)}")
        found.append(joint)
    if found[0] is found[1]:
        raise refusal(path, f"the left and the right wheel are one joint, {shown(names[0])}: name two")
    return found[0], found[1]


def _hint(known: dict[str, Joint]) -> str:
    turning = [name for name, joint in known.items() if joint.kind == "continuous"]
    more = f" and {len(turning) - LISTED} more" if len(turning) > LISTED else ""
    listed = ", ".join(map(shown, turning[:LISTED])) + more if turning else "none"
    return f"Name them by --wheels LEFT RIGHT; its continuous joints: {listed}"


def _sides(path: Path, known: dict[str, Joint], left: list[str], right: list[str], who: str) -> tuple[Joint, Joint]:
    """One wheel a side, or the refusal of more."""
    if len(left) + len(right) > 2:
        raise refusal(
            path,
            f"it is a skid steer ({who} {len(left) + len(right)} wheels), which is not simulated: its wheels slip as "
            "it turns. --wheels LEFT RIGHT drives two of them and lets the others turn freely",
        )
    if len(left) != 1 or len(right) != 1:
        raise refusal(path, f"{who} {len(left)} wheels on the left and {len(right)} on the right. {_hint(known)}")
    return _pair(path, known, (left[0], right[0]), who)


def _of_plugins(path: Path, plugins: Iterable[Element]) -> tuple[list[str], list[str], float | None, float | None]:
    """Joints by side, wheel radius and track [m] of drive plugins."""
    sides: dict[str, list[str]] = {"left": [], "right": []}
    radius = track = None
    for plugin in plugins:
        for tag in plugin:
            name, text = bare(tag.tag), (tag.text or "").strip()
            side = DRIVES.fullmatch(name)
            if side is not None and text and text not in sides[side[1].lower()]:
                sides[side[1].lower()].append(text)
            elif text and (size := RADIUS.fullmatch(name)) is not None:
                radius = numbers(path, text, 1, f"<{name}> of the diff_drive plugin")[0]
                radius = radius / 2.0 if size[1].lower() == "diameter" else radius
            elif text and TRACK.fullmatch(name):
                track = numbers(path, text, 1, f"<{name}> of the diff_drive plugin")[0]
    return sides["left"], sides["right"], radius, track


def _ros2_control(root: Element) -> Iterator[str]:
    """Names of the joints that ros2_control gives a velocity."""
    for joint in root.iterfind("ros2_control/joint"):
        if any(tag.get("name") == "velocity" for tag in joint.findall("command_interface")):
            yield joint.get("name", "")


def _transmissions(root: Element) -> Iterator[str]:
    """Names of the joints that a transmission turns at a velocity, or says nothing about."""
    for joint in root.iterfind("transmission/joint"):
        kinds = [(tag.text or "") for tag in joint.iter("hardwareInterface")]
        if not kinds or any("velocity" in kind.lower() for kind in kinds):
            yield joint.get("name", "")


def _is_wheel(tree: LinkTree, joint: Joint) -> bool:
    T = tree.T_root_links
    axis = T[tree.reference][:3, :3].T @ T[joint.child][:3, :3] @ joint.axis
    return joint.kind == "continuous" and abs(float(axis[2])) < UPRIGHT


def _by_side(tree: LinkTree, joints: Iterable[Joint]) -> tuple[list[str], list[str]]:
    """Names of the joints to the left and to the right of their middle."""
    T = tree.T_root_links
    y = {joint.name: float((T[tree.reference][:3, :3].T @ T[joint.child][:3, 3])[1]) for joint in joints}
    middle = (max(y.values()) + min(y.values())) / 2.0
    return [name for name in y if y[name] > middle], [name for name in y if y[name] <= middle]
