"""`flysim nav`: agents drive to goals, and are scored."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from flysim.errors import FlysimError, did_you_mean

OBSERVATIONS = ("flies", "truth", "sgbm")


def _agents(incomplete: str) -> list[str]:
    from flysim.nav.agents import AGENTS

    return [name for name in AGENTS if name.startswith(incomplete)]


def nav(
    agents: Annotated[list[str], typer.Argument(help="straight, warning, vfh, dwa or random.", autocompletion=_agents)],
    worlds: Annotated[str, typer.Option(help="A world's name or file, random-easy|medium|hard, or barn.")] = "yard",
    episodes: Annotated[int, typer.Option(help="Episodes of each agent; with barn, of each world.", min=1)] = 1,
    observation: Annotated[str, typer.Option(help="What agents see: flies, truth or sgbm.")] = "flies",
    seed: Annotated[int, typer.Option(help="Seed of the first episode.", min=0)] = 0,
    renderer: Annotated[str, typer.Option(help="auto, gl or tiny.")] = "auto",
    barn: Annotated[Path | None, typer.Option(help="Folder of the BARN worlds. [../shared/data/barn]")] = None,
    processes: Annotated[int | None, typer.Option(help="Processes that share the work. [one a core]", min=1)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object, nothing else.")] = False,
) -> None:
    """Let agents drive the same episodes to a goal, and print their scores with 95 % intervals."""
    if observation not in OBSERVATIONS:
        raise FlysimError(f"no observation '{observation}'. {did_you_mean(observation, OBSERVATIONS)}")
    if renderer not in ("auto", "gl", "tiny"):
        raise FlysimError(f"no renderer '{renderer}'. {did_you_mean(renderer, ('auto', 'gl', 'tiny'))}")
    from flysim.nav.trial import drive_all, tasks_for, to_json
    from flysim.terminal import Bar, console, table

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
    if as_json:
        typer.echo(json.dumps({"worlds": worlds, **data}, indent=1, allow_nan=False))
        return
    from flysim.study.nav_sheet import nav_sheet

    console().print(table(nav_sheet(worlds, data)))


def bench_env(
    steps: Annotated[int, typer.Option(help="Steps of each observation that count.", min=20)] = 200,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object, nothing else.")] = False,
) -> None:
    """Time the environment: steps a second by observation, and what the images and the physics take of them."""
    from flysim.study.bench_env import bench_env as measure
    from flysim.terminal import Bar, console, table

    with Bar("bench env", quiet=as_json) as bar:
        result = measure(steps=steps, progress=bar)
    if as_json:
        typer.echo(json.dumps(result.to_json(), indent=1, allow_nan=False))
        return
    for sheet in result.sheets():
        console().print(table(sheet), "")
