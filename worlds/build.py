"""Makes the world files and textures of this folder, the same bytes every time.

    python worlds/build.py [NAME ...] [--out FOLDER]

README.md and preview.png of each world are not made here: the first is written by hand, the second by
`flysim preview`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from flysim.worlds.random.recipe import Body, Model, floor, standing
from flysim.worlds.random.write import write_world
from flysim.worlds.shapes import Box, Cylinder, Sphere

MADE_BY = "Made by worlds/build.py: change it there."
FLOOR, WALL, FAR_WALL = (0.52, 0.47, 0.38), (0.40, 0.46, 0.54), (0.54, 0.52, 0.56)
RED, GREEN, BLUE, YELLOW = (0.78, 0.27, 0.20), (0.24, 0.62, 0.28), (0.22, 0.40, 0.80), (0.82, 0.68, 0.18)
ORANGE, PURPLE, CYAN, PINK = (0.85, 0.47, 0.14), (0.56, 0.30, 0.72), (0.20, 0.66, 0.68), (0.84, 0.44, 0.60)


PAPER = (
    floor(2.0, 0.0, 8.0, 8.0, FLOOR),
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
        floor(cx, cy, 2.0 * YARD_HALF, 2.0 * YARD_HALF, FLOOR),
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
        floor(3.2, 0.0, 8.0, 2.0, FLOOR),
        Model("walls", walls, (3.2, 0.0, 0.0, 0.0, 0.0, 0.0), structure=True),
        standing("box_1", Box((0.40, 0.30, 0.50)), 1.9, 0.55, RED),
        standing("cylinder_1", Cylinder(0.18, 0.70), 3.3, -0.58, BLUE),
        standing("box_2", Box((0.35, 0.30, 0.30)), 4.7, 0.55, GREEN, yaw_deg=15.0),
        standing("cylinder_2", Cylinder(0.15, 0.40), 6.0, -0.60, YELLOW),
    )


WORLDS = {"paper": PAPER, "yard": yard(), "corridor": corridor()}


def build(name: str, out: Path) -> None:
    """Writes world.sdf and textures/ of one world into `out`."""
    write_world(out, name, WORLDS[name], made_by=MADE_BY)


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
