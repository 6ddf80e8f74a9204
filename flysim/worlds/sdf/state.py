"""The `<state>` that Gazebo saves into a world: where everything stood at that moment, which counts over the models."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from flysim.geometry.frames import Array
from flysim.worlds.sdf.elements import Where, child_numbers, text_of, written_pose
from flysim.worlds.sdf.skipped import Skipped

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SavedState:
    """Poses by scoped name, all of them in the world.

    Attributes:
        models: `[4, 4]` T_world_model.
        links: `[4, 4]` T_world_link, by the model's name and the link's with '::' between.
        scales: factors along x, y, z of the models that were given another size.
        inserted: groups of models that are beside those of the world.
        gone: names of models that were taken out.
    """

    models: dict[str, Array] = field(default_factory=dict)
    links: dict[str, Array] = field(default_factory=dict)
    scales: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    inserted: list[Element] = field(default_factory=list)
    gone: frozenset[str] = frozenset()


def read_state(world: Element, where: Where, skipped: Skipped) -> SavedState:
    """The saved state of a world; an empty one where it has none."""
    state = world.find("state")
    if state is None:
        return SavedState()
    if len(world.findall("state")) > 1:
        skipped.note("only the first <state> of a world is read", where)
    gone = frozenset(text_of(name) for group in state.findall("deletions") for name in group.findall("name"))
    found = SavedState(inserted=state.findall("insertions"), gone=gone - {""})
    for model in state.findall("model"):
        _read_model(model, "", found, where, skipped)
    return found


def _read_model(element: Element, above: str, found: SavedState, where: Where, skipped: Skipped) -> None:
    own = (element.get("name") or "").strip()
    name = f"{above}::{own}" if above else own
    here = where.inside("state of model", name)
    if element.find("pose") is not None:
        found.models[name] = written_pose(element, here).T
    x, y, z = child_numbers(element, "scale", 3, here, (1.0, 1.0, 1.0))
    if (x, y, z) != (1.0, 1.0, 1.0) and min(x, y, z) > 0.0:
        found.scales[name] = (x, y, z)
        skipped.note("a saved <scale> changes the size of each shape, not where it is in its link", here)
    for link in element.findall("link"):
        if link.find("pose") is not None:
            found.links[f"{name}::{(link.get('name') or '').strip()}"] = written_pose(link, here).T
    for model in element.findall("model"):
        _read_model(model, name, found, where, skipped)
