"""The triangles a shape is drawn with, and OBJ files of them that every renderer reads alike."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flysim.geometry.frames import frozen
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere
from flysim.worlds.surface.atlas import atlas_patches, atlas_size, box_uv

SAGITTA = 1e-4  # [m] the chords of a round shape are at most this far inside it
MIN_SEGMENTS, MAX_SEGMENTS = 24, 720


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TriangleMesh:
    """Triangles for drawing. Corners that differ in normal or texture coordinate are vertices of their own.

    Attributes:
        vertices: `[V, 3]` float32 [m], shape's frame.
        normals: `[V, 3]` float32 unit vectors, outward: flat on boxes, smooth on round shapes.
        uv: `[V, 2]` float32 in [0, 1], (0, 0) at the texture's left lower corner, as in OBJ and OpenGL.
        faces: `[F, 3]` int32, counter-clockwise from outside.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    uv: NDArray[np.float32]
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        for name, dtype in (
            ("vertices", np.float32),
            ("normals", np.float32),
            ("uv", np.float32),
            ("faces", np.int32),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype))


def segments(radius: float, sagitta: float = SAGITTA) -> int:
    """Sides of the polygon for a circle: a multiple of four, so that it touches all four extremes."""
    least = MIN_SEGMENTS if sagitta <= SAGITTA else MIN_SEGMENTS // 2
    if radius <= sagitta:
        return least
    exact = math.pi / math.acos(1.0 - sagitta / radius)
    return min(max(4 * math.ceil(exact / 4.0), least), MAX_SEGMENTS)


def surface_mesh(shape: Shape, sagitta: float = SAGITTA) -> TriangleMesh:
    """The surface of a shape, with the texture wrapped over it as `flysim.worlds.surface.atlas` lays it out.

    Chords of a round shape are at most `sagitta` [m] inside it: small images need no finer ones.
    """
    if isinstance(shape, Plane):
        corners = shape.outline()
        uv = corners[:, :2] / np.array(shape.size) + 0.5
        return _mesh(corners, np.tile([0.0, 0.0, 1.0], (4, 1)), uv, [[0, 1, 2], [0, 2, 3]])
    if isinstance(shape, Box):
        return _box(shape)
    if isinstance(shape, Cylinder):
        return _cylinder(shape, sagitta)
    if isinstance(shape, Sphere):
        return _sphere(shape, sagitta)
    return _file_mesh(shape)


def _mesh(vertices: ArrayLike, normals: ArrayLike, uv: ArrayLike, faces: ArrayLike) -> TriangleMesh:
    return TriangleMesh(
        vertices=np.asarray(vertices, np.float32),
        normals=np.asarray(normals, np.float32),
        uv=np.asarray(uv, np.float32),
        faces=np.asarray(faces, np.int32),
    )


def _box(shape: Box) -> TriangleMesh:
    vertices, normals = [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            normal = np.zeros(3)
            normal[axis] = sign
            # The next two axes make a right-handed pair about +axis; the pair turns round for the other side.
            first, second = (axis + 1) % 3, (axis + 2) % 3
            for a, b in ((-1.0, -1.0), (sign, -sign), (1.0, 1.0), (-sign, sign)):
                corner = normal.copy()
                corner[first], corner[second] = a, b
                vertices.append(corner * np.array(shape.size) / 2.0)
                normals.append(normal)
    quads = np.arange(24).reshape(6, 4)
    uv = box_uv(np.array(vertices), np.array(normals), shape.size)
    return _mesh(vertices, normals, uv, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))


def _grid(columns: int, rows: int, first: int = 0) -> NDArray[np.int32]:
    """Triangles of a grid of vertices that runs left to right, then bottom to top, seen from outside."""
    index = first + np.arange(columns * rows).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    return np.concatenate(faces).astype(np.int32)


def _cylinder(shape: Cylinder, sagitta: float) -> TriangleMesh:
    n, r, half = segments(shape.radius, sagitta), shape.radius, shape.length / 2.0
    turn = np.arange(n + 1) / n
    circle = np.stack([np.cos(turn * math.tau - math.pi), np.sin(turn * math.tau - math.pi)], axis=1)
    circle[-1] = circle[0]
    side, top, bottom = atlas_patches(shape)
    vertices, normals, uv, faces = [], [], [], [_grid(n + 1, 2)]
    for z, v in ((-half, side.origin[1]), (half, side.origin[1] + side.size[1])):
        vertices.append(np.c_[circle * r, np.full(n + 1, z)])
        normals.append(np.c_[circle, np.zeros(n + 1)])
        uv.append(np.c_[turn * side.size[0], np.full(n + 1, v)])
    for patch, sign in ((top, 1.0), (bottom, -1.0)):
        first = sum(len(v) for v in vertices)
        disc = np.concatenate([[[0.0, 0.0]], circle[:n]]) * r
        vertices.append(np.c_[disc, np.full(n + 1, sign * half)])
        normals.append(np.tile([0.0, 0.0, sign], (n + 1, 1)))
        uv.append(disc * [1.0, sign] + np.array(patch.origin) + r)
        rim = first + 1 + np.arange(n)
        fan = np.stack([np.full(n, first), rim, np.roll(rim, -1)], axis=1)
        faces.append((fan if sign > 0.0 else fan[:, ::-1]).astype(np.int32))
    texture = np.clip(np.concatenate(uv) / atlas_size(shape), 0.0, 1.0)
    return _mesh(np.concatenate(vertices), np.concatenate(normals), texture, np.concatenate(faces))


def _sphere(shape: Sphere, sagitta: float) -> TriangleMesh:
    n = segments(shape.radius, sagitta)
    u, v = np.meshgrid(np.arange(n + 1) / n, np.arange(n // 2 + 1) / (n // 2))
    longitude, latitude = (u % 1.0) * math.tau - math.pi, (v - 0.5) * math.pi
    ring = np.where((v == 0.0) | (v == 1.0), 0.0, np.cos(latitude))
    unit = np.stack([ring * np.cos(longitude), ring * np.sin(longitude), np.sin(latitude)], axis=-1).reshape(-1, 3)
    faces = _grid(n + 1, n // 2 + 1)
    # At the poles one of the two triangles of each quad has no area.
    points = unit[faces].astype(np.float32)
    flat = (points[:, 0] == points[:, 1]).all(1) | (points[:, 1] == points[:, 2]).all(1)
    flat |= (points[:, 2] == points[:, 0]).all(1)
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    return _mesh(unit * shape.radius, unit, uv, faces[~flat])


def _file_mesh(shape: Mesh) -> TriangleMesh:
    corners = shape.vertices[shape.faces]  # [F, 3, 3]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    vertices, normals = corners.reshape(-1, 3), np.repeat(normal, 3, axis=0)
    if shape.uv is not None:
        uv = shape.uv[shape.faces].reshape(-1, 2)
    else:
        low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
        x, y, z = np.maximum(high - low, 1e-3)
        uv = box_uv(vertices - (low + high) / 2.0, normals, (float(x), float(y), float(z)))
    faces = np.arange(len(vertices)).reshape(-1, 3)
    # The file's own coordinates may leave [0, 1] on purpose: the picture then repeats.
    return _mesh(vertices, normals, uv, faces)


def write_obj(
    mesh: TriangleMesh, texture: NDArray[np.uint8] | None, diffuse: tuple[float, float, float], path: Path
) -> Path:
    """Writes `<path>`, beside it its `.mtl` and, for a textured mesh, its `.bmp`.

    Renderers cache meshes and textures by file name: use a path once in a process. Its name stands in the files: let
    it be one of flysim's own, of letters, digits and `_`.

    Args:
        mesh: what to draw.
        texture: `[H, W, 3]` RGB to draw on it, in its own colours; None: draw in the colour `diffuse`.
        diffuse: RGB in [0, 1].
        path: of the OBJ file, in an existing folder.

    Returns:
        The path of the OBJ file.

    Raises:
        OSError: a file cannot be written.
    """
    name = path.stem
    material = ["newmtl surface", "Ka 0 0 0", "Ks 0 0 0"]
    if texture is None:
        material.append("Kd {:.6g} {:.6g} {:.6g}".format(*diffuse))
    else:
        from PIL import Image

        # Pillow takes 25 times as long for a PNG, and Bullet twice as long to read it.
        encoded = io.BytesIO()
        Image.fromarray(texture).save(encoded, "BMP")
        path.with_suffix(".bmp").write_bytes(encoded.getvalue())
        material += ["Kd 1 1 1", f"map_Kd {name}.bmp"]
    path.with_suffix(".mtl").write_text("\n".join(material) + "\n", encoding="ascii")
    lines = [f"mtllib {name}.mtl", "usemtl surface"]
    lines += ["v {:.9g} {:.9g} {:.9g}".format(*row) for row in mesh.vertices.tolist()]
    lines += ["vt {:.9g} {:.9g}".format(*row) for row in mesh.uv.tolist()]
    lines += ["vn {:.7g} {:.7g} {:.7g}".format(*row) for row in mesh.normals.tolist()]
    lines += ["f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}".format(*row) for row in (mesh.faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path
