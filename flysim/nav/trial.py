"""Agents held against each other: the same episodes for all of them, on both cores, with intervals."""

from __future__ import annotations

import contextlib
import time
import traceback
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.runner import Runner
from flysim.common.workers import Died
from flysim.errors import FlysimError, did_you_mean
from flysim.nav.agents.agent import RobotLimits
from flysim.nav.agents.choose import make_agent
from flysim.nav.asked import arguments_of
from flysim.nav.drive import PERIOD_S
from flysim.nav.episode import Episode
from flysim.nav.film import Film
from flysim.nav.scores import barn_score

Progress = Callable[[str, float], None]
MAX_TASKS = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One episode to be driven by one agent.

    Attributes:
        agent: its name.
        world: what the episode is listed under.
        seed: of the episode: the same start, goal and world for every agent.
        settings: arguments of the environment.
        params: of the agent, by name; none: its own.
        filmed: whether its film is made.
    """

    agent: str
    world: str
    seed: int
    settings: dict[str, Any]
    params: dict[str, Any] = field(default_factory=dict)
    filmed: bool = False


def drive(task: Task) -> Episode:
    """Drives one episode, from the making of its environment to its end."""
    from flysim.nav.env import FlyNavEnv

    film = Film() if task.filmed else None
    env = FlyNavEnv(**task.settings, render_mode=None if film is None else "rgb_array")
    try:
        agent = make_agent(
            task.agent,
            RobotLimits(radius=env.radius, v_max=env.v_max, w_max=env.w_max, period=PERIOD_S),
            task.params,
        )
        agent.begin(np.random.default_rng(task.seed))
        observation, info = env.reset(seed=task.seed)
        began, steps, over, truncated = time.perf_counter(), 0, False, False
        while not over:
            observation, _, terminated, truncated, info = env.step(agent.act(observation))
            over, steps = terminated or truncated, steps + 1
            if film is not None and (film.wants() or over):
                film.add(env.render())  # type: ignore[arg-type]
        seconds = time.perf_counter() - began
    finally:
        env.close()
    return Episode(
        agent=task.agent,
        world=task.world,
        seed=task.seed,
        success=info["success"],
        collision=bool(info["collisions"]),
        timed_out=bool(truncated),
        spl=info["spl"],
        soft_spl=info["soft_spl"],
        barn=barn_score(info["success"], info["time"], info["shortest"]),
        clearance=info["clearance"],
        path_length=info["path_length"],
        shortest=info["shortest"],
        time=info["time"],
        hit=info["hit"],
        steps=steps,
        steps_per_second=steps / seconds,
        recoveries=int(getattr(agent, "info", {}).get("recoveries", 0)),
        film=None if film is None else film.done(),
    )


def drive_all(
    tasks: Sequence[Task],
    *,
    run: Runner | None = None,
    progress: Progress | None = None,
    before: Sequence[Episode] = (),
    keep: Callable[[Sequence[Episode]], None] | None = None,
) -> tuple[Episode, ...]:
    """All episodes, in the order of the tasks.

    Args:
        tasks: each episode to be driven.
        run: who drives them; None: this process, one after another.
        progress: called with what was driven last and the share that is done.
        before: episodes of the tasks that were driven already.
        keep: called with those that are done, in the order of the tasks, after each.

    Raises:
        FlysimError: a world or renderer cannot be used, or a process was killed.
    """
    told = progress or (lambda _what, _share: None)
    had = {(episode.agent, episode.world, episode.seed): episode for episode in before}
    done = {k: had[key] for k, task in enumerate(tasks) if (key := (task.agent, task.world, task.seed)) in had}
    todo = [k for k in range(len(tasks)) if k not in done]
    told("start", len(done) / len(tasks))
    with contextlib.closing(_driven([tasks[k] for k in todo], run)) as driven:
        for index, episode in driven:
            done[todo[index]] = episode
            if keep is not None:
                keep([done[k] for k in sorted(done)])
                done[todo[index]] = replace(episode, film=None)  # it is on the disk now
            told(f"{episode.agent}, {episode.world}", len(done) / len(tasks))
    return tuple(done[k] for k in range(len(tasks)))


def _driven(tasks: Sequence[Task], run: Runner | None) -> Generator[tuple[int, Episode]]:
    if run is None:
        for k, task in enumerate(tasks):
            yield k, drive(task)
        return
    with run(_attempt, tasks) as results:
        for k, result in results:
            if isinstance(result, Died):
                raise FlysimError(f"an episode of {tasks[k].agent} was lost: {result}. Was memory short?")
            if isinstance(result, Exception):
                raise result
            yield k, result


def _attempt(task: Task) -> Episode | Exception:
    """As `drive`, in a process of its own: what goes wrong is handed back, with where it did."""
    try:
        return drive(task)
    except Exception as error:
        error.add_note(traceback.format_exc())
        return error


def tasks_for(
    agents: Sequence[str],
    worlds: str,
    *,
    episodes: int,
    observation: str,
    renderer: str = "auto",
    barn: Path | None = None,
    seed: int = 0,
    params: Mapping[str, dict[str, Any]] | None = None,
    settings: Mapping[str, Any] | None = None,
    filmed: bool = False,
) -> list[Task]:
    """The episodes of each agent: `episodes` seeds of a world, or of each BARN world.

    `params` are those of agents, by agent and name, as `{"vfh": {"look": 1.2}}`; `settings` what else was set for the
    environment, as `asked_settings` gives it.

    Raises:
        FlysimError: an unknown agent or world, or a setting that cannot be.
    """
    wanted = arguments_of(settings or {}, observation)
    body = RobotLimits(radius=0.2, v_max=1.0, w_max=1.0, period=PERIOD_S)
    params = params or {}
    for name in params:
        if name not in agents:
            raise FlysimError(f"parameters of '{name}', which does not drive. {did_you_mean(name, agents)}")
    for name in agents:
        make_agent(name, body, params.get(name))  # the mistakes before the minutes
    base = {"observation": observation, "renderer": renderer}
    places: list[tuple[str, dict[str, Any]]] = []
    if worlds == "barn":
        from flysim.common.catalogue import barn_folder
        from flysim.nav.worlds import BARN_SETTINGS, barn_worlds

        places += [
            (f"barn-{one.number}", {**BARN_SETTINGS, "world": str(one.path), "shortest": one.length})
            for one in barn_worlds(barn_folder(barn))
        ]
    else:
        from flysim.common.catalogue import find_world
        from flysim.nav.worlds import find_difficulty

        if find_difficulty(worlds) is None:
            find_world(worlds)
        places.append((worlds, {"world": worlds}))
    if len(agents) * len(places) * episodes > MAX_TASKS:
        raise FlysimError(
            f"{episodes:,} episodes of {len(agents)} agents in {len(places)} worlds: at most {MAX_TASKS:,}."
        )
    return [
        Task(
            agent=agent,
            world=name,
            seed=seed + k,
            settings={**base, **here, **wanted},
            params=params.get(agent, {}),
            filmed=filmed,
        )
        for agent in agents
        for name, here in places
        for k in range(episodes)
    ]
