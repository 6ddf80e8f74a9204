"""What the surfaces of a world show, where that is not what its file says: speckle, what repeats, or less contrast.

Flies need something to match. A texture that repeats offers several places to match at, slats that run along the rows
offer none, and without contrast there is nothing at all: studies turn these on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flysim.foreign.image import read_texture
from flysim.worlds.model import Link, Material, Part, World
from flysim.worlds.shapes import Plane
from flysim.worlds.surface.atlas import atlas_size
from flysim.worlds.surface.dress import dress, with_textures
from flysim.worlds.surface.texture import write_png

Finish = Literal["speckle", "tiles", "blinds"]
FINISHES: tuple[str, ...] = get_args(Finish)
TILE, JOINT = 0.10, 0.015  # [m] a square tile, and the joint between two
SLAT, GAP = 0.05, 0.02  # [m] from slat to slat, and the dark between them
DARK = 0.35  # of the colour, in joints and gaps


def finished(world: World, finish: Finish | None, contrast: float = 1.0) -> World:
    """The world with its surfaces as they are asked for; itself where nothing is.

    Textures that are made lie in a folder that lives as long as the world that is returned: keep that, not only its
    links.

    Args:
        world: as its file has it.
        finish: "speckle" dresses what has no texture. "tiles" and "blinds" take the place of every texture: square
            tiles, all alike; slats that run along the ground.
        contrast: of every texture, 0 to 1; at 0 each is one colour, the mean of it.

    Raises:
        FlysimError: a texture cannot be read or written.
    """
    if finish == "speckle":
        world = dress(world)
    elif finish is not None:
        world = dress(_bared(world), _tiled if finish == "tiles" else _slatted)
    return world if contrast == 1.0 else with_textures(lambda folder: _faded(world, contrast, folder))


def bare(world: World) -> tuple[int, int]:
    """How many of a world's obstacles show no texture at all, and how many it has; without any, of its structure."""
    models: dict[str, bool] = {}
    obstacles = any(not link.structure and link.visuals for link in world.links)
    for link in world.links:
        if link.visuals and not (obstacles and link.structure):
            textured = any(part.material.texture is not None for part in link.visuals)
            models[link.model] = models.get(link.model, False) or textured
    return sum(not textured for textured in models.values()), len(models)


def _bared(world: World) -> World:
    """Without textures, each visual in the mean colour of its own."""
    colours: dict[Path, tuple[float, float, float]] = {}

    def bared(part: Part) -> Part:
        texture = part.material.texture
        if texture is None:
            return part
        if texture not in colours:
            r, g, b = (read_texture(texture).mean(axis=(0, 1)) / 255.0).tolist()
            colours[texture] = (r, g, b)
        return replace(part, material=Material(diffuse=colours[texture]))

    return _with_visuals(world, bared)


def _faded(world: World, contrast: float, folder: Path) -> World:
    """With every texture drawn towards its mean, written into a folder."""
    made: dict[Path, Path] = {}

    def faded(part: Part) -> Part:
        texture = part.material.texture
        if texture is None:
            return part
        if texture not in made:
            image = read_texture(texture)
            mean = image.mean(axis=(0, 1))
            made[texture] = folder / f"faded-{len(made)}.png"
            write_png(np.rint(mean + contrast * (image - mean)).astype(np.uint8), made[texture])
        return replace(part, material=replace(part.material, texture=made[texture]))

    return _with_visuals(world, faded)


def _with_visuals(world: World, change: Callable[[Part], Part]) -> World:
    links: list[Link] = [replace(link, visuals=tuple(map(change, link.visuals))) for link in world.links]
    return replace(world, links=tuple(links))


def _tiled(part: Part, texel: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    width, height = _centres(part, texel)
    joint = (np.mod(width, TILE) < JOINT)[None, :] | (np.mod(height, TILE) < JOINT)[:, None]
    return _two_tone(part, joint)


def _slatted(part: Part, texel: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    width, height = _centres(part, texel)
    return _two_tone(part, np.broadcast_to((np.mod(height, SLAT) < GAP)[:, None], (len(height), len(width))))


def _centres(part: Part, texel: float) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Where the texels of a texture lie [m]: across from its left, and up from its lower edge, upper row first."""
    size = part.shape.size if isinstance(part.shape, Plane) else atlas_size(part.shape)
    columns, rows = (max(1, round(side / texel)) for side in size)
    return (np.arange(columns) + 0.5) * texel, (rows - np.arange(rows) - 0.5) * texel


def _two_tone(part: Part, dark: NDArray[np.bool_]) -> NDArray[np.uint8]:
    colour = np.clip(part.material.diffuse, 0.3, 0.9)
    return np.rint(255.0 * np.where(dark[..., None], DARK * colour, colour)).astype(np.uint8)
