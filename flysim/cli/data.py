"""`flysim export`, and `flysim run --data`: data sets out and in."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flysim.cli.options import (
    NO_DRIVER,
    AsJson,
    Driver,
    FromData,
    OwnSeed,
    Renderer,
    ScenarioKeys,
    Texture,
    bundled,
    within,
)
from flysim.cli.study import renderer_named, reserved_folder, scenario_names, tell_bare
from flysim.cli.terminal import Bar, complain, say, say_json, show, warn, width
from flysim.common import catalogue
from flysim.errors import FlysimError, ScenarioError

if TYPE_CHECKING:
    from flysim.products.findings import Findings
    from flysim.runs.scenario import Scenario

MAX_FPS = 60.0  # [1/s] as often as the driver looks


def _formats(incomplete: str) -> list[str]:
    from flysim.datasets.layout import FORMATS

    return [name for name in FORMATS.names if name.startswith(incomplete)]


@bundled
def export(
    names: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO|WORLD...",
            help="Scenarios, or worlds, whose stops are planned.",
            autocompletion=scenario_names,
        ),
    ],
    layout: Annotated[
        str, typer.Option("--format", help="kitti, euroc, tum, middlebury or mcap.", autocompletion=_formats)
    ] = "kitti",
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write; with several names, the folder they go in. [runs/out/export-...]"),
    ] = None,
    stops: Annotated[bool, typer.Option("--stops", help="A frame at each stop: what is done without --fps.")] = False,
    fps: Annotated[
        float | None,
        typer.Option(
            help="In place of stops: so many frames a simulated second, all the way.",
            callback=within("--fps", 0.01, MAX_FPS),
        ),
    ] = None,
    seed: OwnSeed = None,
    overrides: ScenarioKeys = None,
    driver: Driver = NO_DRIVER,
    texture: Texture = None,
    renderer: Renderer = "auto",
    as_json: AsJson = False,
) -> None:
    """Drive scenarios and write what both eyes saw, with its truth, as a data set that other programs read.

    Beside the format's own files: flysim.json, by which `flysim run --data` sees the same again, and truth/ with depth,
    masks, poses and obstacles, frame by frame.
    """
    from flysim.datasets.layout import FORMATS

    if stops and fps is not None:
        raise FlysimError("--stops and --fps: choose one of the two.")
    drawn_by, form = renderer_named(renderer), FORMATS.check(layout)
    plans = [_planned(name, driver, texture, overrides or ()) for name in names]
    if len({plan.name for plan in plans}) < len(plans):
        raise ScenarioError("two scenarios have one name and would share a folder: export them one by one.")
    if seed is not None:
        plans = [plan.model_copy(update={"seed": seed}) for plan in plans]
    for plan in plans:
        tell_bare(plan.world_path, plan.texture, plan.model_folders)
    folders = [out if out is None or len(plans) == 1 else out / plan.name for plan in plans]
    told = _exported(plans, folders, layout_name=form, renderer=drawn_by, fps=fps, quiet=as_json)
    if as_json:
        say_json({"exports": told})


def _exported(
    plans: Sequence[Scenario], folders: Sequence[Path | None], *, quiet: bool, **how: Any
) -> list[dict[str, Any]]:
    """Drives and writes them all; what was written of each."""
    told: list[dict[str, Any]] = []
    with contextlib.ExitStack() as stack:
        places = [  # all of them before the first drive
            stack.enter_context(reserved_folder(folder, f"export-{plan.name}", plan.seed))
            for folder, plan in zip(folders, plans, strict=True)
        ]
        from flysim.runs.export import export_into
        from flysim.runs.run import check

        for plan in plans[1:]:
            check(plan)
        for plan, place in zip(plans, places, strict=True):
            with Bar(f"export {plan.name}", quiet=quiet) as bar, place.writing() as room:
                done = export_into(room, plan, seed=plan.seed, progress=bar, **how)
            told.append({**done, "folder": str(place.out)})
            if done["blocked"]:
                warn(f"{plan.name}: {done['blocked']}: what was taken before is kept.")
            if not quiet:
                frames = f"{done['frames']} frames as {done['format']}"
                say(f"{plan.name}: {frames} in {place.out}   (flysim run --data {place.out})")
    return told


def _planned(name: str, driver: Driver, texture: str | None, overrides: Sequence[str]) -> Scenario:
    """The scenario of a name or a file, or the planned path through the world that has it."""
    from flysim.runs.planned import asked

    robot, wheels, cameras, path, models = driver
    world = name in catalogue.world_names() or Path(name).suffix in (".sdf", ".world", ".gz")
    if world and name not in catalogue.names("runs"):
        return asked((), name, robot, path, texture, overrides, wheels, cameras, models or ())[0]
    return asked([name], None, robot, path, texture, overrides, wheels, cameras, models or ())[0]


def see_data_set(
    given: FromData,
    *,
    engine: str | None,
    overrides: Sequence[str],
    seed: int | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """`flysim run --data`: the frames of a data set instead of a drive."""
    from flysim.datasets.source import read_data_set
    from flysim.engines.choose import DEFAULT, ENGINES
    from flysim.runs.data import plan_of

    assert given.data is not None
    name = ENGINES.check(engine or DEFAULT)
    data = read_data_set(given.data, every=given.every or 1, height=given.height)
    plan = plan_of(data, overrides, seed)
    with reserved_folder(out, plan.name, plan.seed) as place:
        from flysim.runs.data import run_data_into

        with Bar(f"{plan.name}, {len(data.rows)} frames", quiet=as_json) as bar, place.writing() as room:
            findings, report = run_data_into(room, data, plan, name, progress=bar)
    if report is not None and report.warnings:
        warn(" ".join(report.warnings))
    if as_json:
        say_json([report.to_json()] if report is not None else [_found_json(findings)])
    else:
        if report is not None:
            say(report.text(width()))
        else:
            show([_found(findings)])
        say(f"\nrun folder: {place.out}")
    end_failed(findings.failed)


def end_failed(failed: Sequence[str]) -> None:
    """Exit 2 with a line for each frame that an engine failed at; what it saw of the others is written by now."""
    for line in failed:
        complain(line)
    if failed:
        raise typer.Exit(2)


def _found_json(findings: Findings) -> dict[str, Any]:
    """What was found where nobody knows the truth."""
    from flysim.record.files import obstacle_json

    return {
        "scenario": findings.sequence.name,
        "engine": findings.engine,
        "frames": len(findings.seen),
        "points": len(findings.cloud.points),
        "obstacles": [obstacle_json(one) for one in findings.obstacles],
        "notes": [*findings.sequence.notes],
        **({"failed": findings.failed} if findings.failed else {}),
    }


def _found(findings: Findings) -> Any:
    """The same as a table."""
    from flysim.common.sheet import Sheet

    rows = tuple(
        (
            one.shape,
            " ".join(f"{100.0 * x:.1f}" for x in one.center),
            " x ".join(f"{100.0 * x:.1f}" for x in one.size),
            str(len(one.flies)),
        )
        for one in findings.obstacles
    )
    points, frames = len(findings.cloud.points), len(findings.seen)
    return Sheet(
        title=f"{findings.sequence.name}: {findings.engine}, {frames} frames, {points} points",
        columns=("obstacle", "centre", "size", "flies"),
        rows=rows,
        note="; ".join(("lengths in cm", "of this data set nobody knows the truth", *findings.sequence.notes)),
    )
