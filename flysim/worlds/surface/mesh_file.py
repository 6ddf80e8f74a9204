"""OBJ and STL files, read strictly and in bounded memory. The other files they name are not opened."""

from __future__ import annotations

import re
from array import array
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.errors import WorldError
from flysim.plain import shown
from flysim.worlds.sdf.elements import MAX_NUMBER, Where
from flysim.worlds.shapes import Mesh

MAX_LINE = 2**20  # bytes; a longer one would be a polygon of a hundred thousand corners
_STL_RECORD = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])


def parse_mesh(data: bytes, path: Path, scale: tuple[float, float, float], max_faces: int, where: Where) -> Mesh:
    """A mesh file's bytes as a scaled `Mesh`.

    Args:
        data: the file's content.
        path: of the file; its suffix tells the format.
        scale: factor along x, y, z; a negative one mirrors, and the faces are turned to stay outward.
        max_faces: triangles that are left to the world.
        where: the element that names the file.

    Raises:
        WorldError: another format than OBJ and STL, damaged data, no area, or too many triangles.
    """
    where = where.inside("mesh", path.name)
    suffix = path.suffix.lower()
    if suffix == ".obj":
        vertices, faces, uv = _parse_obj(data, max_faces, where)
    elif suffix == ".stl":
        vertices, faces = _parse_stl(data, max_faces, where)
        uv = None
    else:
        raise where.error(f"format {shown(suffix)} is not read: export it as .obj or .stl")
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = vertices * np.array(scale)
    if not (np.abs(vertices) <= MAX_NUMBER).all() or (uv is not None and not (np.abs(uv) <= MAX_NUMBER).all()):
        raise where.error(f"has a coordinate that is NaN or more than {MAX_NUMBER:.0e}: correct it, or the <scale>")
    if np.prod(np.sign(scale)) < 0:
        faces = faces[:, ::-1]
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    faces = faces[area > 0.0]
    if not len(faces):
        raise where.error("has no triangle with an area: export it again")
    return Mesh(vertices=vertices, faces=faces.astype(np.int32), uv=uv, path=path)


def _too_many(max_faces: int, where: Where) -> WorldError:
    return where.error(f"takes the world over its limit of triangles or vertices ({max_faces} left): simplify it")


def _parse_obj(
    data: bytes, max_faces: int, where: Where
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64] | None]:
    """Vertices, triangles and texture coordinates (None unless every corner has one) of a Wavefront OBJ."""
    positions, texture = array("d"), array("d")
    corners = array("q")  # position and texture index of each corner of each triangle; -1: no texture index
    # Millions of numbers as Python objects would take a hundred times the file: arrays, line by line.
    for number, match in enumerate(re.finditer(rb"[^\r\n]+", data.replace(b"\\\n", b" ")), start=1):
        if match.end() - match.start() > MAX_LINE:
            raise where.error(f"has a line of more than {MAX_LINE} bytes: export it again as triangles")
        head, *words = match.group().split(b"#", 1)[0].split() or [b""]
        try:
            if head == b"v":
                positions.extend(float(w) for w in words[:3])
                if len(words) < 3:
                    raise ValueError
            elif head == b"vt":
                texture.extend(float(w) for w in words[:2])
                if len(words) < 2:
                    raise ValueError
            elif head == b"f":
                polygon = [_corner(w, len(positions) // 3, len(texture) // 2) for w in words]
                if len(polygon) < 3:
                    raise ValueError
                for second, third in pairwise(polygon[1:]):
                    corners.extend((*polygon[0], *second, *third))
        except ValueError:
            line = shown(match.group()[:60].decode("ascii", "replace"))
            raise where.error(f"is damaged in its line {number} of data, {line}: export it again") from None
        if len(corners) > 6 * max_faces or len(positions) > 9 * max_faces or len(texture) > 6 * max_faces:
            raise _too_many(max_faces, where)
    if not corners:
        raise where.error("has no faces: export it again")
    xyz = np.frombuffer(positions, dtype=np.float64).reshape(-1, 3)
    index = np.frombuffer(corners, dtype=np.int64).reshape(-1, 2)
    if (index[:, 1] < 0).any():
        return xyz, index[:, 0].reshape(-1, 3), None
    pairs, inverse = np.unique(index, axis=0, return_inverse=True)
    uv = np.frombuffer(texture, dtype=np.float64).reshape(-1, 2)[pairs[:, 1]]
    return xyz[pairs[:, 0]], inverse.reshape(-1, 3), uv


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


def _parse_stl(data: bytes, max_faces: int, where: Where) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and triangles of a binary or text STL."""
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + count * _STL_RECORD.itemsize:
        if count > max_faces:
            raise _too_many(max_faces, where)
        vertices = np.frombuffer(data, _STL_RECORD, offset=84)["vertices"].astype(np.float64).reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid":
        values = array("d")
        try:
            for match in re.finditer(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", data):
                values.extend(float(word) for word in match.groups())
                if len(values) > 9 * max_faces:
                    raise _too_many(max_faces, where)
        except ValueError:
            raise where.error("has a vertex that is no three numbers: export it again") from None
        if len(values) % 9:
            raise where.error("has a facet without three vertices: export it again")
        vertices = np.frombuffer(values, dtype=np.float64).reshape(-1, 3) if values else np.empty((0, 3))
    else:
        raise where.error("is no STL: its length is not what its header says, and it has no 'solid' line")
    if not len(vertices):
        raise where.error("has no faces: export it again")
    merged, inverse = np.unique(vertices, axis=0, return_inverse=True)
    return merged, inverse.reshape(-1, 3)
