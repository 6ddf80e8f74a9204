"""The folder of a world: nothing outside it is opened, and what is inside may only be so large."""

from __future__ import annotations

import gzip
import io
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import TreeBuilder

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import ParseError, XMLParser, iterparse

from flysim.errors import WorldError
from flysim.foreign.files import read_bytes
from flysim.foreign.image import check_png, png_size
from flysim.plain import shown
from flysim.worlds.sdf.elements import Where
from flysim.worlds.shapes import Mesh
from flysim.worlds.surface.mesh_file import parse_mesh

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_FILE_BYTES = 64 * 2**20  # of each XML (after decompression) and mesh file
MAX_ELEMENTS = 1_000_000  # XML elements of a world with all it includes; one takes about 0.3 kB
MAX_ATTRIBUTES = 1_000_000
MAX_DEPTH = 64  # nested XML elements
MAX_FACES = 2_000_000  # triangles of all meshes of a world
MAX_TEXTURE_PIXELS = 2 * 8192 * 8192  # of all textures of a world


def _megabytes(count: int) -> str:
    return f"{count / 2**20:.0f} MB"


@dataclass(slots=True)
class WorldFolder:
    """Opens a world's files and counts what they take of its limits. One for each `read_world`."""

    root: Path
    elements: int = 0
    faces: int = 0
    pixels: int = 0
    _documents: dict[Path, tuple[Element, int]] = field(default_factory=dict)
    _meshes: dict[tuple[Path, tuple[float, ...]], Mesh] = field(default_factory=dict)
    _textures: set[Path] = field(default_factory=set)

    def find(self, uri: str, base: Path, where: Where) -> Path:
        """The real path of `uri` inside the folder; it need not exist.

        `uri` is a path relative to `base`, the folder of the file that names it, or to the world's folder;
        `file://` or `model://` may stand before it.
        """
        scheme, mark, rest = uri.partition("://")
        if not mark:
            scheme, rest = "", uri
        if scheme not in ("", "file", "model"):
            raise where.error(
                f"{shown(uri)} is not read: use a path inside the world's folder, with file://, model:// or neither"
            )
        parts = rest.split("/")
        if not rest.strip() or rest.startswith("/") or ".." in parts or any(c in rest for c in "\\:\0"):
            raise where.error(
                f"{shown(uri)} is not a plain path inside the world's folder: "
                "use a relative one without '..', such as textures/box.png"
            )
        candidates = [base / rest, self.root / rest]
        if scheme == "model":
            candidates.append(self.root / "models" / rest)
            if parts[0] == self.root.name and len(parts) > 1:
                candidates.append(self.root.joinpath(*parts[1:]))
        try:
            path = next((c for c in candidates if c.exists()), candidates[0]).resolve()
        except (OSError, RuntimeError) as error:  # a name too long, a loop of links
            raise where.error(f"{shown(uri)} cannot be resolved ({type(error).__name__}): rename it") from None
        if not path.is_relative_to(self.root):
            raise where.error(f"{shown(uri)} leads out of the world's folder: copy the file into it")
        return path

    def read_bytes(self, path: Path, what: str, where: Where) -> bytes:
        """The content of a regular file of at most 64 MB that is not empty."""
        label = f"{what} {shown(path.name)}"
        try:
            if path.is_dir():
                raise where.error(f"{label} is a folder: name the file in it")
            if not path.is_file():
                raise where.error(f"{label} does not exist: check the name, or add the file")
            if path.stat().st_size > MAX_FILE_BYTES:
                raise where.error(f"{label} is larger than {_megabytes(MAX_FILE_BYTES)}: make it smaller")
        except OSError as error:
            reason = error.strerror or type(error).__name__
            raise where.error(f"{label} cannot be read ({reason})") from None
        data = read_bytes(path, what, MAX_FILE_BYTES, WorldError)
        if not data:
            raise where.error(f"{label} is empty: write it again")
        return data

    def read_xml(self, path: Path, where: Where) -> Element:
        """The root element of an XML file, gzipped or not. Reading it again costs its elements again."""
        if path not in self._documents:
            data = _gunzip(self.read_bytes(path, "file", where), where)
            self._documents[path] = _parse_xml(data, MAX_ELEMENTS - self.elements, where)
        root, count = self._documents[path]
        self.elements += count
        if self.elements > MAX_ELEMENTS:
            raise where.error(f"the world has more than {MAX_ELEMENTS} XML elements with its includes: split it")
        return root

    def texture(self, uri: str, base: Path, where: Where) -> Path:
        """The path of a sound 8-bit PNG of at most 8192 x 8192 px."""
        path = self.find(uri, base, where)
        if path in self._textures:
            return path
        data = self.read_bytes(path, "texture", where)
        label = f"texture {shown(uri)}"
        try:
            width, height = png_size(data)  # by its header: nothing is decoded before it is known to be small
        except ValueError as error:
            raise where.error(f"{label} {error}") from None
        self.pixels += width * height
        if self.pixels > MAX_TEXTURE_PIXELS:
            raise where.error(f"{label} makes the textures more than {MAX_TEXTURE_PIXELS} px in all: scale them down")
        try:
            check_png(data)
        except ValueError as error:
            raise where.error(f"{label} {error}") from None
        self._textures.add(path)
        return path

    def mesh(self, uri: str, scale: tuple[float, float, float], base: Path, where: Where) -> Mesh:
        """An OBJ or STL mesh, scaled; the same record for the same file and scale."""
        path = self.find(uri, base, where)
        key = (path, scale)
        if key not in self._meshes:
            data = self.read_bytes(path, "mesh", where)
            mesh = parse_mesh(data, path, scale, MAX_FACES - self.faces, where)
            self.faces += len(mesh.faces)
            self._meshes[key] = mesh
        return self._meshes[key]


def _gunzip(data: bytes, where: Where) -> bytes:
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
            plain = stream.read(MAX_FILE_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise where.error(f"is damaged gzip ({error}): pack it again") from None
    if len(plain) > MAX_FILE_BYTES:
        raise where.error(f"unpacks to more than {_megabytes(MAX_FILE_BYTES)}: make it smaller")
    if not plain:
        raise where.error("is empty once unpacked: write it again")
    return plain


def _parse_xml(data: bytes, max_elements: int, where: Where) -> tuple[Element, int]:
    """The root element and how many there are. UTF-8 alone, so that the counts below hold."""
    # A "<" begins each element and a "=" is in each attribute: memory is bounded before anything is parsed.
    if data.count(b"<") > 2 * max_elements + 16 or data.count(b"=") > MAX_ATTRIBUTES:
        raise where.error(f"has more than {max_elements} XML elements, or too many attributes: split it")
    root: Element | None = None
    count = depth = 0
    try:
        # The parser is made here: iterparse's own takes the encoding that the file declares.
        parser = XMLParser(target=TreeBuilder(), encoding="utf-8", forbid_dtd=True)
        for event, element in iterparse(io.BytesIO(data), events=("start", "end"), parser=parser):
            if event == "end":
                depth -= 1
                continue
            root = element if root is None else root
            count, depth = count + 1, depth + 1
            if depth > MAX_DEPTH:
                raise where.error(f"has XML elements nested deeper than {MAX_DEPTH}: flatten it")
    except DefusedXmlException:
        raise where.error("declares a DTD or entities, which are not read: remove the <!DOCTYPE ...>") from None
    except ParseError as error:
        raise where.error(f"is not well-formed UTF-8 XML ({error}): correct it") from None
    if root is None or count > max_elements:
        raise where.error(f"has {count} XML elements, 1 to {max_elements} are read: split it")
    return root, count
