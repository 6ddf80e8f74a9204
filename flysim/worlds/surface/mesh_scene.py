"""Collada and glTF files by trimesh's loaders, which are given nothing that is not counted, and no file to open.

Pictures are not decoded by them: each one that a file names is answered by one pixel, whose colour says which it was.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flysim.errors import WorldError
from flysim.foreign.data import parse_json
from flysim.geometry.frames import Array
from flysim.worlds.model import Material
from flysim.worlds.sdf.document import parse_xml
from flysim.worlds.sdf.elements import Unread, Where
from flysim.worlds.surface.mesh_group import Files, RawGroup, too_many

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_ELEMENTS = 300_000  # XML elements of a Collada file
MAX_INSTANCES = 10_000  # of geometries in a scene
MAX_UNPACKED = 2**27  # characters of indices of all instances
MAX_ACCESSED = 30_000_000  # numbers of all accessors of a glTF file
MAX_PARTS = 20_000  # entries of one table of a glTF file
GLB, JSON_CHUNK, BIN_CHUNK = b"glTF", 0x4E4F534A, 0x004E4942
# Rows are where each axis of a file points in a world whose z is up.
UP = {
    "Z_UP": np.eye(3),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
}


class _Pictures:
    """Stands for the pictures of a file while trimesh reads it, and opens no other file than its buffers."""

    def __init__(self, read: Callable[[str], bytes] | None = None) -> None:
        self.names: list[str] = []
        self._read = read

    def get(self, name: str) -> bytes:
        """One pixel that says which picture it was, or a buffer's bytes."""
        if self._read is not None and not name.startswith("picture:"):
            return self._read(name)
        if name not in self.names:
            if len(self.names) >= MAX_PARTS:
                raise Unread("mesh", "names too many pictures")
            self.names.append(name)
        k = self.names.index(name) + 1
        return b"P6 1 1 255\n" + bytes((k & 255, k >> 8 & 255, k >> 16))

    __getitem__ = get

    def named(self, image: Any) -> str | None:
        """Which picture trimesh's one is."""
        r, g, b = image.convert("RGB").getpixel((0, 0))
        k = r + (g << 8) + (b << 16) - 1
        return self.names[k].removeprefix("picture:") if 0 <= k < len(self.names) else None


def parse_collada(data: bytes, path: Path, max_faces: int, files: Files, where: Where) -> list[RawGroup]:
    """The triangles of a Collada scene in metres, z up.

    Raises:
        Unread: it is damaged, or too large.
    """
    try:
        root, _ = parse_xml(data, MAX_ELEMENTS, where)
    except WorldError as error:
        raise Unread("mesh", str(error).split(": ", 1)[-1]) from None
    space = root.tag.partition("}")[0] + "}" if root.tag.startswith("{") else ""
    if root.tag != f"{space}COLLADA":
        raise Unread("mesh", "is no Collada file")
    _check_instances(root, space)
    unit = root.find(f"{space}asset/{space}unit")
    axis = (root.findtext(f"{space}asset/{space}up_axis") or "Y_UP").strip()
    try:
        metre = float(unit.get("meter", "1")) if unit is not None else 1.0
    except ValueError:
        metre = float("nan")
    if not 1e-9 < metre < 1e9 or axis not in UP:
        raise Unread("mesh", f"has the unit {metre:g} m and the axis {axis}, which cannot be")
    return _scene(data, "dae", path, _Pictures(), UP[axis] * metre, max_faces, files, where)


def _check_instances(root: Element, space: str) -> None:
    """Refuses a scene whose nodes stand for each other so often that it grows beyond all bounds."""
    nodes = {f"#{node.get('id')}": node for node in root.iter(f"{space}node") if node.get("id")}
    sizes = {
        f"#{g.get('id')}": sum(len(p.text or "") for p in g.iter(f"{space}p")) for g in root.iter(f"{space}geometry")
    }
    known: dict[int, tuple[int, int]] = {}

    def count(node: Element, depth: int) -> tuple[int, int]:
        if id(node) not in known:
            if depth > 100:
                raise Unread("mesh", "has nodes that stand for each other")
            inside = [child for child in node if child.tag == f"{space}node"]
            inside += [nodes[u] for c in node.findall(f"{space}instance_node") if (u := c.get("url", "")) in nodes]
            own = [sizes.get(c.get("url", ""), 0) for c in node.findall(f"{space}instance_geometry")]
            of = [count(child, depth + 1) for child in inside]
            known[id(node)] = 1 + len(own) + sum(n for n, _ in of), sum(own) + sum(size for _, size in of)
        return known[id(node)]

    for scene in root.iter(f"{space}visual_scene"):
        instances, size = count(scene, 0)
        if instances > MAX_INSTANCES or size > MAX_UNPACKED:
            raise Unread("mesh", f"has {instances} instances in its scene, or too many triangles")


def parse_gltf(data: bytes, path: Path, max_faces: int, files: Files, where: Where) -> list[RawGroup]:
    """The triangles of a glTF scene, .glb or .gltf, turned from y up to z up.

    Raises:
        Unread: it is damaged, or too large.
    """
    text, binary = _glb_chunks(data) if data.startswith(GLB) else (data, None)
    try:
        tree = parse_json(text.decode("utf-8-sig"), max_text=len(text))
    except (ValueError, UnicodeDecodeError) as error:
        raise Unread("mesh", f"is damaged ({error})") from None
    if not isinstance(tree, dict):
        raise Unread("mesh", "is no glTF file")
    _check_tables(tree)
    for k, image in enumerate(tree.get("images", [])):
        uri = image.get("uri", "") if isinstance(image, dict) else ""
        inside = not uri or uri.startswith("data:")
        # Nothing is left to decode in the file itself.
        tree["images"][k] = {"uri": f"picture:{'' if inside else uri}"}

    def read(name: str) -> bytes:
        found = files.named(name, path.parent, "a buffer of a mesh", where)
        if found is None:
            raise Unread("mesh", f"lacks its buffer {name}")
        return found[0]

    plain = json.dumps(tree).encode()
    kind = "gltf" if binary is None else "glb"
    return _scene(_glb(plain, binary), kind, path, _Pictures(read), UP["Y_UP"], max_faces, files, where)


def _glb_chunks(data: bytes) -> tuple[bytes, bytes]:
    chunks: dict[int, bytes] = {}
    at = 12
    while at + 8 <= len(data) and len(chunks) < 4:
        length, kind = struct.unpack_from("<II", data, at)
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    if JSON_CHUNK not in chunks:
        raise Unread("mesh", "is a damaged .glb file")
    return chunks[JSON_CHUNK], chunks.get(BIN_CHUNK, b"")


def _glb(text: bytes, binary: bytes | None) -> bytes:
    if binary is None:
        return text
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), JSON_CHUNK) + text
    if binary:
        binary += bytes(-len(binary) % 4)
        body += struct.pack("<II", len(binary), BIN_CHUNK) + binary
    return GLB + struct.pack("<II", 2, 12 + len(body)) + body


def _check_tables(tree: dict[str, Any]) -> None:
    """Refuses what a few bytes make large: numbers that stand in no buffer, and tables without end."""
    for key, table in tree.items():
        if isinstance(table, list) and len(table) > MAX_PARTS:
            raise Unread("mesh", f"has {len(table)} {key[:40]}")
    counts = [one.get("count") if isinstance(one, dict) else None for one in tree.get("accessors") or []]
    whole = [n for n in counts if isinstance(n, int) and 0 <= n <= MAX_ACCESSED]
    if len(whole) < len(counts) or sum(whole) > MAX_ACCESSED:
        raise Unread("mesh", "has accessors without a count that can be")


def _scene(
    data: bytes, kind: str, path: Path, pictures: _Pictures, turn: Array, max_faces: int, files: Files, where: Where
) -> list[RawGroup]:
    import io

    import trimesh

    # trimesh resolves data: URIs of buffers by itself, and asks for all else here.
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=pictures, process=False)  # type: ignore[arg-type]
        placed = [(scene.graph.get(node), scene) for node in scene.graph.nodes_geometry]
        shapes = [(np.asarray(T, float), scene.geometry[name]) for (T, name), _ in placed if name is not None]
    except (MemoryError, Unread, WorldError):
        raise
    except BaseException as error:  # trimesh and pycollada raise whatever the damaged bytes lead them to
        if isinstance(error, (KeyboardInterrupt, SystemExit)):
            raise
        raise Unread("mesh", f"is damaged ({type(error).__name__})") from None
    shapes = [(T, shape) for T, shape in shapes if isinstance(shape, trimesh.Trimesh)]
    if sum(len(shape.faces) for _, shape in shapes) > max_faces:
        raise too_many(max_faces)
    groups = []
    for T, shape in shapes:
        vertices = (np.asarray(shape.vertices, np.float64) @ T[:3, :3].T + T[:3, 3]) @ turn.T
        faces = np.asarray(shape.faces, np.int64)
        if np.linalg.det(T[:3, :3]) < 0.0:
            faces = faces[:, ::-1]
        uv, material = _looks(shape, pictures, path, files, where)
        groups.append(RawGroup(vertices=vertices, faces=faces, uv=uv, material=material))
    return groups


def _looks(
    shape: Any, pictures: _Pictures, path: Path, files: Files, where: Where
) -> tuple[Array | None, Material | None]:
    """Texture coordinates and material of one of trimesh's meshes."""
    visual = shape.visual
    uv = getattr(visual, "uv", None)
    uv = None if uv is None or np.shape(uv) != (len(shape.vertices), 2) else np.asarray(uv, np.float64)
    own = getattr(visual, "material", None)
    if own is None:
        return uv, None
    colour = getattr(own, "baseColorFactor", None)
    diffuse = Material().diffuse
    if colour is not None and np.size(colour) >= 3:
        values = np.asarray(colour, float).ravel()[:3]
        scale = 255.0 if np.asarray(colour).dtype.kind in "iu" else 1.0
        r, g, b = np.clip(values / scale, 0.0, 1.0).tolist()
        diffuse = (r, g, b)
    picture = getattr(own, "baseColorTexture", None)
    if picture is None:
        return uv, Material(diffuse=diffuse)
    name = pictures.named(picture)
    if not name:
        files.note("a picture inside a mesh file is not read", where, path.name)
        return uv, Material(diffuse=diffuse)
    return uv, Material(diffuse=diffuse, texture=files.picture(name, path.parent, where))
