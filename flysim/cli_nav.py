"""`flysim nav`, `bench env` and `train`: agents drive to goals, are scored, and one of them is trained."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flysim.cli_options import MAX_EPISODES, MAX_PROCESSES, MAX_SEED, AsJson, Processes, Renderer, minutes_of, within
from flysim.cli_study import RUNS_OUT
from flysim.errors import FlysimError, did_you_mean
from flysim.terminal import Bar, say, say_json, show

MAX_TRAIN_SEED = 2**31 - 1  # stable-baselines3 counts seeds of its processes on from it, in 32 bits
OBSERVATIONS = ("flies", "truth", "sgbm")


def _agents(incomplete: str) -> list[str]:
    from flysim.nav.agents import AGENTS

    return [name for name in AGENTS if name.startswith(incomplete)]


def nav(
    agents: Annotated[
        list[str],
        typer.Argument(
            help="straight, warning, vfh, dwa, ppo, random, or a policy file (.npz).", autocompletion=_agents
        ),
    ],
    worlds: Annotated[str, typer.Option(help="A world's name or file, random-easy|medium|hard, or barn.")] = "yard",
    episodes: Annotated[
        int,
        typer.Option(
            help="Episodes of each agent; with barn, of each world.",
            callback=within("--episodes", 1, MAX_EPISODES),
        ),
    ] = 1,
    observation: Annotated[str, typer.Option(help="What agents see: flies, truth or sgbm.")] = "flies",
    seed: Annotated[
        int, typer.Option(help="Seed of the first episode.", callback=within("--seed", 0, MAX_SEED - MAX_EPISODES))
    ] = 0,
    renderer: Renderer = "auto",
    barn: Annotated[Path | None, typer.Option(help="Folder of the BARN worlds. [../shared/data/barn]")] = None,
    processes: Processes = None,
    picture: Annotated[Path | None, typer.Option(help="PNG file for the scores as bars.")] = None,
    as_json: AsJson = False,
) -> None:
    """Let agents drive the same episodes to a goal, and print their scores with 95 % intervals."""
    _known("observation", observation, OBSERVATIONS)
    _known("renderer", renderer, ("auto", "gl", "tiny"))
    from flysim.nav.trial import drive_all, tasks_for, to_json

    if picture is not None and not picture.absolute().parent.is_dir():
        raise FlysimError(f"--picture {picture}: there is no folder {picture.parent}.")
    tasks = tasks_for(
        agents,
        worlds,
        episodes=episodes,
        observation=observation,
        renderer=renderer,
        barn=barn,
        seed=seed,
    )
    with Bar(f"nav, {worlds}", quiet=as_json) as bar:
        found = drive_all(tasks, processes=processes, progress=bar)
    data = to_json(observation, found)
    if picture is not None:
        from flysim.study.nav_figure import draw_scores

        draw_scores(worlds, data, picture)
    if as_json:
        say_json({"worlds": worlds, **data})
        return
    from flysim.study.nav_sheet import nav_sheet

    show([nav_sheet(worlds, data)])


def bench_env(
    steps: Annotated[
        int,
        typer.Option(help="Steps of each observation that count.", callback=within("--steps", 20, 10_000_000)),
    ] = 200,
    as_json: AsJson = False,
) -> None:
    """Time the environment: steps a second by observation, and what the images and the physics take of them."""
    from flysim.study.bench_env import bench_env as measure

    with Bar("bench env", quiet=as_json) as bar:
        result = measure(steps=steps, progress=bar)
    if as_json:
        say_json(result.to_json())
        return
    show(result.sheets())


train = typer.Typer(help="Train an agent for `flysim nav`; needs the extra flysim-testbed[rl].", no_args_is_help=True)


@train.command(epilog="Example: flysim train ppo --worlds random-medium --minutes 30 --out runs/out/mine")
def ppo(
    worlds: Annotated[str, typer.Option(help="A world's name or file, or random-easy|medium|hard.")] = "random-medium",
    observation: Annotated[str, typer.Option(help="What it sees: flies, truth or sgbm.")] = "flies",
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
    renderer: Renderer = "auto",
    as_json: AsJson = False,
) -> None:
    """Train a policy by PPO (stable-baselines3); `flysim nav OUT/policy.npz` then drives by it.

    After every rollout OUT holds policy.npz, checkpoint.pt, training.json and, for TensorBoard, tensorboard/.
    """
    _known("observation", observation, OBSERVATIONS)
    _known("renderer", renderer, ("auto", "gl", "tiny"))
    import os

    from flysim.nav.train import Task
    from flysim.nav.train import train as run
    from flysim.study.training_figure import draw_curve

    task = Task(
        worlds=worlds,
        observation=observation,
        steps=steps,
        minutes=minutes,
        processes=processes or 3 * len(os.sched_getaffinity(0)),
        seed=seed,
        renderer=renderer,
    )
    with Bar("train ppo", quiet=as_json) as bar:
        training = run(task, out, resume=resume, progress=bar)
    draw_curve(training.curve, training.tasks, out / "curve.png")
    if as_json:
        from dataclasses import asdict

        say_json({"out": str(out), **asdict(training)})
        return
    success = "no episode ended" if training.success is None else f"success {training.success:.2f} of the last episodes"
    say(f"{training.steps} steps, {training.episodes} episodes, {training.minutes:.1f} minutes: {success}.")
    say(f"policy: {out / 'policy.npz'}   (flysim nav {out / 'policy.npz'} --worlds {worlds} --episodes 50)")


def _known(what: str, word: str, known: tuple[str, ...]) -> None:
    if word not in known:
        raise FlysimError(f"no {what} '{word}'. {did_you_mean(word, known)}")
