"""The figure of a suite of photographs: share within a pixel, and cells held, of every engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flysim.record.canvas import blank, label, place
from flysim.studies.photographs.photographs import PhotographScores

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def scores_figure(scores: PhotographScores) -> Figure:
    """Two rows of bars, a group a pair."""
    names, engines = list(scores.pairs), scores.engines
    wide = max(4.0, 1.1 + 0.35 * len(names) * (len(engines) + 1))
    figure = blank(wide + 1.6, 5.6)
    rows = (
        ("within 1 px [%]", lambda one: one.seen.within_1px, 3.1),
        ("textured cells held [%]", lambda one: one.coverage, 0.6),
    )
    at = np.arange(len(names))
    for title, of, bottom in rows:
        axes = place(figure, 0.7, bottom, wide - 0.2, 2.0)
        values = []
        for k, engine in enumerate(engines):
            bars = [100.0 * (of(scores.pairs[name][engine]) or 0.0) for name in names]
            values += bars
            axes.bar(at + (k - (len(engines) - 1) / 2.0) * 0.8 / len(engines), bars, 0.8 / len(engines), label=engine)
        axes.set_ylim(max(0.0, 10.0 * np.floor(min(values, default=0.0) / 10.0 - 0.5)), 100.0)
        axes.set_xticks(at, [label(name) for name in names], fontsize=8)
        axes.set_ylabel(title, fontsize=9)
        axes.grid(True, axis="y", color="0.9", linewidth=0.6)
        axes.set_axisbelow(True)
        if bottom > 1.0:
            axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure
