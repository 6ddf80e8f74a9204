"""`flysim study`: one disturbance of cameras or world, from none of it to far too much, and who loses what when."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flysim.cli.options import NO_JOBS, Jobs, bundled, parse_seeds
from flysim.cli.study import RUNS_OUT, engine_names, renderer_named
from flysim.cli.terminal import Bar, say, say_json, show
from flysim.errors import FlysimError

if TYPE_CHECKING:
    from flysim.studies.sweep.study import Study

MAX_DRIVES = 100_000


def _studies(incomplete: str) -> list[str]:
    from flysim.studies.sweep.study import STUDIES

    return [name for name in STUDIES.names if name.startswith(incomplete)]


Name = Annotated[
    str,
    typer.Argument(
        help="light, glare, exposure, offset, noise, blur, defocus, jpeg, contrast, alignment, roll, calibration, "
        "calibration-images, texture, floor, baseline, hop, odometry or localisation; or module:object.",
        autocompletion=_studies,
    ),
]


@bundled
def study(
    name: Name,
    engines: Annotated[
        str | None, typer.Option(help="Names with commas between. [flies,sgbm,bm, or the study's own]")
    ] = None,
    scenarios: Annotated[
        str | None, typer.Option(help="Names or files, with commas between. [paper_a,paper_c,yard, or its own]")
    ] = None,
    seeds: Annotated[str, typer.Option(help="A:B for the seeds A to B - 1.")] = "0:3",
    levels: Annotated[
        str | None, typer.Option(help="Numbers with commas between, the least first. [the study's own]")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write, or to go on with. [runs/out/study-NAME-...]")
    ] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE for all scenarios; may be repeated.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the study in --out, as it does anyway.")] = False,
    jobs: Jobs = NO_JOBS,
) -> None:
    """Turn up one disturbance level by level, and see what each engine still finds.

    What a folder holds is not run again: stopped or killed, the same command with --out goes on; with more seeds,
    levels, scenarios or engines it adds those.
    """
    from flysim.studies.sweep.study import STUDIES, Study

    drawn_by, found = renderer_named(jobs.renderer), STUDIES.load(name)
    if not isinstance(found, Study):
        raise FlysimError(f"study '{name}' is no flysim.studies.sweep.study.Study.")
    who = engine_names(",".join(f'"{name}"' for name in found.engines) if engines is None else engines)
    if resume and out is None:
        raise FlysimError("--resume needs the folder to go on with: --out DIR.")
    from flysim.common.growing import growing
    from flysim.common.runner import runner
    from flysim.record.run_folder import default_folders
    from flysim.studies.sweep.sweep import STUDY, run_study, trips

    todo = trips(
        found,
        found.scenarios if scenarios is None else _listed("--scenarios", scenarios),
        parse_seeds(seeds) or range(0),
        who,
        levels=_levels(levels, found),
        renderer=drawn_by,
        overrides=overrides or (),
    )
    if not 0 < len(todo) <= MAX_DRIVES:
        raise FlysimError(f"--seeds {seeds}: {len(todo):,} drives, from 1 to {MAX_DRIVES:,} can be asked for.")
    run = runner(jobs.processes, jobs.ray)
    outs = default_folders(RUNS_OUT, f"study-{name}", None) if out is None else [out]
    with (
        growing(outs, STUDY, {"study": name}, len(todo), "drives", resume=out is not None, more=True) as folder,
        Bar(f"study {name}", quiet=jobs.as_json) as bar,
    ):
        result = run_study(name, found, todo, folder, run, progress=bar)
    if jobs.as_json:
        say_json({**result.to_json(), "folder": str(folder.out)})
    else:
        show(result.sheets())
        say(f"folder: {folder.out}   (study.json; cells.parquet; figures/study.png)")
    if result.lost:
        raise FlysimError(f"{len(result.lost)} drives were lost, {result.lost[0]}: the same command does them again.")


def _listed(option: str, text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names or len(set(names)) < len(names):
        raise FlysimError(f"{option} {text}: name each once, with commas between.")
    return names


def _levels(text: str | None, study: Study) -> tuple[float, ...]:
    if text is None:
        return study.levels
    try:
        levels = tuple(float(word) for word in _listed("--levels", text))
    except ValueError:
        raise FlysimError(f"--levels {text}: write numbers with commas between, as in --levels 0,5,10.") from None
    if not all(map(math.isfinite, levels)) or len(set(levels)) < len(levels):
        raise FlysimError(f"--levels {text}: give finite numbers, each once.")
    return levels
