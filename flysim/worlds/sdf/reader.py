"""Reads SDF world files (http://sdformat.org/spec, versions 1.4 to 1.12) without a simulator.

Read are boxes, cylinders, spheres, planes and meshes in models, nested and included ones, with poses, colours and
textures; docs/worlds.md has every construct. What else stands in a file is skipped: what decorates or configures
another simulator silently, what would change the world by name in `World.warnings`. A world file is somebody else's
file: it opens nothing outside its folders, and its size is bounded (`flysim.worlds.sdf.folder`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flysim.errors import FlysimError, WorldError
from flysim.geometry.frames import Array
from flysim.plain import shown_path
from flysim.worlds.model import Link, Part, World
from flysim.worlds.sdf.elements import Where, flag, name_of, numbers
from flysim.worlds.sdf.folder import WorldFolder, beside_worlds, model_folders
from flysim.worlds.sdf.inertial import read_inertial
from flysim.worlds.sdf.parts import read_part
from flysim.worlds.sdf.reading import Reading
from flysim.worlds.sdf.state import SavedState, read_state
from flysim.worlds.sdf.tree import LinkNode, ModelNode, Tree
from flysim.worlds.structure import told_apart

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_LINKS = 20_000
MAX_PARTS = 100_000
NO_MODEL = "a <state> has the pose of a model that there is none of, which is passed over"
NO_FRAME = "a pose's frame is not known and it counts as relative to what it stands in"


def read_world(path: Path, models: Iterable[str | Path] = ()) -> World:
    """The world that an SDF file (plain or gzipped) describes.

    `<flysim:structure>` (xmlns:flysim="urn:flysim:sdf") in a model says whether it is structure: ground or
    wall. Where it is missing, `flysim.worlds.structure` tells by what a thing is.

    Args:
        path: of the file.
        models: folders in which models are looked for beside the world's own; "env": those of Gazebo's variables.

    Raises:
        WorldError: the file is missing, damaged, too large, or says something that cannot be. One line with file,
            element, and what to do; what was passed over before that is in its notes.
    """
    path = Path(path)
    where = Where(path)
    try:
        root_folder = path.parent.resolve()
        exists = path.exists()
    except (OSError, RuntimeError, ValueError) as error:
        raise WorldError(f"{shown_path(path)}: cannot be resolved ({type(error).__name__}): check the path") from None
    if not exists:
        raise WorldError(f"{shown_path(path)}: there is no such world file: check the path")
    folder = WorldFolder(root_folder, (*beside_worlds(root_folder), *model_folders(models)))
    try:
        return _Reader(folder, where).world(_world_of(folder.read_xml(path, where), folder, where), path)
    except FlysimError as error:
        for sentence in folder.skipped.sentences():
            error.add_note(sentence)
        raise


def _world_of(sdf: Element, folder: WorldFolder, where: Where) -> Element:
    if sdf.tag != "sdf":
        raise where.error(
            f"its root element is <{sdf.tag[:80]}>, a world file begins with <sdf>: is it another format?"
        )
    worlds = sdf.findall("world")
    if not worlds:
        raise where.error("has no <world> in its <sdf>: put the models into <world name='...'>")
    if len(worlds) > 1:
        folder.note("only the first <world> of a file is read", where)
    return worlds[0]


@dataclass(slots=True)
class _Reader:
    """One reading of one world; owns what has been found so far."""

    folder: WorldFolder
    where: Where
    state: SavedState = field(default_factory=SavedState)
    links: list[Link] = field(default_factory=list)
    said: list[bool | None] = field(default_factory=list)  # of each link, whether the file calls it structure
    models: set[str] = field(default_factory=set)  # by whole name
    parts: int = 0

    def world(self, element: Element, path: Path) -> World:
        name = name_of(element, "world", 0, self.where)
        self.state = read_state(element, self.where, self.folder.skipped)
        tree = Tree(self.folder)
        top = tree.world(element, path, self.where, self.state.gone)
        for group in self.state.inserted:
            tree.inserted(group, top, path)
        for model in top.models:
            self._model(model, top, np.eye(4))
        for one in (name for name in self.state.models if name not in self.models):
            self.folder.note(NO_MODEL, self.where, one)
        gravity = element.find("gravity")
        if gravity is None:  # where SDF 1.4 has it
            gravity = element.find("physics/gravity")
        gx, gy, gz = (0.0, 0.0, -9.81) if gravity is None else numbers(gravity, 3, self.where)
        if gx or gy:
            self.folder.note("gravity is read along z alone", self.where)
        self._note_frames(top)
        return World(
            name=path.name.split(".")[0] if name == "world_0" else name,
            path=path,
            links=told_apart(self.links, self.said),
            gravity=gz,
            warnings=self.folder.skipped.sentences(),
        )

    def _note_frames(self, node: ModelNode) -> None:
        for name, where in node.scope.unknown:
            self.folder.note(NO_FRAME, where, name)
        for model in node.models:
            self._note_frames(model)

    def _model(self, node: ModelNode, above: ModelNode, T_world_above: Array) -> None:
        whole = node.scope.whole
        self.models.add(whole)
        T = self.state.models.get(whole)
        if T is None:
            T = T_world_above @ above.scope.place(node.scope.name, node.where)
        held = node.joints.held()
        for name in () if node.static else node.joints.unread(held):
            self.folder.note("<joint> is not read", node.where, name)
        for link in node.links:
            self._link(link, node, T, link.name in held)
        for model in node.models:
            self._model(model, node, T)

    def _link(self, link: LinkNode, node: ModelNode, T_world_model: Array, held: bool) -> None:
        element, where, scope = link.element, link.where, node.scope
        static = node.static or held or flag(element, "kinematic", where)
        if not static and not flag(element, "gravity", where, True):
            self.folder.note("<gravity> of a single link is not read", where)
        mass, inertia = read_inertial(element, where, not static, self.folder.skipped)
        T_world_link = self.state.links.get(f"{scope.whole}::{link.name}")
        if T_world_link is None:
            T_world_link = T_world_model @ scope.place(link.name, where)
        reading = Reading(
            folder=self.folder,
            scope=scope,
            base=link.base,
            where=where,
            scale=self._scale(scope.whole),
        )
        visuals = self._parts(element, "visual", link.name, reading)
        collisions = self._parts(element, "collision", link.name, reading)
        if not visuals and not collisions:
            return  # a frame without a body
        if len(self.links) >= MAX_LINKS:
            raise where.error(f"the world has more than {MAX_LINKS} links: split it")
        self.said.append(node.structure)
        self.links.append(
            Link(
                name=link.name,
                model=scope.whole,
                T_world_link=T_world_link,
                visuals=visuals,
                collisions=collisions,
                static=static,
                structure=False,  # until all that there is has been read
                mass=mass,
                inertia=inertia,
            )
        )

    def _scale(self, whole: str) -> tuple[float, float, float]:
        """The saved size of a model, or of the one it stands in."""
        while whole:
            if whole in self.state.scales:
                return self.state.scales[whole]
            whole = whole.rpartition("::")[0]
        return 1.0, 1.0, 1.0

    def _parts(self, link: Element, tag: str, link_name: str, reading: Reading) -> tuple[Part, ...]:
        parts: list[Part] = []
        for index, element in enumerate(link.findall(tag)):
            name = name_of(element, tag, index, reading.where)
            here = reading.where.inside(tag, name)
            found = read_part(element, name, link_name, replace(reading, where=here))
            self.parts += max(1, len(found))
            if self.parts > MAX_PARTS:
                raise here.error(f"the world has more than {MAX_PARTS} visuals and collisions: split it")
            parts += found
        return tuple(parts)
