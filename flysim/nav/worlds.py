"""The worlds of episodes: by name, from a file, or drawn anew."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from flysim.common.catalogue import find_world
from flysim.errors import WorldError, did_you_mean
from flysim.foreign.arrays import read_npy
from flysim.geometry.frames import Pose2
from flysim.plain import shown_path
from flysim.worlds.ground import grounded
from flysim.worlds.model import World
from flysim.worlds.random.difficulty import DIFFICULTIES
from flysim.worlds.random.generate import generate
from flysim.worlds.random.recipe import Body, Model
from flysim.worlds.random.write import FLOOR_CELLS, OBJECT_CELLS, WALL_CELLS, texture_name, world_sdf
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Plane
from flysim.worlds.surface.atlas import atlas_size
from flysim.worlds.surface.dress import dress
from flysim.worlds.surface.texture import speckle_flat

RANDOM = "random-"
OBJECT_TEXEL, STRUCTURE_TEXEL = 0.005, 0.012  # [m] an image of 160 px sees 8 mm a pixel at 1 m

BLANK = np.full((1, 1, 3), 128, np.uint8)

BARN_START = Pose2(-2.25, 3.0, 1.57)
BARN_GOAL = (-2.25, 13.0)
BARN_PATH_BYTES, BARN_CELLS = 2**20, 1000
BARN_CELL, BARN_X, BARN_Y = 0.15, -4.575, 5.075  # [m] where its integer cells lie
# The rules: a success within 1 m of the goal, 100 s, 2 m/s; its grey cylinders are dressed.
BARN_SETTINGS = {
    "robot": "barn_rover",
    "texture": "speckle",
    "start": (BARN_START.x, BARN_START.y, BARN_START.yaw),
    "goal": BARN_GOAL,
    "goal_radius": 1.0,
    "time_limit": 100.0,
    "v_max": 2.0,
    "w_max": 2.5,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BarnWorld:
    """One world of the BARN benchmark (Perille et al., 2020): where it is, and how long its path is.

    Attributes:
        number: its own.
        path: the world file, plain or gzipped.
        length: [m] of the path that comes with it, from start to goal.
    """

    number: int
    path: Path
    length: float


def find_difficulty(world: str) -> str | None:
    """The difficulty of a world's name that stands for a fresh random one; None for any other name.

    Raises:
        WorldError: no such difficulty.
    """
    if not world.startswith(RANDOM) or "/" in world or world.endswith(".sdf"):
        return None
    difficulty = world.removeprefix(RANDOM)
    if difficulty not in DIFFICULTIES:
        raise WorldError(f"no difficulty '{difficulty}'. {did_you_mean(difficulty, DIFFICULTIES)}")
    return difficulty


def named_world(name: str, *, dressed: bool, models: Sequence[str] = ()) -> World:
    """The world of a name or a path; dressed in speckles where it is bare, if so asked."""
    world = grounded(read_world(find_world(name).resolve(), models))
    return dress(world) if dressed else world


def random_world(folder: Path, seed: int, difficulty: str, *, plain: bool = False) -> World:
    """What `flysim world random` makes of a seed, with textures for small images, in a fiftieth of the time.

    Args:
        folder: an empty one, for its files; the world lives no longer than it.
        seed: 0 to 2^63 - 1.
        difficulty: easy, medium or hard.
        plain: without textures, for who does not look at it.
    """
    models = generate(seed, difficulty)
    (folder / "textures").mkdir(parents=True)
    path = folder / "world.sdf"
    name = f"random-{difficulty}-{seed}"
    path.write_text(world_sdf(name, models, made_by=f"Seed {seed}, difficulty {difficulty}."), encoding="utf-8")
    for model in models:
        for body in model.bodies:
            rng = np.random.default_rng(list(f"{name}/{model.name}/{body.name}".encode()))
            Image.fromarray(BLANK if plain else _texture(model, body, rng)).save(
                folder / "textures" / texture_name(model, body), format="PNG", compress_level=1
            )
    return read_world(path)


def _texture(model: Model, body: Body, rng: np.random.Generator) -> np.ndarray:
    cells, texel, chroma = OBJECT_CELLS, OBJECT_TEXEL, 0.5
    if model.structure:
        cells = FLOOR_CELLS if isinstance(body.shape, Plane) else WALL_CELLS
        texel, chroma = STRUCTURE_TEXEL, 0.15
    return speckle_flat(
        atlas_size(body.shape),
        rng,
        metres_per_texel=texel,
        colour=body.colour,
        contrast=body.contrast,
        chroma=chroma,
        cells=cells,
    )


def barn_worlds(folder: Path) -> tuple[BarnWorld, ...]:
    """The BARN worlds in a folder, by number: `world_N.world[.gz]` and `path_files/path_N.npy`.

    Raises:
        WorldError: there is none, or a path is missing.
    """
    found = []
    for path in folder.glob("world_*.world*"):
        name = re.fullmatch(r"world_([0-9]{1,9})\.world(?:\.gz)?", path.name)
        if name is None:
            continue
        file = folder / "path_files" / f"path_{name[1]}.npy"
        cells = read_npy(file, f"path of BARN world {name[1]}", BARN_PATH_BYTES, WorldError)
        if cells.ndim != 2 or cells.shape[1] != 2 or not ((cells >= -BARN_CELLS) & (cells <= BARN_CELLS)).all():
            raise WorldError(
                f"{shown_path(file)}: no path of BARN, which is rows of two cells of at most {BARN_CELLS}."
            )
        found.append(BarnWorld(number=int(name[1]), path=path, length=barn_length(cells)))
    if not found:
        raise WorldError(f"no BARN worlds (world_N.world.gz) in {shown_path(folder)}. Name their folder with --barn.")
    return tuple(sorted(found, key=lambda world: world.number))


def barn_length(cells: np.ndarray) -> float:
    """[m] of a BARN path `[n, 2]` of integer cells (column, row), with start and goal at its ends."""
    xy = np.stack([BARN_CELL * cells[:, 0] + BARN_X, BARN_CELL * cells[:, 1] + BARN_Y], axis=1)
    points = np.concatenate([[(BARN_START.x, BARN_START.y)], xy, [BARN_GOAL]])
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
