"""Everything of a run into its folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flysim.common.progress import Progress, silent
from flysim.common.whole_folder import whole_folder
from flysim.products.findings import Findings
from flysim.truth.truth import Truth
from flysim.worlds.model import Part

if TYPE_CHECKING:
    from flysim.evaluate.report import Report

FIGURES = "figures"
RECORDING = "recording.rrd"
_CHANGING = ("written", "versions")  # what in a configuration differs between two runs of one seed


def write_run(
    folder: Path,
    findings: Findings,
    truth: Truth | None = None,
    report: Callable[[], Report | None] = lambda: None,
    config: Mapping[str, Any] | None = None,
    progress: Progress = silent,
    *,
    robot_parts: Sequence[Part] = (),
) -> None:
    """Write the data files, the figures and the recording of whatever there is into an existing folder.

    With `whole_folder` round it, the folder appears whole or not at all.

    Args:
        folder: where to.
        findings: what an engine found.
        truth: of the same frames, for figures and recording; None where nobody knows it.
        report: gives the evaluation, or None; asked when all is drawn that needs none.
        config: all parameters of the run; seed, commit and versions are added.
        progress: called before each step and once after the last.
        robot_parts: the robot's visuals in base_link, for the recording.

    Raises:
        RecordError: rerun is switched off by its environment variable.
        OSError: the disk is full or refuses; `whole_folder` turns it into a RecordError.
    """
    from flysim.common.provenance import git_commit, versions
    from flysim.record.figures import write_figures
    from flysim.record.files import write_files
    from flysim.record.recording import write_recording

    config = config or {}
    progress("draw the figures", 0.0)
    (folder / FIGURES).mkdir()
    write_figures(folder / FIGURES, findings, truth)
    judged = report()
    facts = None if judged is None else judged.to_json()
    progress("write the data files", 0.7)
    made_by = {"git_commit": git_commit(), "versions": {**versions(), **config.get("versions", {})}}
    write_files(folder, findings, truth, facts, {"seed": findings.sequence.seed, **config, **made_by})
    progress("write the recording", 0.8)
    lasting = {key: value for key, value in config.items() if key not in _CHANGING}
    write_recording(folder / RECORDING, findings, truth, facts, robot_parts=robot_parts, config=lasting)
    progress("written", 1.0)


def record(
    findings: Findings, out: str | Path, *, truth: Truth | None = None, report: Report | None = None, **config: Any
) -> Path:
    """Write a folder of whatever there is, whole or not at all: of photographs as well as of a simulated drive.

    Args:
        findings: what an engine found.
        out: the folder to make.
        truth: of the same frames, where it is known.
        report: how far the findings are from it.
        config: what config.json is to hold beside seed, commit and versions.

    Returns:
        The folder.

    Raises:
        RecordError: it cannot be written.
    """
    with whole_folder(Path(out)) as folder:
        write_run(folder, findings, truth, lambda: report, config)
    return Path(out)
