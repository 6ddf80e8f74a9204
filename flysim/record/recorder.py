"""Everything of a run into its folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flysim.journey import Journey
from flysim.worlds.model import Part

if TYPE_CHECKING:
    from flysim.evaluate.report import Report
    from flysim.truth.obstacles import TrueObstacle

Progress = Callable[[str, float], None]  # what is written next, and the share that is done
FIGURES = "figures"
RECORDING = "recording.rrd"
_CHANGING = ("written", "versions")  # what in a configuration differs between two runs of one seed


def write_run(
    folder: Path,
    journey: Journey,
    report: Callable[[], Report],
    true_obstacles: Sequence[TrueObstacle],
    config: Mapping[str, Any],
    progress: Progress = lambda what, share: None,
    *,
    robot_parts: Sequence[Part] = (),
) -> None:
    """Write the data files, the figures and the recording of a run into an existing folder.

    With `run_folder` round it, the folder appears whole or not at all.

    Args:
        folder: where to.
        journey: the finished drive.
        report: gives its evaluation; asked when all is drawn that needs none.
        true_obstacles: what stands in the world, for figures and recording.
        config: all parameters of the run; commit and versions are added.
        progress: called before each step and once after the last.
        robot_parts: the robot's visuals in base_link, for the recording.

    Raises:
        RecordError: rerun is switched off by its environment variable.
        OSError: the disk is full or refuses; `run_folder` turns it into a RecordError.
    """
    from flysim.common.provenance import git_commit, versions
    from flysim.record.figures import write_figures
    from flysim.record.files import write_files
    from flysim.record.recording import write_recording

    progress("draw the figures", 0.0)
    (folder / FIGURES).mkdir()
    write_figures(folder / FIGURES, journey, true_obstacles)
    facts = report().to_json()
    progress("write the data files", 0.7)
    made_by = {"git_commit": git_commit(), "versions": {**versions(), **config.get("versions", {})}}
    write_files(folder, journey, facts, {"seed": journey.seed, **config, **made_by})
    progress("write the recording", 0.8)
    lasting = {key: value for key, value in config.items() if key not in _CHANGING}
    write_recording(folder / RECORDING, journey, facts, true_obstacles, robot_parts=robot_parts, config=lasting)
    progress("written", 1.0)
