"""A world and a robot on the graphics card: meshes, textures and mipmaps, uploaded once and drawn by each pass."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from flysim.foreign.image import read_texture
from flysim.geometry.frames import Array, transform
from flysim.robots.robot import Robot
from flysim.sim.simulation import Simulation
from flysim.worlds.model import Material, Part, World
from flysim.worlds.shapes import Cylinder, Plane, Sphere
from flysim.worlds.surface.mesh import surface_mesh

# What a part moves with: a link of the world by its index, one of the robot's by its name, or nothing.
Frame = int | str | None
Size = tuple[int, int]  # [px] width, height of a texture
STILL = np.eye(4)
STILL_BYTES = STILL.astype(np.float32).tobytes()


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """A part of the world or the robot, whose link is -1; where it moves with nothing, its frame is the world's."""

    part: Part
    link: int
    frame: Frame
    T_frame_part: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Batch:
    """What is drawn at once: one piece that moves, or all that stand still and have textures of one size.

    Vertices of what stands still are in the world's frame already.

    `round` has every other triangle face away, behind the rest: they need not be drawn.
    """

    frame: Frame
    T_frame_part: Array
    box: Array  # `[4, 8]` corners about it, homogeneous [m]
    colour: moderngl.VertexArray
    truth: moderngl.VertexArray
    textures: moderngl.TextureArray
    round: bool


@dataclass(frozen=True, slots=True, eq=False)
class Stand:
    """Where all that is drawn stands at one moment."""

    T_world_frame: Mapping[Frame, Array]
    boxes: Array  # `[n, 4, 8]` corners about each batch, world frame [m]
    matrices: list[bytes]  # `T_world_part` of each batch as GLSL takes it


class GlWorld:
    """All that is drawn of one world, and where it stands."""

    def __init__(
        self,
        context: moderngl.Context,
        programs: tuple[moderngl.Program, moderngl.Program],
        world: World,
        robot: Robot,
        sagitta: float,
    ) -> None:
        """Uploads it.

        Args:
            context: the renderer's, entered.
            programs: of the passes for colour and for truth.
            world: what stands there.
            robot: who drives there.
            sagitta: chords of a round shape are at most this far inside it [m].
        """
        self.world = world
        self._context, self._programs, self._sagitta = context, programs, sagitta
        self._uniforms = [[_uniform(one, name) for name in ("clip_world", "world_part")] for one in programs]
        self._held: list[moderngl.Buffer | moderngl.VertexArray | moderngl.TextureArray] = []
        pieces = _pieces(world, robot)
        self._tall = [
            (piece.frame, transform(piece.T_frame_part, piece.part.shape.outline()))
            for piece in pieces
            if not isinstance(piece.part.shape, Plane)
        ]
        try:
            self._batches = self._upload(pieces)
        except BaseException:
            self.release()
            raise
        self._boxes = np.array([batch.box for batch in self._batches]).reshape(-1, 4, 8)

    def release(self) -> None:
        """Frees what it holds."""
        for one in self._held:
            one.release()
        self._held.clear()

    def stand(self, simulation: Simulation) -> Stand:
        """Where all of it stands now."""
        moving = {batch.frame for batch in self._batches} - {None}
        links = simulation.T_world_links() if any(isinstance(frame, int) for frame in moving) else []
        frames: dict[Frame, Array] = {None: STILL}
        for frame in moving:
            frames[frame] = links[frame] if isinstance(frame, int) else simulation.T_world_robot_link(str(frame))
        parts = [STILL if b.frame is None else frames[b.frame] @ b.T_frame_part for b in self._batches]
        boxes = np.array(parts).reshape(-1, 4, 4) @ self._boxes
        return Stand(frames, boxes, [STILL_BYTES if T is STILL else _bytes(T) for T in parts])

    def corners(self, stand: Stand) -> Array:
        """`[n, 3]` of all that may throw a shadow, world frame [m]."""
        tall = (transform(stand.T_world_frame[frame], points) for frame, points in self._tall)
        return np.concatenate([np.zeros((0, 3)), *tall])

    def draw(self, stand: Stand, clip_world: Array, *, truth: bool = False, cull: bool = True) -> None:
        """Draws what may be in view into the frame buffer in use.

        Args:
            stand: where all of it stands.
            clip_world: `[4, 4]` from the world to OpenGL's clip space.
            truth: by the pass for truth, else by the one for colour.
            cull: whether to leave out what faces away where something else of it stands before that.
        """
        clip, part = self._uniforms[truth]
        clip.write(_bytes(clip_world))
        last, culls = b"", None
        for k in np.flatnonzero(_seen(clip_world @ stand.boxes)).tolist():
            batch, matrix = self._batches[k], stand.matrices[k]
            if matrix != last:
                part.write(last := matrix)
            if culls != (cull and batch.round):
                culls = cull and batch.round
                (self._context.enable if culls else self._context.disable)(moderngl.CULL_FACE)
            if truth:
                batch.truth.render()
            else:
                batch.textures.use()
                batch.colour.render()

    def _upload(self, pieces: list[_Piece]) -> list[_Batch]:
        pictures: dict[object, NDArray[np.uint8]] = {}
        sizes: dict[Size, list[object]] = defaultdict(list)  # of each, the pictures: a layer each
        together: dict[object, list[_Piece]] = defaultdict(list)
        for piece in pieces:
            key = _look(piece)
            if key not in pictures:
                pictures[key] = _picture(piece.part.material)
                sizes[pictures[key].shape[1::-1]].append(key)
            together[pictures[key].shape if piece.frame is None else piece].append(piece)
        textures = {size: self._texture([pictures[key] for key in keys]) for size, keys in sizes.items()}
        # The last of the file comes first: floors, which are large and hide little, are mostly at its head. So that of
        # two surfaces in one place the first of the file is seen, what is as near as what was drawn replaces it.
        found = []
        for some in reversed(together.values()):
            size = pictures[_look(some[0])].shape[1::-1]
            found.append(self._batch(some[::-1], sizes[size], textures[size]))
        return found

    def _texture(self, pictures: list[NDArray[np.uint8]]) -> moderngl.TextureArray:
        pixels = np.stack(pictures)
        pixels = np.concatenate([pixels, np.full_like(pixels[..., :1], 255)], axis=3)  # llvmpipe is slow on 3 bytes
        layers, height, width, _ = pixels.shape
        texture = self._context.texture_array((width, height, layers), 4, pixels.tobytes())
        self._held.append(texture)
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        return texture

    def _batch(self, pieces: list[_Piece], layers: list[object], textures: moderngl.TextureArray) -> _Batch:
        rows, faces, start = [], [], 0
        for piece in pieces:
            mesh = surface_mesh(piece.part.shape, self._sagitta)
            positions, normals = mesh.vertices, mesh.normals
            if piece.frame is None:
                positions, normals = _moved(piece.T_frame_part, positions, normals)
            known = np.tile(np.array([layers.index(_look(piece)), piece.link], np.float32), (len(positions), 1))
            rows.append(np.concatenate([positions, normals, mesh.uv, known], axis=1))
            faces.append(mesh.faces[::-1] + start)
            start += len(positions)
        data = np.concatenate(rows)
        vertices = self._context.buffer(data.tobytes())
        order = self._context.buffer(np.concatenate(faces).astype(np.int32).tobytes())
        shown = (vertices, "3f 3f 3f 4x", "position", "normal", "uv"), (vertices, "3f 24x 1f", "position", "link")
        colour, truth = (
            self._context.vertex_array(program, [content], index_buffer=order)
            for program, content in zip(self._programs, shown, strict=True)
        )
        self._held += [colour, truth, vertices, order]
        ends = np.stack([data[:, :3].min(axis=0), data[:, :3].max(axis=0)], axis=1)
        box = np.stack([*np.meshgrid(*ends), np.ones((2, 2, 2))]).reshape(4, 8)
        curved = all(isinstance(piece.part.shape, Cylinder | Sphere) for piece in pieces)
        frame, T = pieces[0].frame, pieces[0].T_frame_part
        return _Batch(frame, T, box, colour, truth, textures, curved)


def _pieces(world: World, robot: Robot) -> list[_Piece]:
    """In the order of the files, the robot's last."""
    pieces = []
    for i, link in enumerate(world.links):
        for part in link.visuals:
            T, frame = (link.T_world_link @ part.T_link_part, None) if link.static else (part.T_link_part, i)
            pieces.append(_Piece(part, i, frame, T))
    return pieces + [_Piece(part, -1, name, part.T_link_part) for name, part in robot.visuals]


def _look(piece: _Piece) -> object:
    return piece.part.material.texture or piece.part.material.diffuse


def _picture(material: Material) -> NDArray[np.uint8]:
    """`[H, W, 3]` a texture from its bottom row up; or one pixel of a colour."""
    if material.texture is None:
        return np.round(np.array([[material.diffuse]]) * 255.0).astype(np.uint8)
    return read_texture(material.texture)[::-1]  # v runs up, rows run down


def _moved(T: Array, points: NDArray[np.float32], normals: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """In the order and the precision of the graphics card: what is placed here is seen as if it were placed there."""
    R, t = T[:3, :3].T.astype(np.float32), T[:3, 3].astype(np.float32)
    turned = [(R[0] * a[:, :1] + R[1] * a[:, 1:2]) + R[2] * a[:, 2:] for a in (points, normals)]
    return [turned[0] + t, turned[1]]


def _uniform(program: moderngl.Program, name: str) -> moderngl.Uniform:
    uniform = program[name]
    assert isinstance(uniform, moderngl.Uniform)
    return uniform


def _bytes(matrix: Array) -> bytes:
    """Of a `[4, 4]` matrix as GLSL takes it."""
    return matrix.T.astype(np.float32).tobytes()


def _seen(corners: Array) -> NDArray[np.bool_]:
    """`[n]` whether boxes may be in view: not all of the `[n, 4, 8]` corners, in clip space, lie beyond one side."""
    sides, w = corners[:, :3], corners[:, 3:] + 1e-3  # a millimetre: the graphics card rounds
    beyond = np.all(sides > w, axis=2) | np.all(sides < -w, axis=2)
    return np.logical_not(np.any(beyond, axis=1))
