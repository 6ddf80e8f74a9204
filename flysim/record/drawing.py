"""What the figures of a run are drawn with: bodies, flies, stops and pictures put into axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flysim.evaluate.track import Track
from flysim.geometry.frames import Array, yaw_of
from flysim.products.findings import Findings, Seen
from flysim.record import colours
from flysim.record.canvas import label
from flysim.record.outline import PlacedPart, believed_points, box_corners, hull
from flysim.truth.truth import Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from flysim.products.obstacle import Obstacle
    from flysim.truth.obstacles import TrueObstacle

_MOST_FLIES = 6000  # more dots than this only cost time
NEAR = 0.10  # [m] flies at most so far beside a box are drawn in the planes
_MOST_NAMES = 15  # more names than this hide the figure
TRUE, BELIEVED = colours.hexadecimal(colours.TRUE), colours.hexadecimal(colours.BELIEVED)
_FLY, _STRUCTURE = colours.hexadecimal(colours.FLY), colours.hexadecimal(colours.STRUCTURE)
LETTERS = "xyz"


def draw_part(axes: Axes, part: PlacedPart, plane: tuple[int, int]) -> None:
    """The body below the flies and its outline above them."""
    outline = part.outline(plane)
    if part.structure:
        axes.fill(*outline.T, facecolor=_STRUCTURE, edgecolor=_STRUCTURE, linewidth=1.5, zorder=2, label="wall")
        return
    axes.fill(*outline.T, facecolor=(*(c / 255 for c in colours.TRUE), 0.15), zorder=2)
    axes.fill(*outline.T, facecolor="none", edgecolor=TRUE, linewidth=1.5, zorder=4, label="obstacle, true")


def draw_flies(axes: Axes, points: Array, plane: tuple[int, int], area: float) -> None:
    """Flies as dots, thinned if they are many; `plane` has the two axes to draw."""
    thin = points[:: max(-(-len(points) // _MOST_FLIES), 1), plane]
    axes.scatter(*thin.T, s=area, color=_FLY, alpha=0.45, linewidths=0, zorder=3)
    axes.plot([], [], ".", color=_FLY, markersize=6, label="flies")  # one that the legend can show


def draw_believed(axes: Axes, box: Obstacle, plane: tuple[int, int]) -> None:
    """The outline of an estimated obstacle in a plane."""
    outline = hull(believed_points(box)[:, plane])
    style = {"edgecolor": BELIEVED, "linewidth": 1.8, "linestyle": "--"}
    axes.fill(*outline.T, facecolor="none", zorder=4.5, label="obstacle, estimated", **style)
    axes.plot(*box.center[list(plane)], "+", color=BELIEVED, markersize=7, zorder=4.5)


def draw_legend(axes: Axes, place: Axes, **where: Any) -> None:
    """Each label once, however many artists bear it."""
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    place.legend(handles.values(), handles.keys(), frameon=False, **where)


def draw_names(axes: Axes, true_obstacles: Sequence[TrueObstacle]) -> None:
    """The names of the true obstacles beside them, unless they are many."""
    if len(true_obstacles) > _MOST_NAMES:
        return
    for obstacle in true_obstacles:
        top = box_corners(obstacle.center, obstacle.size, obstacle.yaw)[:, 1].max()
        axes.annotate(
            obstacle.name,
            (obstacle.center[0], top),
            xytext=(0, 5),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=8,
            color=TRUE,
            zorder=7,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.0},
        )


def draw_stops(axes: Axes, findings: Findings, truth: Truth | None) -> None:
    """Numbered discs at the true stops, or where they are believed to be, with an arrow along the heading."""
    if not findings.seen:
        return
    if truth is None:
        poses = [(*one.frame.T_world_base[:2, 3], yaw_of(one.frame.T_world_base)) for one in findings.seen]
        numbers = [one.frame.index for one in findings.seen]
    else:
        poses = [(stop.true.x, stop.true.y, stop.true.yaw) for stop in truth.stops]
        numbers = [stop.index for stop in truth.stops]
    x, y, yaw = np.array(poses).T
    inch = {"units": "inches", "width": 0.02, "scale_units": "inches", "scale": 1.0 / 0.24, "headlength": 4}
    axes.quiver(x, y, np.cos(yaw), np.sin(yaw), color="black", zorder=6, **inch)
    axes.plot(x, y, "o", color="white", markeredgecolor="black", markersize=10, zorder=6.1, label="stop, heading")
    for number, u, v in zip(numbers, x, y, strict=True):
        axes.text(u, v, str(number), ha="center", va="center_baseline", fontsize=7, zorder=6.2)


def draw_image(axes: Axes, one: Seen, area: float) -> Any:
    """The left image and its flies, the fittest on top; returns the dots."""
    axes.imshow(one.frame.pair.left, interpolation="antialiased")
    order = np.argsort(one.swarm.fitness, kind="stable")[-_MOST_FLIES:]
    u, v = np.reshape(one.swarm.uv, (-1, 2))[order].T
    rank = colours.ranks(one.swarm.fitness)[order]
    dots = axes.scatter(u, v, c=rank, s=area, cmap="viridis", vmin=0.0, vmax=1.0, linewidths=0, rasterized=True)
    camera = one.frame.pair.rig.left
    axes.set_xlim(-0.5, camera.width - 0.5)
    axes.set_ylim(camera.height - 0.5, -0.5)
    axes.set_xticks([])
    axes.set_yticks([])
    return dots


def obstacles_of(truth: Truth | None) -> tuple[TrueObstacle, ...]:
    """The true obstacles; none without truth."""
    return () if truth is None else truth.obstacles


def bounds(
    findings: Findings, track: Track, parts: Sequence[PlacedPart], boxes: Sequence[TrueObstacle]
) -> tuple[Array, Array]:
    """Lower and upper corner [m] of what the path's figure shows: path, obstacles, walls nearby."""
    spots = [track.believed[:, :2], *([] if track.true is None else [track.true[:, :2]])]
    spots += [part.points[:, :2] for part in parts if not part.structure]
    spots += [box_corners(box.center, box.size, box.yaw)[:, :2] for box in (*boxes, *findings.obstacles)]
    points = np.concatenate(spots)
    if not len(points):
        points = np.zeros((1, 2))
    low, high = points.min(axis=0) - 0.4, points.max(axis=0) + 0.4
    walls = np.concatenate([np.stack([low, high]), *(part.points[:, :2] for part in parts if part.structure)])
    return (
        np.maximum(np.minimum(low, walls.min(axis=0) - 0.1), low - 1.0),
        np.minimum(np.maximum(high, walls.max(axis=0) + 0.1), high + 1.0),
    )


def window(boxes: Sequence[TrueObstacle | Obstacle]) -> tuple[Array, Array]:
    """`[3]` lower and upper corner [m] of what the planes show: all boxes, with the ground below them."""
    corners = [box_corners(box.center, box.size, box.yaw) for box in boxes] or [box_corners((0, 0, 0.5), (1, 1, 1), 0)]
    margin = NEAR + 0.05
    low, high = np.concatenate(corners).min(axis=0) - margin, np.concatenate(corners).max(axis=0) + margin
    return np.append(low[:2], min(low[2] + margin, 0.0) - 0.05), high


def finish(axes: Axes, plane: tuple[int, int], low: Array, high: Array) -> None:
    """Limits, equal scales and labels of axes that show a plane from `low` to `high` [m]."""
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel(f"{LETTERS[plane[0]]} [m]")
    axes.set_ylabel(f"{LETTERS[plane[1]]} [m]")
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)


def counted(one: Seen) -> str:
    """What stands over the picture of a stop: its number and its flies."""
    return f"{len(one.swarm.points)} flies, {one.swarm.iterations} generations"


def title(findings: Findings, what: str) -> str:
    """A figure's title: whose run it is, and what is shown."""
    return f"{label(findings.sequence.name)}, seed {findings.sequence.seed}: {what}"
