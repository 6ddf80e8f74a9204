"""How long a stop takes: the robot's look by each renderer, and all that it does where it stands."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from flysim.common.progress import Progress, silent
from flysim.common.sheet import Sheet, number
from flysim.engines.choose import engine
from flysim.render.choose import RendererName, gl_works
from flysim.render.look import look
from flysim.render.studio import drawn
from flysim.runs.run import errand
from flysim.runs.scenario import Scenario
from flysim.sources.simulated import SimulatedDrive
from flysim.studies.bench.timing import Done, interleaved
from flysim.studies.machine import machine

REPEATS = 9


@dataclass(frozen=True, slots=True, kw_only=True)
class StopTime:
    """What one renderer takes at a scenario's first stop; medians over the repeats.

    Attributes:
        scenario: its name.
        renderer: "gl" or "tiny".
        width: of an image [px].
        height: of an image [px].
        look_ms: a stereo pair drawn, with its truth.
        stop_ms: drawn and evolved, with no way to drive.
        least_ms: the shortest of those.
        most_ms: the longest of those.
    """

    scenario: str
    renderer: str
    width: int
    height: int
    look_ms: float
    stop_ms: float
    least_ms: float
    most_ms: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StopBench:
    """Each scenario's first stop by each renderer that draws on this machine."""

    machine: Mapping[str, Any]
    repeats: int
    stops: tuple[StopTime, ...]

    def to_json(self) -> dict[str, Any]:
        """Plain data: `machine`, `repeats` and `stops[]`."""
        stops = [asdict(stop) for stop in self.stops]
        return {"machine": dict(self.machine), "repeats": self.repeats, "stops": stops}

    def sheets(self) -> tuple[Sheet, ...]:
        """The table a person reads."""
        return (
            Sheet(
                title="The first stop, ms",
                columns=("scenario", "renderer", "images", "look", "stop", "least", "most"),
                rows=tuple(
                    (
                        stop.scenario,
                        stop.renderer,
                        f"2 x {stop.width}x{stop.height}",
                        *map(number, (stop.look_ms, stop.stop_ms, stop.least_ms, stop.most_ms)),
                    )
                    for stop in self.stops
                ),
                note="A look draws the pair; a stop is a look and its evolution, with no way to drive.",
            ),
        )


def bench_stop(plans: Sequence[Scenario], *, repeats: int = REPEATS, progress: Progress | None = None) -> StopBench:
    """Measures the first stop of scenarios, all renderers in turn.

    Args:
        plans: scenarios; of each, the first stop alone.
        repeats: rounds that count, after one that does not.
        progress: called with what is going on and the share that is done.

    Raises:
        FlysimError: a world or a robot cannot be used.
        ValueError: fewer than one repeat.
    """
    told = progress or silent
    stops: list[StopTime] = []
    for k, plan in enumerate(plans):
        told(plan.name, k / len(plans))
        stops += _stop(plan, repeats, lambda share, k=k, name=plan.name: told(name, (k + share) / len(plans)))
    return StopBench(machine=machine(), repeats=repeats, stops=tuple(stops))


def _stop(plan: Scenario, repeats: int, done: Done) -> list[StopTime]:
    here = errand(plan.model_copy(update={"stops": plan.stops[:1], "texture": None}))
    seer = engine(plan.engine)
    names: tuple[RendererName, ...] = ("gl", "tiny") if gl_works() else ("tiny",)
    works: dict[tuple[str, str], Callable[[int], None]] = {}
    with ExitStack() as stack:
        for name in names:
            simulation, eye = stack.enter_context(drawn(here.world, here.robot, plan.stops[0].pose, name))

            def draw(_turn: int, simulation=simulation, eye=eye) -> None:
                look(simulation, eye)

            def stop(turn: int, simulation=simulation, eye=eye) -> None:
                drive = SimulatedDrive(here, simulation, eye)
                seer.begin(drive.rig, plan.flies)
                for frame in drive.frames():
                    seer.see(frame, rng=np.random.default_rng(turn).spawn(1)[0])

            works[name, "look"], works[name, "stop"] = draw, stop
        timed = interleaved(works, repeats, done)
    return [
        StopTime(
            scenario=plan.name,
            renderer=name,
            width=here.robot.rig.left.width,
            height=here.robot.rig.left.height,
            look_ms=statistics.median(timed[name, "look"].ms),
            stop_ms=statistics.median(timed[name, "stop"].ms),
            least_ms=min(timed[name, "stop"].ms),
            most_ms=max(timed[name, "stop"].ms),
        )
        for name in names
    ]
