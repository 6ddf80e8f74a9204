"""Where to stop in a world: `orbit`, `sweep`, `frontal`. Part of the task, so it may read the world's file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from flysim.errors import WorldError
from flysim.geometry.plan_view import APART
from flysim.paths.choose import shown_by, sides_seen
from flysim.paths.grid import CELL, FLOOR, survey
from flysim.paths.kinds import MAX_STOPS, frontal, joined, orbit, sweep
from flysim.paths.outlook import RobotGeometry, outlook
from flysim.paths.route import Ways
from flysim.paths.target import Targets, find_targets
from flysim.plain import shown_path
from flysim.worlds.ground import floor_level, middle_of
from flysim.worlds.model import World

PathKind = Literal["orbit", "sweep", "frontal"]
KINDS: tuple[PathKind, ...] = get_args(PathKind)
MARGIN = 0.035  # [m] beyond the robot's radius
_PATHS = {"orbit": orbit, "sweep": sweep, "frontal": frontal}


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


def plan_stops(world: World, robot: RobotGeometry, kind: PathKind, *, merge_gap: float = APART) -> Plan:
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
    start = start_node(ways, world)
    targets = find_targets(world, grid, merge_gap)
    if not len(targets.names):
        return _look_round(ways, start, kind)
    here = outlook(grid, targets, robot, ways.nodes[[start]], np.zeros(1))
    views = _PATHS[kind](grid, ways, targets, robot, (here, 0))
    places = [(*outlook.xy[k].tolist(), float(outlook.yaw[k])) for outlook, k in views]
    via = ((), *joined(ways, views))
    stops = tuple(PlannedStop(x=x, y=y, yaw=yaw, via=v) for (x, y, yaw), v in zip(places, via, strict=True))
    shown = shown_by(views, len(targets.xy))
    has, seen = sides_seen(targets, shown)
    coarse = () if grid.cell <= CELL else (f"the world is large: its floor was cut to cells of {grid.cell:.2f} m.",)
    return Plan(
        stops=stops,
        warnings=(*coarse, *_unseen(targets, shown, kind, len(stops))),
        covered=float(seen.sum() / has.sum()),
    )


def start_node(ways: Ways, world: World) -> int:
    """The node at the place to begin at if it is free, else the nearest of the largest free region.

    Raises:
        WorldError: the robot can stand nowhere.
    """
    place = middle_of(world.links)
    if not len(ways.nodes):
        raise WorldError(f"{shown_path(world.path)}: the robot can stand nowhere: {_why_nowhere(ways, world)}")
    node = ways.node_at(place)
    if np.hypot(*(ways.nodes[node] - place)) <= ways.grid.cell * 2.0:
        return node
    return ways.node_at(place, int(np.argmax(np.bincount(ways.region))))


def _why_nowhere(ways: Ways, world: World) -> str:
    level = floor_level(world.links)
    if level is None:
        return "it has no floor, nothing wide and level that collides. Give it a plane at z = 0."
    if abs(level) > FLOOR:
        return f"its floor is at z = {level:.3f}, not at z = 0. Move the world, or the floor."
    return (
        f"no place on its floor is {ways.room:.2f} m away from everything. Use a smaller robot, or a world with room."
    )


def _look_round(ways: Ways, start: int, kind: PathKind) -> Plan:
    """Six looks from the start, where there is nothing to go to."""
    x, y = ways.nodes[start].tolist()
    stops = tuple(PlannedStop(x=x, y=y, yaw=k * math.pi / 3.0) for k in range(6))
    said = f"the world has no obstacle: in place of path {kind} a look once round from the start."
    return Plan(stops=stops, warnings=(said,), covered=1.0)


def _unseen(targets: Targets, shown: np.ndarray, kind: PathKind, stops: int) -> tuple[str, ...]:
    """One sentence that names the obstacles of which no stop sees anything."""
    count = np.bincount(targets.obstacle, shown, minlength=len(targets.names))
    lost = [name for name, points in zip(targets.names, count, strict=True) if not points]
    if not lost:
        return ()
    named = ", ".join(f"'{name}'" for name in lost[:5]) + (f" and {len(lost) - 5} more" if len(lost) > 5 else "")
    why = "no free place that can be reached shows them"
    if kind == "sweep" or stops >= MAX_STOPS:
        why = "it leads past them too far off" if kind == "sweep" else f"it has {MAX_STOPS} stops at most"
    return (f"path {kind} sees nothing of {named}: {why}.",)
