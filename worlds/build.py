"""Makes the world files and textures of this folder, the same bytes every time.

    python worlds/build.py [NAME ...] [--out FOLDER]

README.md and preview.png of each world are not made here: the first is written by hand, the second by
`flysim preview`.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.world.sdf import NAMESPACE
from flysim.world.shapes import Box, Cylinder, Plane, Shape, Sphere
from flysim.world.texture import speckle_shape, write_png

OBJECT_TEXEL, STRUCTURE_TEXEL = 0.002, 0.008  # [m] a pixel is 5 mm wide at 2.5 m
OBJECT_COLOURS, STRUCTURE_COLOURS = 128, 64  # of the palettes, for the size of the files
FLOOR_CELLS, WALL_CELLS, OBJECT_CELLS = (0.40, 0.16, 0.07), (0.30, 0.13, 0.064), (0.09, 0.04, 0.016)
FLOOR, WALL, FAR_WALL = (0.52, 0.47, 0.38), (0.40, 0.46, 0.54), (0.54, 0.52, 0.56)
RED, GREEN, BLUE, YELLOW = (0.78, 0.27, 0.20), (0.24, 0.62, 0.28), (0.22, 0.40, 0.80), (0.82, 0.68, 0.18)
ORANGE, PURPLE, CYAN, PINK = (0.85, 0.47, 0.14), (0.56, 0.30, 0.72), (0.20, 0.66, 0.68), (0.84, 0.44, 0.60)


@dataclass(frozen=True)
class Body:
    """A link of one shape. `pose` is x y z [m] roll pitch yaw [degrees] in the model."""

    name: str
    shape: Shape
    pose: tuple[float, float, float, float, float, float]
    colour: tuple[float, float, float]


@dataclass(frozen=True)
class Model:
    """Links that stand on `pose`: x y z [m] roll pitch yaw [degrees] in the world."""

    name: str
    bodies: tuple[Body, ...]
    pose: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    structure: bool = False


def standing(
    name: str, shape: Shape, x: float, y: float, colour: tuple[float, float, float], yaw_deg: float = 0.0
) -> Model:
    """An obstacle: the model's origin lies on the floor, its link is raised by half its height."""
    height = shape.size[2] if isinstance(shape, Box) else getattr(shape, "length", 2.0 * getattr(shape, "radius", 0.0))
    body = Body("body", shape, (0.0, 0.0, height / 2.0, 0.0, 0.0, 0.0), colour)
    return Model(name, (body,), (x, y, 0.0, 0.0, 0.0, yaw_deg))


def floor(x: float, y: float, length: float, width: float) -> Model:
    """A floor about (x, y)."""
    level = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Model("floor", (Body("floor", Plane((length, width)), level, FLOOR),), (x, y, *level[2:]), True)


PAPER = (
    floor(2.0, 0.0, 8.0, 8.0),
    Model(
        "wall",
        (Body("wall", Box((0.1, 5.0, 1.2)), (0.0, 0.0, 0.6, 0.0, 0.0, 0.0), WALL),),
        (3.65, 0.0, 0.0, 0.0, 0.0, 0.0),
        structure=True,
    ),
    standing("box", Box((0.40, 0.30, 0.35)), 2.2, 0.0, RED, yaw_deg=20.0),
)

YARD_MIDDLE, YARD_HALF = (2.6, 0.0), 3.6  # the inner faces of the walls


def yard() -> tuple[Model, ...]:
    """Eight obstacles in a ring round an empty middle, inside four walls."""
    cx, cy = YARD_MIDDLE
    out, long = YARD_HALF + 0.05, 2.0 * YARD_HALF + 0.2
    side = Box((long, 0.1, 0.9))
    across = Box((long - 0.2, 0.1, 0.9))
    walls = (
        Body("left", side, (0.0, out, 0.45, 0.0, 0.0, 0.0), WALL),
        Body("right", side, (0.0, -out, 0.45, 0.0, 0.0, 0.0), FAR_WALL),
        Body("front", across, (out, 0.0, 0.45, 0.0, 0.0, 90.0), WALL),
        Body("back", across, (-out, 0.0, 0.45, 0.0, 0.0, 90.0), FAR_WALL),
    )
    return (
        floor(cx, cy, 2.0 * YARD_HALF, 2.0 * YARD_HALF),
        Model("walls", walls, (cx, cy, 0.0, 0.0, 0.0, 0.0), structure=True),
        standing("box_1", Box((0.45, 0.35, 0.50)), cx - 1.15, cy - 1.15, RED),
        standing("box_2", Box((0.60, 0.40, 0.25)), cx, cy - 1.15, CYAN),
        standing("cylinder_1", Cylinder(0.15, 0.75), cx + 1.15, cy - 1.15, YELLOW),
        standing("sphere", Sphere(0.25), cx + 1.15, cy, PURPLE),
        standing("box_turned", Box((0.50, 0.30, 0.40)), cx + 1.15, cy + 1.15, GREEN, yaw_deg=30.0),
        standing("kerb", Box((0.15, 1.00, 0.10)), cx, cy + 0.95, ORANGE),
        standing("cylinder_2", Cylinder(0.20, 0.60), cx - 1.15, cy + 1.15, BLUE),
        standing("post", Cylinder(0.03, 0.90), cx - 1.15, cy, PINK),
    )


def corridor() -> tuple[Model, ...]:
    """Two metres wide, eight long, closed at the far end; four obstacles in turn on the left and right."""
    side = Box((8.0, 0.1, 1.0))
    walls = (
        Body("left", side, (0.0, 1.05, 0.5, 0.0, 0.0, 0.0), WALL),
        Body("right", side, (0.0, -1.05, 0.5, 0.0, 0.0, 0.0), FAR_WALL),
        Body("end", Box((0.1, 2.2, 1.0)), (4.05, 0.0, 0.5, 0.0, 0.0, 0.0), WALL),
    )
    return (
        floor(3.2, 0.0, 8.0, 2.0),
        Model("walls", walls, (3.2, 0.0, 0.0, 0.0, 0.0, 0.0), structure=True),
        standing("box_1", Box((0.40, 0.30, 0.50)), 1.9, 0.55, RED),
        standing("cylinder_1", Cylinder(0.18, 0.70), 3.3, -0.58, BLUE),
        standing("box_2", Box((0.35, 0.30, 0.30)), 4.7, 0.55, GREEN, yaw_deg=15.0),
        standing("cylinder_2", Cylinder(0.15, 0.40), 6.0, -0.60, YELLOW),
    )


WORLDS = {"paper": PAPER, "yard": yard(), "corridor": corridor()}


def geometry(shape: Shape) -> str:
    """The SDF element of a shape."""
    if isinstance(shape, Box):
        return "<box><size>{:g} {:g} {:g}</size></box>".format(*shape.size)
    if isinstance(shape, Plane):
        return "<plane><normal>0 0 1</normal><size>{:g} {:g}</size></plane>".format(*shape.size)
    if isinstance(shape, Cylinder):
        return f"<cylinder><radius>{shape.radius:g}</radius><length>{shape.length:g}</length></cylinder>"
    assert isinstance(shape, Sphere)
    return f"<sphere><radius>{shape.radius:g}</radius></sphere>"


def link(model: Model, body: Body) -> str:
    """The SDF element of a body: its collision shape is the one that is seen."""
    red, green, blue = body.colour
    return f"""\
      <link name="{body.name}">
        <pose degrees="true">{" ".join(f"{v:g}" for v in body.pose)}</pose>
        <collision name="collision">
          <geometry>{geometry(body.shape)}</geometry>
        </collision>
        <visual name="visual">
          <geometry>{geometry(body.shape)}</geometry>
          <material>
            <diffuse>{red:g} {green:g} {blue:g} 1</diffuse>
            <pbr><metal><albedo_map>textures/{texture_name(model, body)}</albedo_map></metal></pbr>
          </material>
        </visual>
      </link>
"""


def texture_name(model: Model, body: Body) -> str:
    """One texture for each body."""
    return f"{model.name}.png" if len(model.bodies) == 1 else f"{model.name}_{body.name}.png"


def world_sdf(name: str) -> str:
    """The world file."""
    models = []
    for model in WORLDS[name]:
        pose = " ".join(f"{v:g}" for v in model.pose)
        links = "".join(link(model, body) for body in model.bodies)
        structure = "      <flysim:structure>true</flysim:structure>\n" if model.structure else ""
        models.append(
            f'    <model name="{model.name}">\n{structure}      <static>true</static>\n'
            f'      <pose degrees="true">{pose}</pose>\n{links}    </model>\n'
        )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        "<!-- Made by worlds/build.py: change it there. -->\n"
        f'<sdf version="1.9" xmlns:flysim="{NAMESPACE}">\n  <world name="{name}">\n'
        "    <gravity>0 0 -9.81</gravity>\n" + "".join(models) + "  </world>\n</sdf>\n"
    )


def body_texture(name: str, model: Model, body: Body) -> NDArray[np.uint8]:
    """The texture of one body; its seed is the world's and its own name, so that bodies may come and go."""
    key = f"{name}/{model.name}/{body.name}".encode()
    cells, texel, chroma = OBJECT_CELLS, OBJECT_TEXEL, 0.5
    if model.structure:
        cells = FLOOR_CELLS if isinstance(body.shape, Plane) else WALL_CELLS
        texel, chroma = STRUCTURE_TEXEL, 0.15
    return speckle_shape(
        body.shape,
        np.random.default_rng(list(key)),
        metres_per_texel=texel,
        colour=body.colour,
        contrast=0.30,
        chroma=chroma,
        cells=cells,
    )


def build(name: str, out: Path) -> None:
    """Writes world.sdf and textures/ of one world into `out`."""
    (out / "textures").mkdir(parents=True, exist_ok=True)
    (out / "world.sdf").write_text(world_sdf(name), encoding="utf-8", newline="\n")
    for model in WORLDS[name]:
        for body in model.bodies:
            path = out / "textures" / texture_name(model, body)
            colours = STRUCTURE_COLOURS if model.structure else OBJECT_COLOURS
            write_png(body_texture(name, model, body), path, colours=colours)


def main() -> None:
    """Builds the worlds named on the command line, or all."""
    parser = argparse.ArgumentParser(description="Makes the world files and textures of this folder.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(WORLDS)}; none: all")
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parent)
    arguments = parser.parse_args()
    unknown = set(arguments.names) - set(WORLDS)
    if unknown:
        parser.error(f"no world {', '.join(sorted(unknown))}; there is {', '.join(WORLDS)}")
    for name in arguments.names or WORLDS:
        build(name, arguments.out / name)


if __name__ == "__main__":
    main()
