"""Dresses bare worlds: what has no texture gets a speckle in its own colour, since flies need something to match.

Like shapes share a handful of textures, so that a world of hundreds of cylinders is dressed in a second or two.
"""

from __future__ import annotations

import math
import tempfile
import weakref
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flysim.common.scratch import Scratch
from flysim.errors import FlysimError
from flysim.geometry.frames import Array, inverse, transform
from flysim.worlds.model import Link, Part, World
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere
from flysim.worlds.surface.atlas import atlas_size
from flysim.worlds.surface.texture import speckle_flat, speckle_shape

VARIANTS = 16  # textures that shapes of one kind, size and colour share, in turns
MAX_TEXTURES = 300  # beyond that, shapes of about one size share as well
GRAINS = (0.0, 0.1, 0.5, 3.0)  # how far their sizes may then differ: none, 10 %, ...
FINEST = 0.004  # [m] a texel
TEXELS = 1_000_000  # of all solid shapes of a world; more surface than that takes gets coarser texels
FLAT_TEXELS = 1_000_000  # of a plane
GROUND = 4.0  # [m] a plane goes on beyond all that stands there; flies search no farther
LARGE = 6.0  # [m] of texture: a sphere or a mesh with more gets a flat one, since noise in space would take gigabytes
MIDDLE = (0.3, 0.7)  # a colour nearer to black or white would leave no room for blotches

# Of a part, the side of a texel [m] and what is random, to `[H, W, 3]` its texture (`atlas` has where each face lies).
Painter: TypeAlias = Callable[[Part, float, np.random.Generator], NDArray[np.uint8]]


def dress(world: World, paint: Painter | None = None) -> World:
    """The same world with a texture on every visual that had none. A plane is cut to where it can be seen from near.

    The textures lie in a folder of their own that lives as long as the world that is returned: keep that, not only
    its links.

    Args:
        world: whose bare visuals are dressed.
        paint: makes a texture; None: a speckle in the visual's own colour.

    Raises:
        FlysimError: the textures cannot be written.
    """
    return with_textures(lambda folder: replace(world, links=_dressed(world, folder, paint or speckled)))


def with_textures(make: Callable[[Path], World]) -> World:
    """The world that a function makes, which writes textures into the folder it is given.

    The folder lives as long as the world.

    Raises:
        FlysimError: the textures cannot be written.
    """
    try:
        scratch = Scratch()
        try:
            made = make(Path(scratch.name))
        except BaseException:
            scratch.cleanup()
            raise
    except OSError as error:
        raise FlysimError(
            f"cannot write the textures of a dressed world to {tempfile.gettempdir()}: {error.strerror or error}. "
            "Free some space there, or set TMPDIR to another folder."
        ) from error
    weakref.finalize(made, scratch.cleanup)
    return made


@dataclass(frozen=True, slots=True)
class _Sort:
    """What shapes that share textures have in common."""

    kind: str
    size: tuple[float, ...]  # [m], or steps of the logarithm
    colour: tuple[float, ...]


def _dressed(world: World, folder: Path, paint: Painter) -> tuple[Link, ...]:
    extent = _extent(world)
    bare = [[_bare(link, part, extent) for part in link.visuals] for link in world.links]
    worn = [part for parts in bare for part in parts if part is not None]
    grain, count = 0.0, Counter[_Sort]()
    for grain in GRAINS:
        count = Counter(_sort(part, grain) for part in worn)
        if sum(min(n, VARIANTS) for n in count.values()) <= MAX_TEXTURES:
            break
    example = {_sort(part, grain): part for part in reversed(worn)}
    area = sum(
        math.prod(atlas_size(example[sort].shape)) * min(n, VARIANTS)
        for sort, n in count.items()
        if not isinstance(example[sort].shape, Plane)
    )
    texel = max(FINEST, math.sqrt(area / TEXELS))
    textures: dict[tuple[_Sort, int], Path] = {}
    turn: Counter[_Sort] = Counter()
    links = []
    for link, parts in zip(world.links, bare, strict=True):
        visuals = []
        for part, dressed in zip(link.visuals, parts, strict=True):
            if dressed is None:
                visuals.append(part)
                continue
            sort = _sort(dressed, grain)
            key = sort, turn[sort] % VARIANTS
            turn[sort] += 1
            if key not in textures:
                # By the name of what wears it first: the same world is dressed the same way every time.
                seed = zlib.crc32(f"{link.model}::{link.name}::{part.name}".encode(errors="surrogatepass"))
                textures[key] = folder / f"speckle-{len(textures)}.png"
                finest = FINEST if isinstance(dressed.shape, Plane) else texel
                _write(paint(dressed, _texel(dressed, finest), np.random.default_rng(seed)), textures[key])
            visuals.append(replace(dressed, material=replace(dressed.material, texture=textures[key])))
        links.append(replace(link, visuals=tuple(visuals)))
    return tuple(links)


def _bare(link: Link, part: Part, extent: Array) -> Part | None:
    """A part without texture as it is dressed: cut if it is a large plane; None where it has a texture."""
    if part.material.texture is not None:
        return None
    if isinstance(part.shape, Mesh):  # its own coordinates are for a picture that there is none of
        return replace(part, shape=replace(part.shape, uv=None))
    if not isinstance(part.shape, Plane):
        return part
    corners = np.array(np.meshgrid(*extent.T)).reshape(3, -1).T
    local = transform(inverse(link.T_world_link @ part.T_link_part), corners)[:, :2]
    half = np.array(part.shape.size) / 2.0
    low, high = np.maximum(local.min(axis=0), -half), np.minimum(local.max(axis=0), half)
    if not (high - low > 0.0).all():
        return part
    width, height = (high - low).tolist()
    T = part.T_link_part.copy()
    T[:3, 3] = transform(T, [*((low + high) / 2.0), 0.0])
    return replace(part, shape=Plane((width, height)), T_link_part=T)


def _extent(world: World) -> Array:
    """`[2, 3]` corners [m] of the box in which a plane may be seen from near."""
    corners = [np.zeros((1, 3))]
    for link in world.links:
        corners += [
            transform(link.T_world_link @ part.T_link_part, part.shape.outline())
            for part in link.visuals or link.collisions
            if not isinstance(part.shape, Plane)
        ]
    points = np.concatenate([[corner.min(axis=0), corner.max(axis=0)] for corner in corners])
    return np.stack([points.min(axis=0) - GROUND, points.max(axis=0) + GROUND])


def _sort(part: Part, grain: float) -> _Sort:
    sizes = _measures(part.shape)
    size = tuple(round(math.log(v) / math.log1p(grain)) if grain else round(v, 3) for v in sizes)
    # Of many colours a few are left.
    colour = part.material.diffuse if grain <= GRAINS[1] else tuple(round(2.0 * c) / 2.0 for c in part.material.diffuse)
    return _Sort(type(part.shape).__name__, size, colour)


def _measures(shape: Shape) -> Iterator[float]:
    match shape:
        case Box() | Plane():
            yield from shape.size
        case Cylinder():
            yield from (shape.radius, shape.length)
        case Sphere():
            yield shape.radius
        case Mesh():
            yield from np.maximum(np.ptp(shape.vertices, axis=0), 1e-3).tolist()


def _texel(part: Part, texel: float) -> float:
    """Side of a texel [m], no finer than the part's texture may have."""
    return max(texel, math.sqrt(math.prod(_extent_of(part)) / FLAT_TEXELS))


def _extent_of(part: Part) -> tuple[float, float]:
    return part.shape.size if isinstance(part.shape, Plane) else atlas_size(part.shape)


def _write(image: NDArray[np.uint8], path: Path) -> None:
    from PIL import Image

    Image.fromarray(image).save(path, format="PNG", compress_level=1)


def speckled(part: Part, texel: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """A speckle that never repeats, in the part's own colour."""
    shape, size = part.shape, _extent_of(part)
    r, g, b = (min(max(value, MIDDLE[0]), MIDDLE[1]) for value in part.material.diffuse)
    if isinstance(shape, Sphere | Mesh) and max(size) < LARGE:
        return speckle_shape(shape, rng, metres_per_texel=texel, colour=(r, g, b))
    # A seam at an edge, or down one side of a cylinder, does no harm.
    return speckle_flat(size, rng, metres_per_texel=texel, colour=(r, g, b))
