"""Where an episode takes place: a world, the ground a robot can drive on, a start, a goal and the shortest way."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from flysim.errors import FlysimError
from flysim.geometry.frames import Array, Pose2
from flysim.paths.footprint import Disc, Points, Polygon, footprint
from flysim.paths.grid import survey
from flysim.paths.route import Ways
from flysim.robots.robot import Robot
from flysim.worlds.model import World
from flysim.worlds.shapes import Plane

SPACING = 0.01  # [m] of points on outlines
AROUND = 4.5  # [m] of floor round all that stands there: BARN's goals lie 3.4 m beyond
LOWEST = 0.02  # [m] what is lower blocks no robot
MARGIN = 0.02  # [m] that the shortest way keeps from things beyond the robot's radius
ROOMY = 0.12  # [m] that drawn goals keep, beyond what the way keeps
# The same of drawn starts: a robot that has not moved yet cannot know of low things nearer than its cameras see.
START_ROOMY = 0.35
NEAREST_GOAL = 2.5  # [m] along the shortest way, of a drawn goal; less where the world has no such place


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Course:
    """One episode's task.

    Attributes:
        start: where the robot is set down, world frame.
        goal: x, y [m], world frame.
        shortest: [m] of the shortest way between them, of the robot's axis.
    """

    start: Pose2
    goal: tuple[float, float]
    shortest: float


class Ground:
    """A world's floor as a robot can use it: outlines of all that it would hit, and the free places between them.

    Bodies that move count where the world's file has them.
    """

    def __init__(self, world: World, robot: Robot) -> None:
        self.world, self.robot = world, robot
        self.outline = outlines(world, robot.height)  # [n, 2] m, world frame
        self._tree = KDTree(self.outline) if len(self.outline) else None

    @functools.cached_property
    def ways(self) -> Ways:
        """The free floor for the robot's axis."""
        return Ways(survey(self.world, self.robot.height, AROUND), self.robot.radius + MARGIN, dear=0.0)

    def clearance(self, x: float, y: float) -> float:
        """[m] between the robot's circle and the nearest thing it would hit; negative where they overlap."""
        near = math.inf if self._tree is None else float(self._tree.query((x, y))[0])
        return min(near, 100.0) - self.robot.radius

    def course(self, rng: np.random.Generator, start: Pose2 | None, goal: tuple[float, float] | None) -> Course:
        """A start and a goal, drawn where they are not given, with a way between them.

        Raises:
            FlysimError: nowhere to stand, or no way.
            ValueError: a given start or goal is taken by something.
        """
        ways = self.ways
        ways.forget()
        if not len(ways.nodes):
            raise FlysimError(f"{self.world.path}: the robot finds no place to stand. Give a smaller robot.")
        inside = self._inside()
        if start is not None:
            self._check("start", (start.x, start.y))
        if goal is not None:
            self._check("goal", goal)
        anchor = (start.x, start.y) if start is not None else goal if goal is not None else (0.0, 0.0)
        region = ways.region[ways.node_at(np.array(anchor))]
        clear = ways.grid.clear_of(ways.nodes) - ways.room
        places, free = (
            next(
                some
                for least in (room, ROOMY, -math.inf)
                if len(some := np.flatnonzero((inside | (least < 0.0)) & (clear >= least) & (ways.region == region)))
            )
            for room in (ROOMY, START_ROOMY)
        )
        if start is None:
            x, y = ways.nodes[rng.choice(free)].tolist()
            start = Pose2(x, y, float(rng.uniform(-math.pi, math.pi)))
        first = ways.node_at(np.array([start.x, start.y]), region)
        costs = ways.costs(first)
        if goal is None:
            reach = costs[places]
            far = places[reach >= min(NEAREST_GOAL, 0.75 * float(reach.max()))]
            gx, gy = ways.nodes[rng.choice(far)].tolist()
            goal = (gx, gy)
        last = ways.node_at(np.array(goal), region)
        off = math.dist(ways.nodes[last], goal)
        if not np.isfinite(costs[last]) or off > 0.5:
            raise ValueError(f"goal {_at(goal)}: no way leads there from {_at((start.x, start.y))}. Give another one.")
        points = np.array([(start.x, start.y), *ways.way(first, last), goal])
        return Course(start=start, goal=goal, shortest=float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()))

    def distances(self, goal: tuple[float, float]) -> Array:
        """`[n]` [m] of the shortest way from each of the ways' nodes to the goal; inf where there is none."""
        return self.ways.costs(self.ways.node_at(np.array(goal)))

    def _inside(self) -> np.ndarray:
        """`[n]` nodes among the things, not on the floor that goes on round them."""
        grid = self.ways.grid
        low = np.array(grid.origin) + AROUND
        high = grid.points(np.array([grid.shape]))[0] - AROUND
        return ((self.ways.nodes >= low - 1e-6) & (self.ways.nodes <= high + 1e-6)).all(axis=1)

    def _check(self, what: str, place: tuple[float, float]) -> None:
        if not all(math.isfinite(v) for v in place):
            raise ValueError(f"{what} must be finite, got {place}")
        if self.clearance(*place) < 0.0 or self.ways.grid.clear_of(np.array([place]))[0] <= 0.0:
            raise ValueError(
                f"{what} {_at(place)} is taken: something of world '{self.world.name}' stands within the robot's "
                f"radius of {self.robot.radius:.2f} m, or there is no floor. Give a free place."
            )


def _at(place: tuple[float, float]) -> str:
    return f"({place[0]:g}, {place[1]:g})"


def outlines(world: World, height: float) -> Array:
    """`[n, 2]` points [m], 1 cm apart, on the outlines of all that stands between 2 cm and `height` [m]."""
    found = [np.zeros((0, 2))]
    for link in world.links:
        for part in link.collisions or link.visuals:
            if isinstance(part.shape, Plane):
                continue
            T = link.T_world_link @ part.T_link_part
            one = footprint(part.shape, T, LOWEST, height, SPACING, solid=not link.static)
            match one:
                case Disc(x, y, radius):
                    angle = np.arange(max(12, math.ceil(math.tau * radius / SPACING)))
                    angle = angle * (math.tau / len(angle))
                    found.append(np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1))
                case Polygon(corners):
                    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                        n = max(1, math.ceil(float(np.linalg.norm(b - a)) / SPACING))
                        found.append(a + np.arange(n)[:, None] / n * (b - a))
                case Points(xy):
                    found.append(xy)
    return np.concatenate(found)
