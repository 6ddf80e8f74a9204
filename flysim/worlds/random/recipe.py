"""What a world file is written from: bodies of one shape and one colour, in models that stand somewhere."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.worlds.shapes import Box, Cylinder, Plane, Shape, Sphere

Pose = tuple[float, float, float, float, float, float]  # x y z [m] roll pitch yaw [degrees]
Colour = tuple[float, float, float]  # RGB in [0, 1]

ORIGIN: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Body:
    """A link of one shape: what is seen is what is hit."""

    name: str
    shape: Shape
    pose: Pose  # in the model
    colour: Colour
    contrast: float = 0.30  # standard deviation of the texture's brightness, in [0, 1] of the whole range


@dataclass(frozen=True, slots=True)
class Model:
    """Links that stand together; none of them moves."""

    name: str
    bodies: tuple[Body, ...]
    pose: Pose = ORIGIN  # in the world
    structure: bool = False  # ground or wall: no obstacle


def standing(name: str, shape: Shape, x: float, y: float, colour: Colour, yaw_deg: float = 0.0) -> Model:
    """An obstacle: the model's origin lies on the floor, its link is raised by half its height."""
    body = Body("body", shape, (0.0, 0.0, height_of(shape) / 2.0, 0.0, 0.0, 0.0), colour)
    return Model(name, (body,), (x, y, 0.0, 0.0, 0.0, yaw_deg))


def floor(x: float, y: float, length: float, width: float, colour: Colour) -> Model:
    """A floor about (x, y)."""
    return Model("floor", (Body("floor", Plane((length, width)), ORIGIN, colour),), (x, y, *ORIGIN[2:]), True)


def height_of(shape: Shape) -> float:
    """[m] along z. Of a box, a cylinder or a sphere; 0 of what is flat."""
    match shape:
        case Box():
            return shape.size[2]
        case Cylinder():
            return shape.length
        case Sphere():
            return 2.0 * shape.radius
        case _:
            return 0.0
