"""How many steps a second the environment makes, and what share of a step its two images and the physics take."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.progress import Progress, silent
from flysim.common.scratch import Scratch
from flysim.common.sheet import Sheet, number, percent
from flysim.common.workers import Died, finished
from flysim.studies.machine import machine

OBSERVATIONS = ("flies", "pixels", "truth", "sgbm")
STEPS = 200
WORLD = "yard"


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvBench:
    """Steps of an environment in `yard`, 160x120, one core unless said otherwise.

    Attributes:
        steps: timed, of each observation.
        steps_per_second: by observation: what one process makes, the agent left out.
        steps_per_cpu_second: the same by the processor's time, all threads together: what one core makes that has no
            other work.
        two_processes: with flies, what two processes make together, over what one makes; None with one core, or where
            one was killed.
        render_ms: of drawing the two images alone, median.
        physics_ms: of a period's physics alone, median.
        step_ms: of a step with flies, median.
        render_share: of such a step: render_ms over step_ms.
        over_floor: step_ms over render_ms + physics_ms.
    """

    machine: Mapping[str, Any]
    repeats: int
    steps: int
    steps_per_second: Mapping[str, float]
    steps_per_cpu_second: Mapping[str, float]
    two_processes: float | None
    render_ms: float
    physics_ms: float
    step_ms: float
    render_share: float
    over_floor: float

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        names = (
            "repeats",
            "steps",
            "two_processes",
            "render_ms",
            "physics_ms",
            "step_ms",
            "render_share",
            "over_floor",
        )
        found = {name: getattr(self, name) for name in names}
        rates = {
            "steps_per_second": dict(self.steps_per_second),
            "steps_per_cpu_second": dict(self.steps_per_cpu_second),
        }
        return {"machine": dict(self.machine), **rates, **found}

    def sheets(self) -> tuple[Sheet, ...]:
        """The tables a person reads."""
        rows = tuple(
            (name, number(value), number(self.steps_per_cpu_second[name]))
            for name, value in self.steps_per_second.items()
        )
        parts = (
            ("a step with flies, ms", number(self.step_ms, 2)),
            ("its two images alone, ms", number(self.render_ms, 2)),
            ("its physics alone, ms", number(self.physics_ms, 2)),
            ("share of the images", percent(self.render_share)),
            ("step over images and physics", number(self.over_floor, 2)),
            ("two processes over one", number(self.two_processes, 2)),
        )
        return (
            Sheet(title="Steps a second", columns=("observation", "steps/s", "steps/s of processor time"), rows=rows),
            Sheet(title="With flies", columns=("", "figure"), rows=parts),
        )


def bench_env(*, steps: int = STEPS, progress: Progress | None = None) -> EnvBench:
    """Measures it.

    Args:
        steps: of each observation that count, after ten that do not.
        progress: called with what is going on and the share that is done.
    """
    told = progress or silent
    rates: dict[str, float] = {}
    busy: dict[str, float] = {}
    for k, name in enumerate(OBSERVATIONS):
        told(name, k / 6.0)
        ms, busy[name] = step_times(name, steps)
        rates[name] = 1e3 / statistics.median(ms)
    told("images and physics", 4.0 / 6.0)
    step, render, physics = _beside(steps)
    told("two processes", 5.0 / 6.0)
    cores = machine()["cpus_usable"] or 1
    return EnvBench(
        machine=machine(),
        repeats=1,
        steps=steps,
        steps_per_second=rates,
        steps_per_cpu_second=busy,
        two_processes=_together(steps) if cores > 1 else None,
        render_ms=render,
        physics_ms=physics,
        step_ms=step,
        render_share=render / step,
        over_floor=step / (render + physics),
    )


def step_times(observation: str, steps: int) -> tuple[list[float], float]:
    """[ms] of so many steps, and steps a second of processor time; resets do not count."""
    from flysim.nav.env import FlyNavEnv

    env = FlyNavEnv(world=WORLD, observation=observation)  # type: ignore[arg-type]
    rng = np.random.default_rng(0)
    found: list[float] = []
    busy = 0.0
    try:
        env.reset(seed=0)
        for k in range(steps + 10):
            action = np.array([0.4, rng.uniform(-0.6, 0.6)], np.float32)
            began, busy_before = time.perf_counter(), time.process_time()
            _, _, terminated, truncated, _ = env.step(action)
            if k >= 10:
                found.append(1e3 * (time.perf_counter() - began))
                busy += time.process_time() - busy_before
            if terminated or truncated:
                env.reset()
    finally:
        env.close()
    return found, steps / busy


def _beside(steps: int) -> tuple[float, float, float]:
    """Medians [ms] of a step with flies, of drawing its two images and of its physics by themselves.

    Step by step beside each other, two robots on the same way: a machine that slows down slows all three.
    """
    from flysim.nav.drive import CHUNK, CHUNKS
    from flysim.nav.env import FlyNavEnv

    whole, parts = FlyNavEnv(world=WORLD), FlyNavEnv(world=WORLD)
    rng = np.random.default_rng(0)
    times: list[tuple[float, float, float]] = []
    try:
        for env in (whole, parts):
            env.reset(seed=0)
        for k in range(steps + 10):
            v, w = 0.4, float(rng.uniform(-0.6, 0.6))
            began = time.perf_counter()
            _, _, terminated, truncated, _ = whole.step(np.array([v, w], np.float32))
            stepped = time.perf_counter()
            parts.stage.pair()
            drawn = time.perf_counter()
            for _ in range(CHUNKS):
                parts.stage.simulation.advance(v * parts.v_max, w * parts.w_max, CHUNK)
            if k >= 10:
                times.append((stepped - began, drawn - stepped, time.perf_counter() - drawn))
            if terminated or truncated:
                for env in (whole, parts):
                    env.reset(seed=k)
    finally:
        whole.close()
        parts.close()
    step, render, physics = (1e3 * statistics.median(column) for column in zip(*times, strict=True))
    return step, render, physics


def _rate(job: tuple[int, str]) -> float:
    """Seconds of so many steps with flies, from when the folder holds as many files as it has a name for."""
    steps, gate = job
    step_times("flies", 5)  # what is compiled and read once
    (Path(gate) / str(os.getpid())).touch()
    while len(list(Path(gate).iterdir())) < int(Path(gate).name):
        time.sleep(0.001)
    began = time.perf_counter()
    step_times("flies", steps)
    return time.perf_counter() - began


def _together(steps: int) -> float | None:
    """Steps a second of two processes side by side, over those of one alone: the same work, by the wall clock.

    None where a process was killed.
    """
    scratch = Scratch()
    took: list[float] = []
    try:
        for count in (1, 2):  # each waits until all of them are ready
            gate = Path(scratch.name) / str(count)
            gate.mkdir()
            with finished(_rate, [(steps, str(gate))] * count, count) as found:
                times = [seconds for _, seconds in found]
            if any(isinstance(seconds, Died) for seconds in times):
                return None
            took.append(max(times))
    finally:
        scratch.cleanup()
    return 2.0 * took[0] / took[1]
