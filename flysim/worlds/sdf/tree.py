"""The models of a world file with all it includes, and the frames of each; no shape is read yet."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from flysim.plain import shown
from flysim.worlds.sdf.elements import Unread, Where, WrittenPose, flag, name_of, text_of, written_pose
from flysim.worlds.sdf.folder import WorldFolder
from flysim.worlds.sdf.frames import MODEL, WORLD, Scope
from flysim.worlds.sdf.includes import (
    BUILT_IN,
    MAX_CHAIN,
    built_in,
    included_file,
    model_in,
)
from flysim.worlds.sdf.joints import Joints

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

NAMESPACE = "urn:flysim:sdf"  # of the one element that is flysim's own: <flysim:structure>
STRUCTURE = f"{{{NAMESPACE}}}structure"
MAX_NESTED = 64  # models in models
MAX_FRAMES = 200_000  # named places of a world
# Standard elements that change neither what stands in a world nor how it looks to flysim.
SILENT = {
    "world": "atmosphere audio frame gravity gui light magnetic_field model include physics scene "
    "spherical_coordinates state wind",
    "model": "allow_auto_disable enable_wind frame include joint link model pose self_collide static",
    "link": "audio_sink battery collision enable_wind gravity inertial kinematic light must_be_base_link "
    "particle_emitter pose self_collide velocity_decay visual",
}
STANDARD_PLUGINS = ("gz-sim-", "ignition-gazebo-")  # of the simulator itself: physics, scene, user commands


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkNode:
    """A `<link>`: its element, its name, and the folder of the file it stands in."""

    element: Element
    name: str
    base: Path
    where: Where


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelNode:
    """A model with what stands in it.

    Attributes:
        scope: its frames.
        static: nothing in it moves.
        structure: what the file says of it; None: nothing.
        joints: what holds its links.
        names: of the models in it.
    """

    scope: Scope
    static: bool
    structure: bool | None
    where: Where
    links: list[LinkNode] = field(default_factory=list)
    models: list[ModelNode] = field(default_factory=list)
    joints: Joints = field(default_factory=Joints)
    names: set[str] = field(default_factory=set)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Site:
    """Where elements are read.

    Attributes:
        node: the model, or the world, that they go to.
        base: folder of their file.
        files: that file, and those that include it.
        default: the frame that a pose in it is relative to.
        depth: models round it.
    """

    node: ModelNode
    base: Path
    files: tuple[Path, ...]
    where: Where
    default: str = MODEL
    depth: int = 0


@dataclass(slots=True)
class Tree:
    """Builds the tree of one world."""

    folder: WorldFolder
    frames: int = 0

    def world(self, element: Element, path: Path, where: Where, gone: frozenset[str]) -> ModelNode:
        """The world as a node without links; models of the names `gone` were taken out of it before it was saved."""
        top = ModelNode(scope=Scope(), static=False, structure=None, where=where)
        site = _Site(node=top, base=self.folder.root, files=(path.resolve(),), where=where, default=WORLD)
        self.note_unread(element, "world", where)
        self._inside(element, site, gone)
        return top

    def inserted(self, group: Element, top: ModelNode, path: Path) -> None:
        """Adds the models of a saved state's `<insertions>` beside those of the world."""
        site = _Site(node=top, base=self.folder.root, files=(path.resolve(),), where=top.where, default=WORLD)
        self.note_unread(group, "world", top.where)
        self._inside(group, site)

    def note_unread(self, element: Element, kind: str, where: Where) -> None:
        """Notes the children of a world, model or link that would change it, and are not read."""
        known = SILENT[kind].split()
        for child in element:
            if child.tag in known or child.tag == STRUCTURE:
                continue
            if child.tag.startswith("{"):
                if child.tag.endswith("}structure"):
                    self.folder.note(f"a structure element outside the namespace {NAMESPACE} is not read", where)
                continue
            detail = child.get("name") or child.get("filename") or ""
            if child.tag == "plugin" and (child.get("filename") or "").startswith(STANDARD_PLUGINS):
                continue
            self.folder.note(f"<{child.tag[:40]}> is not read", where, detail)

    def _count(self, where: Where) -> None:
        self.frames += 1
        if self.frames > MAX_FRAMES:
            raise where.error(f"the world has more than {MAX_FRAMES} models, links and frames: split it")

    def _inside(self, element: Element, site: _Site, gone: frozenset[str] = frozenset()) -> None:
        """All that stands directly in a world or a model, in the order of the file."""
        index = -1
        for child in element:
            if child.tag == "link":
                self._link(child, site)
            elif child.tag in ("frame", "joint"):
                self._frame(child, site)
            elif child.tag in ("model", "include"):
                index += 1
                name = name_of(child, "model", index, site.where) if child.tag == "model" else ""
                if name and name in gone:
                    continue
                if child.tag == "model":
                    self._model(child, name, site, None)
                else:
                    self._include(child, index, site, gone)

    def _pose(self, element: Element, where: Where, site: _Site) -> WrittenPose:
        """A pose in which the model's own frame is that of the site: of a merged model, another one."""
        pose = written_pose(element, where)
        own = pose.frame == MODEL and site.default != WORLD
        return replace(pose, frame=site.default) if own else pose

    def _link(self, element: Element, site: _Site) -> None:
        node = site.node
        name = name_of(element, "link", len(node.links), site.where)
        where = site.where.inside("link", name)
        if name in node.joints.links:
            raise where.error("its name is taken by another link of the model: give each its own")
        node.joints.links.add(name)
        self._count(where)
        self.note_unread(element, "link", where)
        node.scope.add(name, self._pose(element, where, site), site.default, where)
        node.links.append(LinkNode(element=element, name=name, base=site.base, where=where))

    def _frame(self, element: Element, site: _Site) -> None:
        """A `<frame>`, placed in what it is attached to, or a `<joint>`, placed in its child."""
        name = (element.get("name") or "").strip()
        where = site.where.inside(element.tag, name)
        self._count(where)
        if element.tag == "frame":
            attached = (element.get("attached_to") or "").strip()
        else:
            attached = text_of(element.find("child"))
            site.node.joints.add(element, name)
        if name:
            default = site.default if attached in ("", MODEL) else attached
            pose = self._pose(element, where, site)
            site.node.scope.add(name, pose, default, where)

    def _include(self, element: Element, index: int, site: _Site, gone: frozenset[str]) -> None:
        uri = text_of(element.find("uri"))
        if known := built_in(uri, self.folder, site.where):
            root, path = BUILT_IN[known], site.files[0]
            if root is None:
                return
            files = site.files
        else:
            try:
                path = included_file(uri, site.base, self.folder)
                files = (*site.files, path)
                self._check_circle(path, site, uri)
                root = self.folder.read_xml(path, Where(path))
                model_in(root, Where(path))
            except Unread as error:
                self.folder.skipped.leave_out(error, site.where)
                return
        model = model_in(root, Where(path))
        name = text_of(element.find("name")) or name_of(model, "model", index, Where(path))
        if name in gone:
            return
        inside = replace(site, base=path.parent, files=files)
        merge = (element.get("merge") or "").strip().lower() in ("true", "1")
        (self._merged if merge and site.node.scope.name else self._model)(model, name, inside, element)

    def _check_circle(self, path: Path, site: _Site, uri: str) -> None:
        here = site.where.inside("include", uri)
        if path in site.files:
            raise here.error(f"{shown(path.name)} includes itself: take the <include> out")
        if len(site.files) > MAX_CHAIN:
            raise here.error(f"files include each other more than {MAX_CHAIN} deep: put them together")

    def _model(self, element: Element, name: str, site: _Site, include: Element | None) -> None:
        above = site.node
        taken = above.names
        where = site.where.inside("model", name)
        if name in taken and include is not None and include.find("name") is None:
            free = next(f"{name}_{k}" for k in range(1, len(taken) + 2) if f"{name}_{k}" not in taken)
            self.folder.note("an included model's name is taken, and it is read by another", where, free)
            name, where = free, site.where.inside("model", free)
        elif name in taken:
            raise where.error("its name is taken by another model: give each its own")
        taken.add(name)
        if site.depth >= MAX_NESTED:
            raise where.error(f"models stand in each other more than {MAX_NESTED} deep: flatten them")
        self._count(where)
        self.note_unread(element, "model", where)
        static = flag(element, "static", where)
        if include is not None:
            static = flag(include, "static", where, static)
        says = flag(element, STRUCTURE, where) if element.find(STRUCTURE) is not None else above.structure
        whole = f"{above.scope.whole}::{name}" if above.scope.whole else name
        node = ModelNode(
            scope=Scope(name=name, whole=whole), static=above.static or static, structure=says, where=where
        )
        inner = replace(site, node=node, where=where, default=MODEL, depth=site.depth + 1)
        self._inside(element, inner)
        pose, placed = self._placed(element, include, where, site)
        if placed and not node.scope.has(placed):
            raise where.error(f"its placement_frame is {shown(placed)}, and there is no such frame: correct the name")
        above.scope.add(name, pose, site.default, where, inner=node.scope, placed="" if placed == MODEL else placed)
        above.models.append(node)

    def _placed(self, element: Element, include: Element | None, where: Where, site: _Site) -> tuple[WrittenPose, str]:
        """The pose that a model is given, and the frame in it that this pose places."""
        placed = (element.get("placement_frame") or "").strip()
        if include is not None and include.find("pose") is not None:
            placed = text_of(include.find("placement_frame")) or placed
            return self._pose(include, where, site), placed
        return self._pose(element, where, site), placed

    def _merged(self, element: Element, name: str, site: _Site, include: Element) -> None:
        """An include with merge="true": what is in the model becomes the outer model's own, placed as the model was."""
        proxy = f"_merged__{name}__model__"
        where = site.where.inside("include", name)
        pose, placed = self._placed(element, include, where, site)
        if placed not in ("", MODEL):
            self.folder.note("a placement_frame of a merged include is not read", where, placed)
        site.node.scope.add(proxy, pose, site.default, where)
        if site.depth >= MAX_NESTED:
            raise where.error(f"models stand in each other more than {MAX_NESTED} deep: flatten them")
        self.note_unread(element, "model", where)
        self._inside(element, replace(site, default=proxy, depth=site.depth + 1))
