"""The command line: the only printer. One line and exit 2 for a user's mistake."""

from __future__ import annotations

import contextlib
import os
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from flysim import __version__
from flysim.cli.bench import bench, table_1
from flysim.cli.check import check
from flysim.cli.data import export
from flysim.cli.listing import list_names
from flysim.cli.nav import bench_env
from flysim.cli.nav import nav as nav_command
from flysim.cli.nav import train as train_commands
from flysim.cli.new import new as new_commands
from flysim.cli.run import preview, run, show_run, view
from flysim.cli.score import score
from flysim.cli.see import see
from flysim.cli.sensors import sensors
from flysim.cli.study import study
from flysim.cli.sweep import study as study_command
from flysim.cli.terminal import complain, say, warn
from flysim.cli.usage import Usage, is_help, usage_line
from flysim.cli.world import world as world_commands
from flysim.errors import FlysimError

OPENCV_NO_MEMORY = -4  # `code` of a cv2.error; cv2 itself is not loaded for its name


class _Guard(TyperGroup):
    """Turns what flysim refuses, and what typer does, into one line and an exit code, for every command."""

    def make_context(self, *words: Any, **more: Any) -> Any:
        try:
            return super().make_context(*words, **more)
        except Usage as error:
            raise _refused(error) from None

    def invoke(self, ctx: typer.Context) -> Any:
        try:
            return super().invoke(ctx)
        except Usage as error:
            raise _refused(error, ctx) from None
        except FlysimError as error:
            for note in dict.fromkeys(getattr(error, "__notes__", ())):  # what was passed over may be its cause
                warn(note)
            complain(str(error))
            raise typer.Exit(2) from None
        except BrokenPipeError:
            raise  # `flysim list | head`: typer ends quietly
        except OSError as error:
            place = f" {os.fsdecode(error.filename)}" if isinstance(error.filename, str | bytes) else " the output"
            complain(f"cannot read or write{place}: {error.strerror or error}.")
            with contextlib.suppress(OSError):  # what is still to be flushed to a full disk goes nowhere
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            raise typer.Exit(2) from None
        except Exception as error:
            if not (isinstance(error, MemoryError) or getattr(error, "code", None) == OPENCV_NO_MEMORY):
                raise
            complain("out of memory. Use a smaller population, image or world.")
            raise typer.Exit(2) from None


def _refused(error: Any, ctx: typer.Context | None = None) -> Exception:
    """Tells a mistake of the command line; gives what ends the program."""
    if is_help(error):
        return error
    complain(usage_line(error, ctx))
    return typer.Exit(2)


app = typer.Typer(
    cls=_Guard,
    name="flysim",
    help="A simulation testbed for the fly algorithm in robot navigation.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run", epilog="Example: flysim run paper_a --seed 7 --set flies.population=3000")(run)
app.command("export", epilog="Example: flysim export yard --format euroc --out yard")(export)
app.command("score", epilog="Example: flysim score yard --disparity 'results/*.pfm' --name mine")(score)
app.command("check", epilog="Example: flysim check yard")(check)
app.command("list", epilog="Example: flysim list --json")(list_names)
app.command("show", epilog="Example: flysim show latest")(show_run)
app.command("view", epilog="Example: flysim view latest --web")(view)
app.command("preview", epilog="Example: flysim preview yard --out yard.png")(preview)
app.command(
    "sensors",
    epilog="Example: flysim sensors yard --set sensors.noise=5 --set sensors.gain_right=0.8 --out sensors.png",
)(sensors)
app.command("see", epilog="Example: flysim see left.png right.png --calib calib.txt")(see)
app.command("table1", epilog="Example: flysim table1 --seeds 5 --out table1")(table_1)
app.command("nav", epilog="Example: flysim nav vfh dwa --worlds yard --episodes 5")(nav_command)
app.command("study", epilog="Example: flysim study exposure --scenarios paper_a,yard --seeds 0:2")(study_command)
app.add_typer(study)
app.add_typer(train_commands, name="train", epilog="Example: flysim train ppo --minutes 30")
app.add_typer(new_commands, name="new", epilog="Example: flysim new scenario mine")
app.add_typer(world_commands, name="world", epilog="Example: flysim world random --seed 7")

app.add_typer(bench, name="bench", epilog="Example: flysim bench engine --repeats 3")
bench.command("env", epilog="Example: flysim bench env --json")(bench_env)


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
