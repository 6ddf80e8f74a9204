"""Values out of a URDF: names, numbers, places. Every refusal is one line that names the file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from flysim.errors import RobotError
from flysim.geometry.frames import Array, pose6
from flysim.plain import shown, shown_path
from flysim.robots.xacro import UnexpandedError, expanded, is_xacro, told
from flysim.worlds.sdf.document import mended

MAX_BYTES = 4_000_000
MAX_LINKS = 100  # pybullet takes 128 joints
MAX_DEPTH = 64  # nested XML elements
MAX_NUMBER = 1e6  # metres, kilograms, anything: beyond it is a typing error
MAX_NAME = 200  # characters
MAX_WORDS = 220  # characters of a refusal, its file's path apart

T = TypeVar("T")
Three = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Origin:
    """A place as URDF writes it, so that it can be written again to the last bit."""

    xyz: Three = (0.0, 0.0, 0.0)  # [m]
    rpy: Three = (0.0, 0.0, 0.0)  # [rad] fixed-axis roll, pitch, yaw

    @property
    def matrix(self) -> Array:
        """`[4, 4]` transform from what lies there to what it lies in."""
        return pose6(*self.xyz, *self.rpy)


def parse(path: Path) -> Element:
    """The root element of a URDF; of a xacro file, that of the URDF which it stands for.

    Raises:
        RobotError: it cannot be read, is no URDF, or is a xacro file that cannot be expanded here.
    """
    data = _bytes(path)
    root = _parsed(path, data)
    if root is None or is_xacro(root):
        try:
            root = _parsed(path, expanded(path, MAX_BYTES))
        except UnexpandedError as error:
            raise refusal(path, told(str(error))) from None
    if root is None or root.tag != "robot":
        raise refusal(path, f"the root element is <{'' if root is None else root.tag[:60]}>; a URDF has <robot>")
    level = [root]
    for _ in range(MAX_DEPTH):
        level = [child for element in level for child in element]
    if level:
        raise refusal(path, f"XML elements nested deeper than {MAX_DEPTH}: flatten it")
    return root


def _bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise refusal(path, f"cannot read the robot: {reason}. Give the path of a URDF") from error
    if len(data) > MAX_BYTES:
        raise refusal(path, f"a URDF of more than {MAX_BYTES} bytes; at most that much is read")
    return data


def _parsed(path: Path, data: bytes) -> Element | None:
    """The root element; None of what has tags of xacro and does not declare them.

    What a world's file is forgiven, `--` in comments and undeclared prefixes, a robot's is too; no bytes of no text.
    """
    first: Exception | None = None
    for mend in (None,) if b"\0" in data else (None, mended):
        try:
            return fromstring(data if mend is None else mend(data), forbid_dtd=True)
        except DefusedXmlException:
            raise refusal(path, "declares a DTD or entities, which are not read: remove the <!DOCTYPE ...>") from None
        except (ParseError, ValueError, LookupError) as error:  # LookupError: an encoding that nobody knows
            if isinstance(error, ParseError) and "unbound prefix" in str(error) and b"<xacro:" in data:
                return None
            first = first or error
    raise refusal(path, f"not a readable URDF: {first}: correct it") from first


def refusal(path: Path, what: str) -> RobotError:
    """A `RobotError` of one line, and a short one, whatever names the file has."""
    what = "".join(c if c.isprintable() else "?" for c in what)
    return RobotError(f"{shown_path(path)}: {what if len(what) <= MAX_WORDS else what[: MAX_WORDS - 3] + '...'}.")


def refused(path: Path, where: str, make: Callable[[], T]) -> T:
    """What `make` makes; its ValueError as a `RobotError`."""
    try:
        return make()
    except ValueError as error:
        raise refusal(path, f"{where}: {error}") from error


def named(path: Path, root: Element, tag: str) -> dict[str, Element]:
    """The links or joints of a robot by name."""
    found: dict[str, Element] = {}
    for element in root.findall(tag):
        name = attribute(path, element, "name")
        if name in found:
            raise refusal(path, f"two {tag}s are named {shown(name)}: give each its own name")
        found[name] = element
    if len(found) > MAX_LINKS:
        raise refusal(path, f"{len(found)} {tag}s; at most {MAX_LINKS} are simulated")
    return found


def attribute(path: Path, element: Element, name: str, most: int = MAX_NAME) -> str:
    """What an attribute says: printable, not blank, and of at most so many characters."""
    value = element.get(name)
    if value is None:
        raise refusal(path, f"{called(element)} has no {name}=: add it")
    if not value.strip() or not value.isprintable() or len(value) > most:
        raise refusal(
            path,
            f"<{element.tag}> has {name}={shown(value)}: it must be printable, not blank, "
            f"and have at most {most} characters",
        )
    return value


def numbers(path: Path, text: str | None, count: int, where: str) -> list[float]:
    """`count` finite numbers of at most a million."""
    words = (text or "").split(maxsplit=16)
    try:
        values = [float(word) if "_" not in word else math.nan for word in words]
    except ValueError:
        values = []
    if len(values) != count or not all(abs(value) <= MAX_NUMBER for value in values):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise refusal(path, f"{where} must be {what}, got {'nothing' if text is None else shown(text)}")
    return values


def at_least_zero(path: Path, text: str | None, where: str) -> float:
    """One finite number that is not negative."""
    value = numbers(path, text, 1, where)[0]
    if value < 0.0:
        raise refusal(path, f"{where} must be >= 0, got {value:g}")
    return value


def origin(path: Path, element: Element) -> Origin:
    """What an `<origin>` child says; the identity where there is none."""
    tag = element.find("origin")
    if tag is None:
        return Origin()
    where = f"the origin of {called(element)}"
    x, y, z = numbers(path, tag.get("xyz", "0 0 0"), 3, f"{where}, xyz,")
    roll, pitch, yaw = numbers(path, tag.get("rpy", "0 0 0"), 3, f"{where}, rpy,")
    return Origin((x, y, z), (roll, pitch, yaw))


def called(element: Element) -> str:
    """An element by its name, or by its tag where it has none."""
    name = element.get("name")
    return f"<{element.tag}>" if name is None else f"{element.tag} {shown(name)}"
