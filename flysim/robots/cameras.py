"""The eyes of a URDF: every camera that Gazebo's sensor tags declare, and which of them the robot sees with."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Array, inverse, pose6, se3
from flysim.geometry.rig import StereoRig
from flysim.plain import shown
from flysim.robots.account import Account
from flysim.robots.urdf import attribute, numbers, refusal, refused

MAX_SIDE = 8192  # [px] of a camera image
BEHIND = -0.1  # forward part of where an eye looks, below which it looks backward
MAX_CAMERAS = 100
COLOUR = ("camera", "multicamera")
DEPTH = ("depth", "depth_camera", "rgbd", "rgbd_camera")
FLAWS = ("noise", "distortion", "lens")
NEAREST, FARTHEST = 0.05, 10.0  # [m] a camera that hides something between them is told of
PARALLEL = math.cos(math.radians(5.0))  # of the axes of two cameras that are no pair by name
SIDEWAYS = 0.9  # of their baseline that lies along the image's rows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Eye:
    """A camera that a file declares.

    Attributes:
        name: of its sensor; of one of several in a sensor, that and its own.
        camera: its pinhole.
        T_base_optical: `[4, 4]` its optical frame in the robot's frame.
        words: all that it is called by, in lower case.
        depth: whether it is one that measures depth.
    """

    name: str
    camera: Camera
    T_base_optical: Array
    words: str
    depth: bool

    @property
    def called(self) -> str:
        """The eye in a sentence."""
        return f"camera {shown(self.name)}"


def read_eyes(path: Path, root: Element, T_base_links: dict[str, Array], account: Account) -> list[Eye]:
    """Every camera of a URDF, in the order of the file; what is left out is noted.

    Raises:
        RobotError: a camera says nonsense, or refers to no link.
    """
    found: list[Eye] = []
    for tag, sensor in _sensors(root):
        kind, link = sensor.get("type", ""), tag.get("reference", "")
        cameras = sensor.findall("camera")
        if kind not in COLOUR + DEPTH or not cameras:
            account.note("sensors", f"{shown(sensor.get('name', ''))} ({kind[:40] or 'without type'})")
            continue
        name = attribute(path, sensor, "name")
        where = f"camera {shown(name)}"
        if link not in T_base_links:
            raise refusal(path, f"{where} refers to link {shown(link)}, which there is none of")
        if any(eye.name == name for eye in found):
            raise refusal(path, f"two camera sensors are named {shown(name)}: give each its own name")
        T_base_sensor = T_base_links[link] @ _pose(path, sensor, where)
        for index, camera in enumerate(cameras):
            own = camera.get("name") or str(index)
            called = name if len(cameras) == 1 else f"{name}/{own}"
            T = T_base_sensor @ _pose(path, camera, f"camera {shown(called)}")
            if index > 0:
                T = T @ _hacked(path, sensor, called)
            found.append(
                Eye(
                    name=called,
                    camera=_pinhole(path, camera, f"camera {shown(called)}", account),
                    T_base_optical=T @ se3(R_BODY_OPTICAL, (0, 0, 0)),
                    words=" ".join((called, own, link)).lower() if len(cameras) == 1 else own.lower(),
                    depth=kind in DEPTH,
                )
            )
            if len(found) > MAX_CAMERAS:
                raise refusal(path, f"more than {MAX_CAMERAS} cameras")
    return found


def _sensors(root: Element) -> Iterator[tuple[Element, Element]]:
    for tag in root.findall("gazebo"):
        for sensor in tag.findall("sensor"):
            yield tag, sensor


def _pose(path: Path, element: Element, where: str) -> Array:
    """`[4, 4]` what its `<pose>` says; nothing where there is none."""
    pose = element.findtext("pose")
    return pose6(*numbers(path, pose, 6, f"{where}, its pose,")) if pose and pose.strip() else np.eye(4)


def _hacked(path: Path, sensor: Element, name: str) -> Array:
    """`[4, 4]` where Gazebo's stereo plugin moves the second camera of a sensor that has both in one place."""
    if any((camera.findtext("pose") or "").strip() for camera in sensor.findall("camera")):
        return np.eye(4)
    text = next((tag.text for tag in sensor.iterfind("plugin/hackBaseline")), None)
    if text is None:
        return np.eye(4)
    return se3(np.eye(3), (0.0, -numbers(path, text, 1, f"camera {shown(name)}, its hackBaseline,")[0], 0.0))


def _pinhole(path: Path, camera: Element, where: str, account: Account) -> Camera:
    fov = numbers(path, camera.findtext("horizontal_fov"), 1, f"{where}, its horizontal_fov,")[0]
    width, height = (
        numbers(path, camera.findtext(f"image/{side}"), 1, f"{where}, its {side},")[0] for side in ("width", "height")
    )
    if not (width.is_integer() and height.is_integer() and 1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise refusal(path, f"{where} has {width:g}x{height:g} px; whole numbers from 1 to {MAX_SIDE} are drawn")
    for flaw in FLAWS:
        if camera.find(flaw) is not None:
            account.note("lens", f"<{flaw}> of {where}")
    near, far = (camera.findtext(f"clip/{end}") for end in ("near", "far"))
    if near is not None and numbers(path, near, 1, f"{where}, its near clip,")[0] > NEAREST + 1e-9:
        account.note("clip", f"{where} from {near.strip()[:20]} m")
    if far is not None and numbers(path, far, 1, f"{where}, its far clip,")[0] < FARTHEST - 1e-9:
        account.note("clip", f"{where} to {far.strip()[:20]} m")
    return refused(path, where, lambda: Camera.from_fov(int(width), int(height), fov))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vision:
    """What a robot sees with.

    Attributes:
        camera: the left one, or the only one.
        pair: None of a robot with one eye.
        T_base_left: `[4, 4]` optical frame of `camera`.
    """

    camera: Camera
    pair: StereoRig | None
    T_base_left: Array


def read_sight(path: Path, root: Element, T_base_links: dict[str, Array], account: Account) -> Vision:
    """The pair among a file's cameras, or the one eye.

    Raises:
        RobotError: there is no camera, or one says nonsense.
    """
    eyes = read_eyes(path, root, T_base_links, account)
    if not eyes:
        raise refusal(
            path,
            "no camera sensor: --cameras stereo mounts a pair, or declare two, "
            "<gazebo reference=...><sensor type='camera' name='left'>",
        )
    ahead = [eye for eye in eyes if eye.T_base_optical[0, 2] > BEHIND]
    pair = _named_pair(ahead) or _named_pair(eyes) or _equal_pair(eyes)
    used = list(pair or (next((eye for some in (ahead, eyes) for eye in some if not eye.depth), eyes[0]),))
    for eye in eyes:
        if all(eye is not one for one in used):
            account.note("cameras", eye.called)
        elif eye.depth:
            account.note("depth camera", eye.called)
    if used[0].T_base_optical[0, 2] <= BEHIND:
        account.note("behind", used[0].called)
    if pair is None:
        return Vision(camera=used[0].camera, pair=None, T_base_left=used[0].T_base_optical)
    left, right = pair
    if _right_of(left, right):
        left, right = right, left
        account.note("swapped", f"{left.called}, {right.called}")
    return stereo(path, left.camera, right.camera, left.T_base_optical, right.T_base_optical)


def stereo(path: Path, left: Camera, right: Camera, T_base_left: Array, T_base_right: Array) -> Vision:
    """A pair of cameras that stand so."""
    T_right_left = inverse(T_base_right) @ T_base_left
    # Rounding would hide that the pair is rectified.
    T_right_left[np.abs(T_right_left) < 1e-12] = 0.0
    T_right_left[np.abs(T_right_left - 1.0) < 1e-12] = 1.0
    rig = refused(path, "its stereo pair", lambda: StereoRig(left=left, right=right, T_right_left=T_right_left))
    return Vision(camera=left, pair=rig, T_base_left=T_base_left)


def _right_of(left: Eye, right: Eye) -> bool:
    """Whether the left camera stands clearly to the right of the right one, as it sees it."""
    x, y, z = (inverse(left.T_base_optical) @ right.T_base_optical)[:3, 3].tolist()
    return x < -SIDEWAYS * math.hypot(x, y, z)


def _named_pair(eyes: list[Eye]) -> tuple[Eye, Eye] | None:
    """The first pair that names call left and right: by one name but for that, else the only one of each."""
    exact = {eye.name: eye for eye in eyes}
    if {"left", "right"} <= exact.keys():
        return exact["left"], exact["right"]
    for some in ([eye for eye in eyes if not eye.depth], eyes):
        lefts = [eye for eye in some if "left" in eye.words and "right" not in eye.words]
        rights = [eye for eye in some if "right" in eye.words and "left" not in eye.words]
        for left in lefts:
            for right in rights:
                if left.words.replace("left", "right") == right.words:
                    return left, right
        if len(lefts) == len(rights) == 1:
            return lefts[0], rights[0]
    return None


def _equal_pair(eyes: list[Eye]) -> tuple[Eye, Eye] | None:
    """The only two equal cameras that look the same way side by side; the left one first."""
    found = []
    for one, other in combinations(eyes, 2):
        T_one_other = inverse(one.T_base_optical) @ other.T_base_optical
        x, y, z = T_one_other[:3, 3].tolist()
        baseline = math.hypot(x, y, z)
        parallel = T_one_other[2, 2] > PARALLEL and T_one_other[0, 0] > PARALLEL
        same = one.camera == other.camera and one.depth == other.depth
        if same and parallel and baseline > 0.0 and abs(x) > SIDEWAYS * baseline:
            found.append((one, other) if x > 0.0 else (other, one))
    return found[0] if len(found) == 1 else None
