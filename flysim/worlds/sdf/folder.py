"""The folders of a world: nothing outside them is opened, and what is inside may only be so large."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from flysim.errors import WorldError
from flysim.foreign.files import read_bytes
from flysim.foreign.image import check_texture, texture_size
from flysim.plain import shown, shown_path
from flysim.worlds.sdf.document import parse_xml, unpacked
from flysim.worlds.sdf.elements import Unread, Where
from flysim.worlds.sdf.skipped import Skipped
from flysim.worlds.surface.mesh_file import parse_mesh
from flysim.worlds.surface.mesh_group import MeshGroup

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_FILE_BYTES = 64 * 2**20  # of each XML (after decompression) and mesh file
MAX_ALL_BYTES = 2**30  # of all files of a world
MAX_ELEMENTS = 1_000_000  # XML elements of a world with all it includes; one takes about 0.3 kB
MAX_FACES = 2_000_000  # triangles of all meshes of a world
MAX_TEXTURE_PIXELS = 2 * 8192 * 8192  # of all textures of a world
WORLDS, MODELS = ("worlds", "world"), "models"
UP = 3  # folders between a world's file and its package at most
FROM_ENVIRONMENT = "env"
VARIABLES = ("GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH")

NO_MESH = "a mesh cannot be read and its part is left out"
NO_TEXTURE = "a texture cannot be read and its visual is bare"


def model_folders(asked: Iterable[str | Path]) -> tuple[Path, ...]:
    """The folders of `--models`: each as it is, and for "env" those that Gazebo's variables name.

    Raises:
        WorldError: one that is asked for is no folder.
    """
    found: dict[Path, None] = {}
    for one in asked:
        if str(one) == FROM_ENVIRONMENT:
            for variable in VARIABLES:
                found |= {Path(p).resolve(): None for p in os.environ.get(variable, "").split(":") if p and _is_dir(p)}
        elif _is_dir(one):
            found[Path(one).resolve()] = None
        else:
            raise WorldError(f"--models {shown_path(one)}: there is no such folder. Give one that holds models.")
    return tuple(found)


def _is_dir(path: str | Path) -> bool:
    try:
        return Path(path).is_dir()
    except (OSError, ValueError):
        return False


def beside_worlds(root: Path) -> tuple[Path, ...]:
    """`models/` beside the folder `worlds/` that a world's folder is, or lies in; nothing that links out of there."""
    for folder in (root, *root.parents)[:UP]:
        if folder.name.lower() in WORLDS:
            models = folder.parent / MODELS
            if _is_dir(models) and models.resolve().is_relative_to(folder.parent):
                return (models.resolve(),)
    return ()


@dataclass(slots=True)
class WorldFolder:
    """Opens a world's files and counts what they take of its limits. One for each `read_world`."""

    root: Path
    models: tuple[Path, ...] = ()  # where models are looked for besides
    skipped: Skipped = field(default_factory=Skipped)
    elements: int = 0
    faces: int = 0
    pixels: int = 0
    bytes: int = 0
    _documents: dict[Path, tuple[Element, int]] = field(default_factory=dict)
    _meshes: dict[tuple[Path, tuple[float, ...]], tuple[MeshGroup, ...] | Unread] = field(default_factory=dict)
    _textures: dict[Path, Unread | None] = field(default_factory=dict)

    def find(self, uri: str, base: Path, kind: str) -> Path:
        """The real path of `uri` inside the folders; it need not exist.

        `uri` is a path relative to `base`, the folder of the file that names it, or to the world's folder;
        `file://` or `model://` may stand before it.

        Raises:
            Unread: of that kind: it leads elsewhere.
        """
        scheme, mark, rest = uri.partition("://")
        if not mark:
            scheme, rest = "", uri
        if scheme not in ("", "file", "model"):
            raise Unread(kind, f"{uri}: not in the world's folder")
        parts = rest.split("/")
        if not rest.strip() or rest.startswith("/") or ".." in parts or any(c in rest for c in "\\:\0"):
            return self._upwards(rest, uri, base, kind)
        candidates = [base / rest, self.root / rest]
        if scheme == "model":
            candidates += [folder / rest for folder in (self.root / MODELS, *self.models)]
            candidates += [f.joinpath(*parts[1:]) for f in (self.root, base) if parts[0] == f.name and len(parts) > 1]
        try:
            path = next((c for c in candidates if c.exists()), candidates[0]).resolve()
        except (OSError, RuntimeError) as error:  # a name too long, a loop of links
            raise Unread(kind, f"{uri}: cannot be resolved ({type(error).__name__})") from None
        return self._inside(path, uri, kind)

    def _upwards(self, rest: str, uri: str, base: Path, kind: str) -> Path:
        """A path with `..` in it, as of a mesh that names `../textures/a.png`, which stays inside."""
        plain = rest.strip() and not rest.startswith("/") and not any(c in rest for c in "\\:\0")
        path = Path(os.path.normpath(base / rest)) if plain else None
        if path is None or not self._holds(path):
            raise Unread(kind, f"{uri}: not a path inside the world's folder")
        try:
            return self._inside(path.resolve(), uri, kind)
        except (OSError, RuntimeError) as error:
            raise Unread(kind, f"{uri}: cannot be resolved ({type(error).__name__})") from None

    def _holds(self, path: Path) -> bool:
        return any(path.is_relative_to(folder) for folder in (self.root, *self.models))

    def _inside(self, path: Path, uri: str, kind: str) -> Path:
        if not self._holds(path):
            raise Unread(kind, f"{uri}: leads out of the world's folder")
        return path

    def read_part(self, path: Path, what: str, uri: str, kind: str) -> bytes:
        """The content of a regular file of at most 64 MB that is not empty.

        Raises:
            Unread: of that kind.
            WorldError: the world's files are too large in all.
        """
        try:
            return self.read_bytes(path, what, Where(path))
        except Unread as error:
            raise Unread(kind, f"{uri}: {error.detail}") from None

    def read_bytes(self, path: Path, what: str, where: Where) -> bytes:
        """The content of a regular file of at most 64 MB that is not empty.

        Raises:
            Unread: there is none.
            WorldError: the world's files are too large in all.
        """
        try:
            if path.is_dir():
                raise Unread(what, "is a folder")
            if not path.is_file():
                raise Unread(what, "does not exist")
            if path.stat().st_size > MAX_FILE_BYTES:
                raise Unread(what, f"is larger than {MAX_FILE_BYTES / 2**20:.0f} MB")
            data = read_bytes(path, what, MAX_FILE_BYTES, WorldError)
        except (OSError, WorldError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise Unread(what, f"cannot be read ({reason})") from None
        if not data:
            raise Unread(what, "is empty")
        self.bytes += len(data)
        if self.bytes > MAX_ALL_BYTES:
            raise where.error(f"the world's files are larger than {MAX_ALL_BYTES / 2**20:.0f} MB in all: split it")
        return data

    def read_xml(self, path: Path, where: Where) -> Element:
        """The root element of an XML file, gzipped or not. Reading it again costs its elements again."""
        if path not in self._documents:
            try:
                data = self.read_bytes(path, "file", where)
            except Unread as error:
                raise where.error(
                    f"file {shown(path.name)} {error.detail}: check the name, or write it again"
                ) from None
            data = unpacked(data, MAX_FILE_BYTES, where)
            self._documents[path] = parse_xml(data, MAX_ELEMENTS - self.elements, where)
        root, count = self._documents[path]
        self.elements += count
        if self.elements > MAX_ELEMENTS:
            raise where.error(f"the world has more than {MAX_ELEMENTS} XML elements with its includes: split it")
        return root

    def texture(self, uri: str, base: Path) -> Path:
        """The path of a sound picture of at most 8192 x 8192 px.

        Raises:
            Unread: it is none, or the textures are too large in all.
        """
        path = self.find(uri, base, NO_TEXTURE)
        if path not in self._textures:
            try:
                self._textures[path] = self._checked(path, uri)
            except Unread as error:
                self._textures[path] = error
        known = self._textures[path]
        if known is not None:
            raise known
        return path

    def _checked(self, path: Path, uri: str) -> None:
        data = self.read_part(path, "texture", uri, NO_TEXTURE)
        try:
            width, height = texture_size(data)  # by its header: nothing is decoded before it is known to be small
        except ValueError as error:
            raise Unread(NO_TEXTURE, f"{uri}: {error}") from None
        if self.pixels + width * height > MAX_TEXTURE_PIXELS:
            raise Unread(NO_TEXTURE, f"{uri}: makes the textures more than {MAX_TEXTURE_PIXELS} px in all")
        self.pixels += width * height
        try:
            check_texture(data)
        except ValueError as error:
            raise Unread(NO_TEXTURE, f"{uri}: {error}") from None

    def mesh(self, uri: str, scale: tuple[float, float, float], base: Path) -> tuple[MeshGroup, ...]:
        """A mesh, scaled, in groups of one material each; the same records for the same file and scale.

        Raises:
            Unread: it cannot be read, or the meshes are too large in all.
        """
        path = self.find(uri, base, NO_MESH)
        key = (path, scale)
        if key not in self._meshes:
            try:
                data = self.read_part(path, "mesh", uri, NO_MESH)
                groups = parse_mesh(data, path, scale, MAX_FACES - self.faces, self)
                self.faces += sum(len(group.mesh.faces) for group in groups)
                self._meshes[key] = groups
            except Unread as error:
                self._meshes[key] = Unread(NO_MESH, f"{uri}: {error.detail.removeprefix(f'{uri}: ')}")
        known = self._meshes[key]
        if isinstance(known, Unread):
            raise known
        return known

    def named(self, uri: str, base: Path, what: str, where: Where) -> tuple[bytes, Path] | None:
        """The content of a file that a mesh names and its path; None where it cannot be read, which is noted."""
        kind = f"{what} cannot be read and is left out"
        try:
            path = self.find(uri, base, kind)
            return self.read_part(path, what, uri, kind), path
        except Unread as error:
            self.skipped.leave_out(error, where)
            return None

    def picture(self, uri: str, base: Path, where: Where) -> Path | None:
        """The path of a sound picture that a mesh names; None where it cannot be read, which is noted.

        Gazebo looks for it beside the mesh, and in its model's `materials/textures` too.
        """
        name = uri.replace("%20", " ").rpartition("/")[2]
        first: Unread | None = None
        for one in (uri, name, f"../materials/textures/{name}"):
            try:
                if self.find(one, base, NO_TEXTURE).is_file():
                    return self.texture(one, base)
                first = first or Unread(NO_TEXTURE, f"{uri}: does not exist")
            except Unread as error:
                first = first or error
        if first is not None:
            self.skipped.leave_out(first, where)
        return None

    def note(self, kind: str, where: Where, detail: str = "") -> None:
        """Counts one more of what is passed over."""
        self.skipped.note(kind, where, detail)
