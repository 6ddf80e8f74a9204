"""Where each piece of a shape's surface lies in its texture: one picture, wrapped once round the shape."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import Array
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """A flat rectangle of a texture and the surface it covers, to one scale.

    Attributes:
        name: as in "side", "top".
        origin: left lower corner in the texture [m], u right, v up.
        size: width and height in the texture [m].
    """

    name: str
    origin: tuple[float, float]
    size: tuple[float, float]


def atlas_patches(shape: Shape) -> tuple[Patch, ...]:
    """The patches of a shape's texture, none over another.

    The four sides of a box, and the side of a cylinder, stand along the lower edge; the top and the bottom
    lie above them. A sphere's is its map by longitude and latitude, true to scale along the equator.
    A mesh that comes without texture coordinates has the patches of its bounding box.
    """
    if isinstance(shape, Plane):
        return (Patch(name="top", origin=(0.0, 0.0), size=shape.size),)
    if isinstance(shape, Sphere):
        return (Patch(name="side", origin=(0.0, 0.0), size=(math.tau * shape.radius, math.pi * shape.radius)),)
    if isinstance(shape, Cylinder):
        r, height = shape.radius, shape.length
        return (
            Patch(name="side", origin=(0.0, 0.0), size=(math.tau * r, height)),
            Patch(name="top", origin=(0.0, height), size=(2.0 * r, 2.0 * r)),
            Patch(name="bottom", origin=(2.0 * r, height), size=(2.0 * r, 2.0 * r)),
        )
    x, y, z = _box_of(shape)
    return (
        Patch(name="+x", origin=(0.0, 0.0), size=(y, z)),
        Patch(name="+y", origin=(y, 0.0), size=(x, z)),
        Patch(name="-x", origin=(y + x, 0.0), size=(y, z)),
        Patch(name="-y", origin=(y + x + y, 0.0), size=(x, z)),
        # Lying down, so that the top of a long wall does not make its texture as high as the wall is long.
        Patch(name="top", origin=(0.0, z), size=(max(x, y), min(x, y))),
        Patch(name="bottom", origin=(max(x, y), z), size=(max(x, y), min(x, y))),
    )


def atlas_size(shape: Shape) -> tuple[float, float]:
    """Width and height [m] of the surface that a shape's texture shows."""
    patches = atlas_patches(shape)
    return (
        max(p.origin[0] + p.size[0] for p in patches),
        max(p.origin[1] + p.size[1] for p in patches),
    )


def atlas_pixels(shape: Shape, metres_per_texel: float) -> tuple[int, int]:
    """Width and height [px] of a texture of about that density."""
    width, height = atlas_size(shape)
    return max(1, round(width / metres_per_texel)), max(1, round(height / metres_per_texel))


def atlas_points(shape: Shape, width: int, height: int) -> Array:
    """`[height, width, 3]` the surface point [m, shape's frame] each texel shows; row 0 is the upper edge.

    Noise that is a function of these points covers the shape evenly and without seams. Texels beyond the
    patches get a point of the plane that their patch lies in.
    """
    atlas_width, atlas_height = atlas_size(shape)
    a = (np.arange(width) + 0.5) / width * atlas_width
    b = (1.0 - (np.arange(height) + 0.5) / height) * atlas_height
    u, v = np.meshgrid(a, b)
    if isinstance(shape, Plane):
        return np.stack([u - shape.size[0] / 2.0, v - shape.size[1] / 2.0, np.zeros_like(u)], axis=-1)
    if isinstance(shape, Sphere):
        longitude, latitude = u / shape.radius - math.pi, v / shape.radius - math.pi / 2.0
        (ring, height_of_ring), (cos, sin) = cosine_sine(latitude), cosine_sine(longitude)
        unit = np.stack([ring * cos, ring * sin, height_of_ring], axis=-1)
        return unit * shape.radius
    if isinstance(shape, Cylinder):
        r, half = shape.radius, shape.length / 2.0
        cos, sin = cosine_sine(u / r - math.pi)
        side = np.stack([r * cos, r * sin, v - half], axis=-1)
        upper = u < 2.0 * r
        x = np.where(upper, u - r, u - 3.0 * r)
        y = v - shape.length - r
        cap = np.stack([x, np.where(upper, y, -y), np.where(upper, half, -half)], axis=-1)
        return np.where((v < shape.length)[..., None], side, cap)
    x, y, z = _box_of(shape)
    points = np.zeros((height, width, 3))
    for patch in atlas_patches(shape):
        (u0, v0), (du, dv) = patch.origin, patch.size
        # A texel belongs to the last patch it begins in, so that none is left without a point.
        columns = slice(int(np.argmax(a >= u0)), None)
        rows = np.flatnonzero((b >= v0) & ((b < v0 + dv) | (v0 > 0.0)))
        if not len(rows):
            continue
        region = slice(rows[0], rows[-1] + 1), columns
        across, up = u[region] - u0 - du / 2.0, v[region] - v0 - dv / 2.0
        points[region] = _box_points(patch.name, across, up, (x, y, z))
    return points


def cosine_sine(angle: Array) -> tuple[Array, Array]:
    """Cosine and sine of angles [rad] of a few turns, to the last bit or two, the same on every machine.

    The platform's own differ in the last bit. Here are sums and products alone: the series of Taylor within an eighth
    of a turn, and quarter turns.
    """
    quarters = np.rint(angle * (2.0 / math.pi))
    rest = angle - quarters * (math.pi / 2.0)
    square = rest * rest
    cos, sin = np.ones_like(square), np.ones_like(square)
    for n in range(16, 0, -2):
        cos = 1.0 - cos * square / (n * (n - 1))
        sin = 1.0 - sin * square / (n * (n + 1))
    sin *= rest
    turn = quarters.astype(np.int64) % 4
    return np.choose(turn, [cos, -sin, -cos, sin]), np.choose(turn, [sin, cos, -sin, -cos])


def box_uv(points: Array, normals: Array, size: tuple[float, float, float]) -> Array:
    """`[N, 2]` texture coordinates in [0, 1] of points on or in a box, each by the side its normal faces."""
    box = Box(size)
    axis = np.argmax(np.abs(normals), axis=1)
    positive = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] >= 0.0
    side = np.array([["-x", "+x"], ["-y", "+y"], ["bottom", "top"]])[axis, positive.astype(int)]
    uv = np.empty((len(points), 2))
    px, py, pz = points.T
    top, bottom = ((px, py), (px, -py)) if size[0] >= size[1] else ((py, -px), (py, px))
    across = {
        "+x": (py, pz),
        "+y": (-px, pz),
        "-x": (-py, pz),
        "-y": (px, pz),
        "top": top,
        "bottom": bottom,
    }
    for patch in atlas_patches(box):
        mine = side == patch.name
        for column in range(2):
            middle = patch.origin[column] + patch.size[column] / 2.0
            uv[mine, column] = middle + across[patch.name][column][mine]
    return np.clip(uv / atlas_size(box), 0.0, 1.0)


def _box_points(name: str, a: Array, b: Array, size: tuple[float, float, float]) -> Array:
    """The points of one side, `a` to the right and `b` up from its middle as it is seen from outside."""
    x, y, z = (np.full_like(a, s / 2.0) for s in size)
    top, bottom = ((a, b, z), (a, -b, -z)) if size[0] >= size[1] else ((-b, a, z), (b, a, -z))
    sides = {
        "+x": (x, a, b),
        "+y": (-a, y, b),
        "-x": (-x, -a, b),
        "-y": (a, -y, b),
        "top": top,
        "bottom": bottom,
    }
    return np.stack(sides[name], axis=-1)


def _box_of(shape: Box | Mesh) -> tuple[float, float, float]:
    """The size of a box, or of a mesh's bounding box (at least 1 mm thick)."""
    if isinstance(shape, Box):
        return shape.size
    x, y, z = np.maximum(np.ptp(shape.vertices, axis=0), 1e-3)
    return float(x), float(y), float(z)
