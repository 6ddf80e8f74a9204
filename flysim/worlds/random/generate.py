"""Worlds nobody tuned to: obstacles drawn at random, of three difficulties, the same for the same seed.

What a difficulty promises (counts, gaps, contrasts) is checked as a world is drawn, not hoped for: an attempt that
breaks a promise is thrown away. Places and sizes are whole millimetres, headings whole degrees.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.whole_folder import whole_folder
from flysim.errors import WorldError, did_you_mean
from flysim.worlds.random.difficulty import DIFFICULTIES
from flysim.worlds.random.draft import Draft
from flysim.worlds.random.recipe import Model
from flysim.worlds.random.write import write_world
from flysim.worlds.shapes import Box, Cylinder, Sphere

ATTEMPTS = 200
TEXEL = 0.003  # [m] on obstacles: a folder of fifteen stays below 2 MB


def generate(seed: int, difficulty: str = "medium") -> tuple[Model, ...]:
    """The floor, walls and obstacles of a world: a function of its arguments alone.

    The robot starts at the world's origin, heading along +x, near the middle of the room's back wall.

    Raises:
        WorldError: no such difficulty, or a seed that is not 0 to 2^63 - 1.
    """
    if difficulty not in DIFFICULTIES:
        raise WorldError(f"no difficulty '{difficulty}'. {did_you_mean(difficulty, DIFFICULTIES)}")
    if not 0 <= seed < 2**63:
        raise WorldError(f"the seed must be 0 to 2^63 - 1, got {seed}. Give another one.")
    rules = DIFFICULTIES[difficulty]
    for rng in np.random.default_rng([seed, rules.stream]).spawn(ATTEMPTS):
        world = Draft(rules, rng).world()
        if world is not None:
            return world
    raise AssertionError(f"no {difficulty} world in {ATTEMPTS} attempts with seed {seed}")


def write_random_world(folder: Path, *, seed: int, difficulty: str = "medium") -> Path:
    """Writes a generated world, `world.sdf` and `textures/`, whole or not at all.

    Args:
        folder: to make; it must not exist, or be empty.
        seed: the same gives the same bytes.
        difficulty: easy, medium or hard.

    Returns:
        The path of `world.sdf`.

    Raises:
        WorldError: as `generate`.
        RecordError: the folder cannot be written.
    """
    models = generate(seed, difficulty)
    made_by = f"Made by flysim world random, seed {seed}, difficulty {difficulty}."
    with whole_folder(folder) as room:
        write_world(room, f"random-{difficulty}-{seed}", models, made_by=made_by, object_texel=TEXEL, quick=True)
    return folder / "world.sdf"


def describe(model: Model) -> dict[str, Any]:
    """What a generated obstacle is, for JSON: its kind, its place, and each of its bodies with its own dimensions."""
    bodies = []
    for body in model.bodies:
        x, y, z = body.pose[:3]
        entry: dict[str, Any] = {"name": body.name, "x_m": x, "y_m": y, "z_m": z}
        match body.shape:
            case Box():
                entry |= {"shape": "box", "size_m": list(body.shape.size)}
            case Cylinder():
                entry |= {"shape": "cylinder", "radius_m": body.shape.radius, "height_m": body.shape.length}
            case Sphere():
                entry |= {"shape": "sphere", "radius_m": body.shape.radius}
        bodies.append(entry)
    return {
        "name": model.name,
        "shape": model.name.rpartition("_")[0],
        "x_m": model.pose[0],
        "y_m": model.pose[1],
        "yaw_deg": model.pose[5],
        "contrast": model.bodies[0].contrast,
        "bodies": bodies,
    }
