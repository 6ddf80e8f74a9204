"""Writes a world from its recipe: `world.sdf` and one texture for each body, the same bytes every time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.worlds.random.recipe import Body, Model
from flysim.worlds.sdf.tree import NAMESPACE
from flysim.worlds.shapes import Box, Cylinder, Plane, Shape, Sphere
from flysim.worlds.surface.texture import speckle_shape, write_png

OBJECT_TEXEL, STRUCTURE_TEXEL = 0.002, 0.008  # [m] a pixel is 5 mm wide at 2.5 m
OBJECT_COLOURS, STRUCTURE_COLOURS = 128, 64  # of the palettes, for the size of the files
FLOOR_CELLS, WALL_CELLS, OBJECT_CELLS = (0.40, 0.16, 0.07), (0.30, 0.13, 0.064), (0.09, 0.04, 0.016)


def write_world(
    folder: Path,
    name: str,
    models: Sequence[Model],
    *,
    made_by: str,
    object_texel: float = OBJECT_TEXEL,
    quick: bool = False,
) -> Path:
    """Writes `world.sdf` and `textures/` into a folder, which is made if it is not there.

    Args:
        folder: where to.
        name: of the world; with a body's own name, the seed of its texture.
        models: what stands there, in the order of the file.
        made_by: the sentence that stands at the head of the file.
        object_texel: [m] a texel of what is no structure.
        quick: palettes in a tenth of the time, up to a tenth less exact.

    Returns:
        The path of `world.sdf`.
    """
    (folder / "textures").mkdir(parents=True, exist_ok=True)
    path = folder / "world.sdf"
    path.write_text(world_sdf(name, models, made_by=made_by), encoding="utf-8", newline="\n")
    for model in models:
        for body in model.bodies:
            colours = STRUCTURE_COLOURS if model.structure else OBJECT_COLOURS
            image = body_texture(name, model, body, object_texel=object_texel)
            write_png(image, folder / "textures" / texture_name(model, body), colours=colours, quick=quick)
    return path


def world_sdf(name: str, models: Sequence[Model], *, made_by: str) -> str:
    """The text of a world file."""
    elements = []
    for model in models:
        pose = " ".join(f"{v:g}" for v in model.pose)
        links = "".join(_link(model, body) for body in model.bodies)
        structure = "      <flysim:structure>true</flysim:structure>\n" if model.structure else ""
        elements.append(
            f'    <model name="{model.name}">\n{structure}      <static>true</static>\n'
            f'      <pose degrees="true">{pose}</pose>\n{links}    </model>\n'
        )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f"<!-- {made_by} -->\n"
        f'<sdf version="1.9" xmlns:flysim="{NAMESPACE}">\n  <world name="{name}">\n'
        "    <gravity>0 0 -9.81</gravity>\n" + "".join(elements) + "  </world>\n</sdf>\n"
    )


def body_texture(world: str, model: Model, body: Body, *, object_texel: float = OBJECT_TEXEL) -> NDArray[np.uint8]:
    """`[H, W, 3]` the texture of one body; its seed is the world's and its own name: bodies may come and go."""
    key = f"{world}/{model.name}/{body.name}".encode()
    cells, texel, chroma = OBJECT_CELLS, object_texel, 0.5
    if model.structure:
        cells = FLOOR_CELLS if isinstance(body.shape, Plane) else WALL_CELLS
        texel, chroma = STRUCTURE_TEXEL, 0.15
    return speckle_shape(
        body.shape,
        np.random.default_rng(list(key)),
        metres_per_texel=texel,
        colour=body.colour,
        contrast=body.contrast,
        chroma=chroma,
        cells=cells,
    )


def texture_name(model: Model, body: Body) -> str:
    """One texture for each body."""
    return f"{model.name}.png" if len(model.bodies) == 1 else f"{model.name}_{body.name}.png"


def _link(model: Model, body: Body) -> str:
    red, green, blue = body.colour
    return f"""\
      <link name="{body.name}">
        <pose degrees="true">{" ".join(f"{v:g}" for v in body.pose)}</pose>
        <collision name="collision">
          <geometry>{_geometry(body.shape)}</geometry>
        </collision>
        <visual name="visual">
          <geometry>{_geometry(body.shape)}</geometry>
          <material>
            <diffuse>{red:g} {green:g} {blue:g} 1</diffuse>
            <pbr><metal><albedo_map>textures/{texture_name(model, body)}</albedo_map></metal></pbr>
          </material>
        </visual>
      </link>
"""


def _geometry(shape: Shape) -> str:
    match shape:
        case Box():
            return "<box><size>{:g} {:g} {:g}</size></box>".format(*shape.size)
        case Plane():
            return "<plane><normal>0 0 1</normal><size>{:g} {:g}</size></plane>".format(*shape.size)
        case Cylinder():
            return f"<cylinder><radius>{shape.radius:g}</radius><length>{shape.length:g}</length></cylinder>"
        case Sphere():
            return f"<sphere><radius>{shape.radius:g}</radius></sphere>"
        case _:
            raise ValueError(f"a {type(shape).__name__} is not written: use boxes, cylinders, spheres and planes")
