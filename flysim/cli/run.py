"""`flysim run`, `show`, `view` and `preview`: drive a scenario, and look at what it left."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flysim.cli.data import end_failed, see_data_set
from flysim.cli.options import (
    NO_DATA,
    NO_DRIVER,
    Driver,
    FromData,
    Models,
    OwnSeed,
    Renderer,
    ScenarioKeys,
    Texture,
    bundled,
)
from flysim.cli.study import RUNS_OUT, reserved_folder, tell_bare
from flysim.cli.study import renderer_named as _renderer
from flysim.cli.study import scenario_names as _scenarios
from flysim.cli.terminal import Bar, say, say_json, warn, width
from flysim.common import catalogue as assets
from flysim.errors import RecordError, ScenarioError
from flysim.plain import shown_path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flysim.evaluate.report import Report
    from flysim.render.choose import RendererName
    from flysim.runs.scenario import Scenario


def _worlds(incomplete: str) -> list[str]:
    return [name for name in assets.world_names() if name.startswith(incomplete)]


@bundled
def run(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(help="Names (flysim list) or paths of scenario files.", autocompletion=_scenarios),
    ] = None,
    seed: OwnSeed = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Run folder to write; with several scenarios, the folder they go in. [runs/out/...]"),
    ] = None,
    overrides: ScenarioKeys = None,
    renderer: Renderer = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON array of reports, nothing else.")] = False,
    engine: Annotated[
        str | None, typer.Option(help="What sees: a name of flysim list, exec:COMMAND or onnx:FILE. [flies]")
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(help="In place of scenarios: a world, or any SDF file.", autocompletion=_worlds),
    ] = None,
    driver: Driver = NO_DRIVER,
    texture: Texture = None,
    data: FromData = NO_DATA,
) -> None:
    """Drive scenarios, let the flies evolve at each stop, and hold what they found against the truth.

    With --world the stops are planned: orbit, from all sides; sweep, up and down; frontal, from the start's side.
    With --data nothing is driven: the frames of a data set are seen (flysim export writes them).
    """
    if data.data is not None:
        if any((scenarios, world, texture, *driver)):
            raise ScenarioError("--data goes without scenarios, --world, --texture and a robot: it has its frames.")
        see_data_set(data, engine=engine, overrides=overrides or (), seed=seed, out=out, as_json=as_json)
        return
    if data.every is not None or data.height is not None:
        raise ScenarioError("--every and --height go with --data DIR.")
    from flysim.runs.planned import asked

    # Every mistake before the first drive, the cheap ones before the libraries of a drive are loaded.
    drawn_by = _renderer(renderer)
    robot, wheels, cameras, path, models = driver
    # What another run was seen by does not count where --engine says it: its file may name a program of somebody's.
    keys = [*(overrides or ()), *([] if engine is None else ["engine=flies"])]
    plans = asked(scenarios or (), world, robot, path, texture, keys, wheels, cameras, models or ())
    if engine is not None:
        from flysim.engines.choose import ENGINES

        plans = [plan.model_copy(update={"engine": ENGINES.check(engine)}) for plan in plans]
    if out is not None and len({plan.name for plan in plans}) < len(plans):
        raise ScenarioError("two scenarios have one name and would share a folder in --out: run them one by one.")
    if seed is not None:
        plans = [plan.model_copy(update={"seed": seed}) for plan in plans]
    for plan in plans:
        tell_bare(plan.world_path, plan.texture, plan.model_folders)
    folders = [out if out is None or len(plans) == 1 else out / plan.name for plan in plans]
    reports = _driven(plans, folders, drawn_by, as_json)
    if as_json:
        say_json(reports)
    end_failed([line for report in reports for line in report.get("failed", ())])


def _driven(
    plans: Sequence[Scenario], folders: Sequence[Path | None], renderer: RendererName, as_json: bool
) -> list[dict[str, Any]]:
    """Runs them all, writes and tells of each; the reports."""
    reports = []
    with contextlib.ExitStack() as stack:
        places = [  # all of them before the first drive
            stack.enter_context(reserved_folder(folder, plan.name, plan.seed))
            for folder, plan in zip(folders, plans, strict=True)
        ]
        from flysim.runs.run import check, run_into

        for plan in plans[1:]:  # the first one's drive checks itself
            check(plan)

        for plan, place in zip(plans, places, strict=True):
            with Bar(f"{plan.name}, seed {plan.seed}", quiet=as_json) as bar, place.writing() as room:
                report = run_into(room, plan, seed=plan.seed, renderer=renderer, progress=bar)
            reports.append(report.to_json())
            _tell(report, place.out, as_json)
    return reports


def _tell(report: Report, out: Path, as_json: bool) -> None:
    if report.warnings:
        warn(" ".join(report.warnings))
    if not as_json:
        say(report.text(width()), f"\nrun folder: {out}   (flysim show {out}; flysim view {out})\n")


def show_run(
    run_name: Annotated[str, typer.Argument(metavar="RUN", help="A run folder, a scenario's name, or 'latest'.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print report.json.")] = False,
) -> None:
    """Print the report of a recorded run."""
    from flysim.evaluate.report import Report
    from flysim.record.run_folder import find_run, read_report

    folder = find_run(run_name, RUNS_OUT)
    report = read_report(folder)
    if as_json:
        say_json(report)
        return
    try:
        text = Report.from_json(report).text(width())
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        why = f"{type(error).__name__}: {error}"
        raise RecordError(
            f"{shown_path(folder)}: its report is damaged or another version's ({why}). Run it again."
        ) from error
    say(text, "", folder, *sorted((folder / "figures").glob("*.png")))


def view(
    run_name: Annotated[str, typer.Argument(metavar="RUN", help="A run folder, a scenario's name, or 'latest'.")],
    web: Annotated[bool, typer.Option("--web", help="Serve it to a browser on this machine.")] = False,
) -> None:
    """Open a run's recording in the rerun viewer."""
    from flysim.record.recorder import RECORDING
    from flysim.record.run_folder import find_run
    from flysim.record.viewer import open_viewer

    given = Path(run_name)  # what `flysim see` wrote has a recording and no report
    folder = given if (given / RECORDING).is_file() else find_run(run_name, RUNS_OUT)
    with open_viewer(folder, web=web) as viewer:
        if web:
            say(viewer.url, "Ctrl-C ends it.")
        viewer.wait()


def preview(
    world: Annotated[str, typer.Argument(help="Name or path of a world.", autocompletion=_worlds)],
    out: Annotated[Path | None, typer.Option(help="PNG to write. [WORLD.png]")] = None,
    renderer: Renderer = "auto",
    models: Models = None,
) -> None:
    """Draw a world as a person standing in its corner would see it."""
    from flysim.render.preview import draw_preview

    drawn_by, path = _renderer(renderer), assets.find_world(world)
    target = out or Path(f"{path.parent.name if path.name == 'world.sdf' else path.stem}.png")
    for warning in draw_preview(path, target, drawn_by, models or ()):
        warn(warning)
    say(target)
