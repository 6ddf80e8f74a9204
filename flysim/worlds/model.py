"""What a world file says, as records: a world has models, a model links, a link visuals and collisions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flysim.geometry.frames import Array, frozen
from flysim.worlds.shapes import Shape


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """How a visual looks: a texture image if there is one, else one colour."""

    diffuse: tuple[float, float, float] = (0.7, 0.7, 0.7)  # RGB in [0, 1]
    texture: Path | None = None  # an 8-bit PNG


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """One shape of a link, at its place in the link."""

    name: str
    shape: Shape
    T_link_part: Array  # [4, 4]
    material: Material = Material()  # of visuals; collisions ignore it

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_link_part", frozen(self.T_link_part, float))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Link:
    """A rigid body. Its index in `World.links` is its id in the instance masks."""

    name: str
    model: str
    T_world_link: Array  # [4, 4] as the file says; dynamic links move from there
    visuals: tuple[Part, ...]
    collisions: tuple[Part, ...]
    static: bool
    structure: bool  # ground or wall: its surface counts, but it is no obstacle
    mass: float = 1.0  # [kg], dynamic links alone
    inertia: tuple[float, float, float] | None = None  # [kg m^2] principal moments; None: from the shape

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_world_link", frozen(self.T_world_link, float))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class World:
    """A world as its file describes it.

    Attributes:
        links: every rigid body, structure included, in the order of the file.
        gravity: [m/s^2], along z.
        warnings: what the reader skipped, one sentence each.
    """

    name: str
    path: Path
    links: tuple[Link, ...]
    gravity: float = -9.81
    warnings: tuple[str, ...] = ()
