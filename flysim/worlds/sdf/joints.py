"""The joints of a model: which of its links are fixed to the world and stand still."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from flysim.worlds.sdf.elements import text_of

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


@dataclass(slots=True, eq=False)
class Joints:
    """What holds the links of one model.

    Attributes:
        links: names of those that there are.
    """

    links: set[str] = field(default_factory=set)
    _all: list[tuple[str, str, str, bool]] = field(default_factory=list)  # name, parent, child, fixed

    def add(self, element: Element, name: str) -> None:
        """One more `<joint>`."""
        ends = (text_of(element.find("parent")), text_of(element.find("child")))
        self._all.append((name, *ends, element.get("type") == "fixed"))

    def held(self) -> set[str]:
        """The links that fixed joints hold to the world, over others or directly."""
        of: dict[str, list[str]] = {}
        for _, parent, child, fixed in self._all:
            if fixed:
                of.setdefault(parent, []).append(child)
                of.setdefault(child, []).append(parent)
        found, left = {"world"}, ["world"]
        while left:
            for other in of.get(left.pop(), []):
                if other not in found:
                    found.add(other)
                    left.append(other)
        return found & self.links

    def unread(self, held: set[str]) -> list[str]:
        """Names of the joints that make a difference which flysim does not read."""
        still = held | {"world"}
        return [name for name, parent, child, _ in self._all if not (parent in still and child in still)]
