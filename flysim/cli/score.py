"""`flysim score`: another algorithm's results on a data set, judged by flysim's evaluator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flysim.cli.options import AsJson, ScenarioKeys, within
from flysim.cli.terminal import Bar, say, say_json, show
from flysim.errors import FlysimError, did_you_mean


def score(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A data set with its truth, as flysim export writes.")],
    points: Annotated[
        list[Path] | None,
        typer.Option(help="Points: PLY, .npy or text, one file a frame; a folder, a pattern, or repeated."),
    ] = None,
    disparity: Annotated[
        list[Path] | None, typer.Option(help="Disparities of the left picture: PFM, 16-bit PNG or .npy; likewise.")
    ] = None,
    obstacles: Annotated[Path | None, typer.Option(help="Obstacles in the world: one JSON file.")] = None,
    frame: Annotated[str, typer.Option(help="Of points: left, the camera's optical frame, or world.")] = "left",
    name: Annotated[str | None, typer.Option(help="Of the algorithm, in the table. [points, disparity, ...]")] = None,
    every: Annotated[
        int, typer.Option(help="Of the frames, one in so many.", callback=within("--every", 1, 100_000))
    ] = 1,
    overrides: ScenarioKeys = None,
    out: Annotated[Path | None, typer.Option(help="Folder of report, figures and recording to write. [none]")] = None,
    as_json: AsJson = False,
) -> None:
    """Judge points, disparities or obstacles that another program made of a data set's frames."""
    from flysim.studies.score.score import FRAMES, KINDS

    given = {"points": points, "disparity": disparity, "obstacles": [obstacles] if obstacles else None}
    kinds = [kind for kind in KINDS if given[kind]]
    if len(kinds) != 1:
        raise FlysimError("give one of --points, --disparity, --obstacles.")
    if frame not in FRAMES:
        raise FlysimError(f"no frame '{frame}'. {did_you_mean(frame, FRAMES)}")
    from flysim.datasets.source import read_data_set
    from flysim.runs.data import plan_of
    from flysim.studies.score.score import score as judge

    data = read_data_set(folder, every=every)
    plan = plan_of(data, overrides or ())
    with Bar(f"score {data.name}", quiet=as_json) as bar:
        scored = judge(data, plan, kinds[0], given[kinds[0]] or (), name=name, frame=frame, progress=bar)
        if out is not None:
            from flysim.record.recorder import record

            bar("write", 0.9)
            record(scored.findings, out, truth=scored.truth, report=scored.report, data=str(folder.resolve()))
    if as_json:
        say_json(scored.to_json())
        return
    show(scored.sheets())
    if out is not None:
        say(f"folder: {out}   (report.json; figures/*.png; recording.rrd)")
