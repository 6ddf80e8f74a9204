"""`flysim compare`, `suite` and `regress`: engines side by side, many worlds at once, and what may not get worse."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flysim.cli.options import NO_JOBS, AsJson, Jobs, OwnSeed, Renderer, ScenarioKeys, Texture, bundled, parse_seeds
from flysim.cli.terminal import Bar, say, say_json, show, warn
from flysim.common import catalogue as assets
from flysim.errors import FlysimError, RendererError, did_you_mean
from flysim.plain import shown, shown_path

if TYPE_CHECKING:
    from flysim.common.whole_folder import Reserved
    from flysim.render.choose import RendererName

RUNS_OUT = Path("runs/out")
_NAMES = re.compile(r"""(?:"[^"]*"|'[^']*'|[^,])+""")  # what stands between commas outside quotes
study = typer.Typer()  # its commands stand beside the others: `flysim compare`

Engines = Annotated[str, typer.Option(help="Names with commas between, the first one first in every table.")]


def scenario_names(incomplete: str) -> list[str]:
    """The scenarios that a shell may complete a word to."""
    return [name for name in assets.names("runs") if name.startswith(incomplete)]


def renderer_named(name: str) -> RendererName:
    """The renderer of an option's word.

    Raises:
        RendererError: there is none.
    """
    known: tuple[RendererName, ...] = ("auto", "gl", "tiny")
    for renderer in known:
        if name == renderer:
            return renderer
    raise RendererError(f"no renderer '{name}'. {did_you_mean(name, known)}")


@contextlib.contextmanager
def reserved_folder(out: Path | None, name: str, seed: int | None) -> Iterator[Reserved]:
    """The folder of `--out`, or a new one in runs/out; a command takes it before its work.

    Raises:
        RecordError: it cannot be had.
    """
    from flysim.common.whole_folder import reserved
    from flysim.record.run_folder import default_folders

    with reserved(default_folders(RUNS_OUT, name, seed) if out is None else [out]) as place:
        yield place


def tell_bare(world: Path, texture: str | None, models: Sequence[str] = ()) -> None:
    """Warns, before any work, where nothing can be matched since a world's file gives no texture."""
    if texture is not None:
        return
    from flysim.worlds.sdf.reader import read_world
    from flysim.worlds.surface.finish import bare

    without, of = bare(read_world(world, models))
    if without:
        who = "nothing in it has a" if without == of else f"{without} of its {of} obstacles have no"
        warn(f"{shown_path(world)}: {who} texture, and flies find nothing on bare surfaces: give --texture speckle.")


def engine_names(text: str) -> tuple[str, ...]:
    """Engine names of `flies,sgbm`; one that has a comma in it stands in quotes."""
    from flysim.engines.choose import ENGINES, engine

    names = tuple(_unquoted(name.strip()) for name in _NAMES.findall(text) if name.strip())
    if not names or len(set(names)) < len(names):
        raise FlysimError(f"--engines {text}: name each engine once, as in --engines flies,sgbm.")
    for name in names:
        if ENGINES.scheme(ENGINES.check(name)) is not None:
            engine(name)  # whether there is such a program or network
    return names


def _unquoted(name: str) -> str:
    return name[1:-1] if len(name) > 2 and name[0] == name[-1] and name[0] in "\"'" else name


@study.command(epilog="Example: flysim compare paper_b yard --engines flies,sgbm,bm")
def compare(
    scenarios: Annotated[
        list[str],
        typer.Argument(help="Names (flysim list) or paths of scenario files.", autocompletion=scenario_names),
    ],
    engines: Engines = "flies,sgbm,bm,exhaustive,chance",
    seed: OwnSeed = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write. [runs/out/compare-...]")] = None,
    overrides: ScenarioKeys = None,
    texture: Texture = None,
    renderer: Renderer = "auto",
    as_json: AsJson = False,
) -> None:
    """Drive scenarios, let several engines see at the same stops, and judge all by the same clusterer and evaluator."""
    from flysim.runs.planned import asked

    drawn_by, names = renderer_named(renderer), engine_names(engines)
    plans = asked(scenarios, None, None, None, texture, overrides or ())
    if len({plan.name for plan in plans}) < len(plans):
        raise FlysimError("two scenarios have one name and would share a folder: compare them one by one.")
    if seed is not None:
        plans = [plan.model_copy(update={"seed": seed}) for plan in plans]
    for plan in plans:
        tell_bare(plan.world_path, plan.texture, plan.model_folders)
    found = []
    with (
        reserved_folder(out, "compare", plans[0].seed) as place,
        place.writing() as room,
    ):  # before the drives, not after them
        from flysim.studies.compare.compare import compare as compare_engines
        from flysim.studies.compare.figures import write_comparison

        for plan in plans:
            with Bar(f"{plan.name}, seed {plan.seed}", quiet=as_json) as bar:
                comparison = compare_engines(plan, names, seed=plan.seed, renderer=drawn_by, progress=bar)
            folder = room if len(plans) == 1 else room / plan.name
            folder.mkdir(exist_ok=True)
            write_comparison(folder, comparison)
            found.append(comparison.to_json())
            if not as_json:
                show([comparison.sheet()])
    if as_json:
        say_json({"comparisons": found, "folder": str(place.out)})
        return
    say(f"folder: {place.out}   (compare.json; reports/*.json; figures/top.png, depth.png)")


@study.command(epilog="Example: flysim suite random-medium --seeds 0:20 --engines flies,sgbm")
@bundled
def suite(
    name: Annotated[str, typer.Argument(help="paper, random-easy, random-medium, random-hard, barn or photographs.")],
    seeds: Annotated[
        str | None, typer.Option(help="A:B for the seeds A to B - 1. [random 0:20, paper 0:5, barn 0:1]")
    ] = None,
    engines: Engines = "flies,sgbm,bm",
    out: Annotated[Path | None, typer.Option(help="Folder to write. [runs/out/suite-NAME-...]")] = None,
    data: Annotated[
        Path | None,
        typer.Option(help="Folder of BARN's worlds, or of the photographs. [$FLYSIM_BARN, ../shared/data/barn]"),
    ] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Keep all run folders, not the worst alone.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the suite in --out.")] = False,
    overrides: ScenarioKeys = None,
    jobs: Jobs = NO_JOBS,
) -> None:
    """Run many worlds by every engine, and pool the figures. Each run is kept as it is done."""
    from flysim.runs.scenario import read_scenario
    from flysim.studies.photographs.pairs import KnownPair
    from flysim.studies.suite.suites import Case, cases

    drawn_by, names = renderer_named(jobs.renderer), engine_names(engines)
    if overrides:
        read_scenario("paper_a", overrides, "--set")  # a typing error ends the suite at once, and not each of its runs
    found = cases(name, parse_seeds(seeds), data)
    if pairs := [one for one in found if isinstance(one, KnownPair)]:
        from flysim.cli.photographs import suite_of_pairs

        if overrides or keep or resume:
            raise FlysimError(
                f"suite {shown(name)} sees photographs, none of which drives: no --set, --keep, --resume."
            )
        with reserved_folder(out, f"suite-{name}", None) as place:
            suite_of_pairs(name, pairs, names, parse_seeds(seeds), place, as_json=jobs.as_json)
        return
    todo = [replace(one, overrides=tuple(overrides or ())) for one in found if isinstance(one, Case)]
    if resume and out is None:
        raise FlysimError("--resume needs the folder to go on with: --out DIR.")
    from flysim.common.growing import growing
    from flysim.common.runner import runner
    from flysim.record.run_folder import default_folders
    from flysim.studies.suite.suite import SUITE, run_suite

    asked = {
        **{"suite": name, "engines": list(names), "renderer": jobs.renderer, "seeds": sorted({c.seed for c in todo})},
        **({"set": list(overrides)} if overrides else {}),
    }
    outs = default_folders(RUNS_OUT, f"suite-{name}", None) if out is None else [out]
    run = runner(jobs.processes, jobs.ray)
    with (
        growing(outs, SUITE, asked, len(todo), "runs", resume=resume) as folder,  # before the work, not after it
        Bar(f"suite {name}", quiet=jobs.as_json) as bar,
    ):
        result = run_suite(name, todo, names, folder, renderer=drawn_by, keep=keep, run=run, progress=bar)
    if jobs.as_json:
        say_json({**result.to_json(), "folder": str(folder.out)})
        return
    show(result.sheets())
    say(f"folder: {folder.out}   (suite.json; runs/*)")


@study.command(epilog="Example: flysim regress paper_b")
def regress(
    names: Annotated[list[str] | None, typer.Argument(help="Baselines of runs/baselines. [all]")] = None,
    update: Annotated[bool, typer.Option("--update", help="Write the figures of now, with --reason.")] = False,
    reason: Annotated[str, typer.Option(help="Why the figures may change; it stays in the file.")] = "",
    baselines: Annotated[Path | None, typer.Option(help="Folder of the baselines. [runs/baselines]")] = None,
    as_json: AsJson = False,
) -> None:
    """Run what the baselines hold, and print what moved; exit 1 if something is worse than it may be."""
    from flysim.studies.regress.baseline import FOLDER, find_baselines, write_baseline

    if update and not reason.strip():
        raise FlysimError("--update needs a --reason 'why the figures may change': it is kept in the baseline.")
    if reason and not update:
        raise FlysimError("--reason goes with --update.")
    found = find_baselines(names or (), baselines or FOLDER)
    from datetime import UTC, datetime

    from flysim.studies.regress.regress import check_baseline, sheet

    checked = []
    for baseline in found:
        with Bar(baseline.name, quiet=as_json) as bar:
            checked.append(check_baseline(baseline, bar))
    if update:
        today = datetime.now(UTC).date().isoformat()
        for one in checked:
            write_baseline(one.baseline.path, one.baseline.updated(one.figures, reason, today))
    worse = sum(one.worse for one in checked)
    if as_json:
        say_json({"worse": worse, "updated": update, "baselines": [one.to_json() for one in checked]})
    else:
        show([sheet(checked)])
        if update:
            say(*(f"written: {one.baseline.path}" for one in checked))
    if worse and not update:
        raise typer.Exit(1)
