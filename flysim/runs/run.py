"""Wires the rooms: drive, look, evolve, gather, find, evaluate, record."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.whole_folder import whole_folder
from flysim.engines.choose import engine, warm
from flysim.errors import ScenarioError
from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.geometry.frames import Pose2
from flysim.journey import Journey, Look
from flysim.obstacles.find import find_obstacles
from flysim.obstacles.gather import gather
from flysim.render.choose import Renderer, RendererName, drawn
from flysim.render.look import stop_here
from flysim.robots.robot import parts_in_base, read_robot
from flysim.runs.scenario import Scenario, StopPlan, read_scenario
from flysim.sim.driving import Leg, drive_to
from flysim.sim.simulation import Simulation
from flysim.truth.obstacles import TrueObstacle, true_obstacles
from flysim.worlds.model import World
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.surface.dress import dress

# Called with what is going on and how far it is, 0 to 1.
Progress = Callable[[str, float], None]
DRIVEN, EVALUATED = 0.7, 0.75  # shares of a recorded run's work that are done by then


def run(
    scenario: str | Path | Scenario,
    *,
    seed: int = 0,
    out: str | Path | None = None,
    renderer: RendererName = "auto",
    overrides: Iterable[str] = (),
    progress: Progress | None = None,
) -> Report:
    """Drives a scenario, looks, evolves, clusters, evaluates; writes a run folder if `out` is given.

    Args:
        scenario: a name such as "paper_a", the path of a scenario file, or a `Scenario`.
        seed: of all randomness; the same seed and renderer give the same report but for times.
        out: the run folder to write, whole or not at all; None writes nothing.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.
        overrides: `KEY=VALUE` for the scenario's keys, such as "flies.population=3000".
        progress: called with a word and a share as the work goes on.

    Raises:
        FlysimError: a mistake in the scenario, its world or robot, or a folder that cannot be written.
        ValueError: a negative seed, or overrides of a `Scenario`, which is changed where it is made.
    """
    if seed < 0:
        raise ValueError(f"seed must be >= 0, got {seed}")
    told = progress or _silent
    plan = _plan(scenario, overrides)
    if out is None:
        journey = _travel(plan, seed, renderer, told)
        return evaluate(journey, truth_of_plan(journey, plan))
    with whole_folder(Path(out)) as room:  # before the drive, not after it
        return run_into(room, plan, seed=seed, renderer=renderer, progress=told)


def run_into(room: Path, plan: Scenario, *, seed: int, renderer: RendererName, progress: Progress) -> Report:
    """As `run`, into a folder that is there already and will be the run's."""
    from flysim.record.scribe import scribe

    with scribe() as writer:
        journey = _travel(plan, seed, renderer, progress)
        progress("evaluate", DRIVEN)
        truth = truth_of_plan(journey, plan)
        writer.begin(
            room,
            journey=journey,
            true_obstacles=truth,
            config=configuration(plan, journey),
            robot_parts=parts_in_base(read_robot(plan.robot_path)),
        )
        report = evaluate(journey, truth)
        writer.finish(report, lambda what, share: progress(what, EVALUATED + (1.0 - EVALUATED) * share))
    return report


def _plan(scenario: str | Path | Scenario, overrides: Iterable[str]) -> Scenario:
    if not isinstance(scenario, Scenario):
        return read_scenario(str(scenario), overrides)
    if list(overrides):
        raise ValueError("overrides need a scenario's name or path; change a Scenario where it is made")
    return scenario


def _travel(plan: Scenario, seed: int, renderer: RendererName, told: Progress) -> Journey:
    return travel(plan, seed=seed, renderer=renderer, progress=lambda what, share: told(what, DRIVEN * share))


def truth_of_plan(journey: Journey, plan: Scenario) -> tuple[TrueObstacle, ...]:
    """What truly stands in a journey's world, with what was visible from its stops, read as the plan says."""
    return true_obstacles(
        journey.world,
        [one.stop for one in journey.looks],
        max_range=journey.max_range,
        merge_gap=plan.truth.merge_gap,
    )


def _silent(_what: str, _share: float) -> None:
    pass


def configuration(plan: Scenario, journey: Journey) -> dict[str, Any]:
    """What config.json holds beside commit and versions: every parameter, seed, renderer, time."""
    return {
        "scenario": plan.model_dump(mode="json"),
        "seed": journey.seed,
        "renderer": journey.renderer,
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def travel(plan: Scenario, *, seed: int, renderer: RendererName = "auto", progress: Progress = _silent) -> Journey:
    """Drives a scenario to its end and returns all that was seen and believed, not yet evaluated."""
    began = time.perf_counter()
    progress("build the world", 0.0)
    world, robot = world_of(plan), read_robot(plan.robot_path)
    looks: list[Look] = []
    with drawn(world, robot, plan.stops[0].pose, renderer) as (simulation, eyes):
        _check_stops(plan, simulation)
        generator = looks_of(plan, simulation, eyes, np.random.default_rng(seed))
        blocked = None
        for item in generator:
            if isinstance(item, str):
                blocked = f"blocked at stop {len(looks) + 1} of {len(plan.stops)} {item}"
                break
            looks.append(item)
            progress(f"stop {len(looks)} of {len(plan.stops)}", len(looks) / len(plan.stops))
    return _journey(plan, seed, eyes.name, world, looks, blocked, began)


def seen_again(journey: Journey, plan: Scenario, *, progress: Progress = _silent) -> Journey:
    """The same drive, the same pairs, seen by the engine that `plan` names: what makes engines comparable.

    What the engine loads and compiles once is loaded before the first stop, and not counted. With the journey's own
    engine the same points come out: a stop's random numbers are its own.

    Args:
        journey: of a plan that differs from `plan` in its engine alone.
        plan: the scenario.
        progress: called with a word and a share as the work goes on.

    Raises:
        EngineError: there is no such engine.
    """
    see = engine(plan.engine)
    warm(plan.engine)
    children = np.random.default_rng(journey.seed).spawn(len(plan.stops))
    began = time.perf_counter()
    looks: list[Look] = []
    for one in journey.looks:
        mark = time.perf_counter()
        swarm = see(one.stop.pair, plan.flies, rng=children[one.stop.index])
        looks.append(Look(stop=one.stop, swarm=swarm, evolve_s=time.perf_counter() - mark))
        progress(f"{plan.engine}, stop {len(looks)} of {len(journey.looks)}", len(looks) / len(journey.looks))
    began -= sum(one.stop.drive_s + one.stop.render_s for one in looks)
    return _journey(plan, journey.seed, journey.renderer, journey.world, looks, journey.blocked, began)


def _journey(
    plan: Scenario, seed: int, renderer: str, world: World, looks: list[Look], blocked: str | None, began: float
) -> Journey:
    """What was seen at all stops, clustered; `began` is when the drive did."""
    mark = time.perf_counter()
    cloud = gather(
        [(one.stop.index, one.swarm, one.stop.pair, one.stop.odometry.matrix @ one.stop.T_base_left) for one in looks],
        plan.obstacles,
    )
    obstacles = find_obstacles(cloud, plan.obstacles)
    now = time.perf_counter()
    return Journey(
        scenario=plan.name,
        seed=seed,
        renderer=renderer,
        engine=plan.engine,
        world=world,
        looks=tuple(looks),
        cloud=cloud,
        obstacles=obstacles,
        planned=len(plan.stops),
        blocked=blocked,
        obstacles_s=now - mark,
        total_s=now - began,
        max_range=plan.flies.max_depth,
        texture=plan.texture,
        notes=plan.notes,
    )


def world_of(plan: Scenario) -> World:
    """A scenario's world as it is driven through: dressed, if the scenario says so."""
    world = read_world(plan.world_path)
    return world if plan.texture is None else dress(world)


def check(plan: Scenario) -> None:
    """Refuses what a drive would refuse before it sets out: a bad world or robot, a stop inside an obstacle.

    Raises:
        FlysimError: as `run`.
    """
    world, robot = read_world(plan.world_path), read_robot(plan.robot_path)
    with Simulation(world, robot, plan.stops[0].pose) as simulation:
        _check_stops(plan, simulation)


def _check_stops(plan: Scenario, simulation: Simulation) -> None:
    for index, stop in enumerate(plan.stops):
        model = simulation.occupied(stop.pose)
        if model is not None:
            raise ScenarioError(
                f"scenario '{plan.name}': stop {index + 1} of {len(plan.stops)} at ({stop.x:g}, {stop.y:g}) stands in "
                f"'{model}': move it; the robot needs {simulation.robot.radius:.2f} m about its axis."
            )


def looks_of(plan: Scenario, simulation: Simulation, eyes: Renderer, rng: np.random.Generator) -> Iterator[Look | str]:
    """Each stop's look as it is taken; at last a string if the way was blocked: "by box_2"."""
    children = rng.spawn(len(plan.stops))
    see = engine(plan.engine)
    for index, planned in enumerate(plan.stops):
        began = time.perf_counter()
        leg = drive(simulation, planned)
        if leg.blocked is not None:
            yield leg.blocked
            return
        drive_s = time.perf_counter() - began
        stop = stop_here(simulation, eyes, index=index, commanded=planned.pose, track=leg.track, drive_s=drive_s)
        drawn = time.perf_counter()
        swarm = see(stop.pair, plan.flies, rng=children[index])
        yield Look(stop=stop, swarm=swarm, evolve_s=time.perf_counter() - drawn)


def drive(simulation: Simulation, planned: StopPlan) -> Leg:
    """Drives to a stop over the points on the way; their tracks are one."""
    tracks = []
    for x, y in planned.via:
        here = simulation.odometry.pose
        leg = drive_to(simulation, Pose2(x, y, math.atan2(y - here.y, x - here.x)))
        tracks.append(leg.track)
        if leg.blocked is not None:
            return Leg(blocked=leg.blocked, track=np.concatenate(tracks))
    leg = drive_to(simulation, planned.pose)
    return leg if not tracks else Leg(blocked=leg.blocked, track=np.concatenate([*tracks, leg.track]))
