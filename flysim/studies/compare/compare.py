"""Engines side by side: one drive, the same pairs, the same clusterer, the same evaluator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from flysim.common.sheet import NOTHING, Sheet, number
from flysim.engines.choose import check
from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.journey import Journey
from flysim.render.choose import RendererName
from flysim.runs.run import seen_again, travel, truth_of_plan
from flysim.runs.scenario import Scenario
from flysim.studies.compare.figures_of import pooled, worst_obstacle
from flysim.truth.obstacles import TrueObstacle

ENGINES = ("flies", "sgbm", "bm", "exhaustive", "chance")
DRIVEN = 0.4  # share of the work that is done once the drive is
TAU = "0.02"  # [m] of the surface F-score in the table

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """What each engine made of one drive.

    Attributes:
        journeys: by engine, all with the same stops.
        reports: by engine.
        truth: the obstacles of the world.
    """

    scenario: str
    seed: int
    renderer: str
    journeys: dict[str, Journey]
    reports: dict[str, Report]
    truth: tuple[TrueObstacle, ...]

    def to_json(self) -> dict[str, Any]:
        """`engine` has the figures of each engine (`figures_of.pooled`) with its worst obstacle."""
        engines = {
            name: {**pooled([report]), "worst_obstacle": worst_obstacle(report)}
            for name, report in self.reports.items()
        }
        first = next(iter(self.reports.values()))
        return {
            "scenario": self.scenario,
            "seed": self.seed,
            "renderer": self.renderer,
            "world": first.world,
            "status": first.status,
            "blocked": first.blocked,
            "stops": len(first.stops),
            "engine": engines,
        }

    def sheet(self) -> Sheet:
        """A row an engine."""
        first = next(iter(self.reports.values()))
        title = f"{self.scenario}, seed {self.seed}, {self.renderer}, {len(first.stops)} stops"
        if first.blocked:
            title += f", {first.blocked}"
        return Sheet(
            title=title,
            columns=COLUMNS,
            rows=tuple(row(name, pooled([report])) for name, report in self.reports.items()),
            note=NOTE,
        )


COLUMNS = (
    *("engine", "F1", "precision", "recall", "centre cm", "size cm", "size %"),
    *("surface F", "ms a stop", "missed > 15 cm"),
)
NOTE = "medians over what was found, against its visible part; surface F at 2 cm; drawing not timed"


def row(name: str, figures: dict[str, Any]) -> tuple[str, ...]:
    """An engine's figures as the table has them."""
    return (
        name,
        number(figures["f1"], 3),
        number(figures["precision"], 3),
        number(figures["recall"], 3),
        _times(figures["center_error_m"], 100.0, 2),
        _times(figures["size_error_m"], 100.0, 2),
        _times(figures["size_error_rel"], 100.0, 1),
        number(figures["surface_f"][TAU], 3),
        number(figures["ms_per_stop"], 1),
        str(figures["missed_big"]),
    )


def _times(value: float | None, factor: float, digits: int) -> str:
    return NOTHING if value is None else f"{factor * value:.{digits}f}"


def compare(
    plan: Scenario,
    engines: Sequence[str] = ENGINES,
    *,
    seed: int = 0,
    renderer: RendererName = "auto",
    progress: Progress | None = None,
) -> Comparison:
    """Drives a scenario once and lets every engine see at its stops.

    Args:
        plan: the scenario; the engine it names is not asked.
        engines: names, each once.
        seed: of all randomness: flies see what `flysim run --seed` lets them see.
        renderer: as `pipeline.run`.
        progress: called with a word and a share as the work goes on.

    Raises:
        FlysimError: as `pipeline.run`, or an unknown engine.
        ValueError: no engine, or one twice.
    """
    if not engines or len(set(engines)) < len(engines):
        raise ValueError(f"engines must be named once each, got {', '.join(engines) or 'none'}")
    for name in engines:
        check(name)
    told = progress or (lambda _what, _share: None)
    # The drive needs an engine, and chance costs next to nothing; all are asked again on equal terms below.
    drive = travel(
        _with(plan, "chance"), seed=seed, renderer=renderer, progress=lambda what, share: told(what, DRIVEN * share)
    )
    truth = truth_of_plan(drive, plan)
    journeys, reports = {}, {}
    for k, name in enumerate(engines):

        def within(what: str, share: float, k: int = k) -> None:
            told(what, DRIVEN + (1.0 - DRIVEN) * (k + 0.8 * share) / len(engines))

        journeys[name] = seen_again(drive, _with(plan, name), progress=within)
        reports[name] = evaluate(journeys[name], truth)
    told("done", 1.0)
    return Comparison(
        scenario=plan.name, seed=seed, renderer=drive.renderer, journeys=journeys, reports=reports, truth=truth
    )


def _with(plan: Scenario, name: str) -> Scenario:
    return plan.model_copy(update={"engine": name})
