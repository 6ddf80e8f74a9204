"""Engines side by side as pictures: obstacles and points from above, and points on the image by depth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flysim.evaluate.track import whole_track
from flysim.geometry.frames import Array
from flysim.plain import shortened
from flysim.record import colours
from flysim.record.canvas import blank, fit, label, place, write_pngs
from flysim.record.outline import XY, PlacedPart, believed_points, box_corners, hull, placed_parts
from flysim.record.run_folder import report_file
from flysim.studies.compare.compare import Comparison
from flysim.studies.compare.figures_of import pooled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from flysim.products.findings import Findings
    from flysim.truth.truth import Truth

MOST_POINTS = 12000  # more dots than this only cost time
SHORT = 36  # characters of an engine's name over a panel
COLUMNS = 3
_TRUE, _BELIEVED, _FLY, _STRUCTURE = (
    colours.hexadecimal(colour) for colour in (colours.TRUE, colours.BELIEVED, colours.FLY, colours.STRUCTURE)
)


def write_comparison(folder: Path, comparison: Comparison) -> None:
    """Write `compare.json`, `reports/<engine>.json`, `figures/top.png` and `figures/depth.png`.

    Raises:
        OSError: the disk is full or refuses.
    """
    text = json.dumps(comparison.to_json(), indent=1, allow_nan=False)
    (folder / "compare.json").write_text(text + "\n", encoding="utf-8")
    for sub in ("reports", "figures"):
        (folder / sub).mkdir()
    for name, report in comparison.reports.items():
        text = json.dumps(report.to_json(), indent=1, allow_nan=False)
        (folder / "reports" / report_file(name)).write_text(text + "\n", encoding="utf-8")
    figures = {"top.png": top_figure(comparison)}
    if any(findings.seen for findings in comparison.findings.values()):
        figures["depth.png"] = depth_figure(comparison)
    write_pngs(folder / "figures", figures)


def top_figure(comparison: Comparison) -> Figure:
    """A panel an engine: obstacles true and found, points above the ground's clearance, the way that was driven."""
    parts = [part for part in placed_parts(comparison.truth) if not part.flat]
    low, high = _bounds(comparison, parts)
    width, height = fit(high[0] - low[0], high[1] - low[1], 5.0, 5.0)
    columns = min(len(comparison.findings), COLUMNS)
    rows = -(-len(comparison.findings) // columns)
    gap, head, foot = 0.65, 0.35, 0.4
    figure = blank(max(columns * (width + gap) + 0.2, 5.6), rows * (height + head + gap) + 0.15 + foot)
    for k, (name, findings) in enumerate(comparison.findings.items()):
        at, down = k % columns, rows - 1 - k // columns
        axes = place(figure, gap + at * (width + gap), foot + 0.5 + down * (height + head + gap), width, height)
        _draw_top(axes, findings, comparison.truth, parts)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        figures = pooled([comparison.reports[name]])
        off = "" if figures["size_error_m"] is None else f", sizes {_cm(figures['size_error_m'])} off"
        axes.set_title(f"{label(shortened(name, SHORT))}: F1 {figures['f1']:.2f}{off}", fontsize=10)
        axes.set_xlabel("x [m]", fontsize=8, labelpad=1)
        axes.set_ylabel("y [m]", fontsize=8, labelpad=1)
    _legend(figure)
    figure.suptitle(
        f"{label(comparison.scenario)}, seed {comparison.seed}: what each engine found, from above",
        fontsize=11,
        y=1.0 - 0.08 / figure.get_size_inches()[1],
        va="top",
    )
    return figure


def depth_figure(comparison: Comparison) -> Figure:
    """The left image of the stop in the middle of the drive, an engine a panel, each point coloured by its depth."""
    frames = next(iter(comparison.findings.values())).sequence.frames
    pick = len(frames) // 2
    camera = frames[pick].pair.rig.left
    width, height = fit(camera.width, camera.height, 5.0, 5.0)
    columns = min(len(comparison.findings), COLUMNS)
    rows = -(-len(comparison.findings) // columns)
    gap, head, bar = 0.1, 0.3, 0.9
    figure = blank(columns * (width + gap) + gap + bar, rows * (height + head) + gap)
    dots = None
    for k, (name, findings) in enumerate(comparison.findings.items()):
        at, down = k % columns, rows - 1 - k // columns
        axes = place(figure, gap + at * (width + gap), gap + down * (height + head), width, height)
        one = findings.seen[pick]
        axes.imshow(one.frame.pair.left.mean(axis=2), cmap="gray", vmin=-60, vmax=315)
        order = _thinned(len(one.swarm.points))
        u, v = np.reshape(one.swarm.uv, (-1, 2))[order].T
        depth = np.reshape(one.swarm.points, (-1, 3))[order, 2]
        dots = axes.scatter(
            u, v, c=depth, s=6, cmap="turbo_r", vmin=0.5, vmax=findings.max_range, linewidths=0, rasterized=True
        )
        axes.set_xlim(-0.5, camera.width - 0.5)
        axes.set_ylim(camera.height - 0.5, -0.5)
        axes.set_xticks([])
        axes.set_yticks([])
        title = f"{label(shortened(name, SHORT))}, stop {one.frame.index}: {len(one.swarm.points)} points"
        axes.set_title(title, fontsize=10, pad=3)
    if dots is not None:
        across = columns * (width + gap) + gap
        figure.colorbar(dots, cax=place(figure, across, gap, 0.18, height)).set_label("depth [m]")
    return figure


def _draw_top(axes: Axes, findings: Findings, truth: Truth, parts: list[PlacedPart]) -> None:
    for part in parts:
        outline = part.outline(XY)
        if part.structure:
            axes.fill(*outline.T, facecolor=_STRUCTURE, edgecolor=_STRUCTURE, linewidth=1.0, zorder=1)
            continue
        axes.fill(*outline.T, facecolor=(*(c / 255 for c in colours.TRUE), 0.15), zorder=2)
        axes.fill(*outline.T, facecolor="none", edgecolor=_TRUE, linewidth=1.2, zorder=4)
    points = findings.cloud.points[findings.cloud.points[:, 2] > 0.04]
    points = points[_thinned(len(points))]
    axes.scatter(points[:, 0], points[:, 1], s=1.2, color=_FLY, alpha=0.4, linewidths=0, zorder=3, rasterized=True)
    for box in findings.obstacles:
        outline = hull(believed_points(box)[:, XY])
        axes.fill(*outline.T, facecolor="none", edgecolor=_BELIEVED, linewidth=1.5, linestyle="--", zorder=5)
    way = whole_track(findings, truth).true
    if way is not None:
        axes.plot(way[:, 0], way[:, 1], "-", color="black", linewidth=0.7, zorder=6)
    stops = np.array([[stop.true.x, stop.true.y] for stop in truth.stops]).reshape(-1, 2)
    axes.plot(stops[:, 0], stops[:, 1], "k.", markersize=5, zorder=6)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    r, g, b = (channel / 255 for channel in colours.TRUE)
    true = (r, g, b, 0.15)
    handles = [
        Patch(facecolor=true, edgecolor=_TRUE, linewidth=1.2, label="obstacle, true"),
        Patch(facecolor="none", edgecolor=_BELIEVED, linewidth=1.5, linestyle="--", label="obstacle, found"),
        Line2D([], [], linestyle="", marker=".", markersize=6, color=_FLY, label="points above the floor"),
        Line2D([], [], color="black", linewidth=0.7, marker=".", markersize=5, label="way driven, stops"),
    ]
    figure.legend(
        handles=handles, loc="lower center", ncols=4 if figure.get_size_inches()[0] > 7.0 else 2, frameon=False
    )


def _bounds(comparison: Comparison, parts: list[PlacedPart]) -> tuple[Array, Array]:
    """The path and the true obstacles with a margin: what an engine sees beyond is cut off."""
    way = whole_track(next(iter(comparison.findings.values())), comparison.truth).true
    spots = [np.zeros((0, 2)) if way is None else way[:, :2]]
    spots += [part.points[:, :2] for part in parts if not part.structure]
    spots += [box_corners(box.center, box.size, box.yaw)[:, :2] for box in comparison.truth.obstacles]
    points = np.concatenate(spots)
    if not len(points):
        points = np.zeros((1, 2))
    return points.min(axis=0) - 0.5, points.max(axis=0) + 0.5


def _thinned(count: int) -> slice:
    return slice(None, None, max(-(-count // MOST_POINTS), 1))


def _cm(metres: float | None) -> str:
    return "-" if metres is None else f"{100.0 * metres:.2f} cm"
