"""Reads SDF world files (http://sdformat.org/spec, versions 1.4 to 1.12) without a simulator.

Read are boxes, cylinders, spheres, planes and meshes in models and nested models, with poses, colours and
albedo textures. What else stands in a file is skipped: what decorates or configures another simulator
silently, what would change the world by name in `World.warnings`. A world file is somebody else's file: it
opens nothing outside its folder, and its size is bounded (`flysim.worlds.sdf.folder`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flysim.errors import WorldError
from flysim.geometry.frames import Array
from flysim.plain import shown, shown_path
from flysim.worlds.model import Link, Part, World
from flysim.worlds.sdf.elements import (
    Where,
    flag,
    name_of,
    numbers,
    pose_of,
    text_of,
)
from flysim.worlds.sdf.folder import WorldFolder
from flysim.worlds.sdf.parts import Skipped, read_inertial, read_part
from flysim.worlds.shapes import Plane

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

NAMESPACE = "urn:flysim:sdf"  # of the one element that is flysim's own: <flysim:structure>
STRUCTURE = f"{{{NAMESPACE}}}structure"
STRUCTURE_NAMES = ("ground", "floor", "wall")
SUN = "model://sun"  # that of the simulator
MAX_CHAIN = 32  # files that include each other
MAX_LINKS = 20_000
MAX_PARTS = 100_000

# Standard elements that change neither what stands in a world nor how it looks to flysim.
SILENT = {
    "world": "atmosphere audio frame gravity gui light magnetic_field model include physics scene "
    "spherical_coordinates state wind",
    "model": "allow_auto_disable enable_wind frame include link model pose self_collide static",
    "link": "audio_sink battery collision enable_wind gravity inertial kinematic light must_be_base_link "
    "particle_emitter pose self_collide velocity_decay visual",
}
STANDARD_PLUGINS = ("gz-sim-", "ignition-gazebo-")  # of the simulator itself: physics, scene, user commands


def read_world(path: Path) -> World:
    """The world that an SDF file (plain or gzipped) describes.

    `<flysim:structure>` (xmlns:flysim="urn:flysim:sdf") in a model says whether it is structure: ground or
    wall. Where it is missing, links with a plane and models named ground..., floor... or wall... are.

    Raises:
        WorldError: the file, or a mesh or texture it names, is missing, damaged, too large, outside the
            world's folder, or says something that cannot be. One line with file, element, and what to do.
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
    folder = WorldFolder(root_folder)
    sdf = folder.read_xml(path, where)
    if sdf.tag != "sdf":
        raise where.error(
            f"its root element is <{sdf.tag[:80]}>, a world file begins with <sdf>: is it another format?"
        )
    worlds = sdf.findall("world")
    if not worlds:
        raise where.error("has no <world> in its <sdf>: put the models into <world name='...'>")
    reader = _Reader(folder, where)
    if len(worlds) > 1:
        reader.skipped.note("only the first <world> of a file is read", where)
    return reader.world(worlds[0], path)


@dataclass(frozen=True, slots=True)
class _Scope:
    """What a nested model takes over from those round it."""

    T_world_model: Array
    name: str  # scoped by '::'
    own_name: str
    base: Path  # folder of the file it stands in
    files: tuple[Path, ...]  # that file, and those that include it
    static: bool
    structure: bool | None  # None: no element has decided yet
    where: Where


@dataclass(slots=True)
class _Reader:
    """One reading of one world; owns what has been found so far."""

    folder: WorldFolder
    where: Where
    skipped: Skipped = field(default_factory=Skipped)
    links: list[Link] = field(default_factory=list)
    parts: int = 0
    checked: set[Path] = field(default_factory=set)  # files that include no file that leads back to them

    def world(self, element: Element, path: Path) -> World:
        name = name_of(element, "world", 0, self.where)
        top = _Scope(np.eye(4), "", "world", self.folder.root, (path.resolve(),), False, None, self.where)
        self._note_unread(element, "world", self.where)
        self._models(element, top)
        gravity = element.find("gravity")
        if gravity is None:  # where SDF 1.4 has it
            gravity = element.find("physics/gravity")
        gx, gy, gz = (0.0, 0.0, -9.81) if gravity is None else numbers(gravity, 3, self.where)
        if gx or gy:
            self.skipped.note("gravity is read along z alone", self.where)
        return World(
            name=path.name.split(".")[0] if name == "world_0" else name,
            path=path,
            links=tuple(self.links),
            gravity=gz,
            warnings=self.skipped.sentences(),
        )

    def _note_unread(self, element: Element, kind: str, where: Where) -> None:
        known = SILENT[kind].split()
        for child in element:
            if child.tag in known or child.tag == STRUCTURE:
                continue
            if child.tag.startswith("{"):
                if child.tag.endswith("}structure"):
                    self.skipped.note(f"a structure element outside the namespace {NAMESPACE} is not read", where)
                continue
            detail = child.get("name") or child.get("filename") or ""
            if child.tag == "plugin" and (child.get("filename") or "").startswith(STANDARD_PLUGINS):
                continue
            self.skipped.note(f"<{child.tag[:40]}> is not read", where, detail)

    def _models(self, element: Element, scope: _Scope) -> None:
        """All models and includes directly inside a world or a model, in the order of the file."""
        seen: set[str] = set()
        for index, child in enumerate(e for e in element if e.tag in ("model", "include")):
            if child.tag == "model":
                self._model(child, name_of(child, "model", index, scope.where), scope, seen, None)
            else:
                self._include(child, index, scope, seen)

    def _include(self, element: Element, index: int, scope: _Scope, seen: set[str]) -> None:
        """A model in the world's own folder; any other is named in a warning."""
        where = scope.where
        uri = text_of(element.find("uri"))
        if uri == SUN:
            return
        path = self._included(uri, scope.base, where)
        if path.is_file():
            self._check_circle(path, scope.files, where.inside("include", uri))
        # An include inside an included file is not followed: no chain of files can grow a world.
        if not path.is_file() or len(scope.files) > 1:
            self.skipped.note(
                "an included model is not in the world's folder as a file or a folder with model.sdf",
                where,
                uri,
            )
            return
        file_where = Where(path)
        root = self.folder.read_xml(path, file_where)
        model = root.find("model") if root.tag == "sdf" else None
        if model is None:
            raise file_where.error("has no <model> in its <sdf>: only files with one model can be included")
        name = text_of(element.find("name")) or name_of(model, "model", index, file_where)
        inside = replace(scope, base=path.parent, files=(*scope.files, path))
        self._model(model, name, inside, seen, element)

    def _included(self, uri: str, base: Path, where: Where) -> Path:
        """The file that an include names; it need not exist."""
        here = where.inside("include", uri)
        path = self.folder.find(uri, base, here)
        return self.folder.find(f"{uri.rstrip('/')}/model.sdf", base, here) if path.is_dir() else path

    def _check_circle(self, path: Path, files: tuple[Path, ...], here: Where) -> None:
        """Refuses a file whose includes, or theirs, lead back to it or to one of `files`."""
        if path in files:
            raise here.error(f"{shown(path.name)} includes itself: take the <include> out")
        if path in self.checked:
            return
        if len(files) > MAX_CHAIN:
            raise here.error(f"files include each other more than {MAX_CHAIN} deep: put them together")
        where = Where(path)
        for element in self.folder.read_xml(path, where).iter("include"):
            uri = text_of(element.find("uri"))
            included = self._included(uri, path.parent, where) if uri != SUN else path.parent
            if included.is_file():
                self._check_circle(included, (*files, path), here)
        self.checked.add(path)

    def _model(self, element: Element, name: str, scope: _Scope, seen: set[str], include: Element | None) -> None:
        where = scope.where.inside("model", name)
        if name in seen:
            raise where.error("its name is taken by another model: give each its own")
        seen.add(name)
        if (element.get("placement_frame") or "").strip():
            raise where.error("placement_frame is not read: give the <pose> of the model itself and drop it")
        self._note_unread(element, "model", where)
        parents = (scope.own_name, "world" if not scope.name else "__model__")
        placed = element if include is None or include.find("pose") is None else include
        static = flag(element, "static", where)
        if include is not None:
            static = flag(include, "static", where, static)
        structure = flag(element, STRUCTURE, where) if element.find(STRUCTURE) is not None else scope.structure
        if structure is None and name.lower().startswith(STRUCTURE_NAMES):
            structure = True
        inner = _Scope(
            T_world_model=scope.T_world_model @ pose_of(placed, parents, where),
            name=f"{scope.name}::{name}" if scope.name else name,
            own_name=name,
            base=scope.base,
            files=scope.files,
            static=scope.static or static,
            structure=structure,
            where=where,
        )
        names: set[str] = set()
        for index, link in enumerate(element.findall("link")):
            self._link(link, index, inner, names)
        self._models(element, inner)

    def _link(self, element: Element, index: int, scope: _Scope, names: set[str]) -> None:
        name = name_of(element, "link", index, scope.where)
        where = scope.where.inside("link", name)
        if name in names:
            raise where.error("its name is taken by another link of the model: give each its own")
        names.add(name)
        self._note_unread(element, "link", where)
        if not scope.static and not flag(element, "gravity", where, True):
            self.skipped.note("<gravity> of a single link is not read", where)
        mass, inertia = read_inertial(element, where, not scope.static, self.skipped)
        T_world_link = scope.T_world_model @ pose_of(element, (scope.own_name, "__model__"), where)
        visuals = self._parts(element, "visual", name, scope.base, where)
        collisions = self._parts(element, "collision", name, scope.base, where)
        if not visuals and not collisions:
            return  # a frame without a body
        if len(self.links) >= MAX_LINKS:
            raise where.error(f"the world has more than {MAX_LINKS} links: split it")
        has_plane = any(isinstance(part.shape, Plane) for part in visuals + collisions)
        self.links.append(
            Link(
                name=name,
                model=scope.name,
                T_world_link=T_world_link,
                visuals=visuals,
                collisions=collisions,
                static=scope.static,
                structure=has_plane if scope.structure is None else scope.structure,
                mass=mass,
                inertia=inertia,
            )
        )

    def _parts(self, link: Element, tag: str, link_name: str, base: Path, where: Where) -> tuple[Part, ...]:
        parts = []
        for index, element in enumerate(link.findall(tag)):
            name = name_of(element, tag, index, where)
            here = where.inside(tag, name)
            self.parts += 1
            if self.parts > MAX_PARTS:
                raise here.error(f"the world has more than {MAX_PARTS} visuals and collisions: split it")
            part = read_part(element, name, (link_name,), self.folder, base, here, self.skipped)
            if part is not None:
                parts.append(part)
        return tuple(parts)
