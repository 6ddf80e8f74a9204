"""A finished drive with all that was seen and believed on it: what the evaluator and the recorder read."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.products.cloud import FlyCloud
from flysim.products.obstacle import Obstacle
from flysim.products.swarm import Swarm
from flysim.truth.stop import Stop
from flysim.worlds.model import World


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Look:
    """A stop, the swarm that evolved there, and the wall-clock seconds it took."""

    stop: Stop
    swarm: Swarm
    evolve_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Journey:
    """A drive along a path.

    Attributes:
        looks: one a stop reached, in order.
        cloud: the flies of all looks in the world frame.
        obstacles: what they were fused to.
        planned: stops the path has.
        blocked: None, or what the robot ran into, as "blocked at stop 3 of 8 by box_2".
        obstacles_s: wall-clock seconds of clustering and fusion.
        total_s: wall-clock seconds of the whole drive, evaluation not included.
        max_range: [m] along the left optical axis; what is farther is neither estimated nor scored.
        texture: "speckle" where the world was dressed, else None.
        notes: what a planned path leaves out, one sentence each.
    """

    scenario: str
    seed: int
    renderer: str
    engine: str
    world: World
    looks: tuple[Look, ...]
    cloud: FlyCloud
    obstacles: tuple[Obstacle, ...]
    planned: int
    blocked: str | None
    obstacles_s: float
    total_s: float
    max_range: float
    texture: str | None = None
    notes: tuple[str, ...] = ()
