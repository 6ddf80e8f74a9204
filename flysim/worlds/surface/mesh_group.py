"""What a mesh file holds: triangles in groups of one material each, and who opens the files that it names."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.worlds.model import Material
from flysim.worlds.sdf.elements import MAX_NUMBER, Unread, Where
from flysim.worlds.shapes import Mesh


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshGroup:
    """Triangles of one material; None: the file says nothing of it."""

    mesh: Mesh
    material: Material | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawGroup:
    """The same as a file has it: `[V, 3]` vertices, `[F, 3]` faces, `[V, 2]` texture coordinates or None."""

    vertices: Array
    faces: NDArray[np.int64]
    uv: Array | None = None
    material: Material | None = None


class Files(Protocol):
    """Opens what a mesh file names, within a world's limits; what it cannot open it names in a warning."""

    def named(self, uri: str, base: Path, what: str, where: Where) -> tuple[bytes, Path] | None:
        """The content of a file and its path; None where it cannot be read, which is noted."""
        ...

    def picture(self, uri: str, base: Path, where: Where) -> Path | None:
        """The path of a sound picture; None where it cannot be read, which is noted."""
        ...

    def note(self, kind: str, where: Where, detail: str = "") -> None:
        """Counts one more of what is passed over."""
        ...


def too_many(max_faces: int) -> Unread:
    """What is said of a mesh that is too large."""
    return Unread("mesh", f"takes the world over its limit of triangles or vertices ({max_faces} left)")


def scaled(raw: RawGroup, scale: tuple[float, float, float], path: Path) -> MeshGroup | None:
    """A group as the world has it: scaled, faces turned where that mirrors; None where no triangle has an area.

    Raises:
        Unread: a coordinate that cannot be.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = raw.vertices * np.array(scale)
    faces, uv = raw.faces, raw.uv
    if not (np.abs(vertices) <= MAX_NUMBER).all() or (uv is not None and not (np.abs(uv) <= MAX_NUMBER).all()):
        raise Unread("mesh", f"has a coordinate that is NaN or more than {MAX_NUMBER:.0e}, or its <scale>")
    if np.prod(np.sign(scale)) < 0:
        faces = faces[:, ::-1]
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    faces = faces[area > 0.0]
    if not len(faces):
        return None
    return MeshGroup(
        mesh=Mesh(vertices=vertices, faces=faces.astype(np.int32), uv=uv, path=path), material=raw.material
    )


def merged(groups: tuple[MeshGroup, ...]) -> MeshGroup:
    """All triangles as one group without a material; texture coordinates where every group has them."""
    starts = np.cumsum([0, *(len(group.mesh.vertices) for group in groups)])
    faces = [group.mesh.faces + start for group, start in zip(groups, starts[:-1].tolist(), strict=True)]
    uvs = [group.mesh.uv for group in groups if group.mesh.uv is not None]
    return MeshGroup(
        mesh=Mesh(
            vertices=np.concatenate([group.mesh.vertices for group in groups]),
            faces=np.concatenate(faces).astype(np.int32),
            uv=np.concatenate(uvs) if len(uvs) == len(groups) else None,
            path=groups[0].mesh.path,
        )
    )
