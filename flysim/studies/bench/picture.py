"""Time against image size, for flies and dense matchers, and how good each is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flysim.record import colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 110
# Flies are what is believed, in its colour; the rivals are apart from it by colour, mark and line.
_FLIES = {"color": colours.hexadecimal(colours.BELIEVED)}
LOOKS: dict[str, dict[str, Any]] = {
    "flies": {**_FLIES, "marker": "o", "label": "flies"},
    "evolve": {**_FLIES, "marker": ".", "linestyle": "--", "label": "flies, the evolution alone"},
    "sgbm": {"color": colours.hexadecimal(colours.TRUE), "marker": "s", "label": "SGBM 3WAY"},
    "bm": {"color": colours.hexadecimal(colours.ROBOT), "marker": "^", "label": "BM"},
}


def write_sizes(path: Path, sizes: Sequence[Mapping[str, Any]]) -> None:
    """Draws `sizes[]` of the engine's benchmark to a PNG.

    Raises:
        OSError: the disk is full or refuses.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.6), dpi=DPI, layout="constrained")
    times, accuracy = figure.subplots(1, 2)
    _draw_times(times, sizes)
    _draw_accuracy(accuracy, sizes)
    figure.savefig(path, format="png")


def _draw_times(axes: Axes, sizes: Sequence[Mapping[str, Any]]) -> None:
    pixels = [size["width"] * size["height"] / 1e6 for size in sizes]
    for name, look in LOOKS.items():
        axes.plot(pixels, [size[f"{name}_ms"] for size in sizes], **look)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(pixels, [f"{size['width']}x{size['height']}" for size in sizes])
    axes.set_xticks([], minor=True)
    axes.yaxis.set_major_formatter(lambda value, _place: f"{value:g}")
    axes.set_xlabel("image [px]")
    axes.set_ylabel("time of a pair [ms]")
    axes.set_title("how long")
    axes.grid(True, which="both", color="0.92", linewidth=0.6)
    axes.legend(frameon=False)


def _draw_accuracy(axes: Axes, sizes: Sequence[Mapping[str, Any]]) -> None:
    places = range(len(sizes))
    for name in ("flies", "sgbm", "bm"):
        for key, tolerance, line in (("0_5px", "0.5 px", "-"), ("1px", "1 px", ":")):
            look = {**LOOKS[name], "linestyle": line, "label": f"{LOOKS[name]['label']}, within {tolerance}"}
            axes.plot(places, [_percent(size[f"{name}_within_{key}"]) for size in sizes], **look)
    axes.set_xticks(places, [f"{size['width']}x{size['height']}" for size in sizes])
    axes.set_xlabel("image [px]")
    axes.set_ylabel("share of the flies, of a rival's pixels [%]")
    axes.set_title("how good")
    axes.grid(True, color="0.92", linewidth=0.6)
    # Beside the axes: where the curves run is not known before they are measured.
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _percent(share: float | None) -> float:
    return float("nan") if share is None else 100.0 * share
