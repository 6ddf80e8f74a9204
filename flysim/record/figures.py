"""The figures of a run: path from above, flies on the images, three planes (the paper's Figs. 5 to 7)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flysim.geometry.frames import Array, yaw_of
from flysim.products.findings import Findings, Seen
from flysim.record import colours
from flysim.record.canvas import blank, fit, label, place, write_pngs
from flysim.record.outline import XY, XZ, YZ, PlacedPart, believed_points, box_corners, hull, inside_box, placed_parts
from flysim.record.track import Track, whole_track
from flysim.truth.truth import Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flysim.products.obstacle import Obstacle
    from flysim.truth.obstacles import TrueObstacle

NEAR = 0.10  # [m] flies at most so far beside a box are drawn in the planes
_MOST_FLIES = 6000  # more dots than this only cost time
_MOST_NAMES = 15  # more names than this hide the figure
_MOST_IMAGES = 12
_MOST_ASIDE = 3  # more obstacles than this hide each other in a view from the side: each gets its own
_MOST_PANELS = 24
BAR = 0.6  # [inch] below the images of the stops for their colours
_TRUE, _BELIEVED = colours.hexadecimal(colours.TRUE), colours.hexadecimal(colours.BELIEVED)
_FLY, _STRUCTURE = colours.hexadecimal(colours.FLY), colours.hexadecimal(colours.STRUCTURE)
_LETTERS = "xyz"


def write_figures(folder: Path, findings: Findings, truth: Truth | None) -> None:
    """Write `path.png`, `planes.png` and, after the first frame, `flies_on_image.png`, `flies_on_images.png`.

    Without truth they show what was found alone.

    Raises:
        OSError: the disk is full or refuses.
    """
    figures = {
        "path.png": path_figure(findings, truth),
        "planes.png": planes_figure(findings, truth),
    }
    if findings.seen:
        figures["flies_on_image.png"] = image_figure(findings.seen[-1])
        figures["flies_on_images.png"] = images_figure(findings.seen)
    write_pngs(folder, figures)


def load() -> None:
    """Import matplotlib, which takes half a second."""
    import_module("matplotlib.figure")
    import_module("matplotlib.backends.backend_agg")


def path_figure(findings: Findings, truth: Truth | None) -> Figure:
    """The drive from above: numbered stops with headings, both paths, obstacles true and estimated."""
    parts, true_obstacles = [part for part in placed_parts(truth) if not part.flat], _obstacles(truth)
    track = whole_track(findings, truth)
    low, high = _bounds(findings, track, parts, true_obstacles)
    width, height = fit(high[0] - low[0], high[1] - low[1], 7.0, 6.5)
    figure = blank(width + 3.1, height + 1.1)
    axes = place(figure, 0.75, 0.6, width, height)
    _finish(axes, XY, low, high)
    for part in parts:
        _draw_part(axes, part, XY)
    _draw_flies(axes, findings.cloud.points, XY, area=1.6)
    for obstacle in findings.obstacles:
        _draw_believed(axes, obstacle, XY)
    _draw_names(axes, true_obstacles)
    if track.true is not None:
        axes.plot(*track.true[:, :2].T, "-", color=_TRUE, linewidth=3.5, zorder=5, label="path, true")
    axes.plot(*track.believed[:, :2].T, "--", color=_BELIEVED, linewidth=1.6, zorder=5, label="path, odometry")
    _draw_stops(axes, findings, truth)
    axes.set_title(_title(findings, "the path from above"))
    _legend(axes, axes, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def planes_figure(findings: Findings, truth: Truth | None) -> Figure:
    """The flies near obstacles in the planes XY, XZ and YZ, with true outlines and estimated boxes.

    Of more than three obstacles each has a view from the side of its own.
    """
    true_obstacles = _obstacles(truth)
    if len(true_obstacles or findings.obstacles) > _MOST_ASIDE:
        return _many_planes_figure(findings, truth)
    low, high = _window(true_obstacles or findings.obstacles)
    estimated = [box for box in findings.obstacles if (np.abs(2 * box.center - low - high) < high - low).all()]
    near = np.zeros(len(findings.cloud.points), dtype=bool)
    for box in (*true_obstacles, *estimated):
        near |= inside_box(findings.cloud.points, box.center, box.size, box.yaw, NEAR)
    parts = [part for part in placed_parts(truth) if not part.structure]

    x, y, z = high - low
    scale = min(9.0 / (x + y), 6.5 / (y + z))  # [inch / m], the same in all three planes
    left, bottom, gap = 0.75, 0.6, 0.9
    figure = blank(max(scale * (x + y) + left + gap + 0.3, 6.0), scale * (y + z) + bottom + gap + 0.75)
    over, beside = bottom + scale * z + gap, left + scale * x + gap
    legend = place(figure, beside, over, scale * y, scale * y)
    legend.axis("off")
    for plane, spot in ((XZ, (left, bottom)), (YZ, (beside, bottom)), (XY, (left, over))):
        axes = place(figure, *spot, *(scale * (high - low)[list(plane)]))
        _finish(axes, plane, low[list(plane)], high[list(plane)])
        axes.set_title(f"plane {''.join(_LETTERS[i] for i in plane).upper()}", fontsize=10)
        if plane != XY:
            axes.axhline(0.0, color="black", linewidth=0.8, zorder=1)
        for part in parts:
            _draw_part(axes, part, plane)
        _draw_flies(axes, findings.cloud.points[near], plane, area=3.0)
        for obstacle in estimated:
            _draw_believed(axes, obstacle, plane)
        if plane == XY:
            _draw_names(axes, true_obstacles)
            _legend(axes, legend, loc="upper left")
    figure.suptitle(_title(findings, f"flies within {100 * NEAR:.0f} cm of an obstacle"))
    return figure


def _many_planes_figure(findings: Findings, truth: Truth | None) -> Figure:
    """The plane XY, and below it every obstacle by itself in the plane XZ, all at one scale."""
    true_obstacles = _obstacles(truth)
    boxes = true_obstacles or findings.obstacles
    low, high = _window(boxes)
    parts = [part for part in placed_parts(truth) if not part.structure]
    wide, tall = fit(high[0] - low[0], high[1] - low[1], 8.0, 6.0)
    views = [_window([box]) for box in boxes[:_MOST_PANELS]]
    most = np.max([upper - lower for lower, upper in views], axis=0)
    columns = min(5, len(views))
    scale = min(1.75 / most[0], 1.6 / most[2])  # [inch / m] in all views from the side
    width, height = scale * most[0], scale * most[2]
    rows, gap, head = -(-len(views) // columns), 0.6, 0.75
    figure = blank(max(wide + 3.0, columns * (width + gap) + 0.3), tall + 1.3 + rows * (height + head))
    under = 0.15 + rows * (height + head)
    axes = place(figure, 0.75, under + 0.5, wide, tall)
    _finish(axes, XY, low[:2], high[:2])
    for part in parts:
        _draw_part(axes, part, XY)
    near = np.zeros(len(findings.cloud.points), dtype=bool)
    for box in (*true_obstacles, *findings.obstacles):
        near |= inside_box(findings.cloud.points, box.center, box.size, box.yaw, NEAR)
    _draw_flies(axes, findings.cloud.points[near], XY, area=2.0)
    for obstacle in findings.obstacles:
        _draw_believed(axes, obstacle, XY)
    _draw_names(axes, true_obstacles)
    axes.set_title("plane XY", fontsize=10)
    _legend(axes, axes, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    for k, (box, (lower, upper)) in enumerate(zip(boxes, views, strict=False)):
        row, column = divmod(k, columns)
        spot = place(figure, 0.6 + column * (width + gap), under - 0.1 - height - row * (height + head), width, height)
        middle = (lower + upper) / 2.0
        bounds = [np.array([middle[0] + side * most[0] / 2.0, lower[2] + (side > 0) * most[2]]) for side in (-1, 1)]
        _finish(spot, XZ, *bounds)
        _draw_alone(spot, findings, parts, box)
        spot.set_title(label(getattr(box, "name", f"estimated {k}")), fontsize=8, pad=3)
        spot.tick_params(labelsize=6)
        spot.set_xlabel("x [m]", fontsize=7)
        spot.set_ylabel("z [m]", fontsize=7)
    figure.suptitle(_title(findings, f"flies within {100 * NEAR:.0f} cm of an obstacle"))
    return figure


def _draw_alone(axes: Axes, findings: Findings, parts: Sequence[PlacedPart], box: TrueObstacle | Obstacle) -> None:
    """One obstacle from the side, with its own flies and what was taken for it."""
    axes.axhline(0.0, color="black", linewidth=0.8, zorder=1)

    def own(points: Array) -> Any:
        return inside_box(points, box.center, box.size, box.yaw, NEAR)

    for part in parts:
        if own(part.points.mean(axis=0)[None])[0]:
            _draw_part(axes, part, XZ)
    _draw_flies(axes, findings.cloud.points[own(findings.cloud.points)], XZ, area=2.0)
    for obstacle in findings.obstacles:
        if own(obstacle.center[None])[0]:
            _draw_believed(axes, obstacle, XZ)


def image_figure(one: Seen) -> Figure:
    """The left image of a stop with its flies, coloured by fitness."""
    camera = one.frame.pair.rig.left
    width, height = fit(camera.width, camera.height, 7.5, 6.5)
    figure = blank(width + 1.3, height + 0.6)
    axes = place(figure, 0.2, 0.2, width, height)
    dots = _draw_image(axes, one, 9.0)
    axes.set_title(f"stop {one.frame.index}, left image: {_counted(one)}")
    bar = figure.colorbar(dots, cax=place(figure, width + 0.35, 0.2, 0.2, height))
    bar.set_label("share of the flies that are less fit")
    return figure


def images_figure(seen: Sequence[Seen]) -> Figure:
    """The left images of all stops with their flies, coloured by fitness; some stops of a long drive."""
    picks = np.unique(np.linspace(0, len(seen) - 1, min(len(seen), _MOST_IMAGES)).round().astype(int))
    columns = min(len(picks), 4)
    rows = -(-len(picks) // columns)
    camera = seen[0].frame.pair.rig.left
    width, height = fit(camera.width, camera.height, 3.0, 3.0)
    figure = blank(max(columns * (width + 0.1) + 0.1, 4.4), rows * (height + 0.3) + 0.1 + BAR)
    dots: Any = None
    for cell, pick in enumerate(picks):
        row, column = divmod(cell, columns)
        axes = place(figure, 0.1 + column * (width + 0.1), BAR + 0.1 + (rows - 1 - row) * (height + 0.3), width, height)
        dots = _draw_image(axes, seen[pick], 2.0)
        axes.set_title(f"stop {seen[pick].frame.index}: {_counted(seen[pick])}", fontsize=8, pad=3)
    long = min(figure.get_size_inches()[0] - 0.6, 6.0)
    bar = figure.colorbar(dots, cax=place(figure, 0.3, 0.45, long, 0.12), orientation="horizontal")
    bar.set_label("share of the flies of the stop that are less fit", fontsize=8)
    bar.ax.tick_params(labelsize=8)
    return figure


def _draw_part(axes: Axes, part: PlacedPart, plane: tuple[int, int]) -> None:
    """The body below the flies and its outline above them."""
    outline = part.outline(plane)
    if part.structure:
        axes.fill(*outline.T, facecolor=_STRUCTURE, edgecolor=_STRUCTURE, linewidth=1.5, zorder=2, label="wall")
        return
    axes.fill(*outline.T, facecolor=(*(c / 255 for c in colours.TRUE), 0.15), zorder=2)
    axes.fill(*outline.T, facecolor="none", edgecolor=_TRUE, linewidth=1.5, zorder=4, label="obstacle, true")


def _draw_flies(axes: Axes, points: Array, plane: tuple[int, int], area: float) -> None:
    thin = points[:: max(-(-len(points) // _MOST_FLIES), 1), plane]
    axes.scatter(*thin.T, s=area, color=_FLY, alpha=0.45, linewidths=0, zorder=3)
    axes.plot([], [], ".", color=_FLY, markersize=6, label="flies")  # one that the legend can show


def _draw_believed(axes: Axes, box: Obstacle, plane: tuple[int, int]) -> None:
    outline = hull(believed_points(box)[:, plane])
    style = {"edgecolor": _BELIEVED, "linewidth": 1.8, "linestyle": "--"}
    axes.fill(*outline.T, facecolor="none", zorder=4.5, label="obstacle, estimated", **style)
    axes.plot(*box.center[list(plane)], "+", color=_BELIEVED, markersize=7, zorder=4.5)


def _legend(axes: Axes, place: Axes, **where: Any) -> None:
    """Each label once, however many artists bear it."""
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    place.legend(handles.values(), handles.keys(), frameon=False, **where)


def _draw_names(axes: Axes, true_obstacles: Sequence[TrueObstacle]) -> None:
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
            color=_TRUE,
            zorder=7,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.0},
        )


def _draw_stops(axes: Axes, findings: Findings, truth: Truth | None) -> None:
    """Numbered discs at the true stops, or where they are believed to be, with an arrow along the heading."""
    if not findings.seen:
        return
    if truth is None:
        poses = [(*one.frame.T_world_base[:2, 3], yaw_of(one.frame.T_world_base)) for one in findings.seen]
    else:
        poses = [(stop.true.x, stop.true.y, stop.true.yaw) for stop in truth.stops]
    x, y, yaw = np.array(poses).T
    inch = {"units": "inches", "width": 0.02, "scale_units": "inches", "scale": 1.0 / 0.24, "headlength": 4}
    axes.quiver(x, y, np.cos(yaw), np.sin(yaw), color="black", zorder=6, **inch)
    axes.plot(x, y, "o", color="white", markeredgecolor="black", markersize=10, zorder=6.1, label="stop, heading")
    for one, u, v in zip(findings.seen, x, y, strict=True):
        axes.text(u, v, str(one.frame.index), ha="center", va="center_baseline", fontsize=7, zorder=6.2)


def _draw_image(axes: Axes, one: Seen, area: float) -> Any:
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


def _obstacles(truth: Truth | None) -> tuple[TrueObstacle, ...]:
    return () if truth is None else truth.obstacles


def _bounds(
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


def _window(boxes: Sequence[TrueObstacle | Obstacle]) -> tuple[Array, Array]:
    """`[3]` lower and upper corner [m] of what the planes show: all boxes, with the ground below them."""
    corners = [box_corners(box.center, box.size, box.yaw) for box in boxes] or [box_corners((0, 0, 0.5), (1, 1, 1), 0)]
    margin = NEAR + 0.05
    low, high = np.concatenate(corners).min(axis=0) - margin, np.concatenate(corners).max(axis=0) + margin
    return np.append(low[:2], min(low[2] + margin, 0.0) - 0.05), high


def _finish(axes: Axes, plane: tuple[int, int], low: Array, high: Array) -> None:
    axes.set_aspect("equal")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel(f"{_LETTERS[plane[0]]} [m]")
    axes.set_ylabel(f"{_LETTERS[plane[1]]} [m]")
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)


def _counted(one: Seen) -> str:
    return f"{len(one.swarm.points)} flies, {one.swarm.iterations} generations"


def _title(findings: Findings, what: str) -> str:
    return f"{label(findings.sequence.name)}, seed {findings.sequence.seed}: {what}"
