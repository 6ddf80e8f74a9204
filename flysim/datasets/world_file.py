"""A world's bodies as `world.json` and the meshes beside it: all that the truth of a data set needs, nothing drawn."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.plain_data import plain_data
from flysim.errors import WorldError
from flysim.foreign.arrays import read_npz
from flysim.foreign.data import read_json
from flysim.foreign.folder import inside
from flysim.plain import shown_path
from flysim.worlds.model import Link, Part, World
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere

WORLD = "world.json"
MESHES = "meshes"
MAX_BYTES = 2**26
MAX_MESH_BYTES = 2**28
MAX_LINKS = 60_000  # so that a mask of 16 bits holds them
SHAPES: dict[str, type[Box] | type[Cylinder] | type[Sphere] | type[Plane]] = {
    "box": Box,
    "cylinder": Cylinder,
    "sphere": Sphere,
    "plane": Plane,
}


def write_world(folder: Path, world: World) -> None:
    """Write `world.json`, and an .npz of vertices and faces for each mesh.

    Raises:
        OSError: the disk is full or refuses.
        WorldError: it has more links than a mask can tell apart.
    """
    if len(world.links) > MAX_LINKS:
        raise WorldError(f"world {world.name} has {len(world.links)} links; a data set holds at most {MAX_LINKS}.")
    meshes: list[Mesh] = []
    links = [
        {
            "id": i,
            "model": link.model,
            "name": link.name,
            "static": link.static,
            "structure": link.structure,
            "T_world_link": link.T_world_link,
            "visuals": [_part(part, meshes) for part in link.visuals],
            "collisions": [_part(part, meshes) for part in link.collisions],
        }
        for i, link in enumerate(world.links)
    ]
    data = {"name": world.name, "gravity": world.gravity, "warnings": world.warnings, "links": links}
    (folder / WORLD).write_text(json.dumps(plain_data(data), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    if meshes:
        (folder / MESHES).mkdir()
    for k, mesh in enumerate(meshes):
        stream = io.BytesIO()
        np.savez_compressed(stream, vertices=mesh.vertices, faces=mesh.faces)
        (folder / MESHES / f"{k}.npz").write_bytes(stream.getvalue())


def read_world_file(folder: Path) -> World:
    """The world of a data set's truth, without its surfaces.

    Raises:
        WorldError: a file is missing or damaged.
    """
    path = inside(folder, WORLD, WorldError)
    data = read_json(path, "world of the data set", MAX_BYTES, WorldError)
    try:
        links = tuple(_link(link, folder) for link in data["links"])
        if len(links) > MAX_LINKS:
            raise ValueError(f"it has {len(links)} links")
        warnings = tuple(str(text) for text in data["warnings"])
        return World(name=str(data["name"]), path=path, links=links, gravity=float(data["gravity"]), warnings=warnings)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise WorldError(
            f"{shown_path(path)}: no world of a data set: {type(error).__name__}: {error}. Export it again."
        ) from None


def rigid(value: Any) -> np.ndarray:
    """`[4, 4]` a transform from JSON.

    Raises:
        ValueError: it is none.
    """
    T = np.array(value, np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all() or not np.allclose(T[3], (0.0, 0.0, 0.0, 1.0)):
        raise ValueError("a pose is no finite 4x4 matrix")
    if not np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-6) or np.linalg.det(T[:3, :3]) < 0.0:
        raise ValueError("a pose holds no rotation")
    return T


def _part(part: Part, meshes: list[Mesh]) -> dict[str, Any]:
    shape = part.shape
    kind = next((name for name, of in SHAPES.items() if isinstance(shape, of)), "mesh")
    fields: dict[str, Any] = {name: getattr(shape, name) for name in getattr(SHAPES.get(kind), "__slots__", ())}
    if isinstance(shape, Mesh):
        fields = {"mesh": len(meshes)}
        meshes.append(shape)
    return {"name": part.name, "shape": kind, **fields, "T_link_part": part.T_link_part}


def _link(data: dict[str, Any], folder: Path) -> Link:
    return Link(
        name=str(data["name"]),
        model=str(data["model"]),
        T_world_link=rigid(data["T_world_link"]),
        visuals=tuple(_read_part(part, folder) for part in data["visuals"]),
        collisions=tuple(_read_part(part, folder) for part in data["collisions"]),
        static=bool(data["static"]),
        structure=bool(data["structure"]),
    )


def _read_part(data: dict[str, Any], folder: Path) -> Part:
    return Part(name=str(data["name"]), shape=_shape(data, folder), T_link_part=rigid(data["T_link_part"]))


def _shape(data: dict[str, Any], folder: Path) -> Shape:
    if data["shape"] != "mesh":
        kind = SHAPES[data["shape"]]
        values = [data[name] for name in kind.__slots__]
        return kind(*(tuple(map(float, v)) if isinstance(v, list) else float(v) for v in values))  # type: ignore[arg-type]
    path = inside(folder, f"{MESHES}/{int(data['mesh'])}.npz", WorldError)
    arrays = read_npz(path, "mesh", MAX_MESH_BYTES, WorldError)
    vertices, faces = arrays["vertices"], arrays["faces"]
    sound = vertices.ndim == 2 and vertices.shape[1] == 3 and faces.ndim == 2 and faces.shape[1] == 3
    if not sound or not np.isfinite(vertices).all() or not len(faces):
        raise ValueError("a mesh has no vertices [V, 3] or no faces [F, 3]")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError("a mesh's faces name vertices that it lacks")
    return Mesh(vertices=vertices, faces=faces, uv=None, path=path)
