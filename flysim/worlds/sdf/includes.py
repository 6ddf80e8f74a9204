"""Which file an `<include>` means: one at hand, or one of the models that every Gazebo has."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from defusedxml.ElementTree import fromstring

from flysim.plain import shown
from flysim.worlds.sdf.elements import Unread, Where, text_of
from flysim.worlds.sdf.folder import WorldFolder

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MISSING = "an included model is not at hand and is left out"
SUN = "model://sun"  # that of the simulator
# As Gazebo ships it; a model of that name that is at hand goes before it.
GROUND_PLANE = fromstring(
    "<sdf><model name='ground_plane'><static>true</static><link name='link'>"
    "<collision name='collision'><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
    "</collision><visual name='visual'><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>"
    "<material><script><name>Gazebo/Grey</name></script></material></visual></link></model></sdf>"
)
BUILT_IN = {"ground_plane": GROUND_PLANE, "sun": None}
MAX_CHAIN = 32  # files that include each other


def built_in(uri: str, folder: WorldFolder, where: Where) -> str:
    """Which of what is built in an include means: "sun", a "ground_plane" that is not at hand; empty: none.

    The "Ground Plane" of an address, on which newer worlds stand, is the same floor: nothing is fetched, as is noted.
    """
    scheme, mark, rest = uri.partition("://")
    if scheme in ("http", "https") and _is_ground_plane(rest):
        folder.note("the ground plane of an address is not fetched and the one built in stands for it", where, uri)
        return "ground_plane"
    name = rest.strip("/") if mark and scheme == "model" else "" if mark else uri.strip("/")
    if name not in BUILT_IN:
        return ""
    at_hand = any((root / name).exists() for root in (folder.root, folder.root / "models", *folder.models))
    return "" if at_hand and name != "sun" else name


def _is_ground_plane(address: str) -> bool:
    """Whether an address ends in that model's name, or in a version of it."""
    words = re.sub(r"%20|[\s_]+", " ", address.lower()).strip("/ ").split("/")
    if words[-1] == "tip" or words[-1].isdecimal():
        words.pop()
    return words[-1:] == ["ground plane"]


def included_file(uri: str, base: Path, folder: WorldFolder) -> Path:
    """The SDF file of a model: itself, or in a model's folder what its `model.config` names, else `model.sdf`.

    Raises:
        Unread: it is not at hand.
    """
    if not uri:
        raise Unread(MISSING, "an <include> without a <uri>")
    path = folder.find(uri, base, MISSING)
    if not path.is_dir():
        if not path.is_file():
            raise Unread(MISSING, uri)
        return path
    name = _configured(path, uri, folder) or "model.sdf"
    file = folder.find(name, path, MISSING)
    if not file.is_file() or not file.is_relative_to(path):
        raise Unread(MISSING, f"{uri}: its folder has no {shown(name)}")
    return file


def _configured(path: Path, uri: str, folder: WorldFolder) -> str:
    """The file that a model.config names for the latest version of SDF; empty where there is none."""
    config = folder.find("model.config", path, MISSING)
    if not config.is_file():
        return ""
    root = folder.read_xml(config, Where(config))
    named = [(_version(e.get("version")), text_of(e)) for e in root.findall("sdf") if text_of(e)]
    return max(named, key=lambda one: one[0])[1] if named else ""


def _version(text: str | None) -> tuple[int, ...]:
    words = (text or "0").strip()[:20].split(".")
    return tuple(int(word) if word.isdecimal() else 0 for word in words)


def model_in(root: Element, where: Where) -> Element:
    """The model of a file that is included.

    Raises:
        Unread: it has none.
    """
    model = root.find("model") if root.tag == "sdf" else None
    if model is None:
        raise Unread(MISSING, f"{where.file.name}: has no <model> in its <sdf>")
    return model
