"""Wavefront OBJ files with their materials, read strictly and in bounded memory."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.plain import shown
from flysim.worlds.model import Material
from flysim.worlds.sdf.elements import Unread, Where
from flysim.worlds.surface.mesh_group import Files, RawGroup, too_many

MAX_LINE = 2**20  # bytes; a longer one would be a polygon of a hundred thousand corners
MAX_MATERIALS = 1000  # of a file


@dataclass(slots=True)
class _Obj:
    """The numbers of a file: millions of them as Python objects would take a hundred times the file."""

    positions: array[float] = field(default_factory=lambda: array("d"))
    texture: array[float] = field(default_factory=lambda: array("d"))
    corners: array[int] = field(default_factory=lambda: array("q"))  # position and texture (-1: none) of each corner
    worn: list[tuple[int, str]] = field(default_factory=list)  # from which number of `corners` on, which material
    libraries: list[str] = field(default_factory=list)

    def read(self, head: bytes, words: list[bytes]) -> None:
        if head == b"v":
            self.positions.extend(float(w) for w in words[:3])
            if len(words) < 3:
                raise ValueError
        elif head == b"vt":
            self.texture.extend(float(w) for w in [*words[:2], b"0"][:2])
            if not words:
                raise ValueError
        elif head == b"f":
            polygon = [_corner(w, len(self.positions) // 3, len(self.texture) // 2) for w in words]
            if len(polygon) < 3:
                raise ValueError
            for second, third in pairwise(polygon[1:]):
                self.corners.extend((*polygon[0], *second, *third))
        elif head in (b"usemtl", b"mtllib") and words:
            name = b" ".join(words).decode("utf-8", "replace")
            if head == b"usemtl":
                self.worn.append((len(self.corners), name))
            elif len(self.libraries) < MAX_MATERIALS:
                self.libraries.append(name)
            if len(self.worn) > 100 * MAX_MATERIALS:
                raise Unread("mesh", "changes its material too often")


def parse_obj(data: bytes, path: Path, max_faces: int, files: Files) -> list[RawGroup]:
    """The triangles of an OBJ by material; texture coordinates where every corner of a group has them.

    Raises:
        Unread: it is damaged, or has too many triangles.
    """
    obj = _Obj()
    for number, head, words, line in _lines(data):
        try:
            obj.read(head, words)
        except ValueError:
            text = shown(line[:60].decode("ascii", "replace"))
            raise Unread("mesh", f"is damaged in its line {number} of data, {text}") from None
        most = max(len(obj.corners) // 2, len(obj.positions) // 3, len(obj.texture) // 2)
        if most > 3 * max_faces:
            raise too_many(max_faces)
    if not obj.corners:
        raise Unread("mesh", "has no faces")
    index = np.frombuffer(obj.corners, dtype=np.int64).reshape(-1, 3, 2)
    known = _materials(obj.libraries, path, files) if obj.worn else {}
    missing = {name for _, name in obj.worn} - known.keys() if known else set()
    for name in sorted(missing):
        files.note("a material of a mesh is not in its library and is left out", Where(path), name)
    groups = _by_material(obj.worn, len(index), known)
    return [_group(obj, index[faces], material) for faces, material in groups]


def _lines(data: bytes) -> Iterator[tuple[int, bytes, list[bytes], bytes]]:
    for number, match in enumerate(re.finditer(rb"[^\r\n]+", data.replace(b"\\\n", b" ")), start=1):
        if match.end() - match.start() > MAX_LINE:
            raise Unread("mesh", f"has a line of more than {MAX_LINE} bytes")
        head, *words = match.group().split(b"#", 1)[0].split() or [b""]
        yield number, head, words, match.group()


def _by_material(
    worn: list[tuple[int, str]], count: int, known: dict[str, Material]
) -> list[tuple[NDArray[np.intp], Material | None]]:
    """Which faces wear which material; one group where there is none."""
    if not known:
        return [(np.arange(count), None)]
    starts = [start // 6 for start, _ in worn]
    of_face = np.full(count, -1)
    names: dict[str, int] = {}
    for (start, end), (_, name) in zip(pairwise([*starts, count]), worn, strict=True):
        of_face[start:end] = names.setdefault(name, len(names)) if name in known else -1
    groups = [
        (np.flatnonzero(of_face == -1), None),
        *((np.flatnonzero(of_face == k), known[n]) for n, k in names.items() if n in known),
    ]
    return [(faces, material) for faces, material in groups if len(faces)]


def _group(obj: _Obj, index: NDArray[np.int64], material: Material | None) -> RawGroup:
    xyz = np.frombuffer(obj.positions, dtype=np.float64).reshape(-1, 3)
    index = index.reshape(-1, 2)
    if (index[:, 1] < 0).any():
        used, inverse = np.unique(index[:, 0], return_inverse=True)
        if len(used) == len(xyz) or material is None:  # all of the file: its vertices stay as they are
            return RawGroup(vertices=xyz, faces=index[:, 0].reshape(-1, 3), material=material)
        return RawGroup(vertices=xyz[used], faces=inverse.reshape(-1, 3), material=material)
    pairs, inverse = np.unique(index, axis=0, return_inverse=True)
    uv = np.frombuffer(obj.texture, dtype=np.float64).reshape(-1, 2)[pairs[:, 1]]
    return RawGroup(vertices=xyz[pairs[:, 0]], faces=inverse.reshape(-1, 3), uv=uv, material=material)


def _corner(word: bytes, vertices: int, textures: int) -> tuple[int, int]:
    """Zero-based indices of `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative ones count back from the last."""
    fields = word.split(b"/")
    position = int(fields[0])
    position = position - 1 if position > 0 else position + vertices
    if not 0 <= position < vertices:
        raise ValueError
    if len(fields) < 2 or not fields[1]:
        return position, -1
    texture = int(fields[1])
    texture = texture - 1 if texture > 0 else texture + textures
    if not 0 <= texture < textures:
        raise ValueError
    return position, texture


def _materials(libraries: list[str], path: Path, files: Files) -> dict[str, Material]:
    """The materials of an OBJ's libraries, by name; what cannot be read is noted."""
    found: dict[str, Material] = {}
    where = Where(path)
    for library in dict.fromkeys(libraries):
        read = files.named(library.replace("\\", "/"), path.parent, "a material library of a mesh", where)
        if read is None:
            continue
        data, at = read
        name, colour, picture = "", Material().diffuse, ""
        for _, head, words, _ in _lines(data):
            if head == b"newmtl":
                _keep(found, name, colour, picture, at, files)
                name, colour, picture = b" ".join(words).decode("utf-8", "replace"), Material().diffuse, ""
            elif head == b"Kd":
                colour = _colour(words) or colour
            elif head.lower() == b"map_kd" and words:
                picture = _picture(words)
        _keep(found, name, colour, picture, at, files)
    return found


def _keep(
    found: dict[str, Material], name: str, colour: tuple[float, float, float], picture: str, at: Path, files: Files
) -> None:
    if not name or len(found) >= MAX_MATERIALS:
        return
    texture = files.picture(picture, at.parent, Where(at)) if picture else None
    found.setdefault(name, Material(diffuse=colour, texture=texture))


def _colour(words: list[bytes]) -> tuple[float, float, float] | None:
    try:
        r, g, b = (min(max(float(word), 0.0), 1.0) for word in words[:3])
    except ValueError:
        return None
    return r, g, b


def _picture(words: list[bytes]) -> str:
    """The file's name behind the options of a `map_Kd`."""
    takes = {b"-o": 3, b"-s": 3, b"-t": 3, b"-mm": 2}
    k = 0
    while k < len(words) - 1 and words[k].startswith(b"-"):
        k += 1 + takes.get(words[k], 1)
    return b" ".join(words[min(k, len(words) - 1) :]).decode("utf-8", "replace").replace("\\", "/")
