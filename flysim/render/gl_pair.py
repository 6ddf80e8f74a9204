"""Both eyes' pictures in a hurry: few triangles, few draws, no truth. For whoever looks ten times a second.

What stands still is one mesh for each size of texture, both eyes are drawn into one frame buffer and read at once.
Measured on `yard` at 160x120: a fifth of what two views of `GlRenderer` take.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from flysim.common.one_of_a_kind import OneOfAKind
from flysim.foreign.image import read_png
from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.render.gl_context import close_context, entered, open_context
from flysim.render.light import DAY, LightParams, lamp_position
from flysim.render.optics import NEAR, clip_optical
from flysim.render.shading import Shading, with_light
from flysim.robots.robot import Robot, parts_in_base
from flysim.sim.simulation import Simulation
from flysim.worlds.model import Part, World
from flysim.worlds.shapes import Plane
from flysim.worlds.surface.mesh import surface_mesh

SAGITTA = 0.002  # [m] a quarter of a pixel at 1 m in an image of 160 px
LARGEST = 1024  # [px] side of a texture; larger ones are scaled down
ROBOT, STILL = -1, -2  # groups of parts that move alike; the others are a link's index

VERTEX = """
#version 330
uniform mat4 clip_group, world_group;
uniform vec3 light;
uniform float ambient, diffuse;
in vec3 position, normal, uv;
out vec3 v_uv; out float v_light;
void main() {
    v_light = ambient + diffuse * max(dot(mat3(world_group) * normal, light), 0.0);
    v_uv = uv;
    gl_Position = clip_group * vec4(position, 1.0);
#ifdef LIT
    place(world_group * vec4(position, 1.0), mat3(world_group) * normal);
#endif
}
"""
FRAGMENT = """
#version 330
uniform sampler2DArray images;
in vec3 v_uv; in float v_light;
out vec4 colour;
void main() {
#ifdef LIT
    colour = vec4(lit(texture(images, v_uv).rgb), 1.0);
#else
    colour = vec4(texture(images, v_uv).rgb * v_light, 1.0);
#endif
}
"""


@dataclass(frozen=True, slots=True, eq=False)
class _Batch:
    group: int
    vertices: moderngl.VertexArray
    textures: moderngl.TextureArray


class PairRenderer(OneOfAKind):
    """Draws what a robot's two cameras see in a world; not bound to a simulation: it outlives resets."""

    def __init__(self, world: World, robot: Robot, rig: StereoRig, light: LightParams = DAY) -> None:
        """Uploads the meshes and textures.

        Args:
            world: what stands there.
            robot: who looks; it is drawn where it may stand in its own view.
            rig: its cameras, both of one size.
            light: in the world.

        Raises:
            RendererError: no OpenGL context opens, or the driver refuses the world.
        """
        if (rig.left.width, rig.left.height) != (rig.right.width, rig.right.height):
            raise ValueError("both cameras must have images of one size")
        self.robot, self.rig = robot, rig
        self._batches: list[_Batch] = []
        self._tall: list[tuple[int, Array]] = []  # of what throws shadows: its group, and its corners in that
        self._held: list[moderngl.Buffer | moderngl.VertexArray | moderngl.TextureArray] = []  # of this world
        self._context = context = open_context()
        try:
            with entered(context, "draw this world"):
                vertex, fragment = with_light(light, VERTEX, FRAGMENT)
                self._program = context.program(vertex_shader=vertex, fragment_shader=fragment)
                self._shading = Shading(context, self._program, light)
                size = (rig.left.width, 2 * rig.left.height)
                self._target = context.framebuffer([context.texture(size, 4)], context.depth_texture(size))
            self.renew(world)
        except BaseException:
            self.close()
            raise
        self._clip = [clip_optical(camera) for camera in (rig.left, rig.right)]

    def renew(self, world: World) -> None:
        """Another world from now on. The context stays: moderngl keeps 40 kB of each that is closed.

        Raises:
            RendererError: the driver refuses the world; nothing can be drawn then.
        """
        with entered(self._context, "draw this world"):
            for one in self._held:
                one.release()
            self._held.clear()
            self._batches = self._upload(world)

    def _upload(self, world: World) -> list[_Batch]:
        parts: list[tuple[int, Part, Array]] = []
        for i, link in enumerate(world.links):
            for part in link.visuals:
                if link.static:
                    parts.append((STILL, part, link.T_world_link @ part.T_link_part))
                else:
                    parts.append((i, part, part.T_link_part))
        robot = (part for part in parts_in_base(self.robot) if self._in_view(part))
        parts += [(ROBOT, part, part.T_link_part) for part in robot]
        self._tall = [
            (group, transform(T, part.shape.outline())) for group, part, T in parts if not isinstance(part.shape, Plane)
        ]
        images: dict[object, NDArray[np.uint8]] = {}
        for _, part, _ in parts:
            key = part.material.texture or part.material.diffuse
            if key not in images:
                images[key] = _picture(key)
        layers: dict[tuple[int, int], list[object]] = defaultdict(list)
        for key, image in images.items():
            layers[image.shape[1], image.shape[0]].append(key)
        textures = {size: self._texture(size, [images[key] for key in keys]) for size, keys in layers.items()}
        meshes: dict[tuple[int, tuple[int, int]], list[tuple[NDArray, NDArray]]] = defaultdict(list)
        for group, part, T in parts:
            key = part.material.texture or part.material.diffuse
            size = images[key].shape[1], images[key].shape[0]
            mesh = surface_mesh(part.shape, SAGITTA)
            layer = np.full((len(mesh.vertices), 1), layers[size].index(key), np.float32)
            rows = [transform(T, mesh.vertices), mesh.normals @ T[:3, :3].T, mesh.uv, layer]
            meshes[group, size].append((np.concatenate(rows, axis=1).astype(np.float32), mesh.faces))
        found = []
        # What hides much and is hidden by little first: floors, the largest, come last.
        for (group, size), some in sorted(meshes.items(), key=lambda item: _extent(item[1])):
            starts = np.cumsum([0] + [len(rows) for rows, _ in some[:-1]])
            faces = np.concatenate([faces + start for (_, faces), start in zip(some, starts, strict=True)])
            data = self._context.buffer(np.concatenate([rows for rows, _ in some]).tobytes())
            order = self._context.buffer(faces.astype(np.int32).tobytes())
            layout = [(data, "3f 3f 3f", "position", "normal", "uv")]
            vertices = self._context.vertex_array(self._program, layout, index_buffer=order)
            self._held += [vertices, data, order]
            found.append(_Batch(group, vertices, textures[size]))
        return found

    def _in_view(self, part: Part) -> bool:
        """Whether a part of the robot may stand before one of its cameras."""
        points = transform(part.T_link_part, surface_mesh(part.shape, SAGITTA).vertices)
        for camera, T in (
            (self.rig.left, self.robot.T_base_left),
            (self.rig.right, self.robot.T_base_left @ inverse(self.rig.T_right_left)),
        ):
            local = transform(inverse(T), points)
            local = local[local[:, 2] > NEAR]
            if len(local) and camera.contains(camera.project(local), -2.0).any():
                return True
        return False

    def _texture(self, size: tuple[int, int], images: list[NDArray[np.uint8]]) -> moderngl.TextureArray:
        pixels = np.stack(images)
        pixels = np.concatenate([pixels, np.full_like(pixels[..., :1], 255)], axis=3)  # llvmpipe is slow on 3 bytes
        texture = self._context.texture_array((*size, len(images)), 4, pixels.tobytes())
        self._held.append(texture)
        texture.build_mipmaps()
        # One level, not a blend of two, in a third less time: rectified rows see a thing at one level in both images.
        texture.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        return texture

    def pair(self, simulation: Simulation) -> ImagePair:
        """What the robot's two cameras see now."""
        T_world_base = simulation.T_world_base()
        T_left_world = inverse(T_world_base @ self.robot.T_base_left)
        width, height = self.rig.left.width, self.rig.left.height
        groups = self._groups(simulation, T_world_base)
        with entered(self._context, f"draw {width}x{height} px"):
            eyes = [
                (self._clip[eye] @ T, (0, eye * height, width, height), inverse(T)[:3, 3])
                for eye, T in enumerate((T_left_world, self.rig.T_right_left @ T_left_world))
            ]
            if self._shading.light != DAY:
                self._light(groups, eyes, lamp_position(T_world_base, self.robot))
            self._target.use()
            self._target.viewport = (0, 0, width, 2 * height)
            self._context.clear(*self._shading.sky, 1.0)
            self._context.enable(moderngl.DEPTH_TEST)
            for clip_world, viewport, eye_at in eyes:
                if self._shading.light != DAY:
                    self._shading.begin(self._target.size, lamp_position(T_world_base, self.robot), eye_at)
                self._target.viewport = viewport
                self._draw(groups, clip_world)
            self._target.viewport = (0, 0, width, 2 * height)
            pixels = np.frombuffer(self._target.read(components=4), np.uint8)
        both = pixels.reshape(2, height, width, 4)[:, ::-1, :, :3]
        return ImagePair(left=both[0], right=both[1], rig=self.rig)

    def _groups(self, simulation: Simulation, T_world_base: Array) -> dict[int, Array]:
        """Where what moves alike stands, `T_world_group`."""
        groups = {batch.group for batch in self._batches}
        links = simulation.T_world_links() if groups - {STILL, ROBOT} else None
        found = {ROBOT: T_world_base, STILL: np.eye(4)}
        return found if links is None else {**found, **{i: links[i] for i in groups - {STILL, ROBOT}}}

    def _draw(self, groups: dict[int, Array], clip_world: Array) -> None:
        last = None
        for batch in self._batches:
            if batch.group != last:
                last = batch.group
                self._write("world_group", groups[last])
                self._write("clip_group", clip_world @ groups[last])
            batch.textures.use()
            batch.vertices.render()

    def _light(
        self, groups: dict[int, Array], eyes: list[tuple[Array, tuple[int, int, int, int], Array]], lamp: Array
    ) -> None:
        """What is drawn before the picture: shadows, and mirror images."""
        corners = [transform(groups[group], points) for group, points in self._tall if group in groups]
        self._shading.shadow(np.concatenate(corners or [np.zeros((0, 3))]), lambda clip: self._draw(groups, clip))
        for clip_world, viewport, eye_at in eyes:
            self._shading.begin(self._target.size, lamp, eye_at)
            self._shading.mirror(viewport, clip_world, lambda clip: self._draw(groups, clip))

    def _write(self, name: str, matrix: Array) -> None:
        self._program[name].write(matrix.T.astype(np.float32).tobytes())  # type: ignore[union-attr]

    def close(self) -> None:
        """Frees the context and all it holds. Safe to call twice."""
        close_context(self._context)


def _extent(meshes: list[tuple[NDArray, NDArray]]) -> float:
    """[m^2] of the largest box about one of these meshes, seen from above."""
    return max(float(np.prod(np.ptp(rows[:, :2], axis=0))) for rows, _ in meshes)


def _picture(key: object) -> NDArray[np.uint8]:
    """`[H, W, 3]` a texture from its bottom row up, its sides powers of two; or one pixel of a colour."""
    if not isinstance(key, Path):
        return np.round(np.array([[key]]) * 255.0).astype(np.uint8)
    pixels = read_png(key)[::-1]
    height, width = (min(LARGEST, 1 << max(0, round(np.log2(side)))) for side in pixels.shape[:2])
    return np.asarray(cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
