"""The picture of a training: success over steps, and from where on it was trained with which eyes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from flysim.record import colours

DPI = 110


def draw_curve(curve: Sequence[Sequence[float]], tasks: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Success of the last hundred episodes, with the chance that belongs to training, as a PNG.

    Args:
        curve: (steps, minutes, success, mean reward) after each rollout.
        tasks: what was trained on, each with `from_step`, `worlds` and `observation`.
        path: of the PNG.

    Raises:
        OSError: the disk is full or refuses.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.2), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    axes.plot(
        [row[0] for row in curve],
        [row[2] for row in curve],
        color=colours.hexadecimal(colours.BELIEVED),
        label="success",
    )
    for task in tasks:
        axes.axvline(task["from_step"], color="0.6", linewidth=0.8)
        axes.annotate(
            f" {task['worlds']}, {task['observation']}", (task["from_step"], 1.02), va="bottom", fontsize=9, color="0.3"
        )
    axes.set_ylim(0.0, 1.12)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("steps of all processes together")
    axes.set_ylabel("success of the last 100 episodes")
    axes.plot([], [], color="0.6", linewidth=0.8, label="trained from here on, in which worlds and by what")
    axes.legend(frameon=False, loc="lower right", fontsize=9)
    axes.grid(color="0.92", linewidth=0.6)
    figure.savefig(path, format="png")
