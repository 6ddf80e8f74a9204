"""The figures of a run: path from above, flies on the images, three planes (the paper's Figs. 5 to 7)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flysim.evaluate.track import whole_track
from flysim.geometry.frames import Array
from flysim.products.findings import Findings, Seen
from flysim.record.canvas import blank, fit, label, place, write_pngs
from flysim.record.drawing import (
    BELIEVED,
    LETTERS,
    NEAR,
    TRUE,
    bounds,
    counted,
    draw_believed,
    draw_flies,
    draw_image,
    draw_legend,
    draw_names,
    draw_part,
    draw_stops,
    finish,
    obstacles_of,
    title,
    window,
)
from flysim.record.outline import XY, XZ, YZ, PlacedPart, inside_box, placed_parts
from flysim.truth.truth import Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flysim.products.obstacle import Obstacle
    from flysim.truth.obstacles import TrueObstacle

_MOST_IMAGES = 12
_MOST_ASIDE = 3  # more obstacles than this hide each other in a view from the side: each gets its own
_MOST_PANELS = 24
LOCATED = "tab:purple"  # the way as flies tell it
BAR = 0.6  # [inch] below the images of the stops for their colours


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
    parts, true_obstacles = [part for part in placed_parts(truth) if not part.flat], obstacles_of(truth)
    track = whole_track(findings, truth)
    low, high = bounds(findings, track, parts, true_obstacles)
    width, height = fit(high[0] - low[0], high[1] - low[1], 7.0, 6.5)
    figure = blank(width + 3.1, height + 1.1)
    axes = place(figure, 0.75, 0.6, width, height)
    finish(axes, XY, low, high)
    for part in parts:
        draw_part(axes, part, XY)
    draw_flies(axes, findings.cloud.points, XY, area=1.6)
    for obstacle in findings.obstacles:
        draw_believed(axes, obstacle, XY)
    draw_names(axes, true_obstacles)
    if track.true is not None:
        axes.plot(*track.true[:, :2].T, "-", color=TRUE, linewidth=3.5, zorder=5, label="path, true")
    axes.plot(*track.believed[:, :2].T, "--", color=BELIEVED, linewidth=1.6, zorder=5, label="path, odometry")
    if track.located is not None and findings.located is not None:
        by = label(f"path, {findings.located.by}")
        axes.plot(*track.located[:, :2].T, ":", color=LOCATED, linewidth=2.0, zorder=6, label=by)
    draw_stops(axes, findings, truth)
    axes.set_title(title(findings, "the path from above"))
    draw_legend(axes, axes, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def planes_figure(findings: Findings, truth: Truth | None) -> Figure:
    """The flies near obstacles in the planes XY, XZ and YZ, with true outlines and estimated boxes.

    Of more than three obstacles each has a view from the side of its own.
    """
    true_obstacles = obstacles_of(truth)
    if len(true_obstacles or findings.obstacles) > _MOST_ASIDE:
        return _many_planes_figure(findings, truth)
    low, high = window(true_obstacles or findings.obstacles)
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
        finish(axes, plane, low[list(plane)], high[list(plane)])
        axes.set_title(f"plane {''.join(LETTERS[i] for i in plane).upper()}", fontsize=10)
        if plane != XY:
            axes.axhline(0.0, color="black", linewidth=0.8, zorder=1)
        for part in parts:
            draw_part(axes, part, plane)
        draw_flies(axes, findings.cloud.points[near], plane, area=3.0)
        for obstacle in estimated:
            draw_believed(axes, obstacle, plane)
        if plane == XY:
            draw_names(axes, true_obstacles)
            draw_legend(axes, legend, loc="upper left")
    figure.suptitle(title(findings, f"flies within {100 * NEAR:.0f} cm of an obstacle"))
    return figure


def _many_planes_figure(findings: Findings, truth: Truth | None) -> Figure:
    """The plane XY, and below it every obstacle by itself in the plane XZ, all at one scale."""
    true_obstacles = obstacles_of(truth)
    boxes = true_obstacles or findings.obstacles
    low, high = window(boxes)
    parts = [part for part in placed_parts(truth) if not part.structure]
    wide, tall = fit(high[0] - low[0], high[1] - low[1], 8.0, 6.0)
    views = [window([box]) for box in boxes[:_MOST_PANELS]]
    most = np.max([upper - lower for lower, upper in views], axis=0)
    columns = min(5, len(views))
    scale = min(1.75 / most[0], 1.6 / most[2])  # [inch / m] in all views from the side
    width, height = scale * most[0], scale * most[2]
    rows, gap, head = -(-len(views) // columns), 0.6, 0.75
    figure = blank(max(wide + 3.0, columns * (width + gap) + 0.3), tall + 1.3 + rows * (height + head))
    under = 0.15 + rows * (height + head)
    axes = place(figure, 0.75, under + 0.5, wide, tall)
    finish(axes, XY, low[:2], high[:2])
    for part in parts:
        draw_part(axes, part, XY)
    near = np.zeros(len(findings.cloud.points), dtype=bool)
    for box in (*true_obstacles, *findings.obstacles):
        near |= inside_box(findings.cloud.points, box.center, box.size, box.yaw, NEAR)
    draw_flies(axes, findings.cloud.points[near], XY, area=2.0)
    for obstacle in findings.obstacles:
        draw_believed(axes, obstacle, XY)
    draw_names(axes, true_obstacles)
    axes.set_title("plane XY", fontsize=10)
    draw_legend(axes, axes, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    for k, (box, (lower, upper)) in enumerate(zip(boxes, views, strict=False)):
        row, column = divmod(k, columns)
        spot = place(figure, 0.6 + column * (width + gap), under - 0.1 - height - row * (height + head), width, height)
        middle = (lower + upper) / 2.0
        bounds = [np.array([middle[0] + side * most[0] / 2.0, lower[2] + (side > 0) * most[2]]) for side in (-1, 1)]
        finish(spot, XZ, *bounds)
        _draw_alone(spot, findings, parts, box)
        spot.set_title(label(getattr(box, "name", f"estimated {k}")), fontsize=8, pad=3)
        spot.tick_params(labelsize=6)
        spot.set_xlabel("x [m]", fontsize=7)
        spot.set_ylabel("z [m]", fontsize=7)
    figure.suptitle(title(findings, f"flies within {100 * NEAR:.0f} cm of an obstacle"))
    return figure


def _draw_alone(axes: Axes, findings: Findings, parts: Sequence[PlacedPart], box: TrueObstacle | Obstacle) -> None:
    """One obstacle from the side, with its own flies and what was taken for it."""
    axes.axhline(0.0, color="black", linewidth=0.8, zorder=1)

    def own(points: Array) -> Any:
        return inside_box(points, box.center, box.size, box.yaw, NEAR)

    for part in parts:
        if own(part.points.mean(axis=0)[None])[0]:
            draw_part(axes, part, XZ)
    draw_flies(axes, findings.cloud.points[own(findings.cloud.points)], XZ, area=2.0)
    for obstacle in findings.obstacles:
        if own(obstacle.center[None])[0]:
            draw_believed(axes, obstacle, XZ)


def image_figure(one: Seen) -> Figure:
    """The left image of a stop with its flies, coloured by fitness."""
    camera = one.frame.pair.rig.left
    width, height = fit(camera.width, camera.height, 7.5, 6.5)
    figure = blank(width + 1.3, height + 0.6)
    axes = place(figure, 0.2, 0.2, width, height)
    dots = draw_image(axes, one, 9.0)
    axes.set_title(f"stop {one.frame.index}, left image: {counted(one)}")
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
        dots = draw_image(axes, seen[pick], 2.0)
        axes.set_title(f"stop {seen[pick].frame.index}: {counted(seen[pick])}", fontsize=8, pad=3)
    long = min(figure.get_size_inches()[0] - 0.6, 6.0)
    bar = figure.colorbar(dots, cax=place(figure, 0.3, 0.45, long, 0.12), orientation="horizontal")
    bar.set_label("share of the flies of the stop that are less fit", fontsize=8)
    bar.ax.tick_params(labelsize=8)
    return figure
