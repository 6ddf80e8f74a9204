"""`flysim nav`, `bench env` and `train`: agents drive to goals, are scored, and one of them is trained."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flysim.cli.options import (
    MAX_EPISODES,
    MAX_PROCESSES,
    MAX_SEED,
    NO_JOBS,
    NO_RIDE,
    AsJson,
    Jobs,
    Renderer,
    Ride,
    bundled,
    minutes_of,
    within,
)
from flysim.cli.ride import ridden, tell_ride
from flysim.cli.study import RUNS_OUT, renderer_named
from flysim.cli.terminal import Bar, say, say_json, show
from flysim.errors import FlysimError, did_you_mean

MAX_TRAIN_SEED = 2**31 - 1  # stable-baselines3 counts seeds of its processes on from it, in 32 bits
if TYPE_CHECKING:
    from flysim.common.growing import Growing
    from flysim.common.runner import Runner
    from flysim.nav.episode import Episode
    from flysim.nav.training.folder import Training
    from flysim.nav.trial import Task

NAV = "nav.json"


def _agents(incomplete: str) -> list[str]:
    from flysim.nav.agents.choose import AGENTS

    return [name for name in AGENTS.names if name.startswith(incomplete)]


Agents = Annotated[
    list[str],
    typer.Argument(
        help="straight, warning, vfh, dwa, ppo, random, module:object, or a policy (.npz).", autocompletion=_agents
    ),
]
Episodes = Annotated[
    int,
    typer.Option(
        help="Episodes of each agent; with barn, of each world.", callback=within("--episodes", 1, MAX_EPISODES)
    ),
]


@bundled
def nav(
    agents: Agents,
    worlds: Annotated[str, typer.Option(help="A world's name or file, random-easy|medium|hard, or barn.")] = "yard",
    episodes: Episodes = 1,
    observation: Annotated[str, typer.Option(help="What tells agents: an engine's name, or truth.")] = "flies",
    seed: Annotated[
        int, typer.Option(help="Seed of the first episode.", callback=within("--seed", 0, MAX_SEED - MAX_EPISODES))
    ] = 0,
    barn: Annotated[
        Path | None, typer.Option(help="Folder of the BARN worlds. [$FLYSIM_BARN, then ../shared/data/barn]")
    ] = None,
    ride: Ride = NO_RIDE,
    picture: Annotated[Path | None, typer.Option(help="PNG file for the scores as bars.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for nav.json and episodes.parquet, kept up to date. [none]")
    ] = None,
    videos: Annotated[
        bool, typer.Option("--videos", help="A film of each episode into --out (animated WebP).")
    ] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the episodes in --out.")] = False,
    jobs: Jobs = NO_JOBS,
) -> None:
    """Let agents drive the same episodes to a goal, and print their scores with 95 % intervals."""
    _observation(observation)
    renderer_named(jobs.renderer)
    _refuse_folders(out, picture, resume=resume, videos=videos)
    from flysim.nav.asked import asked_settings
    from flysim.nav.trial import tasks_for

    settings, params = asked_settings(ride.overrides or (), agents, **ridden(ride))
    tasks = tasks_for(
        agents,
        worlds,
        episodes=episodes,
        observation=observation,
        renderer=jobs.renderer,
        barn=barn,
        seed=seed,
        params=params,
        settings=settings,
        filmed=videos,
    )
    tell_ride(worlds, observation, ride)
    asked = {
        "agents": agents, "worlds": worlds, "episodes": episodes, "observation": observation, "seed": seed,
        "renderer": jobs.renderer, **({"params": params} if params else {}),
        **({"settings": settings} if settings else {}), **({"videos": True} if videos else {}),
    }  # fmt: skip
    run = _runner(len(tasks), jobs.processes, jobs.ray)
    with _kept(out, asked, len(tasks), resume) as folder, Bar(f"nav, {worlds}", quiet=jobs.as_json) as bar:
        data = _trial(tasks, asked, folder, run, bar)
    if picture is not None:
        _draw(worlds, data, picture)
    if jobs.as_json:
        say_json(data)
        return
    from flysim.studies.nav.table import nav_sheet

    show([nav_sheet(worlds, data)])


def _refuse_folders(out: Path | None, picture: Path | None, *, resume: bool, videos: bool) -> None:
    """Refuses, before the episodes, what has no folder to lie in."""
    if (resume or videos) and out is None:
        what = "--resume needs the folder to go on with" if resume else "--videos needs a folder to lie in"
        raise FlysimError(f"{what}: --out DIR.")
    if picture is not None and not picture.absolute().parent.is_dir():
        raise FlysimError(f"--picture {picture}: there is no folder {picture.parent}.")


def _draw(worlds: str, data: dict[str, Any], picture: Path) -> None:
    from flysim.common.whole_file import whole_file
    from flysim.studies.nav.figure import draw_scores

    with whole_file(picture) as part:
        draw_scores(worlds, data, part)


def _kept(
    out: Path | None, asked: dict[str, Any], count: int, resume: bool
) -> contextlib.AbstractContextManager[Growing | None]:
    from flysim.common.growing import growing

    return contextlib.nullcontext() if out is None else growing([out], NAV, asked, count, "episodes", resume=resume)


def _runner(count: int, processes: int | None, ray: str | None) -> Runner | None:
    """Who drives so many episodes; None: this process, which spares the start of another."""
    from flysim.common.runner import runner
    from flysim.common.workers import cores

    return None if ray is None and min(processes or cores(), count) <= 1 else runner(processes, ray)


def _trial(
    tasks: Sequence[Task], asked: dict[str, Any], folder: Growing | None, run: Runner | None, bar: Bar
) -> dict[str, Any]:
    """Drives what is left to drive, and keeps it as it comes."""
    from flysim.nav.episode import read_episodes, to_json
    from flysim.nav.trial import drive_all

    def told(found: Sequence[Episode]) -> dict[str, Any]:
        return {"worlds": asked["worlds"], **to_json(asked["observation"], found)}

    if folder is None:
        return told(drive_all(tasks, run=run, progress=bar))
    from flysim.studies.nav.rows import ROWS, episode_rows, films

    def files(found: Sequence[Episode]) -> dict[str, bytes]:
        return {ROWS: episode_rows(asked["observation"], found), **films(found)}

    found = drive_all(
        tasks,
        run=run,
        progress=bar,
        before=() if folder.before is None else read_episodes(folder.before, folder.out / NAV),
        keep=lambda found: folder.keep(told(found), len(found), files=files(found)),
    )
    folder.finish(told(found), files=files(found))
    return told(found)


def bench_env(
    steps: Annotated[
        int,
        typer.Option(help="Steps of each observation that count.", callback=within("--steps", 20, 10_000_000)),
    ] = 200,
    as_json: AsJson = False,
) -> None:
    """Time the environment: steps a second by observation, and what the images and the physics take of them."""
    from flysim.studies.bench.env import bench_env as measure

    with Bar("bench env", quiet=as_json) as bar:
        result = measure(steps=steps, progress=bar)
    if as_json:
        say_json(result.to_json())
        return
    show(result.sheets())


train = typer.Typer(help="Train an agent for `flysim nav`; needs the extra flysim-testbed[rl].", no_args_is_help=True)


@train.command(epilog="Example: flysim train ppo --worlds random-medium --minutes 30 --out runs/out/mine")
@bundled
def ppo(
    worlds: Annotated[str, typer.Option(help="A world's name or file, or random-easy|medium|hard.")] = "random-medium",
    observation: Annotated[str, typer.Option(help="What tells it: an engine's name, or truth.")] = "flies",
    steps: Annotated[
        int,
        typer.Option(
            help="Steps after which it ends, of all processes together.", callback=within("--steps", 1, 10**12)
        ),
    ] = 300_000,
    minutes: Annotated[
        float | None,
        typer.Option(help="Minutes after which it ends, if sooner. [no limit]", callback=minutes_of),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for policy, checkpoint, log and curve.")] = RUNS_OUT / "ppo",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the training in --out.")] = False,
    seed: Annotated[
        int, typer.Option(help="Seed of all randomness.", callback=within("--seed", 0, MAX_TRAIN_SEED))
    ] = 0,
    processes: Annotated[
        int | None,
        typer.Option(
            help="Environments side by side. [three a core: some are always being reset]",
            callback=within("--processes", 1, MAX_PROCESSES),
        ),
    ] = None,
    ride: Ride = NO_RIDE,
    renderer: Renderer = "auto",
    as_json: AsJson = False,
) -> None:
    """Train a policy by PPO (stable-baselines3); `flysim nav OUT/policy.npz` then drives by it.

    After every rollout OUT holds policy.npz, checkpoint.pt, training.json and, for TensorBoard, tensorboard/.
    """
    _observation(observation)
    renderer_named(renderer)
    import os

    from flysim.common.whole_file import whole_file
    from flysim.nav.asked import arguments_of, asked_settings
    from flysim.nav.training.train import TrainingTask
    from flysim.nav.training.train import train as run
    from flysim.studies.nav.training_figure import draw_curve

    settings, _ = asked_settings(ride.overrides or (), **ridden(ride))
    arguments_of(settings, observation)  # the mistakes before the libraries
    tell_ride(worlds, observation, ride)
    task = TrainingTask(
        worlds=worlds,
        observation=observation,
        steps=steps,
        minutes=minutes,
        processes=processes or 3 * len(os.sched_getaffinity(0)),
        seed=seed,
        renderer=renderer,
        settings=settings,
    )
    with Bar("train ppo", quiet=as_json) as bar:
        training = run(task, out, resume=resume, progress=bar)
    with whole_file(out / "curve.png") as part:
        draw_curve(training.curve, training.tasks, part)
    _tell_training(training, out, worlds, as_json)


def _tell_training(training: Training, out: Path, worlds: str, as_json: bool) -> None:
    if as_json:
        from dataclasses import asdict

        say_json({"out": str(out), **asdict(training)})
        return
    success = "no episode ended" if training.success is None else f"success {training.success:.2f} of the last episodes"
    say(f"{training.steps} steps, {training.episodes} episodes, {training.minutes:.1f} minutes: {success}.")
    say(f"policy: {out / 'policy.npz'}   (flysim nav {out / 'policy.npz'} --worlds {worlds} --episodes 50)")


def _observation(name: str) -> None:
    """Refuses what no agent can be told by."""
    from flysim.engines.choose import ENGINES

    if name != "truth" and ":" not in name and name not in ENGINES.names:
        raise FlysimError(f"no observation '{name}'. {did_you_mean(name, (*ENGINES.names, 'truth'))}")
