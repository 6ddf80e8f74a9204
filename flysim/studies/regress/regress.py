"""Runs what baselines hold and tells what moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from flysim.common.progress import Progress
from flysim.common.sheet import NOTHING, Sheet
from flysim.runs.run import run
from flysim.runs.scenario import read_scenario
from flysim.studies.regress.baseline import Baseline, Moved, figures_of_report


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """A baseline, its figures as they are now, and each beside the old one."""

    baseline: Baseline
    figures: dict[str, float | None]
    moved: tuple[Moved, ...]

    @property
    def worse(self) -> int:
        """How many figures fell further behind than they may."""
        return sum(one.verdict == "worse" for one in self.moved)

    def to_json(self) -> dict[str, Any]:
        """Every figure, moved or not."""
        held = self.baseline
        return {
            "name": held.name,
            "scenario": held.scenario,
            "engine": held.engine,
            "seed": held.seed,
            "renderer": held.renderer,
            "worse": self.worse,
            "figures": [asdict(one) for one in self.moved],
            "updates": list(held.updates),
        }


def check_baseline(baseline: Baseline, progress: Progress | None = None) -> Checked:
    """Runs a baseline's scenario and judges the figures.

    Raises:
        FlysimError: the scenario cannot be run.
    """
    plan = read_scenario(baseline.scenario, baseline.overrides)
    plan = plan.model_copy(update={"engine": baseline.engine, "stops": plan.stops[: baseline.stops]})
    report = run(plan, seed=baseline.seed, renderer=baseline.renderer, progress=progress)
    figures = figures_of_report(report)
    return Checked(baseline=baseline, figures=figures, moved=baseline.judge(figures))


def sheet(checked: Sequence[Checked]) -> Sheet:
    """What moved, a row a figure."""
    rows = tuple(
        (
            one.baseline.name,
            figure.figure,
            _cell(figure.old),
            _cell(figure.new),
            _cell(figure.tolerance),
            figure.verdict,
        )
        for one in checked
        for figure in one.moved
        if figure.verdict != "same"
    )
    count, worse = sum(len(one.moved) for one in checked), sum(one.worse for one in checked)
    title = f"{count} figures of {len(checked)} baselines: {len(rows)} moved, {worse} worse than they may be"
    return Sheet(title=title, columns=("baseline", "figure", "old", "new", "tolerance", "verdict"), rows=rows)


def _cell(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.6g}"
