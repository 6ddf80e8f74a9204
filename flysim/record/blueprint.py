"""How a recording opens in rerun's viewer: the world beside the images, curves below, report and log at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flysim.products.findings import Findings
from flysim.record.scene import extent
from flysim.truth.truth import Truth

if TYPE_CHECKING:
    from rerun.blueprint import Blueprint


def blueprint(findings: Findings, truth: Truth | None, cameras: Sequence[str], curves: Mapping[str, str]) -> Blueprint:
    """The views and the timeline of a recording's window.

    Args:
        findings: what is recorded.
        truth: of the same frames, or None.
        cameras: names of the robot's cameras, left one first.
        curves: what is drawn over the generations: its name in the recording, and its title.
    """
    import rerun.blueprint as rrb

    center, reach = extent(findings, truth)
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=center + reach * np.array([-0.5, -0.55, 0.6]),
        look_target=center,
        eye_up=(0.0, 0.0, 1.0),
    )
    scene = ["/world/**", *(f"- /world/robot/{camera}/flies" for camera in cameras)]
    start, end = rrb.TimeRangeBoundary.infinite(), rrb.TimeRangeBoundary.cursor_relative(seq=0)
    past = rrb.VisibleTimeRanges(
        [rrb.VisibleTimeRange(name, start=start, end=end) for name in ("generation", "stop", "sim_time")]
    )

    def space(name: str, overrides: Any) -> rrb.Spatial3DView:
        background = rrb.Background(kind=rrb.BackgroundKind.SolidColor, color=(247, 247, 247))
        return rrb.Spatial3DView(
            origin="/world",
            contents=scene,
            name=name,
            overrides=overrides,
            background=background,
            line_grid=False,
            eye_controls=eye,
        )

    images = (
        rrb.Spatial2DView(origin=f"/world/robot/{camera}", name=f"{camera.title()} image with its flies")
        for camera in cameras
    )
    plots = [rrb.TimeSeriesView(origin=f"/curves/{key}", name=name) for key, name in curves.items()]
    plots.append(rrb.TimeSeriesView(origin="/curves/iterations", name="Generations a stop"))
    words = rrb.Tabs(
        rrb.TextDocumentView(origin="/report", name="Report"),
        rrb.TextLogView(origin="/log", name="Log"),
        active_tab=0,
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Tabs(space("World so far", {"/world/flies": past}), space("This stop alone", {}), active_tab=0),
                rrb.Horizontal(*plots),
                row_shares=[3.0, 1.0],
            ),
            rrb.Vertical(rrb.Horizontal(*images), words, row_shares=[1.0, 1.6]),
            column_shares=[1.3, 1.0],
        ),
        rrb.TimePanel(state="collapsed", timeline="generation", fps=15.0, play_state="following"),
        collapse_panels=True,
    )
