"""The picture of a calibration: where the corners lie, how far each is off, and how far each image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flysim.calibration.result import GRID, BoardCalibration
from flysim.record import colours
from flysim.record.canvas import drawn, label, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ARROW = 0.04  # of the image's width that the root of the mean square is drawn as
MOST_NAMES = 20
COLOURS = (colours.hexadecimal(colours.BELIEVED), colours.hexadecimal(colours.TRUE))


def calibration_png(calibration: BoardCalibration) -> bytes:
    """A PNG's bytes: of each eye its corners with what is left over, and below it the images by their rms."""
    from matplotlib.figure import Figure

    eyes = calibration.solved.eyes
    figure = Figure(figsize=(6.0 * len(eyes) + 0.6, 7.6), dpi=100, layout="constrained")
    grid = figure.add_gridspec(2, len(eyes), height_ratios=(3, 1.5))
    longest = ARROW * calibration.views.size[0] / max(eye.rms for eye in eyes)
    for k, name in enumerate(calibration.infos):
        _corners(figure.add_subplot(grid[0, k]), calibration, k, name, longest)
    _images(figure.add_subplot(grid[1, :]), calibration)
    figure.suptitle(
        f"{label(calibration.board.name)}, {len(calibration.views.names)} images, rms {calibration.solved.rms:.3f} px; "
        f"{calibration.verdict}",
        fontsize=11,
    )
    return png(drawn(figure))


def _corners(axes: Axes, calibration: BoardCalibration, eye: int, name: str, longer: float) -> None:
    width, height = calibration.views.size
    covered = calibration.covered(eye)
    axes.imshow(
        np.where(covered, 1.0, 0.82),
        extent=(-0.5, width - 0.5, height - 0.5, -0.5),
        cmap="gray",
        vmin=0.0,
        vmax=1.0,
        aspect="equal",
    )
    found = calibration.solved.eyes[eye]
    for one, off in zip(found.used, found.residuals, strict=True):
        if one is not None and off is not None:
            arrows = (off * longer).T
            axes.quiver(*one.uv.T, *arrows, angles="xy", scale_units="xy", scale=1.0, width=0.002, color=COLOURS[eye])
    off = found.rms
    share = covered.mean()
    axes.set_title(
        f"{name}: rms {off:.3f} px; {share:.0%} of {GRID[0]}x{GRID[1]} cells covered (grey: none)\n"
        f"arrows: what is left over, {longer:.0f} times as long",
        fontsize=9,
    )
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_xlabel("u [px]")
    axes.set_ylabel("v [px]")


def _images(axes: Axes, calibration: BoardCalibration) -> None:
    names, eyes = calibration.views.names, calibration.solved.eyes
    wide = 0.8 / len(eyes)
    for k, (name, eye) in enumerate(zip(calibration.infos, eyes, strict=True)):
        at = np.arange(len(names)) + (k - (len(eyes) - 1) / 2) * wide
        axes.bar(at, [one or 0.0 for one in eye.rms_of_images], wide, color=COLOURS[k], label=name)
    if len(names) <= MOST_NAMES:
        axes.set_xticks(range(len(names)), [label(name) for name in names], rotation=45, ha="right", fontsize=8)
    else:
        axes.set_xlabel("image")
    axes.set_ylabel("rms [px]")
    axes.set_ylim(0.0, None)
    axes.grid(True, axis="y", color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.legend(frameon=False, ncols=2)
