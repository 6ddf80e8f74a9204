"""The three paths: which views of those that there are each of them takes, and in which order."""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.spatial import KDTree

from flysim.geometry.frames import Array
from flysim.paths.choose import LEAST_GAIN, cover
from flysim.paths.grid import Grid
from flysim.paths.outlook import FARTHEST, Outlook, RobotGeometry, outlook
from flysim.paths.route import Ways, tour
from flysim.paths.target import BANDS, Targets

MAX_STOPS = 60
MAX_PLACES = 900  # to look from, that are compared
LATTICE = 0.2  # [m] between them at least
ROW = 1.2  # [m] between the rows of a sweep, and between the places on a row, at least
BEYOND = 1.0  # [m] a sweep goes round the obstacles
LEAST_OUTLINE = 1.2  # [m] a smaller obstacle weighs as much as one with so long an outline
FULL_OUTLINE = 4.0  # [m] beyond that the weight grows with the root alone: a long wall does not take every stop
SIDE = math.radians(50.0)  # a frontal look stands within this of the line from an obstacle to the start

View = tuple[Outlook, int]


def orbit(grid: Grid, ways: Ways, targets: Targets, robot: RobotGeometry, start: View) -> list[View]:
    """Views of every obstacle from all sides, the start's own first, in the order of a short tour."""
    views = _all_views(grid, ways, targets, robot, start)
    chosen = cover(views, [start], _weights(targets, views), most=MAX_STOPS - 1)
    return _toured(ways, [start, *((views, k) for k in chosen)])


def frontal(grid: Grid, ways: Ways, targets: Targets, robot: RobotGeometry, start: View) -> list[View]:
    """One or two views of each obstacle from the side of the start, the start's own first, in the order of a tour."""
    views = _all_views(grid, ways, targets, robot, start)
    origin = start[0].xy[start[1]]
    to_start = origin - targets.xy
    facing = (to_start * targets.normal).sum(axis=1) > 0.2 * np.hypot(*to_start.T)
    taken = [start]
    weights = _weights(targets, views)
    distance = np.hypot(*(targets.centers - origin).T)
    for k in np.argsort(distance, kind="stable").tolist():
        most = min(2, MAX_STOPS - len(taken))
        weight = np.where(facing & (targets.obstacle == k), weights, 0.0)
        off = views.xy - targets.centers[k]
        cosine = off @ (origin - targets.centers[k])
        near = cosine >= math.cos(SIDE) * np.hypot(*off.T) * distance[k]
        chosen = cover(views, taken, weight, most=most, least=LEAST_GAIN, allowed=near)
        taken += [(views, v) for v in chosen]
    return _toured(ways, taken)


def sweep(grid: Grid, ways: Ways, targets: Targets, robot: RobotGeometry, start: View) -> list[View]:
    """Views along and across from rows over the free floor, up one and down the next; only those that see something."""
    step = ROW
    while True:
        places, yaws = _rows(ways, targets, _region(ways, start), step)
        views = outlook(grid, targets, robot, places, yaws)
        useful = np.flatnonzero(np.diff(views.starts)).tolist()
        if len(useful) < MAX_STOPS:
            return [start, *((views, v) for v in useful)]
        step *= 1.1


def _rows(ways: Ways, targets: Targets, region: int, step: float) -> tuple[Array, Array]:
    """`[n, 2]` places and `[n]` headings, up and down the longer side of the ground with the obstacles."""
    low, high = targets.xy.min(axis=0) - BEYOND, targets.xy.max(axis=0) + BEYOND
    along = int(np.argmax(high - low))
    across = 1 - along
    counts = [max(1, math.ceil((high[axis] - low[axis]) / step)) for axis in (along, across)]
    on_row = low[along] + (np.arange(counts[0]) + 0.5) * (high[along] - low[along]) / counts[0]
    rows = low[across] + (np.arange(counts[1]) + 0.5) * (high[across] - low[across]) / counts[1]
    nodes = ways.nodes[ways.region == region]
    tree = KDTree(nodes)
    ahead = 0.0 if along == 0 else math.pi / 2.0
    places, yaws = [], []
    for k, row in enumerate(rows.tolist()):
        forth = k % 2 == 0
        for n, place in enumerate((on_row if forth else on_row[::-1]).tolist()):
            wanted = np.empty(2)
            wanted[along], wanted[across] = place, row
            off, nearest = tree.query(wanted, distance_upper_bound=step / 2.0)
            if not math.isfinite(off):
                continue
            side = math.pi / 2.0 if n % 2 == 0 else -math.pi / 2.0
            places += [nodes[nearest], nodes[nearest]]
            yaws += [ahead if forth else ahead + math.pi, ahead + side]
    return np.array(places).reshape(-1, 2), np.array(yaws)


def _all_views(grid: Grid, ways: Ways, targets: Targets, robot: RobotGeometry, start: View) -> Outlook:
    """Views from free places that can be reached, on a lattice as far as some target might be seen."""
    nodes = ways.nodes[ways.region == _region(ways, start)]
    nodes = nodes[KDTree(targets.xy).query(nodes, distance_upper_bound=FARTHEST)[0] < FARTHEST]
    step = LATTICE
    while True:
        column, row = np.floor(nodes / step).astype(np.int64).T
        first = np.unique(row * 1_000_000 + column, return_index=True)[1]
        if len(first) <= MAX_PLACES:
            return outlook(grid, targets, robot, nodes[np.sort(first)])
        step *= 1.1


def _weights(targets: Targets, views: Outlook) -> Array:
    """`[n]` metres of outline each target counts for: of that which can be seen at all, small obstacles raised."""
    visible = np.zeros(len(targets.xy) * BANDS, dtype=bool)
    visible[views.columns] = True
    length = np.where(visible.reshape(-1, BANDS).any(axis=1), targets.length, 0.0)
    outline = np.bincount(targets.obstacle, length, minlength=len(targets.names))
    whole = np.where(outline > FULL_OUTLINE, np.sqrt(outline * FULL_OUTLINE), np.maximum(outline, LEAST_OUTLINE))
    return length * (whole / np.maximum(outline, 1e-9))[targets.obstacle]


def _region(ways: Ways, start: View) -> int:
    return int(ways.region[ways.node_at(start[0].xy[start[1]])])


def _toured(ways: Ways, views: list[View]) -> list[View]:
    nodes = [ways.node_at(outlook.xy[k]) for outlook, k in views]
    costs = np.array([ways.costs(node)[nodes] for node in nodes])
    return [views[k] for k in tour((costs + costs.T) / 2.0)]


def joined(ways: Ways, views: list[View]) -> list[tuple[tuple[float, float], ...]]:
    """The points to drive through before each view but the first."""
    nodes = [ways.node_at(outlook.xy[k]) for outlook, k in views]
    return [tuple(ways.way(a, b)) for a, b in itertools.pairwise(nodes)]
