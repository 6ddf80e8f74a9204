"""Engines side by side: one drive, the same pairs, the same clusterer, the same evaluator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flysim.common.progress import Progress, silent, within
from flysim.common.sheet import NOTHING, Sheet, number
from flysim.engines.choose import ENGINES, engine
from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.evaluate.table import flaws
from flysim.products.findings import Findings
from flysim.render.choose import RendererName
from flysim.runs.run import driven
from flysim.runs.scenario import Scenario
from flysim.runs.see import see
from flysim.studies.compare.figures_of import pooled, worst_obstacle
from flysim.truth.truth import Truth

DRIVEN = 0.4  # share of the work that is done once the drive is
TAU = "0.02"  # [m] of the surface F-score in the table


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparison:
    """What each engine made of one drive.

    Attributes:
        findings: by engine, all on the same frames.
        reports: by engine.
        truth: of the drive.
    """

    scenario: str
    seed: int
    renderer: str
    findings: dict[str, Findings]
    reports: dict[str, Report]
    truth: Truth

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
            **self.truth.disturbed,
        }

    def sheet(self) -> Sheet:
        """A row an engine."""
        first = next(iter(self.reports.values()))
        title = f"{self.scenario}, seed {self.seed}, {self.renderer}, {len(first.stops)} stops"
        if first.blocked:
            title += f", {first.blocked}"
        if self.truth.disturbed:
            title += f", {flaws(self.truth.disturbed)}"
        return Sheet(
            title=title,
            columns=COLUMNS,
            rows=tuple(row(name, pooled([report])) for name, report in self.reports.items()),
            note=NOTE,
        )


COLUMNS = (
    *("engine", "F1", "well F1", "precision", "recall", "centre cm", "size cm", "size %"),
    *("size p95", "height p95 / max", "shape", "surface F", "ms a stop", "missed > 15 cm"),
)
NOTE = (
    "well: centre and sizes to 3 cm, or 5 % of a size; medians over what was found, against its visible part; "
    "surface F at 2 cm; drawing not timed"
)


def row(name: str, figures: dict[str, Any]) -> tuple[str, ...]:
    """An engine's figures as the table has them."""
    return (
        name,
        number(figures["f1"], 3),
        number(figures["well_f1"], 3),
        number(figures["precision"], 3),
        number(figures["recall"], 3),
        _times(figures["center_error_m"], 100.0, 2),
        _times(figures["size_error_m"], 100.0, 2),
        _times(figures["size_error_rel"], 100.0, 1),
        _times(figures["size_error_p95_m"], 100.0, 1),
        f"{_times(figures['height_error_p95_m'], 100.0, 1)} / {_times(figures['height_error_max_m'], 100.0, 1)}",
        _times(figures["shape_accuracy"], 1.0, 2),
        number(figures["surface_f"][TAU], 3),
        number(figures["ms_per_stop"], 1),
        str(figures["missed_big"]),
    )


def _times(value: float | None, factor: float, digits: int) -> str:
    return NOTHING if value is None else f"{factor * value:.{digits}f}"


def compare(
    plan: Scenario,
    engines: Sequence[str] = ENGINES.builtin,
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
        engine(name)  # the mistakes before the minutes
    told = progress or silent
    frames, truth = driven(plan, seed=seed, renderer=renderer, progress=within(told, 0.0, DRIVEN))
    findings, reports = {}, {}
    for k, name in enumerate(engines):
        share = (1.0 - DRIVEN) / len(engines)
        tell = within(told, DRIVEN + k * share, DRIVEN + (k + 0.8) * share)
        findings[name] = see(
            frames,
            name,
            plan.flies,
            plan.obstacles,
            seed=seed,
            localisation=plan.localisation,
            warmed=True,
            progress=lambda what, done, name=name, tell=tell: tell(f"{name}, {what}", done),
        )
        reports[name] = evaluate(findings[name], truth)
    told("done", 1.0)
    return Comparison(
        scenario=plan.name, seed=seed, renderer=frames.of.renderer, findings=findings, reports=reports, truth=truth
    )
