"""xacro: told by its name or its tags, expanded by the package `xacro` where that is installed, in a closed process.

A xacro file is a program of somebody else's: it computes, and opens what files it likes. So it is expanded by a
process of its own that may read from the robot's package and from Python's own folders, and do nothing else.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from xml.etree.ElementTree import Element

from flysim.plain import shortened
from flysim.robots.package import package_of

NAMESPACES = ("ros.org/wiki/xacro", "ros.org/xacro")
TIMEOUT_S = 30.0
COMMAND = "xacro FILE > robot.urdf"


class UnexpandedError(Exception):
    """A xacro file cannot be expanded here; in words, why."""


def is_xacro(root: Element) -> bool:
    """Whether a document has something in it that xacro would replace."""
    for element in root.iter():
        if not isinstance(element.tag, str):
            continue
        if any(space in element.tag for space in NAMESPACES) or element.tag.startswith("xacro:"):
            return True
        if any("${" in value or "$(" in value for value in element.attrib.values()):
            return True
    return False


def expanded(path: Path, limit: int) -> bytes:
    """The URDF that a xacro file stands for, of at most `limit` bytes.

    Raises:
        UnexpandedError: the package is not installed, or the file asks for what is not there or not allowed.
    """
    if importlib.util.find_spec("xacro") is None:
        raise UnexpandedError("pip install xacro has flysim expand it")
    path = path.resolve()
    child = Path(__file__).with_name("xacro_child.py")
    command = [sys.executable, "-I", str(child), str(path), str(package_of(path.parent)), str(limit)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        raise UnexpandedError(f"it is not done in {TIMEOUT_S:.0f} s") from None
    if done.returncode != 0:
        words = [line for line in done.stderr.decode("utf-8", "replace").splitlines() if line.strip()]
        raise UnexpandedError(shortened(words[-1] if words else f"xacro ended with {done.returncode}", 100))
    return done.stdout


def told(why: str) -> str:
    """What an error says of a xacro file that is not expanded."""
    return f"this is a xacro file ({shortened(why, 100)}): expand it first: {COMMAND}"
