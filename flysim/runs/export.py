"""Drives a scenario and writes what was seen, and what truly was, as a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flysim.common.progress import Progress, silent
from flysim.datasets.layout import layout
from flysim.datasets.write import SetWriter, Staging
from flysim.errors import ScenarioError
from flysim.products.frame import Frame
from flysim.render.choose import RendererName
from flysim.runs.run import errand
from flysim.runs.scenario import Scenario
from flysim.sources.filmed import FilmedDrive
from flysim.sources.simulated import simulated
from flysim.truth.stop import Stop

SETTINGS = ("flies", "obstacles")  # tables of a scenario that say how its frames were to be seen


def export_into(
    room: Path,
    plan: Scenario,
    *,
    layout_name: str,
    seed: int,
    renderer: RendererName = "auto",
    fps: float | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Writes a data set into a folder that is there and empty. Nothing is seen by any engine.

    Args:
        room: the folder.
        plan: what to drive.
        layout_name: the format's name.
        seed: of all randomness.
        renderer: as `run`.
        fps: frames a second of simulated time on the way; None: one at each stop.
        progress: called with a word and a share as the work goes on.

    Returns:
        What was written, for whoever tells of it: frames, format, scenario, seed, blocked.

    Raises:
        FlysimError: as `run`, there is no such format, or the drive was blocked before its first frame.
        OSError: the disk is full or refuses.
    """
    layout(layout_name)
    progress("build the world", 0.0)
    with simulated(errand(plan, seed), renderer, kind=FilmedDrive) as drive:
        writer = SetWriter(room, layout_name, staging(plan, drive, fps))

        def taken(frame: Frame, stop: Stop) -> None:
            writer.add(frame, stop)
            if fps is None:
                progress(f"stop {frame.index + 1} of {drive.planned}", (frame.index + 1) / drive.planned)
            else:  # how long the way takes nobody knows: the bar goes on, and slows down
                progress(f"frame {frame.index + 1}, {frame.time:.1f} s", 1.0 - 0.99 ** (frame.index / fps))

        drive.stops(taken) if fps is None else drive.film(fps, taken)
        if not writer.count:
            raise ScenarioError(f"scenario '{plan.name}': {drive.blocked}: there is no frame to write.")
        kept = plan.model_dump(mode="json")
        writer.finish(
            drive.disturbed,
            name=plan.name,
            seed=seed,
            renderer=drive.sequence().renderer,
            planned=drive.planned if fps is None else writer.count,
            blocked=drive.blocked,
            texture=plan.surfaces,
            notes=plan.notes,
            settings={name: kept[name] for name in SETTINGS},
        )
        told = {"scenario": plan.name, "seed": seed, "format": layout_name, "frames": writer.count}
        return {**told, "blocked": drive.blocked}


def staging(plan: Scenario, drive: FilmedDrive, fps: float | None = None) -> Staging:
    """What a drive's data set needs to know before its first frame."""
    return Staging(
        world=drive.world,
        believed=drive.rig,
        true=drive.true_rig,
        min_depth=plan.flies.min_depth,
        max_depth=plan.flies.max_depth,
        merge_gap=plan.truth.merge_gap,
        fps=fps,
    )
