"""The pictures of a pair of photographs: flies over it by depth, things drawn into it with their sizes, from above."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flysim.geometry.frames import Array, inverse, transform
from flysim.products.findings import Findings
from flysim.products.thing import Thing
from flysim.record.canvas import blank, fit, label, place
from flysim.record.outline import believed_points, box_corners, hull

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_FLIES = 8000  # more dots than this only cost time
MOST_THINGS = 12  # more labels than this hide the picture
# Edges of a box by the corners of `box_corners`: two that differ in one bit of their number.
EDGES = tuple((i, j) for i in range(8) for j in range(i + 1, 8) if (i ^ j) in (1, 2, 4))
COLOURS = ("#e6194b", "#3cb44b", "#ffe119", "#4363d8", "#f58231", "#911eb4", "#46f0f0", "#f032e6", "#bcf60c", "#fabebe")


def size_text(thing: Thing, metric: bool) -> str:
    """What stands beside a thing: its length, width and height, and how far off it is."""
    if not metric:
        return f"{thing.disparity_px:.1f} px"
    sides = " x ".join(f"{side:.2f}" for side in thing.obstacle.size)
    return f"{sides} m, {thing.distance:.2f} m away"


def depth_figure(findings: Findings, *, metric: bool) -> Figure:
    """The left picture with its flies, coloured by depth; by disparity where nothing is metric."""
    one = findings.seen[0]
    swarm, camera = one.swarm, one.frame.pair.rig.left
    figure, axes = _picture(findings, 1.1)
    thin = slice(None, None, max(-(-len(swarm.points) // MOST_FLIES), 1))
    value = swarm.points[:, 2] if metric else swarm.uv[:, 0] - swarm.uv_right[:, 0]
    shown = {"s": 9.0, "cmap": "turbo_r" if metric else "turbo", "linewidths": 0}
    if len(value):
        low, high = np.quantile(value, (0.01, 0.99))
        shown |= {"vmin": float(low), "vmax": float(high)}
    dots = axes.scatter(*swarm.uv[thin].T, c=value[thin], **shown)
    width, height = fit(camera.width, camera.height, 8.0, 6.5)
    bar = figure.colorbar(dots, cax=place(figure, width + 0.35, 0.2, 0.18, height))
    bar.set_label("depth [m]" if metric else "disparity [px]")
    axes.set_title(f"{label(findings.sequence.name)}: {len(swarm.points)} flies by depth", fontsize=10)
    return figure


def things_figure(findings: Findings, things: Sequence[Thing], *, metric: bool) -> Figure:
    """The left picture with the boxes of the things in it, and their sizes."""
    figure, axes = _picture(findings, 0.2)
    camera, T_left_world = findings.seen[0].frame.pair.rig.left, inverse(findings.seen[0].frame.T_world_left)
    for k, thing in enumerate(things[:MOST_THINGS]):
        colour, one = COLOURS[k % len(COLOURS)], thing.obstacle
        corners = transform(T_left_world, box_corners(one.center, one.size, one.yaw))
        u, v, w, h = thing.rect_px
        if metric and corners[:, 2].min() > 1e-6:
            uv = camera.project(corners)
            for i, j in EDGES:
                axes.plot(*uv[[i, j]].T, color=colour, linewidth=1.3)
            u, v = (float(np.clip(at, 0, most)) for at, most in zip(uv.min(axis=0), (camera.width, camera.height),
                                                                    strict=True))  # fmt: skip
        else:
            axes.plot([u, u + w, u + w, u, u], [v, v, v + h, v + h, v], color=colour, linewidth=1.3)
        axes.text(
            u, max(v - 3.0, 8.0), f"{k}: {size_text(thing, metric)}", fontsize=6.5, color="white", va="bottom",
            bbox={"facecolor": colour, "alpha": 0.75, "pad": 0.8, "edgecolor": "none"}, clip_on=True,
        )  # fmt: skip
    more = f", the largest {MOST_THINGS} shown" if len(things) > MOST_THINGS else ""
    axes.set_title(f"{label(findings.sequence.name)}: {len(things)} things{more}", fontsize=10)
    return figure


def above_figure(findings: Findings, things: Sequence[Thing], *, metric: bool) -> Figure:
    """Flies, things and camera seen from above: x ahead goes up, y left goes left."""
    points = findings.cloud.points
    figure = blank(7.0, 7.4)
    axes = place(figure, 0.75, 0.6, 6.0, 6.3)
    thin = points[:: max(-(-len(points) // MOST_FLIES), 1)]
    dots = axes.scatter(-thin[:, 1], thin[:, 0], c=thin[:, 2], s=3.0, cmap="viridis", linewidths=0)
    for k, thing in enumerate(things):
        outline = hull(believed_points(thing.obstacle)[:, [1, 0]]) * (-1.0, 1.0)
        axes.fill(*outline.T, facecolor="none", edgecolor=COLOURS[k % len(COLOURS)], linewidth=1.6)
        axes.annotate(str(k), outline.mean(axis=0), fontsize=8, ha="center", va="center")
    camera = findings.seen[0].frame.pair.rig.left
    far = float(np.quantile(points[:, 0], 0.99)) if len(points) else 1.0
    for u in (0.0, camera.width - 1.0):
        axes.plot([0.0, (u - camera.cx) / camera.fx * far], [0.0, far], color="0.6", linewidth=0.8)
    axes.plot(0.0, 0.0, marker="^", color="black", markersize=9)
    _frame(axes, points, far)
    unit = "m" if metric else "baselines, focal length guessed"
    axes.set_xlabel(f"to the right [{unit}]")
    axes.set_ylabel(f"ahead [{unit}]")
    axes.set_title(f"{label(findings.sequence.name)} from above, flies by height", fontsize=10)
    bar = figure.colorbar(dots, ax=axes, shrink=0.6)
    bar.set_label(f"height [{'m' if metric else 'baselines'}]", fontsize=8)
    return figure


def _picture(findings: Findings, aside: float) -> tuple[Figure, Axes]:
    one = findings.seen[0]
    camera = one.frame.pair.rig.left
    width, height = fit(camera.width, camera.height, 8.0, 6.5)
    figure = blank(width + 0.2 + aside, height + 0.55)
    axes = place(figure, 0.2 if aside > 0.5 else 0.1, 0.2, width, height)
    axes.imshow(one.frame.pair.left, interpolation="antialiased")
    axes.set_xlim(-0.5, camera.width - 0.5)
    axes.set_ylim(camera.height - 0.5, -0.5)
    axes.set_xticks([])
    axes.set_yticks([])
    return figure, axes


def _frame(axes: Axes, points: Array, far: float) -> None:
    """Limits that a few stray flies do not move."""
    aside = float(np.quantile(np.abs(points[:, 1]), 0.99)) if len(points) else 1.0
    half = max(aside, far / 2.0) * 1.08
    axes.set_aspect("equal")
    axes.set_xlim(-half, half)
    axes.set_ylim(-0.04 * far, 1.06 * far)
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
