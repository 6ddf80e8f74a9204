"""Many worlds, every engine, figures pooled over all of them with their intervals."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flysim.common.growing import Growing
from flysim.common.progress import Progress, silent
from flysim.common.runner import Runner, runner
from flysim.common.sheet import Sheet
from flysim.common.workers import Died
from flysim.errors import FlysimError
from flysim.evaluate.report import Report
from flysim.render.choose import RendererName
from flysim.studies.compare.compare import COLUMNS, row
from flysim.studies.compare.figures_of import interval, pooled, worst_obstacle
from flysim.studies.machine import machine
from flysim.studies.suite.case import Job, Outcome, kept_outcome, run_case
from flysim.studies.suite.suites import Case

WORST = 3  # runs whose folders are kept
RUNS = "runs"  # folder of the runs' folders
SUITE = "suite.json"
DIED = "lost: "  # what the error of a run begins with whose process was killed
INTERVALS = ("f1", "well_f1", "precision", "recall", "center_error_m", "size_error_m", "size_error_rel")
NOTE = (
    "counts pooled over all runs; centre, size: medians over all obstacles found, against the visible part of each; "
    "in brackets 95 % intervals over the runs"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SuiteResult:
    """What became of every case.

    Attributes:
        name: of the suite.
        engines: in the order of the tables; by the first one the worst runs are told.
        cases, outcomes: case by case.
        folders: case -> its run folder, for those that were kept.
    """

    name: str
    engines: tuple[str, ...]
    renderer: str
    cases: tuple[Case, ...]
    outcomes: tuple[Outcome, ...]
    folders: dict[int, Path]

    def reports(self, engine: str) -> list[Report]:
        """The reports of an engine, of the cases that could be run."""
        return [outcome.reports[engine] for outcome in self.outcomes if not outcome.error]

    def worst(self) -> list[int]:
        """Cases from the worst on, as the first engine saw them; those that failed are not among them."""
        first = self.engines[0]
        return sorted(
            (i for i, outcome in enumerate(self.outcomes) if not outcome.error),
            key=lambda i: _badness(self.outcomes[i].reports[first]),
            reverse=True,
        )

    def to_json(self) -> dict[str, Any]:
        """`engine` has the pooled figures of each engine, `runs` a row a run and engine, failed ones too."""
        engines: dict[str, Any] = {}
        for name in self.engines:
            reports = self.reports(name)
            ci = {figure: interval(reports, figure, np.random.default_rng(0)) for figure in INTERVALS}
            engines[name] = {**pooled(reports), "runs": len(reports), "ci95": ci}
        return {
            "suite": self.name,
            "renderer": self.renderer,
            "seeds": sorted({case.seed for case in self.cases}),
            "failed": sum(outcome.error is not None for outcome in self.outcomes),
            "engine": engines,
            "worst": [self._where(i) for i in self.worst() if i in self.folders],
            "runs": [row for i in range(len(self.cases)) for row in self._runs(i)],
            "extents": "center_error_m and size_error_m are against the visible part; *_full_m against the whole",
            "machine": machine(),
        }

    def sheets(self) -> list[Sheet]:
        """The engines' figures with their intervals, the worst runs, the failed ones."""
        data = self.to_json()
        ran = len(self.cases) - data["failed"]
        title = f"suite {self.name}: {ran} runs" + (f", {data['failed']} failed" if data["failed"] else "")
        sheets = [Sheet(title=title, columns=COLUMNS, rows=tuple(map(self._row, self.engines)), note=NOTE)]
        if data["worst"]:
            rows = tuple(
                (w["scenario"], str(w["seed"]), f"{w['f1']:.3f}", _obstacle(w["worst_obstacle"]), w["folder"])
                for w in data["worst"]
            )
            columns = ("worst runs", "seed", "F1", "worst obstacle", "folder")
            sheets.append(Sheet(title="", columns=columns, rows=rows, note=f"as {self.engines[0]} saw them"))
        failed = tuple(
            (case.name, str(case.seed), outcome.error)
            for case, outcome in zip(self.cases, self.outcomes, strict=True)
            if outcome.error
        )
        if failed:
            sheets.append(Sheet(title="", columns=("failed", "seed", "why"), rows=failed))
        return sheets

    def _row(self, engine: str) -> tuple[str, ...]:
        reports = self.reports(engine)
        cells = list(row(engine, pooled(reports)))
        scales = (1.0, 1.0, 1.0, 1.0, 100.0, 100.0, 100.0)
        for k, (figure, scale) in enumerate(zip(INTERVALS, scales, strict=True), start=1):
            found = interval(reports, figure, np.random.default_rng(0))
            if found is not None:
                digits = len(cells[k].partition(".")[2])
                cells[k] += f" ({found[0] * scale:.{digits}f}-{found[1] * scale:.{digits}f})"
        return tuple(cells)

    def _where(self, i: int) -> dict[str, Any]:
        report = self.outcomes[i].reports[self.engines[0]]
        return {
            "scenario": self.cases[i].name,
            "seed": self.cases[i].seed,
            "f1": report.f1,
            "worst_obstacle": worst_obstacle(report),
            "folder": str(self.folders[i]),
        }

    def _runs(self, i: int) -> list[dict[str, Any]]:
        case, outcome = self.cases[i], self.outcomes[i]
        of_case = {"scenario": case.name, "seed": case.seed}
        if outcome.error:
            return [{**of_case, "engine": None, "status": "failed", "error": outcome.error, "folder": None}]
        folder = str(self.folders[i]) if i in self.folders else None
        return [
            {
                **of_case,
                "engine": engine,
                "status": report.status,
                "error": report.blocked,
                "folder": folder,
                "stops": len(report.stops),
                **pooled([report]),
                "worst_obstacle": worst_obstacle(report),
            }
            for engine, report in outcome.reports.items()
        ]


def _badness(report: Report) -> tuple[float, int, float]:
    figures = pooled([report])
    return 1.0 - figures["f1"], figures["missed_big"], report.size_visible_error.max or 0.0


def _obstacle(worst: dict[str, Any] | None) -> str:
    if worst is None:
        return "-"
    if not worst["detected"]:
        return f"{worst['name']} missed"
    off = max((abs(e) for e in worst["size_visible_error_m"] or ()), default=0.0)
    return f"{worst['name']} {100.0 * off:.1f} cm off"


def run_suite(
    name: str,
    cases: Sequence[Case],
    engines: Sequence[str],
    folder: Growing,
    *,
    renderer: RendererName = "auto",
    keep: bool = False,
    run: Runner | None = None,
    progress: Progress | None = None,
) -> SuiteResult:
    """Runs every case, each in one of several processes with one thread, and keeps each as it is done.

    Args:
        name: of the suite.
        cases: what to run.
        engines: who sees; the worst runs are the first one's.
        folder: to keep the runs and `suite.json` in; what it holds already is not run again.
        renderer: as `pipeline.run`.
        keep: all run folders in the end, not the worst alone.
        run: who does it; None: a process a core of this machine.
        progress: called with a word and a share as the work goes on.

    Raises:
        RecordError: the folder cannot be written.
    """
    told = progress or silent
    places = [f"{RUNS}/{case.name}-s{case.seed}" for case in cases]
    outcomes = _kept(cases, tuple(engines), folder, places)
    todo = [i for i in range(len(cases)) if i not in outcomes]

    def result() -> SuiteResult:
        drawn_by = next((r.renderer for o in outcomes.values() for r in o.reports.values()), str(renderer))
        done = sorted(outcomes)
        return SuiteResult(
            name=name,
            engines=tuple(engines),
            renderer=drawn_by,
            cases=tuple(cases[i] for i in done),
            outcomes=tuple(outcomes[i] for i in done),
            folders={k: folder.out / places[i] for k, i in enumerate(done) if not outcomes[i].error},
        )

    told(f"{len(outcomes)} of {len(cases)}", len(outcomes) / len(cases))
    jobs = [Job(case=cases[i], engines=tuple(engines), renderer=renderer) for i in todo]
    with (run or runner())(run_case, jobs) as found:
        for k, outcome in found:
            i = todo[k]
            outcomes[i] = Outcome(reports={}, error=f"{DIED}{outcome}") if isinstance(outcome, Died) else outcome
            folder.keep(result().to_json(), len(outcomes), {places[i]: outcomes[i].files} if outcomes[i].files else {})
            outcomes[i] = replace(outcomes[i], files={})  # they are on the disk now
            told(f"{len(outcomes)} of {len(cases)}", len(outcomes) / len(cases))
    whole = result()
    worst = whole.worst() if keep else whole.worst()[:WORST]
    dropped = [places[i] for i in whole.folders if i not in worst]
    whole = replace(whole, folders={i: place for i, place in whole.folders.items() if i in worst})
    folder.finish(whole.to_json(), dropped)
    return whole


def _kept(
    cases: Sequence[Case], engines: tuple[str, ...], folder: Growing, places: Sequence[str]
) -> dict[int, Outcome]:
    """What a suite that was stopped has done. Who was killed gets another chance."""
    if folder.before is None:
        return {}
    rows = {(row.get("scenario"), row.get("seed")): row.get("error") for row in folder.before.get("runs", ())}
    outcomes = {}
    for i, case in enumerate(cases):
        if (case.name, case.seed) not in rows:
            continue
        error = rows[case.name, case.seed]
        with contextlib.suppress(FlysimError, ValueError, LookupError, TypeError, AttributeError):  # lost: run it again
            outcomes[i] = kept_outcome(folder.out / places[i], engines)
            continue
        if error and not error.startswith(DIED):
            outcomes[i] = Outcome(reports={}, error=error)
    return outcomes
