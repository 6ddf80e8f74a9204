"""Where to stop in a world: `orbit`, `sweep`, `frontal`. Part of the task, so it may read the world's file."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from flysim.errors import WorldError
from flysim.geometry.frames import Array
from flysim.paths.choose import cover, shown_by, sides_seen
from flysim.paths.grid import survey
from flysim.paths.outlook import FARTHEST, RobotGeometry, outlook
from flysim.paths.route import Ways, tour
from flysim.paths.target import Targets, find_targets
from flysim.world.model import World

PathKind = Literal["orbit", "sweep", "frontal"]
KINDS: tuple[PathKind, ...] = get_args(PathKind)
MARGIN = 0.035  # [m] beyond the robot's radius
MAX_STOPS = 60
MAX_PLACES = 900  # to look from, that are compared


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedStop:
    """A stop: x, y [m], yaw [rad], and the points driven through on the way there."""

    x: float
    y: float
    yaw: float
    via: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A path.

    Attributes:
        stops: the robot starts at the first.
        warnings: what the path leaves out, one sentence each.
        covered: share of the obstacles' sides (sectors of 45 degrees of each outline) that some stop sees.
    """

    stops: tuple[PlannedStop, ...]
    warnings: tuple[str, ...]
    covered: float


def plan_stops(world: World, robot: RobotGeometry, kind: PathKind, *, merge_gap: float = 0.05) -> Plan:
    """Plans where to stop.

    Args:
        world: what stands there; bodies that move count where the file has them.
        robot: who drives and looks.
        kind: "orbit" looks at every obstacle from all sides, "sweep" goes up and down the free floor, "frontal" looks
            at every obstacle from the side of the start.
        merge_gap: obstacles at most so far apart are one [m].

    Raises:
        WorldError: the robot can stand nowhere.
    """
    grid = survey(world, robot.height)
    ways = Ways(grid, robot.radius + MARGIN)
    start = _start(ways, world, robot)
    targets = find_targets(world, grid, merge_gap)
    if not len(targets.xy):
        return _look_round(ways, start, world)
    places = _places(ways, targets, ways.region[start])
    views = outlook(grid, targets, robot, places)
    here = outlook(grid, targets, robot, ways.nodes[[start]], np.zeros(1))
    chosen = cover(views, here, targets.weight, most=MAX_STOPS - 1)
    first = PlannedStop(x=float(ways.nodes[start][0]), y=float(ways.nodes[start][1]), yaw=0.0)
    nodes = [start, *(ways.node_at(views.xy[k], int(ways.region[start])) for k in chosen)]
    yaws = [0.0, *(float(views.yaw[k]) for k in chosen)]
    stops = _joined(ways, nodes, yaws)
    has, seen = sides_seen(targets, shown_by([(views, chosen), (here, [0])], len(targets.xy)))
    return Plan(stops=(first, *stops), warnings=_unseen(targets, seen), covered=float(seen.sum() / has.sum()))


def _start(ways: Ways, world: World, robot: RobotGeometry) -> int:
    """The node at (0, 0) if it is free, else the nearest of the largest free region."""
    if not len(ways.nodes):
        raise WorldError(
            f"{world.path}: the robot can stand nowhere: no place on a floor at z = 0 is {ways.room:.2f} m away from "
            "everything. Use a smaller robot, or a world with room."
        )
    origin = np.zeros(2)
    node = ways.node_at(origin)
    if np.hypot(*ways.nodes[node]) <= ways.grid.cell * 2.0:
        return node
    return ways.node_at(origin, int(np.argmax(np.bincount(ways.region))))


def _look_round(ways: Ways, start: int, world: World) -> Plan:
    x, y = ways.nodes[start].tolist()
    stops = tuple(PlannedStop(x=x, y=y, yaw=k * math.pi / 3.0) for k in range(6))
    return Plan(stops=stops, warnings=("no obstacle to go to: the path looks once round from its start.",), covered=1.0)


def _places(ways: Ways, targets: Targets, region: int) -> Array:
    """`[p, 2]` free places [m] from which some target might be seen, on a lattice."""
    from scipy.spatial import KDTree

    nodes = ways.nodes[ways.region == region]
    near = KDTree(targets.xy).query(nodes, distance_upper_bound=FARTHEST)[0] < FARTHEST
    nodes = nodes[near]
    step = 0.2
    while True:
        cell = np.floor(nodes / step).astype(int)
        first = np.unique(cell, axis=0, return_index=True)[1]
        if len(first) <= MAX_PLACES:
            return nodes[np.sort(first)]
        step *= 1.15


def _joined(ways: Ways, nodes: Sequence[int], yaws: Sequence[float]) -> list[PlannedStop]:
    """The stops after the first one in the order of a short tour, with the ways between them."""
    costs = np.array([ways.costs(a)[list(nodes)] for a in nodes])
    order = tour((costs + costs.T) / 2.0)
    stops = []
    for a, b in itertools.pairwise(order):
        x, y = ways.nodes[nodes[b]].tolist()
        stops.append(PlannedStop(x=x, y=y, yaw=yaws[b], via=tuple(ways.way(nodes[a], nodes[b]))))
    return stops


def _unseen(targets: Targets, seen: np.ndarray) -> tuple[str, ...]:
    """One sentence that names the obstacles no stop sees any side of."""
    lost = [name for name, sides in zip(targets.names, seen, strict=True) if not sides.any()]
    if not lost:
        return ()
    named = ", ".join(f"'{name}'" for name in lost[:5]) + (f" and {len(lost) - 5} more" if len(lost) > 5 else "")
    return (f"no stop sees {named}: no free place to see it from was found.",)
