"""The command line: the only printer. One line and exit 2 for a user's mistake."""

from __future__ import annotations

import contextlib
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from flysim import __version__
from flysim.cli.nav import bench_env
from flysim.cli.nav import nav as nav_command
from flysim.cli.nav import train as train_commands
from flysim.cli.options import AsJson, Renderer, Repeats, Seed, within
from flysim.cli.study import RUNS_OUT, reserved_folder, study
from flysim.cli.study import renderer_named as _renderer
from flysim.cli.study import scenario_names as _scenarios
from flysim.cli.terminal import Bar, complain, say, say_json, show, warn
from flysim.cli.world import world as world_commands
from flysim.common import catalogue as assets
from flysim.errors import FlysimError, RecordError, ScenarioError
from flysim.plain import one_line, shown_path

if TYPE_CHECKING:
    from collections.abc import Iterable

    from flysim.common.sheet import Sheet


class _Guard(TyperGroup):
    """Turns what flysim refuses into one line and an exit code, for every command."""

    def invoke(self, ctx: typer.Context) -> Any:
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            error.message = one_line(error.message)
            raise
        except FlysimError as error:
            complain(str(error))
            raise typer.Exit(2) from None
        except MemoryError:
            complain("out of memory. Use a smaller population, image or world.")
            raise typer.Exit(2) from None
        except BrokenPipeError:
            raise  # `flysim list | head`: typer ends quietly
        except OSError as error:
            place = f" {os.fsdecode(error.filename)}" if isinstance(error.filename, str | bytes) else " the output"
            complain(f"cannot read or write{place}: {error.strerror or error}.")
            with contextlib.suppress(OSError):  # what is still to be flushed to a full disk goes nowhere
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            raise typer.Exit(2) from None


app = typer.Typer(
    cls=_Guard,
    name="flysim",
    help="A simulation testbed for the fly algorithm in robot navigation.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("nav", epilog="Example: flysim nav vfh dwa --worlds yard --episodes 5")(nav_command)
app.add_typer(study)
app.add_typer(train_commands, name="train", epilog="Example: flysim train ppo --minutes 30")
app.add_typer(world_commands, name="world", epilog="Example: flysim world random --seed 7")


def _tell_version(asked: bool) -> None:
    if asked:
        say(f"flysim {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_tell_version, is_eager=True)
    ] = False,
) -> None:
    """A simulation testbed for the fly algorithm in robot navigation."""


def _worlds(incomplete: str) -> list[str]:
    return [name for name in assets.names("worlds") if name.startswith(incomplete)]


@app.command(epilog="Example: flysim run paper_a --seed 7 --set flies.population=3000")
def run(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(help="Names (flysim list) or paths of scenario files.", autocompletion=_scenarios),
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Run folder to write; with several scenarios, the folder they go in. [runs/out/...]"),
    ] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE for a scenario's key; may be repeated.")
    ] = None,
    renderer: Renderer = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON array of reports, nothing else.")] = False,
    engine: Annotated[str | None, typer.Option(help="What sees: flies, or a rival such as sgbm. [flies]")] = None,
    world: Annotated[
        str | None,
        typer.Option(help="In place of scenarios: a world, or any SDF file.", autocompletion=_worlds),
    ] = None,
    robot: Annotated[str | None, typer.Option(help="With --world: name or path of a robot. [rover]")] = None,
    path: Annotated[str | None, typer.Option(help="With --world: orbit, sweep or frontal. [orbit]")] = None,
    texture: Annotated[str | None, typer.Option(help="speckle: dress what has no texture.")] = None,
) -> None:
    """Drive scenarios, let the flies evolve at each stop, and hold what they found against the truth.

    With --world the stops are planned: orbit, from all sides; sweep, up and down; frontal, from the start's side.
    """
    from flysim.runs.planned import asked

    # Every mistake before the first drive, the cheap ones before the libraries of a drive are loaded.
    drawn_by = _renderer(renderer)
    plans = asked(scenarios or (), world, robot, path, texture, overrides or ())
    if engine is not None:
        from flysim.engines.choose import ENGINES

        plans = [plan.model_copy(update={"engine": ENGINES.check(engine)}) for plan in plans]
    if out is not None and len({plan.name for plan in plans}) < len(plans):
        raise ScenarioError("two scenarios have one name and would share a folder in --out: run them one by one.")
    reports = []
    with contextlib.ExitStack() as stack:
        folders = [out if out is None or len(plans) == 1 else out / plan.name for plan in plans]
        places = [  # all of them before the first drive
            stack.enter_context(reserved_folder(folder, plan.name, seed))
            for folder, plan in zip(folders, plans, strict=True)
        ]
        from flysim.runs.run import check, run_into

        for plan in plans[1:]:  # the first one's drive checks itself
            check(plan)

        for plan, place in zip(plans, places, strict=True):
            with Bar(f"{plan.name}, seed {seed}", quiet=as_json) as bar, place.writing() as room:
                report = run_into(room, plan, seed=seed, renderer=drawn_by, progress=bar)
            reports.append(report.to_json())
            if report.warnings:
                warn(" ".join(report.warnings))
            if not as_json:
                say(report, f"\nrun folder: {place.out}   (flysim show {place.out}; flysim view {place.out})\n")
    if as_json:
        say_json(reports)


@app.command("list", epilog="Example: flysim list --json")
def list_assets(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the scenarios, worlds and robots that come with flysim."""
    from flysim.runs.scenario import read_scenario

    scenarios = [read_scenario(name) for name in assets.names("runs")]
    if as_json:
        rows = [
            {
                "name": s.name,
                "description": s.description,
                "world": s.world,
                "robot": s.robot,
                "stops": len(s.stops),
            }
            for s in scenarios
        ]
        say_json({"scenarios": rows, "worlds": assets.names("worlds"), "robots": assets.names("robots")})
        return
    from flysim.common.sheet import Sheet

    table = tuple((s.name, s.world, s.robot, str(len(s.stops)), s.description) for s in scenarios)
    columns = ("name", "world", "robot", "stops", "description")
    show([Sheet(title="scenarios", columns=columns, rows=table, left=(0, 1, 2, 4))])
    say(f"worlds: {', '.join(assets.names('worlds'))}", f"robots: {', '.join(assets.names('robots'))}")


@app.command("show", epilog="Example: flysim show latest")
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
        text = str(Report.from_json(report))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        why = f"{type(error).__name__}: {error}"
        raise RecordError(
            f"{shown_path(folder)}: its report is damaged or another version's ({why}). Run it again."
        ) from error
    say(text, "", folder, *sorted((folder / "figures").glob("*.png")))


@app.command(epilog="Example: flysim view latest --web")
def view(
    run_name: Annotated[str, typer.Argument(metavar="RUN", help="A run folder, a scenario's name, or 'latest'.")],
    web: Annotated[bool, typer.Option("--web", help="Serve it to a browser on this machine.")] = False,
) -> None:
    """Open a run's recording in the rerun viewer."""
    from flysim.record.run_folder import find_run
    from flysim.record.viewer import open_viewer

    with open_viewer(find_run(run_name, RUNS_OUT), web=web) as viewer:
        if web:
            say(viewer.url, "Ctrl-C ends it.")
        viewer.wait()


@app.command(epilog="Example: flysim preview yard --out yard.png")
def preview(
    world: Annotated[str, typer.Argument(help="Name or path of a world.", autocompletion=_worlds)],
    out: Annotated[Path | None, typer.Option(help="PNG to write. [WORLD.png]")] = None,
    renderer: Renderer = "auto",
) -> None:
    """Draw a world as a person standing in its corner would see it."""
    from flysim.render.preview import draw_preview

    drawn_by, path = _renderer(renderer), assets.find_world(world)
    target = out or Path(f"{path.parent.name if path.name == 'world.sdf' else path.stem}.png")
    draw_preview(path, target, drawn_by)
    say(target)


@app.command("table1", epilog="Example: flysim table1 --seeds 5 --out table1")
def table_1(
    seeds: Annotated[
        int, typer.Option(help="Evolutions of each setting.", callback=within("--seeds", 1, 100_000))
    ] = 20,
    out: Annotated[Path | None, typer.Option(help="Folder to write. [runs/out/table1-...]")] = None,
    renderer: Renderer = "auto",
    as_json: AsJson = False,
) -> None:
    """Run the grid of the paper's Table 1 on a rendered pair, and print each cell beside the paper's."""
    drawn_by = _renderer(renderer)
    with reserved_folder(out, "table1", None) as place, place.writing() as room:  # before the work, not after it
        from flysim.studies.table1.figures import write_table1_figures
        from flysim.studies.table1.table1 import run_table1

        with Bar(f"Table 1, {seeds} seed" + "s" * (seeds > 1), quiet=as_json) as bar:
            table = run_table1(seeds=seeds, renderer=drawn_by, progress=bar)
        text = json.dumps(table.to_json(), indent=1, allow_nan=False)
        (room / "table1.json").write_text(text + "\n", encoding="utf-8")
        (room / "figures").mkdir()
        write_table1_figures(room / "figures", table)
    if as_json:
        say_json(table.to_json())
        return
    show([table.sheet()])
    say(*table.lines(), f"\nfolder: {place.out}   (table1.json; figures/*.png)")


bench = typer.Typer(help="Measure how fast the parts are on this machine.", no_args_is_help=True)
app.add_typer(bench, name="bench", epilog="Example: flysim bench engine --repeats 3")

bench.command("env", epilog="Example: flysim bench env --json")(bench_env)


@bench.command("engine", epilog="Example: flysim bench engine --out bench")
def bench_engine(
    repeats: Repeats = 9,
    renderer: Renderer = "auto",
    out: Annotated[Path | None, typer.Option(help="Folder to write bench.json and sizes.png into.")] = None,
    as_json: AsJson = False,
) -> None:
    """Time the flies: a generation, the paper's Table 1, and beside OpenCV's dense matchers at four image sizes."""
    drawn_by = _renderer(renderer)
    from flysim.common.whole_folder import whole_folder

    # The folder before the minutes it takes, not after them.
    with contextlib.nullcontext() if out is None else whole_folder(out) as room:
        from flysim.studies.bench.engine import bench_engine as measure

        with Bar("bench engine", quiet=as_json) as bar:
            result = measure(repeats=repeats, renderer=drawn_by, progress=bar)
        if room is not None:
            result.write(room)
    _tell(result.to_json(), result.sheets(), as_json)
    if out is not None and not as_json:
        say(*sorted(out.iterdir()))


@bench.command("stop", epilog="Example: flysim bench stop yard --repeats 3")
def bench_stop(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(help="Names or paths of scenario files. [paper_a yard]", autocompletion=_scenarios),
    ] = None,
    repeats: Repeats = 9,
    as_json: AsJson = False,
) -> None:
    """Time a stop, by each renderer: the look alone, and with its evolution."""
    from flysim.runs.scenario import read_scenario

    plans = [read_scenario(name) for name in scenarios or ("paper_a", "yard")]
    from flysim.studies.bench.stop import bench_stop as measure

    with Bar("bench stop", quiet=as_json) as bar:
        result = measure(plans, repeats=repeats, progress=bar)
    _tell(result.to_json(), result.sheets(), as_json)


def _tell(data: dict[str, Any], sheets: Iterable[Sheet], as_json: bool) -> None:
    """A result's JSON alone, or its machine and tables."""
    if as_json:
        say_json(data)
        return
    on = data["machine"]
    say(f"{on['processor']}, {on['cpus_usable']} cores, {on['threads']} threads, medians of {data['repeats']}\n")
    show(sheets)
