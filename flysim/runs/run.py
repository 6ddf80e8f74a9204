"""Runs a scenario: drive, look, see, gather, find, evaluate, record."""

from __future__ import annotations

import time
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from flysim.common.progress import Progress, silent, within
from flysim.common.whole_folder import whole_folder
from flysim.engines.choose import engine
from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.localise.localiser import DEFAULT as ODOMETRY
from flysim.localise.localiser import localiser_named
from flysim.products.findings import Findings
from flysim.render.choose import RendererName
from flysim.robots.robot import parts_in_base
from flysim.runs.calibration_source import IMAGES, count_of
from flysim.runs.pairs import pair_rule
from flysim.runs.planned import noted
from flysim.runs.robot_of import robot_of
from flysim.runs.scenario import Scenario, read_scenario
from flysim.runs.see import look_on, see
from flysim.sources.simulated import Errand, refuse_taken, simulated
from flysim.sources.source import Replayed
from flysim.truth.truth import Truth
from flysim.worlds.ground import grounded
from flysim.worlds.model import World
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.surface.finish import finished

DRIVEN, EVALUATED = 0.7, 0.75  # shares of a recorded run's work that are done by then


def run(
    scenario: str | Path | Scenario,
    *,
    seed: int | None = None,
    out: str | Path | None = None,
    renderer: RendererName = "auto",
    overrides: Iterable[str] = (),
    progress: Progress | None = None,
) -> Report:
    """Drives a scenario, looks, evolves, clusters, evaluates; writes a run folder if `out` is given.

    Args:
        scenario: a name such as "paper_a", the path of a scenario file, or a `Scenario`.
        seed: of all randomness; the same seed and renderer give the same report but for times. None: the scenario's.
        out: the run folder to write, whole or not at all; None writes nothing.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.
        overrides: `KEY=VALUE` for the scenario's keys, such as "flies.population=3000".
        progress: called with a word and a share as the work goes on.

    Raises:
        FlysimError: a mistake in the scenario, its world or robot, or a folder that cannot be written; or an engine
            that fails at every stop. Of one that fails at some, `Report.failed` has why, and the others count.
        ValueError: a negative seed, or overrides of a `Scenario`, which is changed where it is made.
    """
    if seed is not None and seed < 0:
        raise ValueError(f"seed must be >= 0, got {seed}")
    told = progress or silent
    plan = _plan(scenario, overrides)
    seed = plan.seed if seed is None else seed
    if out is None:
        return evaluate(*travel(plan, seed=seed, renderer=renderer, progress=within(told, 0.0, DRIVEN)))
    with whole_folder(Path(out)) as room:  # before the drive, not after it
        return run_into(room, plan, seed=seed, renderer=renderer, progress=told)


def run_into(room: Path, plan: Scenario, *, seed: int, renderer: RendererName, progress: Progress) -> Report:
    """Runs a scenario and writes its files into a folder that is there already and will be the run's."""
    from flysim.record.scribe import scribe

    with scribe() as writer:
        findings, truth = travel(plan, seed=seed, renderer=renderer, progress=within(progress, 0.0, DRIVEN))
        progress("evaluate", DRIVEN)
        writer.begin(
            room,
            findings=findings,
            truth=truth,
            config=configuration(plan, findings, room),
            robot_parts=parts_in_base(robot_of(plan)),
        )
        report = evaluate(findings, truth)
        writer.finish(report, within(progress, EVALUATED, 1.0))
    return report


def _plan(scenario: str | Path | Scenario, overrides: Iterable[str]) -> Scenario:
    if not isinstance(scenario, Scenario):
        return read_scenario(str(scenario), overrides)
    if list(overrides):
        raise ValueError("overrides need a scenario's name or path; change a Scenario where it is made")
    return scenario


def configuration(plan: Scenario, findings: Findings, room: Path) -> dict[str, Any]:
    """What the config.json of a run folder holds beside commit and versions: every parameter, seed, renderer, time."""
    return {
        "scenario": plan.kept(room, findings.sequence.seed),
        "seed": findings.sequence.seed,
        "renderer": findings.sequence.renderer,
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def travel(
    plan: Scenario, *, seed: int, renderer: RendererName = "auto", progress: Progress = silent
) -> tuple[Findings, Truth]:
    """Drives a scenario to its end: what its engine saw on the way and believes, and the truth, not yet compared.

    What it saw is kept where it fails at some frames, as `see` has it.
    """
    began = time.perf_counter() - plan.planning_s
    progress("build the world", 0.0)
    engine(plan.engine)  # whatever is wrong with it is told before the world is built
    localiser_named(plan.localisation, seed)
    task = errand(plan, seed, renderer)
    with noted(task.world), simulated(task, renderer, began=began) as source:
        findings = see(
            source,
            plan.engine,
            plan.flies,
            plan.obstacles,
            seed=seed,
            localisation=plan.localisation,
            keep=True,
            progress=progress,
        )
        return findings, source.truth()


def driven(
    plan: Scenario, *, seed: int, renderer: RendererName = "auto", progress: Progress = silent
) -> tuple[Replayed, Truth]:
    """Drives a scenario to its end and keeps nothing that is seen on the way but the frames, for any number of engines.

    Where the scenario's robot finds its way by its flies, its own engine looks on.
    """
    began = time.perf_counter() - plan.planning_s
    progress("build the world", 0.0)
    task = errand(plan, seed, renderer)
    with noted(task.world), simulated(task, renderer, began=began) as source:
        if localiser_named(plan.localisation, seed) is None:
            for frame in source.frames():
                progress(f"stop {frame.index + 1} of {source.planned}", (frame.index + 1) / source.planned)
        else:  # it drives by what it sees
            look_on(source, plan.engine, plan.flies, seed=seed, localisation=plan.localisation, progress=progress)
        truth = source.truth()
        return Replayed(of=source.sequence(), rig=source.rig, known=truth, taken=source.taken), truth


def errand(plan: Scenario, seed: int = 0, renderer: RendererName = "auto") -> Errand:
    """What a scenario sends its robot to do: world, robot and calibration read, and the path.

    Raises:
        FlysimError: the world, the robot or the calibration cannot be read.
    """
    robot, measured = robot_of(plan), None
    if plan.calibrated_by:
        from flysim.runs.calibrated import believed_pair

        measured = believed_pair(
            plan.calibrated_by, robot, plan.sensors, folder=plan.folder, seed=seed, renderer=renderer
        )
    return Errand(
        name=plan.name,
        world=world_of(plan),
        robot=robot,
        path=plan.stops,
        max_range=plan.flies.max_depth,
        merge_gap=plan.truth.merge_gap,
        seed=seed,
        texture=plan.surfaces,
        notes=(*robot.warnings, *plan.notes),
        sensors=plan.sensors,
        calibration=plan.calibration,
        measured=measured,
        measured_by=plan.calibrated_by,
        light=plan.light,
        driving=plan.drive,
        pairs=pair_rule(plan.pairs),
        odometry=plan.odometry,
        glances=plan.localisation != ODOMETRY,
    )


def world_of(plan: Scenario) -> World:
    """A scenario's world as it is driven through, its surfaces as the scenario says."""
    world = grounded(read_world(plan.world_path, plan.model_folders))
    return finished(world, plan.texture, plan.texture_contrast)


def check(plan: Scenario) -> None:
    """Refuses what a drive would refuse before it sets out: a bad engine, world or robot, a stop inside an obstacle.

    Raises:
        FlysimError: as `run`.
    """
    engine(plan.engine)
    localiser_named(plan.localisation, plan.seed)
    aside: dict[str, Any] = {"texture": None}
    if plan.calibrated_by.startswith(IMAGES):  # a robot that calibrates itself takes its time
        count_of(plan.calibrated_by)
        aside["calibrated_by"] = ""
    task = errand(plan.model_copy(update=aside))
    with noted(task.world):
        refuse_taken(task)
