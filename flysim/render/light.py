"""The light in a world: where it comes from, how much of it there is, what it does to a floor that shines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flysim.common.ranges import ranged
from flysim.geometry.frames import Array, inverse, transform
from flysim.robots.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class LightParams:
    """A high sun and an even sky, unless set otherwise. It changes what is seen, and never the truth.

    Light is added up linearly in grey levels, as the renderers have it: a level of 1 with a texture's 200 gives 200,
    and what is beyond 255 is white. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        level: factor of all light but the lamp's: 1 as it is drawn, 0.3 dusk, 0.05 a night with a moon, 0 darkness, 2
            glare.
        direction: towards the sun, world frame; its length does not matter.
        ambient: share of the light that comes from everywhere, 0 to 1; the rest is the sun's, and falls as Lambert
            (1760) has it, by the cosine of its angle to the surface.
        colour: of all light but the lamp's, red, green and blue, each 0 to 1.
        lamp: what a lamp on the robot, 5 cm above the middle between its eyes, adds to a surface that faces it at 1 m;
            it falls with the square of the distance. 0 is off.
        shadows: whether what stands throws a shadow of the sun.
        floor_shine: share of the light that the floor (what faces up at height 0) throws back as a mirror, looked at
            from straight above; it grows towards the horizon (Schlick 1994). 0 is off.
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    level: float = 1.0
    direction: tuple[float, float, float] = (0.35, 0.25, 0.9)
    ambient: float = 0.6
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    lamp: float = 0.0
    shadows: bool = False
    floor_shine: float = 0.0

    def __post_init__(self) -> None:
        for name in ("direction", "colour"):
            value = getattr(self, name)
            if isinstance(value, list):  # as TOML has it
                object.__setattr__(self, name, tuple(value))
        ranged(
            self,
            level=(0.0, 16.0, "(a factor)"),
            ambient=(0.0, 1.0, "of the light"),
            lamp=(0.0, 100.0, "(a factor, at 1 m)"),
            floor_shine=(0.0, 1.0, "of the light"),
        )
        _triple("direction", self.direction, -1e6, 1e6)
        _triple("colour", self.colour, 0.0, 1.0)
        if math.hypot(*self.direction) < 1e-6:
            raise ValueError("direction must lead somewhere, got (0, 0, 0)")
        if not isinstance(self.shadows, bool):
            raise ValueError(f"shadows must be true or false, got {self.shadows!r}")

    @property
    def sun(self) -> tuple[float, float, float]:
        """Unit vector towards the sun, world frame."""
        length = math.hypot(*self.direction)
        x, y, z = self.direction
        return x / length, y / length, z / length

    @property
    def tint(self) -> tuple[float, float, float]:
        """What red, green and blue are multiplied with: the level times the colour."""
        r, g, b = self.colour
        return self.level * r, self.level * g, self.level * b


def _triple(name: str, value: object, low: float, high: float) -> None:
    good = isinstance(value, tuple) and len(value) == 3
    for number in value if isinstance(value, tuple) else ():
        good = good and isinstance(number, int | float) and not isinstance(number, bool) and low <= number <= high
    if not good:
        raise ValueError(f"{name} must be three numbers in [{low:g}, {high:g}], got {value!r}")


DAY = LightParams()
LAMP_UP = 0.05  # [m] of the lamp above the middle between the eyes


def lamp_position(T_world_base: Array, robot: Robot) -> Array:
    """`[3]` where a robot's lamp is, world frame [m]."""
    T_base_left = robot.T_base_left
    T_base_right = T_base_left if robot.pair is None else T_base_left @ inverse(robot.pair.T_right_left)
    middle = (T_base_left[:3, 3] + T_base_right[:3, 3]) / 2.0 + np.array([0.0, 0.0, LAMP_UP])
    return transform(T_world_base, middle)
