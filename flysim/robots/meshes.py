"""The meshes that a URDF names: found in the robot's folder or package, read by the reader of the worlds' meshes."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from flysim.errors import WorldError
from flysim.plain import shortened, shown
from flysim.robots.package import package_of
from flysim.worlds.sdf.elements import Unread, Where
from flysim.worlds.sdf.folder import WorldFolder
from flysim.worlds.shapes import Box, Mesh

CORNERS = 256  # of a convex hull: Bullet asks each of them at every contact
MIN_THICK = 1e-3  # [m] of what stands for a flat mesh


class UnreadMeshError(Exception):
    """A mesh cannot be read; in words, why."""


class Meshes:
    """Reads meshes for one robot, within the limits of a world's."""

    def __init__(self, urdf: Path) -> None:
        """A robot's meshes lie in its package, or else beside it."""
        here = urdf.resolve().parent
        self.root = package_of(here)
        self._here, self._where = here, Where(urdf)
        self._folder = WorldFolder(root=self.root)

    def read(self, uri: str, scale: tuple[float, float, float]) -> Mesh:
        """The mesh at a path, a `package://`, a `model://` or a `file://`.

        Raises:
            UnreadMeshError: it is not there, leads out of the robot's folder, or cannot be read.
        """
        name = shown(uri)
        found = self._find(uri.strip())
        if found is None:
            raise UnreadMeshError(f"{name} is not in the robot's folder")
        try:
            return _one([group.mesh for group in self._folder.mesh(found, scale, self.root)])
        except Unread as error:
            reason = error.detail.removeprefix(f"{found}: ").rstrip(".")
        except WorldError as error:
            reason = str(error).removeprefix(str(self._where.file)).lstrip(": ").rstrip(".")
        raise UnreadMeshError(shortened(f"{name}: {reason}", 150))

    def _find(self, uri: str) -> str | None:
        """The path from the root of what `uri` names, if there is such a file."""
        scheme, mark, rest = uri.partition("://")
        if not mark:
            scheme, rest = "", uri
        if not rest or any(c in rest for c in "\\\0") or len(rest) > 1000:
            return None
        if scheme in ("package", "model"):
            package, _, inside = rest.partition("/")
            places = [self.root / package / inside, self._here / package / inside, self.root / inside]
            if package == self.root.name:
                places.reverse()
        elif scheme in ("", "file"):
            places = [self._here / rest]  # of an absolute path, that path
        else:
            return None
        for place in places:
            path = Path(os.path.normpath(place))
            try:
                if path.is_relative_to(self.root) and path.is_file():
                    return path.relative_to(self.root).as_posix()
            except (OSError, ValueError):  # a name too long
                continue
        return None


def _one(meshes: list[Mesh]) -> Mesh:
    """The groups of a file as one mesh: a robot is drawn in its links' colours, not in those of its meshes."""
    if len(meshes) == 1:
        return meshes[0]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    return replace(meshes[0], vertices=vertices, faces=np.concatenate(faces), uv=None)


def hull(mesh: Mesh) -> Mesh | tuple[Box, tuple[float, float, float]]:
    """The convex hull of a mesh; of a flat one the box about it, and where its middle is."""
    points = mesh.vertices[np.unique(mesh.faces)]
    try:
        corners = points[ConvexHull(points).vertices]
        if len(corners) > CORNERS:
            corners = corners[np.unique(np.argmax(corners @ _directions(CORNERS).T, axis=0))]
        outer = ConvexHull(corners)
    except (QhullError, ValueError):
        low, high = points.min(axis=0), points.max(axis=0)
        x, y, z = np.maximum(high - low, MIN_THICK).tolist()
        a, b, c = ((low + high) / 2.0).tolist()
        return Box((x, y, z)), (a, b, c)
    faces = outer.simplices.copy()
    a, b, c = (corners[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), outer.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return replace(mesh, vertices=corners, faces=faces.astype(np.int32), uv=None)


def _directions(count: int) -> np.ndarray:
    """`[count, 3]` unit vectors spread evenly over all directions: a spiral from pole to pole."""
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * k / count), np.pi * (1.0 + 5.0**0.5) * k
    return np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
