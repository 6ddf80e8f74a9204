"""Values out of XML elements: numbers that are numbers, poses that are rigid, errors that say where."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flysim.errors import WorldError
from flysim.geometry.frames import Array, from_quaternion_xyzw, pose6, se3
from flysim.plain import shown, shown_path

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_NUMBER = 1e6  # metres, kilograms, anything: a world beyond it is a typing error and overflows float32
MAX_NAME = 200  # characters


@dataclass(frozen=True, slots=True)
class Where:
    """The place in a world file that an error message names."""

    file: Path
    trail: tuple[str, ...] = ()

    def inside(self, kind: str, name: str) -> Where:
        """The place one element deeper."""
        return replace(self, trail=(*self.trail, f"{kind} {shown(name)}"))

    def error(self, what: str) -> WorldError:
        """A one-line `WorldError`; `what` says what is wrong, what was got, what to do."""
        return WorldError(": ".join(filter(None, (shown_path(self.file), ", ".join(self.trail), what))))

    def __str__(self) -> str:
        return ", ".join(self.trail) or "the world"


def name_of(element: Element, kind: str, index: int, where: Where) -> str:
    """The `name` attribute, or `<kind>_<index>` where there is none."""
    name = (element.get("name") or "").strip()
    if not name:
        return f"{kind}_{index}"
    if len(name) > MAX_NAME or not name.isprintable():
        raise where.error(
            f"<{kind}> has the name {shown(name)}: a name is printable and has at most {MAX_NAME} characters"
        )
    return name


def text_of(element: Element | None) -> str:
    """The element's own text without surrounding space; empty for None."""
    return "" if element is None or element.text is None else element.text.strip()


def numbers(element: Element, count: int | tuple[int, ...], where: Where) -> tuple[float, ...]:
    """The finite numbers in an element's text.

    Raises:
        WorldError: another count than asked, a word that is no number, NaN, infinity, or more than 1e6.
    """
    counts = (count,) if isinstance(count, int) else count
    wanted = " or ".join(str(c) for c in counts) + (" number" if counts == (1,) else " numbers")
    text = text_of(element)
    # No count wanted is above 10: the split stops there whatever the length of the text.
    words = text.split(maxsplit=16)
    if len(words) not in counts:
        raise where.error(f"<{element.tag}> must hold {wanted}, got {shown(text)}")
    values = []
    for word in words:
        try:
            value = float(word) if "_" not in word and len(word) < 64 else math.nan
        except ValueError:
            value = math.nan
        if not abs(value) <= MAX_NUMBER:
            raise where.error(f"<{element.tag}> must hold {wanted} of at most {MAX_NUMBER:.0e}, got {shown(word)}")
        values.append(value)
    return tuple(values)


def child_numbers(
    element: Element, tag: str, count: int | tuple[int, ...], where: Where, default: tuple[float, ...] | None
) -> tuple[float, ...]:
    """The numbers in the child `tag`; `default` where there is none, an error where that is None."""
    child = element.find(tag)
    if child is not None:
        return numbers(child, count, where)
    if default is None:
        raise where.error(f"<{element.tag}> has no <{tag}>: add one")
    return default


def flag(element: Element, tag: str, where: Where, default: bool = False) -> bool:
    """The true/false (1/0) in the child `tag`."""
    child = element.find(tag)
    if child is None:
        return default
    text = text_of(child).lower()
    if text not in ("true", "1", "false", "0"):
        raise where.error(f"<{tag.rpartition('}')[2]}> must be true or false, got {shown(text)}")
    return text in ("true", "1")


class Unread(Exception):
    """One part of a world that cannot be read: it is left out and named, and the rest of the world is read.

    Attributes:
        kind: what it is and what becomes of it, as `Skipped.note` has it.
        detail: its name, and what is wrong with it.
    """

    def __init__(self, kind: str, detail: str) -> None:
        super().__init__(f"{kind}: {detail}")
        self.kind, self.detail = kind, detail


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WrittenPose:
    """A `<pose>` as it is written.

    Attributes:
        T: `[4, 4]` transform from what is placed to the frame it is placed in.
        frame: name of that frame; empty: the element's own default.
        forgiven: whether an unknown frame is passed over, as Gazebo does with the older attribute `frame`.
    """

    T: Array
    frame: str = ""
    forgiven: bool = False


def written_pose(element: Element, where: Where) -> WrittenPose:
    """The `<pose>` child; the identity where there is none."""
    pose = element.find("pose")
    if pose is None:
        return WrittenPose(T=np.eye(4))
    relative, older = ((pose.get(name) or "").strip() for name in ("relative_to", "frame"))
    return WrittenPose(T=_matrix(pose, where), frame=relative or older, forgiven=not relative)


def _matrix(pose: Element, where: Where) -> Array:
    form = (pose.get("rotation_format") or "euler_rpy").strip()
    degrees = (pose.get("degrees") or "false").strip().lower()
    if form not in ("euler_rpy", "quat_xyzw") or degrees not in ("true", "1", "false", "0"):
        raise where.error(
            f"<pose> has rotation_format={shown(form)} degrees={shown(degrees)}: "
            "use euler_rpy or quat_xyzw, and true or false"
        )
    if not text_of(pose):
        return np.eye(4)
    if form == "quat_xyzw":
        x, y, z, *quaternion = numbers(pose, 7, where)
        if abs(math.hypot(*quaternion) - 1.0) > 1e-3:
            raise where.error(f"<pose> must hold a unit quaternion, got one of norm {math.hypot(*quaternion):.4g}")
        return se3(from_quaternion_xyzw(quaternion), (x, y, z))
    x, y, z, *rpy = numbers(pose, 6, where)
    if degrees in ("true", "1"):
        rpy = [math.radians(angle) for angle in rpy]
    return pose6(x, y, z, *rpy)
