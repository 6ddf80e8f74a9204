"""The picture of a study: F1, well F1, points and time against the level, an engine a line."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from flysim.record.canvas import drawn, label, png
from flysim.studies.bench.picture import LOOKS
from flysim.studies.sweep.result import Level, SweepResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDE = 48  # characters under an axis
MARKS = "Dvp*hX"  # of engines that have no look of their own


def study_png(result: SweepResult) -> bytes:
    """A PNG's bytes: four panels, and two of the way where that is told; bands are 95 % intervals over the drives."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    summary = result.summary()
    way = [
        (name, f"way off by, as {who} [cm]")
        for name, who in (("odometry_ape_m", "odometry tells it"), ("located_ape_m", "it was located"))
        if any(getattr(one, name) is not None for one in summary)
    ][-1:]
    last = (("points", "points of a stop"), ("ms_per_stop", "time of a stop [ms]"))
    if result.study.lengths:
        last = (("center_error_max_m", "worst centre, off by [cm]"), ("size_error_max_m", "worst size, off by [cm]"))
    elif way:
        last = (*way, ("center_error_max_m", "worst centre, off by [cm]"), *last)
    shown = (("f1", "F1"), ("well_f1", "F1 of what was found well\n(3 cm, or 5 % of a size)"), *last)
    columns = len(shown) // 2
    figure = Figure(figsize=(5.5 * columns, 7.4), dpi=100, layout="constrained")
    panels = figure.subplots(2, columns)
    for axes, (name, title) in zip(panels.flat, shown, strict=True):
        for k, engine in enumerate(result.engines):
            _line(axes, [one for one in summary if one.engine == engine], name, k)
        places = range(len(result.levels))
        axes.set_xticks(places, [f"{level:g}" for level in result.levels])
        what = label(result.study.what) + (f" [{result.study.unit}]" if result.study.unit else "")
        axes.set_xlabel(textwrap.fill(what, WIDE))
        axes.set_ylabel(title)
        if name.endswith("_m") and any(getattr(one, name) for one in summary):
            axes.set_yscale("log")  # from millimetres to half a metre
            axes.yaxis.set_major_formatter("{x:g}")
            there = [value for one in summary if (value := getattr(one, name))]
            axes.yaxis.set_minor_formatter("{x:.3g}" if max(there) < 10.0 * min(there) else NullFormatter())
        else:
            most = max((getattr(one, name) or 0.0 for one in summary), default=0.0)
            axes.set_ylim(*((-0.02, 1.05) if name.endswith("f1") else (0.0, 1.06 * most or 1.0)))
        axes.grid(True, color="0.92", linewidth=0.6)
        axes.set_axisbelow(True)
    panels[0, 0].legend(frameon=False)
    panels[-1, -1].legend(frameon=False)
    scenarios = list(dict.fromkeys(row.scenario for row in result.rows))
    seeds = len({row.seed for row in result.rows})
    figure.suptitle(
        f"study {label(result.name)}: {label(', '.join(scenarios))}; {seeds} seed{'s' * (seeds != 1)}, "
        f"{result.renderer}; bands: 95 % over the drives",
        fontsize=11,
    )
    return png(drawn(figure))


def _line(axes: Axes, levels: Sequence[Level], name: str, k: int) -> None:
    engine = levels[0].engine
    look = LOOKS.get(engine) or {"marker": MARKS[k % len(MARKS)], "color": f"C{k}", "label": label(engine)}
    known = [(place, one) for place, one in enumerate(levels) if getattr(one, name) is not None]
    places = [place for place, _ in known]
    scale = 100.0 if name.endswith("_m") else 1.0
    axes.plot(places, [scale * getattr(one, name) for _, one in known], **look)
    if name.endswith("f1"):
        bands = [(place, band) for place, one in known if (band := getattr(one, f"{name}_ci95")) is not None]
        if bands:
            at, low, high = (
                [place for place, _ in bands],
                [band[0] for _, band in bands],
                [band[1] for _, band in bands],
            )
            axes.fill_between(at, low, high, color=look["color"], alpha=0.2, linewidth=0)
