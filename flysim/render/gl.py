"""The `gl` renderer: moderngl through EGL draws the bodies' meshes at their pybullet poses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np

from flysim.common.one_of_a_kind import OneOfAKind
from flysim.foreign.image import read_png
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse, transform
from flysim.render.gl_context import close_context, entered, open_context
from flysim.render.light import DAY, LightParams, lamp_position
from flysim.render.optics import FAR, NEAR, clip_optical
from flysim.render.shading import Shading, with_light
from flysim.sim.simulation import Simulation
from flysim.worlds.model import Part
from flysim.worlds.shapes import Plane
from flysim.worlds.surface.mesh import surface_mesh
from flysim.worlds.view import TrueView

VERTEX = """
#version 330
uniform mat4 clip_world, world_part;
uniform vec3 light;
uniform float ambient, diffuse;
in vec3 position, normal; in vec2 uv;
out vec2 v_uv; out float v_light, v_depth;
void main() {
    vec3 n = mat3(world_part) * normal;
    v_light = ambient + diffuse * max(dot(n, light), 0.0);
    v_uv = uv;
    gl_Position = clip_world * (world_part * vec4(position, 1.0));
    v_depth = gl_Position.w;  // the depth along the optical axis
#ifdef LIT
    place(world_part * vec4(position, 1.0), n);
#endif
}
"""
FRAGMENT = """
#version 330
uniform sampler2D image;
uniform float link;
in vec2 v_uv; in float v_light, v_depth;
layout(location = 0) out vec4 colour;
layout(location = 1) out vec2 truth;
void main() {
#ifdef LIT
    colour = vec4(lit(texture(image, v_uv).rgb), 1.0);
#else
    colour = vec4(texture(image, v_uv).rgb * v_light, 1.0);
#endif
    truth = vec2(v_depth, link);
}
"""


@dataclass(frozen=True, slots=True, eq=False)
class _Drawable:
    vertices: moderngl.VertexArray
    texture: moderngl.Texture
    link: int  # index of the world's link, or -1 for the robot
    robot_link: str  # name of the robot's link, or ""
    T_link_part: Array
    outline: Array  # `[n, 3]` corners, in its own frame [m]
    flat: bool  # a plane, which throws no shadow


class GlRenderer(OneOfAKind):
    """Trilinear textures, exact calibration, depth under 0.1 mm, equal bytes across runs."""

    name = "gl"

    def __init__(self, simulation: Simulation, light: LightParams = DAY) -> None:
        """Uploads the meshes and textures of the simulation's world and robot."""
        self._simulation = simulation
        self._shaded_at: bytes | None = None  # where everything stood when the shadows were drawn
        self._context = open_context()
        self._targets: dict[tuple[int, int], moderngl.Framebuffer] = {}
        self._truths: dict[tuple[int, int], moderngl.Framebuffer] = {}  # their truth alone
        self._textures: dict[object, moderngl.Texture] = {}
        try:
            with entered(self._context, "draw this world"):
                vertex, fragment = with_light(light, VERTEX, FRAGMENT)
                self._program = self._context.program(vertex_shader=vertex, fragment_shader=fragment)
                self._shading = Shading(self._context, self._program, light)
                world, robot = simulation.world, simulation.robot
                self._drawables = [
                    self._upload(part, i, "") for i, link in enumerate(world.links) for part in link.visuals
                ]
                self._drawables += [self._upload(part, -1, name) for name, part in robot.visuals]
                for camera in (robot.rig.left, robot.rig.right):  # what is too large is told here, as by PairRenderer
                    self._target(camera.width, camera.height)
        except BaseException:
            self.close()
            raise

    def _set(self, name: str, value: object) -> None:
        uniform = self._program[name]
        assert isinstance(uniform, moderngl.Uniform)
        uniform.value = value

    def _upload(self, part: Part, link: int, robot_link: str) -> _Drawable:
        mesh = surface_mesh(part.shape)
        data = np.concatenate([mesh.vertices, mesh.normals, mesh.uv], axis=1).astype(np.float32)
        vertices = self._context.vertex_array(
            self._program,
            [(self._context.buffer(data.tobytes()), "3f 3f 2f", "position", "normal", "uv")],
            index_buffer=self._context.buffer(mesh.faces.astype(np.int32).tobytes()),
        )
        texture = self._texture(part.material.texture or part.material.diffuse)
        flat = isinstance(part.shape, Plane)
        return _Drawable(vertices, texture, link, robot_link, part.T_link_part, part.shape.outline(), flat)

    def _texture(self, key: Path | tuple[float, float, float]) -> moderngl.Texture:
        if key not in self._textures:
            if isinstance(key, Path):
                pixels = read_png(key)[::-1]  # v runs up, rows run down
            else:
                pixels = np.round(np.array([[key]]) * 255.0).astype(np.uint8)
            pixels = np.ascontiguousarray(pixels)
            texture = self._context.texture((pixels.shape[1], pixels.shape[0]), 3, pixels.tobytes(), alignment=1)
            texture.build_mipmaps()
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            texture.repeat_x = texture.repeat_y = False
            self._textures[key] = texture
        return self._textures[key]

    def _target(self, width: int, height: int) -> moderngl.Framebuffer:
        if (width, height) not in self._targets:
            size = (width, height)
            truth = self._context.texture(size, 2, dtype="f4")
            self._targets[size] = self._context.framebuffer(
                [self._context.texture(size, 4), truth], self._context.depth_texture(size)
            )
            self._truths[size] = self._context.framebuffer([truth])
        return self._targets[width, height]

    def view(self, camera: Camera, T_world_optical: Array) -> TrueView:
        """What a camera at `T_world_optical` sees, with exact depth and body of each pixel."""
        clip_world = clip_optical(camera) @ inverse(T_world_optical)
        with entered(self._context, f"draw {camera.width}x{camera.height} px"):
            target = self._target(camera.width, camera.height)
            poses = self._poses()
            self._light(poses, target.size, clip_world, T_world_optical)
            target.use()
            self._context.clear(*self._shading.sky, 1.0)
            # That painted the sky's colour on the truth too, where it would read as a depth of 0.7 m.
            self._truths[camera.width, camera.height].clear()
            target.use()
            self._context.enable(moderngl.DEPTH_TEST)
            self._draw(poses, clip_world)
            shape = (camera.height, camera.width)
            rgb = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(*shape, 3)[::-1]
            truth = np.frombuffer(target.read(attachment=1, components=2, dtype="f4"), np.float32)
        truth = truth.reshape(*shape, 2)[::-1]
        hit = (truth[..., 0] >= NEAR) & (truth[..., 0] < FAR)  # 0 where nothing was drawn
        return TrueView(
            camera=camera,
            rgb=np.ascontiguousarray(rgb),
            depth=np.where(hit, truth[..., 0], np.float32(np.inf)),
            link=np.where(hit, truth[..., 1].round(), -1).astype(np.int32),
            T_world_optical=T_world_optical,
        )

    def _poses(self) -> list[Array]:
        """Where each drawable stands, `T_world_part`."""
        world = self._simulation.T_world_links()
        robot = {d.robot_link for d in self._drawables if d.robot_link}
        T_robot = {name: self._simulation.T_world_robot_link(name) for name in robot}
        return [(T_robot[d.robot_link] if d.robot_link else world[d.link]) @ d.T_link_part for d in self._drawables]

    def _draw(self, poses: list[Array], clip_world: Array) -> None:
        self._write("clip_world", clip_world)
        for drawable, T_world_part in zip(self._drawables, poses, strict=True):
            self._write("world_part", T_world_part)
            self._set("link", float(drawable.link))
            drawable.texture.use()
            drawable.vertices.render()

    def _light(self, poses: list[Array], size: tuple[int, int], clip_world: Array, T_world_optical: Array) -> None:
        """What is drawn before the picture: shadows, if anything moved since they were, and mirror images."""
        if self._shading.light == DAY:
            return
        if self._shading.light.shadows:
            stand = np.stack(poses).tobytes()
            if stand != self._shaded_at:
                self._shaded_at = stand
                tall = [
                    transform(T, drawable.outline)
                    for T, drawable in zip(poses, self._drawables, strict=True)
                    if not drawable.flat
                ]
                self._shading.shadow(np.concatenate(tall or [np.zeros((0, 3))]), lambda clip: self._draw(poses, clip))
        self._shading.begin(
            size, lamp_position(self._simulation.T_world_base(), self._simulation.robot), T_world_optical[:3, 3]
        )
        self._shading.mirror((0, 0, *size), clip_world, lambda clip: self._draw(poses, clip))

    def _write(self, name: str, matrix: Array) -> None:
        uniform = self._program[name]
        assert isinstance(uniform, moderngl.Uniform)
        uniform.write(matrix.T.astype(np.float32).tobytes())

    def close(self) -> None:
        """Frees the context and all it holds. Safe to call twice."""
        close_context(self._context)
