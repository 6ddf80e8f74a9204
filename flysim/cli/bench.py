"""`flysim bench` and `table1`: how fast the parts are on this machine, and the paper's Table 1 again."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flysim.cli.options import AsJson, Renderer, Repeats, within
from flysim.cli.study import renderer_named as _renderer
from flysim.cli.study import reserved_folder
from flysim.cli.study import scenario_names as _scenarios
from flysim.cli.terminal import Bar, say, say_folded, say_json, show

if TYPE_CHECKING:
    from collections.abc import Iterable

    from flysim.common.sheet import Sheet

bench = typer.Typer(help="Measure how fast the parts are on this machine.", no_args_is_help=True)


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
    say_folded(*table.lines())
    say(f"\nfolder: {place.out}   (table1.json; figures/*.png)")


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
