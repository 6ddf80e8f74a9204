"""The command line: the only printer. One line and exit 2 for a user's mistake."""

from __future__ import annotations

import contextlib
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from flysim import assets
from flysim.cli_nav import bench_env
from flysim.cli_nav import nav as nav_command
from flysim.cli_nav import train as train_commands
from flysim.cli_study import RUNS_OUT, reserved_folder, study
from flysim.cli_study import renderer_named as _renderer
from flysim.cli_study import scenario_names as _scenarios
from flysim.cli_world import world as world_commands
from flysim.errors import FlysimError, RecordError, ScenarioError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from flysim.study.sheet import Sheet


class _Guard(TyperGroup):
    """Turns what flysim refuses into one line and an exit code, for every command."""

    def invoke(self, ctx: typer.Context) -> Any:
        try:
            return super().invoke(ctx)
        except FlysimError as error:
            _complain(str(error))
            raise typer.Exit(2) from None
        except MemoryError:
            _complain("out of memory. Use a smaller population, image or world.")
            raise typer.Exit(2) from None
        except BrokenPipeError:
            raise  # `flysim list | head`: typer ends quietly
        except OSError as error:
            place = f" {os.fsdecode(error.filename)}" if isinstance(error.filename, str | bytes) else " the output"
            _complain(f"cannot read or write{place}: {error.strerror or error}.")
            with contextlib.suppress(OSError):  # what is still to be flushed to a full disk goes nowhere
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            raise typer.Exit(2) from None


def _complain(what: str) -> None:
    """One line on stderr, whatever names from somebody else's files are in it."""
    typer.echo(f"flysim: {_plain(what)}", err=True)


def _plain(what: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in what)


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


def _worlds(incomplete: str) -> list[str]:
    return [name for name in assets.names("worlds") if name.startswith(incomplete)]


@app.command(epilog="Example: flysim run paper_a --seed 7 --set flies.population=3000")
def run(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(help="Names (flysim list) or paths of scenario files.", autocompletion=_scenarios),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of all randomness.", min=0)] = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Run folder to write; with several scenarios, the folder they go in. [runs/out/...]"),
    ] = None,
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="KEY=VALUE for a scenario's key; may be repeated.")
    ] = None,
    renderer: Annotated[str, typer.Option(help="auto, gl or tiny.")] = "auto",
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
    from flysim.world_scenario import asked

    # Every mistake before the first drive, the cheap ones before the libraries of a drive are loaded.
    drawn_by = _renderer(renderer)
    plans = asked(scenarios or (), world, robot, path, texture, overrides or ())
    if engine is not None:
        from flysim.rivals.engines import check as check_engine

        plans = [plan.model_copy(update={"engine": check_engine(engine)}) for plan in plans]
    if out is not None and len({plan.name for plan in plans}) < len(plans):
        raise ScenarioError("two scenarios have one name and would share a folder in --out: run them one by one.")
    reports = []
    with contextlib.ExitStack() as stack:
        folders = [out if out is None or len(plans) == 1 else out / plan.name for plan in plans]
        places = [  # all of them before the first drive
            stack.enter_context(reserved_folder(folder, plan.name, seed))
            for folder, plan in zip(folders, plans, strict=True)
        ]
        from flysim.pipeline import check, run_into

        for plan in plans[1:]:  # the first one's drive checks itself
            check(plan)
        from flysim.terminal import Bar

        for plan, place in zip(plans, places, strict=True):
            with Bar(f"{plan.name}, seed {seed}", quiet=as_json) as bar, place.writing() as room:
                report = run_into(room, plan, seed=seed, renderer=drawn_by, progress=bar)
            reports.append(report.to_json())
            if report.warnings:
                typer.echo(f"flysim: warning: {_plain(' '.join(report.warnings))}", err=True)
            if not as_json:
                typer.echo(str(report))
                typer.echo(f"\nrun folder: {place.out}   (flysim show {place.out}; flysim view {place.out})\n")
    if as_json:
        typer.echo(json.dumps(reports, indent=1, allow_nan=False))


@app.command("list", epilog="Example: flysim list --json")
def list_assets(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List the scenarios, worlds and robots that come with flysim."""
    from flysim.scenario import read_scenario

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
        typer.echo(
            json.dumps(
                {"scenarios": rows, "worlds": assets.names("worlds"), "robots": assets.names("robots")},
                indent=1,
            )
        )
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(title="scenarios", title_justify="left", box=None, pad_edge=False)
    for column in ("name", "world", "robot", "stops", "description"):
        table.add_column(column)
    for s in scenarios:
        table.add_row(s.name, s.world, s.robot, str(len(s.stops)), s.description)
    console = Console()
    console.print(table)
    console.print(f"\nworlds: {', '.join(assets.names('worlds'))}\nrobots: {', '.join(assets.names('robots'))}")


@app.command(epilog="Example: flysim show latest")
def show(
    run_name: Annotated[str, typer.Argument(metavar="RUN", help="A run folder, a scenario's name, or 'latest'.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print report.json.")] = False,
) -> None:
    """Print the report of a recorded run."""
    from flysim.evaluate.report import Report
    from flysim.record.run_folder import find_run, read_report

    folder = find_run(run_name, RUNS_OUT)
    report = read_report(folder)
    try:
        text = json.dumps(report, indent=1, allow_nan=False) if as_json else str(Report.from_json(report))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise RecordError(
            f"{folder}: its report is damaged or another version's ({type(error).__name__}: {error}). Run it again."
        ) from error
    typer.echo(text)
    if as_json:
        return
    figures = sorted((folder / "figures").glob("*.png"))
    typer.echo("\n" + "\n".join(str(path) for path in (folder, *figures)))


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
            typer.echo(f"{viewer.url}\nCtrl-C ends it.")
        viewer.wait()


@app.command(epilog="Example: flysim preview yard --out yard.png")
def preview(
    world: Annotated[str, typer.Argument(help="Name or path of a world.", autocompletion=_worlds)],
    out: Annotated[Path | None, typer.Option(help="PNG to write. [WORLD.png]")] = None,
    renderer: Annotated[str, typer.Option(help="auto, gl or tiny.")] = "auto",
) -> None:
    """Draw a world as a person standing in its corner would see it."""
    from flysim.sim.preview import draw_preview

    drawn_by, path = _renderer(renderer), assets.find_world(world)
    target = out or Path(f"{path.parent.name if path.name == 'world.sdf' else path.stem}.png")
    draw_preview(path, target, drawn_by)
    typer.echo(str(target))


@app.command("table1", epilog="Example: flysim table1 --seeds 5 --out table1")
def table_1(
    seeds: Annotated[int, typer.Option(help="Evolutions of each setting.", min=1)] = 20,
    out: Annotated[Path | None, typer.Option(help="Folder to write. [runs/out/table1-...]")] = None,
    renderer: Annotated[str, typer.Option(help="auto, gl or tiny.")] = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object, nothing else.")] = False,
) -> None:
    """Run the grid of the paper's Table 1 on a rendered pair, and print each cell beside the paper's."""
    drawn_by = _renderer(renderer)
    with reserved_folder(out, "table1", None) as place, place.writing() as room:  # before the work, not after it
        from flysim.study.table1 import run_table1
        from flysim.study.table1_figures import write_table1_figures
        from flysim.terminal import Bar

        with Bar(f"Table 1, {seeds} seed" + "s" * (seeds > 1), quiet=as_json) as bar:
            table = run_table1(seeds=seeds, renderer=drawn_by, progress=bar)
        text = json.dumps(table.to_json(), indent=1, allow_nan=False)
        (room / "table1.json").write_text(text + "\n", encoding="utf-8")
        (room / "figures").mkdir()
        write_table1_figures(room / "figures", table)
    if as_json:
        typer.echo(text)
        return
    _print_sheets([table.sheet()])
    typer.echo("\n".join(table.lines()))
    typer.echo(f"\nfolder: {place.out}   (table1.json; figures/*.png)")


bench = typer.Typer(help="Measure how fast the parts are on this machine.", no_args_is_help=True)
app.add_typer(bench, name="bench", epilog="Example: flysim bench engine --repeats 3")

bench.command("env", epilog="Example: flysim bench env --json")(bench_env)

Repeats = Annotated[int, typer.Option(help="Rounds that count, after one that does not.", min=1)]


@bench.command("engine", epilog="Example: flysim bench engine --out bench")
def bench_engine(
    repeats: Repeats = 9,
    renderer: Annotated[str, typer.Option(help="auto, gl or tiny.")] = "auto",
    out: Annotated[Path | None, typer.Option(help="Folder to write bench.json and sizes.png into.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object, nothing else.")] = False,
) -> None:
    """Time the flies: a generation, the paper's Table 1, and beside OpenCV's dense matchers at four image sizes."""
    drawn_by = _renderer(renderer)
    from flysim.whole_folder import whole_folder

    # The folder before the minutes it takes, not after them.
    with contextlib.nullcontext() if out is None else whole_folder(out) as room:
        from flysim.study.bench_engine import bench_engine as measure
        from flysim.terminal import Bar

        with Bar("bench engine", quiet=as_json) as bar:
            result = measure(repeats=repeats, renderer=drawn_by, progress=bar)
        if room is not None:
            result.write(room)
    _show(result.to_json(), result.sheets(), as_json)
    if out is not None and not as_json:
        typer.echo("\n".join(str(path) for path in sorted(out.iterdir())))


@bench.command("stop", epilog="Example: flysim bench stop yard --repeats 3")
def bench_stop(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(help="Names or paths of scenario files. [paper_a yard]", autocompletion=_scenarios),
    ] = None,
    repeats: Repeats = 9,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object, nothing else.")] = False,
) -> None:
    """Time a stop, by each renderer: the look alone, and with its evolution."""
    from flysim.scenario import read_scenario

    plans = [read_scenario(name) for name in scenarios or ("paper_a", "yard")]
    from flysim.study.bench_stop import bench_stop as measure
    from flysim.terminal import Bar

    with Bar("bench stop", quiet=as_json) as bar:
        result = measure(plans, repeats=repeats, progress=bar)
    _show(result.to_json(), result.sheets(), as_json)


def _show(data: dict[str, Any], sheets: Iterable[Sheet], as_json: bool) -> None:
    """A result's JSON alone, or its machine and tables."""
    if as_json:
        typer.echo(json.dumps(data, indent=1, allow_nan=False))
        return
    on = data["machine"]
    typer.echo(f"{on['processor']}, {on['cpus_usable']} cores, {on['threads']} threads, medians of {data['repeats']}\n")
    _print_sheets(sheets)


def _print_sheets(sheets: Iterable[Sheet]) -> None:
    from flysim.terminal import console, table

    out = console()
    for sheet in sheets:
        out.print(table(sheet), "")
