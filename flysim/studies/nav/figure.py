"""The picture of a comparison of agents: success, collisions and SPL with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flysim.record import colours
from flysim.record.canvas import label

DPI = 110
BARS = (
    ("success", "success", colours.BELIEVED),
    ("spl", "SPL", colours.ROBOT),
    ("collision", "collision", colours.TRUE),
)


def draw_scores(worlds: str, data: Mapping[str, Any], path: Path) -> None:
    """Bars of each agent's means with 95 % intervals, as a PNG.

    Args:
        worlds: the title's.
        data: of `nav.episode.to_json`.
        path: of the PNG.

    Raises:
        OSError: the disk is full or refuses.
    """
    from matplotlib.figure import Figure

    agents = data["agents"]
    figure = Figure(figsize=(1.8 + 1.4 * len(agents), 4.0), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    for k, (key, title, colour) in enumerate(BARS):
        places = [i + 0.27 * (k - 1) for i in range(len(agents))]
        means = [agent[key] for agent in agents]
        axes.bar(places, means, 0.25, label=title, color=colours.hexadecimal(colour))
        for place, mean, interval in zip(places, means, (agent[f"{key}_ci95"] for agent in agents), strict=True):
            low, high = interval or (mean, mean)
            low, high = max(low, 0.0), min(high, 1.0)
            off = [[max(mean - low, 0.0)], [max(high - mean, 0.0)]]
            axes.errorbar([place], [mean], off, fmt="none", ecolor="black", elinewidth=1.4, capsize=4.0, capthick=1.4)
    axes.set_xticks(range(len(agents)), [label(agent["agent"]) for agent in agents])
    axes.set_ylim(0.0, 1.05)
    axes.set_ylabel("mean of the episodes, 95 % interval")
    count = agents[0]["episodes"]
    axes.set_title(
        f"{label(worlds)}, seen by {data['observation']}, {count} episode{'s' * (count != 1)} each", fontsize=10
    )
    axes.grid(axis="y", color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(frameon=False, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.08))
    figure.savefig(path, format="png")
