"""The text of the shaders, how they light a surface, and the passes that shadows and mirror images take.

By day, which is all defaults, the program holds not a line of sun, lamp and mirror.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import moderngl
import numpy as np

from flysim.geometry.frames import Array
from flysim.render.light import DAY, LightParams
from flysim.render.optics import SKY

SHADOW_SIDE = 2048  # [px] of the picture that the sun has of the world
REACH = 60.0  # [m] from the middle of the world to where the sun looks from
FLOOR_M = 0.003  # [m] of height 0: the floor
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])  # the world under the floor
SHADE_UNIT, MIRROR_UNIT = 1, 2  # texture units; the world's own textures are at 0

VERTEX = """
uniform mat4 clip_world, world_part;
in vec3 position;
invariant gl_Position;
#ifdef TRUTH
in float link;
out float v_depth; flat out float v_link;
#else
uniform vec3 light;
uniform float ambient, diffuse;
in vec3 normal, uv;  // the texture's layer is the third of uv
out vec3 v_uv; out float v_light;
#endif
#ifdef LIT
uniform mat4 clip_sun;
out vec3 v_world, v_normal; out vec4 v_shade;
void place(vec4 world, vec3 normal) {
    v_world = world.xyz;
    v_normal = normal;
    v_shade = clip_sun * world;
}
#endif
void main() {
    vec4 world = world_part * vec4(position, 1.0);
    gl_Position = clip_world * world;
#ifdef TRUTH
    v_depth = gl_Position.w;  // the depth along the optical axis
    v_link = link;
#else
    vec3 n = mat3(world_part) * normal;
    v_light = ambient + diffuse * max(dot(n, light), 0.0);
    v_uv = uv;
#endif
#ifdef LIT
    place(world, n);
#endif
}
"""
FRAGMENT = """
#ifdef TRUTH
in float v_depth; flat in float v_link;
out vec2 truth;
void main() { truth = vec2(v_depth, v_link); }
#else
uniform sampler2DArray images;
in vec3 v_uv; in float v_light;
out vec4 colour;
#ifdef LIT
uniform vec3 sun, tint, lamp_at, eye_at;
uniform float sky_share, lamp, shine, cut;
uniform bool shaded;
uniform sampler2DShadow shade;
uniform sampler2D below;
in vec3 v_world, v_normal; in vec4 v_shade;
vec3 lit(vec3 albedo) {
    if (v_world.z < cut) discard;  // in the mirror's picture there is nothing but what stands on the floor
    vec3 n = normalize(v_normal);
    float direct = max(dot(n, sun), 0.0);
    if (shaded && direct > 0.0) {
        vec3 at = v_shade.xyz / v_shade.w * 0.5 + 0.5;
        if (all(greaterThan(at, vec3(0.0))) && all(lessThan(at, vec3(1.0)))) {
            float open = 0.0, step = 1.0 / textureSize(shade, 0).x;
            for (int i = -1; i <= 1; ++i)
                for (int j = -1; j <= 1; ++j) open += texture(shade, at + vec3(i * step, j * step, 0.0));
            direct *= open / 9.0;
        }
    }
    vec3 light = tint * (sky_share + (1.0 - sky_share) * direct);
    vec3 to_lamp = lamp_at - v_world;
    float d2 = max(dot(to_lamp, to_lamp), 1e-4);
    light += lamp * max(dot(n, to_lamp) * inversesqrt(d2), 0.0) / max(d2, 0.01);
    vec3 colour = albedo * light;
    if (shine > 0.0 && cut < -1e8 && abs(v_world.z) < FLOOR_M && n.z > 0.999) {
        float facing = normalize(eye_at - v_world).z;
        float share = shine + (1.0 - shine) * pow(1.0 - clamp(facing, 0.0, 1.0), 5.0);
        colour = mix(colour, texelFetch(below, ivec2(gl_FragCoord.xy), 0).rgb, share);
    }
    return colour;
}
#endif
void main() {
#ifdef LIT
    colour = vec4(lit(texture(images, v_uv).rgb), 1.0);
#else
    colour = vec4(texture(images, v_uv).rgb * v_light, 1.0);
#endif
}
#endif
""".replace("FLOOR_M", str(FLOOR_M))


def program(context: moderngl.Context, light: LightParams | None) -> moderngl.Program:
    """The program of a pass: what is seen in a light, or depth and link where that is None."""
    defined = "TRUTH" if light is None else "DAY" if light == DAY else "LIT"
    vertex, fragment = (f"#version 330\n#define {defined}\n{text}" for text in (VERTEX, FRAGMENT))
    return context.program(vertex_shader=vertex, fragment_shader=fragment)


# Draws all that there is through a `[4, 4]` matrix from the world to OpenGL's clip space.
Draw = Callable[[Array], None]


class Shading:
    """The light of one renderer, and what it draws before the picture itself."""

    def __init__(self, context: moderngl.Context, program: moderngl.Program, light: LightParams) -> None:
        """Binds to the program of a light.

        Args:
            context: the renderer's, entered.
            program: of its pass for colour.
            light: as `program` got it.
        """
        r, g, b = (min(colour * factor / 255.0, 1.0) for colour, factor in zip(SKY, light.tint, strict=True))
        self.light, self.sky = light, (r, g, b)
        self._context, self._program = context, program
        self._shade: moderngl.Framebuffer | None = None
        self._depth: moderngl.Texture | None = None
        self._below: moderngl.Framebuffer | None = None
        if light == DAY:
            self._set(light=light.sun, ambient=light.ambient, diffuse=1.0 - light.ambient)
            return
        self._set(sun=light.sun, tint=light.tint, sky_share=light.ambient, lamp=light.lamp, cut=-1e9)
        self._set(shine=light.floor_shine, shaded=light.shadows, shade=SHADE_UNIT, below=MIRROR_UNIT)
        # A sampler that nothing is bound to is undefined, even where it is not read.
        self._depth = context.depth_texture((SHADOW_SIDE, SHADOW_SIDE) if light.shadows else (1, 1))
        self._depth.compare_func = "<="
        self._depth.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self._depth.repeat_x = self._depth.repeat_y = False
        if light.shadows:
            self._shade = context.framebuffer(depth_attachment=self._depth)

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            if name in self._program:  # the compiler drops what is never read
                uniform = self._program[name]
                assert isinstance(uniform, moderngl.Uniform)
                uniform.value = value

    def shadow(self, corners: Array, draw: Draw) -> None:
        """Draws what the sun sees, once for all pictures until something moves; nothing without shadows.

        Args:
            corners: `[n, 3]` of what may throw a shadow, world frame.
            draw: draws it.
        """
        if self._shade is None or not len(corners):
            return
        clip_sun = _sun_matrix(np.array(self.light.sun), corners)
        self._write("clip_sun", clip_sun)
        self._set(shaded=False, shine=0.0)
        self._shade.use()
        self._shade.clear(depth=1.0)
        self._context.enable(moderngl.DEPTH_TEST)
        self._context.polygon_offset = 2.0, 4.0  # else a surface shades itself
        draw(clip_sun)
        self._context.polygon_offset = 0.0, 0.0
        self._set(shaded=True, shine=self.light.floor_shine)

    def begin(self, size: tuple[int, int], lamp_at: Array, eye_at: Array) -> None:
        """Before a picture: where lamp and eye are, and the textures in their units; nothing by day.

        Args:
            size: of the frame buffer that will be drawn into [px].
            lamp_at, eye_at: `[3]`, world frame [m].
        """
        if self._depth is None:
            return
        self._set(lamp_at=tuple(map(float, lamp_at)), eye_at=tuple(map(float, eye_at)))
        self._depth.use(SHADE_UNIT)
        if self._below is None or self._below.size != size:
            wanted = size if self.light.floor_shine else (1, 1)
            if self._below is None or self._below.size != wanted:
                self._below = self._context.framebuffer(
                    [self._context.texture(wanted, 4)], self._context.depth_texture(wanted)
                )
        picture = self._below.color_attachments[0]
        assert isinstance(picture, moderngl.Texture)
        picture.use(MIRROR_UNIT)

    def mirror(self, clip_world: Array, draw: Draw) -> None:
        """Draws what the floor shows of what stands on it; nothing where it does not shine. Before the picture.

        Args:
            clip_world: of the picture.
            draw: draws all there is.
        """
        if not self.light.floor_shine or self._below is None:
            return
        self._below.use()
        self._below.clear(*self.sky, 1.0)
        self._context.enable(moderngl.DEPTH_TEST)
        self._set(cut=FLOOR_M)
        draw(clip_world @ MIRROR)
        self._set(cut=-1e9)

    def _write(self, name: str, matrix: Array) -> None:
        if name in self._program:
            uniform = self._program[name]
            assert isinstance(uniform, moderngl.Uniform)
            uniform.write(matrix.T.astype(np.float32).tobytes())


def _sun_matrix(sun: Array, corners: Array) -> Array:
    """`[4, 4]` parallel projection along the sun's light, as narrow as holds the corners."""
    side = np.cross([0.0, 0.0, 1.0] if abs(sun[2]) < 0.99 else [1.0, 0.0, 0.0], sun)
    side /= np.linalg.norm(side)
    R = np.stack([side, np.cross(sun, side), sun])
    local = corners @ R.T
    low, high = local.min(axis=0), local.max(axis=0)
    middle, half = (low + high) / 2.0, np.maximum((high - low) / 2.0, 0.01) * 1.02
    half[2] += REACH  # what lies far behind is in it, too: a floor
    P = np.eye(4)
    P[:3, :3] = R / half[:, None]
    P[2, :3] *= -1.0  # nearer to the sun is nearer
    P[:3, 3] = -middle / half
    P[2, 3] *= -1.0
    return P
