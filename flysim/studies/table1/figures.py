"""The pictures of Table 1: flies by population and regions (the paper's Figs. 2 to 4), cost against quality."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flysim.common.statistics import front
from flysim.record.canvas import blank, fit, place, write_pngs
from flysim.studies.table1.grid import FAVOURITES, SETS
from flysim.studies.table1.result import CellResult, Table1

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPER_FIGURE = {"A": "Fig. 2", "B": "Fig. 3", "C": "Fig. 4"}
_FLY, _ON_OBJECT = "#f0e442", "#00e5ff"  # yellow; cyan stands out from the red of the box
_SET_COLOUR = {"A": "#0072b2", "B": "#009e73", "C": "#cc79a7"}
_MARKER = {2: "s", 4: "o"}


def write_table1_figures(folder: Path, table: Table1) -> None:
    """Write `set_A.png`, `set_B.png`, `set_C.png` (those that were run) and `cost_quality.png`.

    Raises:
        OSError: the disk is full or refuses.
    """
    sets = [name for name in SETS if any(one.cell.operators == name for one in table.cells)]
    figures = {f"set_{name}.png": set_figure(table, name) for name in sets}
    write_pngs(folder, {**figures, "cost_quality.png": cost_quality_figure(table)})


def set_figure(table: Table1, operators: str) -> Figure:
    """The first seed's flies on the left image: a row for each number of regions, a column for each population.

    Of the stop criteria the lowest is shown, as 90 % in the paper's grid.
    """
    cells = [one for one in table.cells if one.cell.operators == operators]
    stop = min(one.cell.stop for one in cells)
    columns = sorted({one.cell.population for one in cells})
    rows = sorted({one.cell.regions for one in cells})
    height, width = table.image.shape[:2]
    wide, high = fit(width, height, 3.6, 3.6)
    gap, head, foot = 0.1, 0.3, 0.45
    figure = blank(max(len(columns) * (wide + gap) + gap, 5.0), len(rows) * (high + head) + head + foot)
    for one in cells:
        if one.cell.stop != stop:
            continue
        column, row = columns.index(one.cell.population), rows.index(one.cell.regions)
        bottom = foot + (len(rows) - 1 - row) * (high + head)
        _draw_flies(place(figure, gap + column * (wide + gap), bottom, wide, high), table, one)
    figure.suptitle(
        f"set {operators} at {stop} %: flies on the left image (the paper's {PAPER_FIGURE[operators]})",
        y=1.0 - 0.08 / figure.get_size_inches()[1],
        va="top",
        fontsize=12,
    )
    _legend_of_flies(figure)
    return figure


def cost_quality_figure(table: Table1) -> Figure:
    """Cost against quality of every cell, with what nothing beats and the paper's favourite.

    Two qualities: how many flies sit on the object, which is what it can be measured with, and what share of the
    swarm that is, which does not reward a larger swarm for its size alone.
    """
    figure = blank(13.4, 5.6)
    left = place(figure, 0.75, 0.6, 4.8, 4.4)
    right = place(figure, 6.35, 0.6, 4.8, 4.4)
    _draw_cost(left, table, lambda one: one.flies_on_object, lambda one: one.flies_on_object_ci95)
    left.set_ylabel("flies within 2 cm of the object")
    _draw_cost(right, table, lambda one: 100.0 * one.on_object, lambda one: None)
    right.set_ylabel("share of the swarm within 2 cm of the object [%]")
    for axes in (left, right):
        axes.set_xlabel("evolution [ms]")
        axes.grid(True, color="0.92", linewidth=0.6)
        axes.set_axisbelow(True)
    figure.suptitle(
        f"Table 1: cost and quality of {len(table.cells)} settings, means of {_counted(table.seeds, 'seed')}",
        y=0.985,
        fontsize=12,
    )
    _legend_of_settings(left, right)
    return figure


def _draw_flies(axes: Axes, table: Table1, one: CellResult) -> None:
    height, width = table.image.shape[:2]
    # Darker than it is, so that both colours of flies stand out from any texture.
    axes.imshow((table.image * np.float32(0.7)).astype(np.uint8), interpolation="antialiased")
    edge = {"color": "white", "linewidth": 0.8, "linestyle": "--"}
    axes.axvline(width / 2 - 0.5, **edge)  # two halves side by side
    if one.cell.regions == 4:
        axes.axhline(height / 2 - 0.5, **edge)
    uv, on = one.example.uv, one.example.on_object
    for flies, colour, area in ((uv[~on], _FLY, 2.5), (uv[on], _ON_OBJECT, 7.0)):
        axes.scatter(*flies.T, s=area, color=colour, linewidths=0, rasterized=True)
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(
        f"{one.cell.population} flies, {one.cell.regions} regions: {len(uv)} settled, {int(on.sum())} on the object, "
        f"{_counted(one.example.iterations, 'generation')}",
        fontsize=7.5,
        pad=3,
    )


def _legend_of_flies(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    names = {_ON_OBJECT: "flies within 2 cm of the object", _FLY: "other flies"}
    dots = [
        Line2D([], [], marker="o", linestyle="", markersize=6, color=colour, markeredgecolor="0.3", label=name)
        for colour, name in names.items()
    ]
    figure.legend(handles=dots, loc="lower center", ncols=2, frameon=False, fontsize=10)


def _draw_cost(
    axes: Axes,
    table: Table1,
    quality: Callable[[CellResult], float],
    doubt: Callable[[CellResult], float | None],
) -> None:
    """The cells as marks with their intervals, and the front as steps: what its cost can buy at each place."""
    cells = table.cells
    unbeaten = [cells[i] for i in front([one.ms_mean for one in cells], [quality(one) for one in cells])]
    for one in cells:
        colour, full = _SET_COLOUR[one.cell.operators], one.cell.stop == min(other.cell.stop for other in cells)
        axes.errorbar(
            one.ms_mean, quality(one), xerr=one.ms_ci95, yerr=doubt(one), fmt="none", ecolor="0.5", elinewidth=1.0,
            capsize=2.0, zorder=2,
        )  # fmt: skip
        axes.plot(
            one.ms_mean, quality(one), _MARKER[one.cell.regions], color=colour, markersize=_mark(one.cell.population),
            markerfacecolor=colour if full else "white", zorder=3,
        )  # fmt: skip
        if one.cell in FAVOURITES:
            axes.plot(
                one.ms_mean, quality(one), "o", color="black", markersize=17, markerfacecolor="none",
                markeredgewidth=1.6, zorder=4,
            )  # fmt: skip
    axes.plot(
        [one.ms_mean for one in unbeaten], [quality(one) for one in unbeaten], "-", color="black", linewidth=1.2,
        drawstyle="steps-post", zorder=2.5,
    )  # fmt: skip
    # As far as the means reach: with few seeds an interval is many times as long.
    axes.set_xlim(0.0, 1.08 * max(one.ms_mean for one in cells))
    axes.set_ylim(0.0, 1.08 * max(1e-9, *(quality(one) for one in cells)))


def _mark(population: int) -> float:
    """Side of a mark whose area grows with the population [points]."""
    return 3.0 + 7.0 * (population / 5000) ** 0.5


def _legend_of_settings(axes: Axes, beside: Axes) -> None:
    from matplotlib.lines import Line2D

    def mark(label: str, marker: str, **style: object) -> Line2D:
        return Line2D([], [], linestyle="", marker=marker, label=label, **{"color": "0.35", "markersize": 8, **style})

    handles = [
        *(mark(f"set {name}", "o", color=colour) for name, colour in _SET_COLOUR.items()),
        *(mark(f"{regions} regions", marker) for regions, marker in _MARKER.items()),
        mark("stop at 90 %", "o"),
        mark("stop at 95 %", "o", markerfacecolor="white"),
        *(mark(f"{n} flies", "o", markersize=_mark(n)) for n in (500, 1500, 3000, 5000)),
        Line2D([], [], color="black", linewidth=1.2, label="beaten by no setting"),
        mark(
            "the paper's favourite:\n3000 flies, set C,\n4 regions", "o", color="black", markersize=15,
            markerfacecolor="none", markeredgewidth=1.6,
        ),
    ]  # fmt: skip
    beside.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0, frameon=False)


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")
