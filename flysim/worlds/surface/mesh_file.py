"""Mesh files by their ending: OBJ and STL by flysim's own readers, Collada and glTF by trimesh's, all within limits."""

from __future__ import annotations

from pathlib import Path

from flysim.plain import shown
from flysim.worlds.sdf.elements import Unread, Where
from flysim.worlds.surface.mesh_group import Files, MeshGroup, RawGroup, scaled, too_many
from flysim.worlds.surface.mesh_scene import parse_collada, parse_gltf
from flysim.worlds.surface.obj import parse_obj
from flysim.worlds.surface.stl import parse_stl


def parse_mesh(
    data: bytes, path: Path, scale: tuple[float, float, float], max_faces: int, files: Files
) -> tuple[MeshGroup, ...]:
    """A mesh file's bytes as scaled triangles, in groups of one material each.

    Args:
        data: the file's content.
        path: of the file; its suffix tells the format.
        scale: factor along x, y, z; a negative one mirrors, and the faces are turned to stay outward.
        max_faces: triangles that are left to the world.
        files: opens what the file names.

    Raises:
        Unread: another format, damaged data, no area, or too many triangles.
    """
    raw = _parsed(data, path, max_faces, files)
    if sum(len(group.faces) for group in raw) > max_faces or sum(len(g.vertices) for g in raw) > 3 * max_faces:
        raise too_many(max_faces)
    groups = tuple(group for one in raw if (group := scaled(one, scale, path)) is not None)
    if not groups:
        raise Unread("mesh", "has no triangle with an area")
    return groups


def _parsed(data: bytes, path: Path, max_faces: int, files: Files) -> list[RawGroup]:
    suffix, where = path.suffix.lower(), Where(path)
    if suffix == ".obj":
        return parse_obj(data, path, max_faces, files)
    if suffix == ".stl":
        vertices, faces = parse_stl(data, max_faces)
        return [RawGroup(vertices=vertices, faces=faces)]
    if suffix == ".dae":
        return parse_collada(data, path, max_faces, files, where)
    if suffix in (".glb", ".gltf"):
        return parse_gltf(data, path, max_faces, files, where)
    raise Unread("mesh", f"format {shown(suffix)} is not read")
