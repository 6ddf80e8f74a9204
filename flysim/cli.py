"""The command line: the only printer. One line and exit 2 for a user's mistake, 130 for Ctrl-C."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from flysim import assets
from flysim.errors import FlysimError, ScenarioError, did_you_mean

if TYPE_CHECKING:
    from flysim.sim.renderer import RendererName

RUNS_OUT = Path("runs/out")


class _Guard(TyperGroup):
    """Turns what flysim refuses into one line and an exit code, for every command."""

    def invoke(self, ctx: typer.Context) -> Any:
        try:
            return super().invoke(ctx)
        except FlysimError as error:
            typer.echo(f"flysim: {error}", err=True)
            raise typer.Exit(2) from None
        except MemoryError:
            typer.echo("flysim: out of memory. Use a smaller population, image or world.", err=True)
            raise typer.Exit(2) from None
        except KeyboardInterrupt:
            typer.echo("flysim: stopped by Ctrl-C; nothing half-written is left.", err=True)
            raise typer.Exit(130) from None


app = typer.Typer(
    cls=_Guard,
    name="flysim",
    help="A simulation testbed for the fly algorithm in robot navigation.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _scenarios(incomplete: str) -> list[str]:
    return [name for name in assets.names("runs") if name.startswith(incomplete)]


def _worlds(incomplete: str) -> list[str]:
    return [name for name in assets.names("worlds") if name.startswith(incomplete)]


@app.command(epilog="Example: flysim run paper_a --seed 7 --set flies.population=3000")
def run(
    scenarios: Annotated[
        list[str],
        typer.Argument(help="Names (flysim list) or paths of scenario files.", autocompletion=_scenarios),
    ],
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
) -> None:
    """Drive scenarios, let the flies evolve at each stop, and hold what they found against the truth."""
    from flysim.scenario import read_scenario

    known: tuple[RendererName, ...] = ("auto", "gl", "tiny")
    if renderer not in known:
        raise ScenarioError(f"no renderer '{renderer}'. {did_you_mean(renderer, known)}")
    plans = [read_scenario(name, overrides or ()) for name in scenarios]  # every mistake before the first drive
    reports = []
    for plan in plans:
        folder = _folder(out, plan.name, seed, len(plans))
        with _Bar(f"{plan.name}, seed {seed}", quiet=as_json) as bar:
            from flysim.pipeline import run as run_scenario

            report = run_scenario(plan, seed=seed, out=folder, renderer=renderer, progress=bar)
        reports.append(report.to_json())
        if not as_json:
            typer.echo(str(report))
            typer.echo(f"\nrun folder: {folder}   (flysim show {folder}; flysim view {folder})\n")
    if as_json:
        typer.echo(json.dumps(reports, indent=1, allow_nan=False))


def _folder(out: Path | None, name: str, seed: int, count: int) -> Path:
    from flysim.record.run_folder import check_target, default_folder

    folder = default_folder(RUNS_OUT, name, seed) if out is None else out if count == 1 else out / name
    check_target(folder)  # before the drive, not after it
    return folder


class _Bar:
    """A progress bar on stderr where that is a terminal; silent elsewhere."""

    def __init__(self, title: str, *, quiet: bool) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.fields[title]}"),
            BarColumn(),
            TextColumn("{task.description}"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=quiet or not console.is_terminal,
        )
        self._task = self._progress.add_task("start", total=1.0, title=title)

    def __enter__(self) -> _Bar:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def __call__(self, what: str, share: float) -> None:
        self._progress.update(self._task, description=what, completed=share)


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
    if as_json:
        typer.echo(json.dumps(report, indent=1, allow_nan=False))
        return
    typer.echo(str(Report.from_json(report)))
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

    path = assets.find_world(world)
    target = out or Path(f"{path.parent.name if path.name == 'world.sdf' else path.stem}.png")
    draw_preview(path, target, renderer)  # type: ignore[arg-type]
    typer.echo(str(target))


def main() -> None:
    """Entry point of the `flysim` command."""
    app()
