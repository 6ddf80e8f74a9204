"""The figures by which engines are compared, pooled over any number of reports.

Found, missed and false obstacles are counted over all reports before anything is divided; centre and size errors are
medians over all obstacles that were visible and found, against the part of them that was *visible* from the stops (and
against the whole, under keys that say so). Surface figures are means over the reports.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.statistics import bootstrap_ci95, pooled_share_ci95
from flysim.evaluate.matching import harmonic
from flysim.evaluate.report import Report
from flysim.evaluate.scores import TAUS, ObstacleReport
from flysim.evaluate.well import well

VISIBLE_ERRORS = ("center_error_m", "size_error_m", "size_error_rel")
SHARES = ("f1", "well_f1", "precision", "recall")
BIG = 0.15  # [m] an obstacle whose largest visible dimension exceeds this must not be missed


def pooled(reports: Sequence[Report]) -> dict[str, Any]:
    """The figures over reports of one engine; None where there is nothing to take a median of.

    `f1`, `precision`, `recall`: pooled counts; `well_f1`: of what was found well (`evaluate.well`). `center_error_m`,
    `size_error_m`: medians against the visible part.
    Of both, and of heights alone (`height_error_m`), `*_p95_m` and `*_max_m` are the 95 % quantile and the greatest.
    `shape_accuracy`: share of the found whose shape was told. `iou_plan`, `iou_3d`: mean over the visible (`overlap`).
    `size_error_rel`: median of a dimension's error over that visible dimension. `center_error_full_m`,
    `size_error_full_m`: against the whole obstacle. `surface_f`: mean F-score by threshold [m]. `ms_per_stop`: median
    over all stops of the engine's time and the stop's share of the clustering; drawing is not in it. `visible`,
    `found`, `false`: the counts. `missed_big`: how many of the visible that were missed are bigger than 15 cm.
    """
    seen = [o for report in reports for o in report.obstacles if o.visible]
    found = [o for o in seen if o.detected]
    false = sum(report.false_obstacles for report in reports)
    stops = [stop.time for report in reports for stop in report.stops]
    return {
        **_shares(sum(o.share for o in seen), len(seen), false),
        "well_f1": well(seen, false)["f1"],
        **{figure: _median(e for report in reports for e in _errors(report, figure)) for figure in VISIBLE_ERRORS},
        "center_error_full_m": _median(o.center_error for o in found),
        "size_error_full_m": _median(abs(e) for o in found for e in o.size_error or ()),
        "center_error_p95_m": _quantile((o.center_visible_error for o in found), 0.95),
        "center_error_max_m": _quantile((o.center_visible_error for o in found), 1.0),
        "size_error_p95_m": _quantile((abs(e) for o in found for e in o.size_visible_error or ()), 0.95),
        "size_error_max_m": _quantile((abs(e) for o in found for e in o.size_visible_error or ()), 1.0),
        "height_error_m": _median(_heights(found)),
        "height_error_p95_m": _quantile(_heights(found), 0.95),
        "height_error_max_m": _quantile(_heights(found), 1.0),
        "shape_accuracy": _mean(float(o.shape_true == o.shape_estimated) for o in found),
        "iou_plan": _weighted(reports, "iou_plan"),
        "iou_3d": _weighted(reports, "iou_3d"),
        "surface_f": {tau: _mean(report.surface.f_score[tau] for report in reports) for tau in TAUS},
        "ms_per_stop": _median(1e3 * (time["evolve"] + time["obstacles"]) for time in stops),
        "visible": len(seen),
        "found": len(found),
        "false": false,
        "missed_big": sum(missed_big(o) for o in seen),
    }


def missed_big(obstacle: ObstacleReport) -> bool:
    """Whether a visible obstacle bigger than `BIG` was missed. What is visible lies within the searched depths."""
    size = obstacle.size_visible
    return obstacle.visible and not obstacle.detected and size is not None and max(size) > BIG


def worst_obstacle(report: Report) -> dict[str, Any] | None:
    """What most speaks against a report: its largest missed obstacle, else the one with the largest size error."""
    seen = [o for o in report.obstacles if o.visible]
    missed = [o for o in seen if not o.detected]
    if missed:
        worst = max(missed, key=lambda o: max(o.size_visible or o.size_true))
        return {"name": worst.name, "detected": False, "size_visible_m": _rounded(worst.size_visible)}
    if not seen:
        return None
    worst = max(seen, key=_largest_error)
    return {
        "name": worst.name,
        "detected": True,
        "size_visible_m": _rounded(worst.size_visible),
        "size_visible_error_m": _rounded(worst.size_visible_error),
        "center_visible_error_m": None if worst.center_visible_error is None else round(worst.center_visible_error, 6),
    }


def _largest_error(obstacle: ObstacleReport) -> float:
    return max((abs(e) for e in obstacle.size_visible_error or ()), default=0.0)


def _counts(report: Report) -> tuple[float, float, int, int]:
    """Found, found well, visible, false."""
    seen = [o for o in report.obstacles if o.visible]
    right = sum(o.share for o in seen if o.found_well)
    return sum(o.share for o in seen), right, len(seen), report.false_obstacles


def _shares(found: float, visible: int, false: int) -> dict[str, float]:
    """As the evaluator has them of one report (`evaluate.matching`)."""
    recall = found / visible if visible else 1.0
    claimed = found + false
    precision = found / claimed if claimed else float(visible == 0)
    return {"f1": harmonic(precision, recall), "precision": precision, "recall": recall}


def _errors(report: Report, figure: str) -> Iterator[float]:
    """Every single error of the visible obstacles that were found, against the visible part of each."""
    for o in report.obstacles:
        if not (o.visible and o.detected):
            continue
        if figure == "center_error_m" and o.center_visible_error is not None:
            yield o.center_visible_error
        elif figure == "size_error_m":
            yield from map(abs, o.size_visible_error or ())
        elif figure == "size_error_rel":
            yield from (
                abs(error) / size
                for error, size in zip(o.size_visible_error or (), o.size_visible or (), strict=True)
                if size > 0.0
            )


def _median(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return statistics.median(known) if known else None


def _quantile(values: Iterable[float | None], share: float) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.quantile(known, share)) if known else None


def _heights(found: Iterable[ObstacleReport]) -> Iterator[float]:
    yield from (abs(o.size_visible_error[2]) for o in found if o.size_visible_error)


def _weighted(reports: Sequence[Report], figure: str) -> float | None:
    """The mean of a report's mean over its visible obstacles, over those of all reports."""
    told = [(sum(o.visible for o in report.obstacles), getattr(report, figure)) for report in reports]
    total = sum(count for count, value in told if value is not None)
    return sum(count * value for count, value in told if value is not None) / total if total else None


def _mean(values: Iterable[float]) -> float | None:
    known = list(values)
    return statistics.fmean(known) if known else None


def _rounded(values: Iterable[float] | None) -> list[float] | None:
    return None if values is None else [round(value, 6) + 0.0 for value in values]


def share_interval(counts: Sequence[tuple[float, float, int, int]], figure: str) -> tuple[float, float] | None:
    """Wilson's 95 % interval of "f1", "well_f1", "precision" or "recall" pooled over runs; None where nothing counts.

    F1 is twice what was found over what is there and what was claimed together: a share in which each is counted once
    on either side, so that half of them make the sample.

    Args:
        counts: found, found well, visible and false of each run.
        figure: which.
    """
    found, right, visible, false = np.array(counts, dtype=np.float64).reshape(-1, 4).T
    if figure == "recall":
        return pooled_share_ci95(found.tolist(), visible.tolist())
    if figure == "precision":
        return pooled_share_ci95(found.tolist(), (found + false).tolist())
    hits, both = right if figure == "well_f1" else found, visible + found + false
    return pooled_share_ci95((2.0 * hits).tolist(), both.tolist(), float(both.sum()) / 2.0)


def interval(reports: Sequence[Report], figure: str, rng: np.random.Generator) -> tuple[float, float] | None:
    """The 95 % interval of a pooled figure over runs, whose obstacles hang together.

    Of shares it is Wilson's (`pooled_share_ci95`): where nothing failed it does not end at 1.00 on both sides. Of
    medians, whole runs are drawn again and again (`bootstrap_ci95`).

    Args:
        reports: of one engine.
        figure: "f1", "well_f1", "precision", "recall", "center_error_m", "size_error_m" or "size_error_rel".
        rng: what draws.
    """
    if figure in SHARES:
        return share_interval([_counts(report) for report in reports], figure)
    errors = [np.array(list(_errors(report, figure))) for report in reports]

    def median(drawn: NDArray[np.intp]) -> float | None:
        values = np.concatenate([errors[i] for i in drawn])
        return float(np.median(values)) if len(values) else None

    return bootstrap_ci95(len(reports), median, rng)
