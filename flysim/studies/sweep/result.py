"""What came of a study: rows, figures by level and engine with their intervals, and where half is lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from flysim.common.sheet import NOTHING, Sheet, number
from flysim.evaluate.matching import harmonic
from flysim.studies.compare.figures_of import share_interval
from flysim.studies.machine import machine
from flysim.studies.sweep.cell import Row
from flysim.studies.sweep.study import Study


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """An engine's figures over all drives of one level.

    Attributes:
        f1, well_f1: of the counts of all drives together; None where none could be driven.
        f1_ci95, well_f1_ci95: their 95 % intervals over the drives.
        center_error_max_m, size_error_max_m: medians over the drives of the worst error in each [m].
        points: mean of a stop.
        ms_per_stop: median.
        odometry_ape_m, located_ape_m: medians over the drives; None where nobody told.
        drives, failed: how many there were, and how many could not be driven.
    """

    level: float
    engine: str
    f1: float | None
    well_f1: float | None
    f1_ci95: tuple[float, float] | None
    well_f1_ci95: tuple[float, float] | None
    center_error_max_m: float | None
    size_error_max_m: float | None
    points: float | None
    ms_per_stop: float | None
    odometry_ape_m: float | None
    located_ape_m: float | None
    drives: int
    failed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepResult:
    """A study's rows, and what they say.

    Attributes:
        name, study: which one.
        levels: in the order of the study.
        engines: in the order of the tables.
        renderer: who drew.
        rows: a cell each: level by level, scenario, seed, engine.
        lost: drives whose process died, one sentence each; the next run of the study does them.
    """

    name: str
    study: Study
    levels: tuple[float, ...]
    engines: tuple[str, ...]
    renderer: str
    rows: tuple[Row, ...]
    lost: tuple[str, ...] = ()

    def summary(self) -> tuple[Level, ...]:
        """The figures of each level and engine."""
        return tuple(self._level(level, engine) for level in self.levels for engine in self.engines)

    def half_level(self, figure: str = "f1") -> dict[str, float | None]:
        """By engine, the level at which a figure has fallen to half of what it is at the first level.

        Between two levels the figure is taken for a straight line. None where it never falls so far.
        """
        of = {(one.engine, one.level): getattr(one, figure) for one in self.summary()}
        return {engine: half_lost(self.levels, [of[engine, level] for level in self.levels]) for engine in self.engines}

    def to_json(self) -> dict[str, Any]:
        """`rows[]` has a row a cell, `levels[]` the figures over all of a level, `half_level` who is lost where."""
        return {
            "study": self.name,
            "what": self.study.what,
            "unit": self.study.unit,
            "engines": list(self.engines),
            "renderer": self.renderer,
            "rows": [row.to_json() for row in self.rows],
            "levels": [{name: getattr(one, name) for name in Level.__dataclass_fields__} for one in self.summary()],
            "half_level": self.half_level(),
            "half_level_well": self.half_level("well_f1"),
            "lost": list(self.lost),
            "machine": machine(),
        }

    def sheets(self) -> list[Sheet]:
        """A table of all levels, and one of where each engine has lost half."""
        drives = len({(row.scenario, row.seed) for row in self.rows})
        unit = f" [{self.study.unit}]" if self.study.unit else ""
        rows, before = [], None
        for one in self.summary():
            rows.append((f"{one.level:g}" if one.level != before else "", *_cells(one)))
            before = one.level
        sheets = [
            Sheet(
                title=f"study {self.name}: {self.study.what}{unit}, {drives} drives a level, {self.renderer}",
                columns=("level", "engine", "F1", "95 %", "well F1", "centre cm", "size cm", "points", "ms"),
                rows=tuple(rows),
                note="of all drives together; centre, size: of the worst obstacle, median over the drives; points and "
                "time are of a stop",
                left=(1,),
            )
        ]
        sheets += self._way()
        half, well = self.half_level(), self.half_level("well_f1")
        sheets.append(
            Sheet(
                title="",
                columns=("half is lost at", "F1", "well F1"),
                rows=tuple((engine, _level(half[engine]), _level(well[engine])) for engine in self.engines),
            )
        )
        failed = {(row.scenario, row.seed, row.error) for row in self.rows if row.error} | {
            (text, None, "") for text in self.lost
        }
        if failed:
            listed = tuple((name, "" if seed is None else str(seed), why or "lost") for name, seed, why in failed)
            sheets.append(Sheet(title="", columns=("failed", "seed", "why"), rows=tuple(sorted(listed))))
        return sheets

    def _way(self) -> list[Sheet]:
        """How far off the robot believed itself, where anybody told."""
        told = [one for one in self.summary() if one.odometry_ape_m is not None or one.located_ape_m is not None]
        if not told:
            return []
        rows = (
            (
                f"{one.level:g}",
                one.engine,
                *(NOTHING if m is None else f"{100.0 * m:.2f}" for m in (one.odometry_ape_m, one.located_ape_m)),
            )
            for one in told
        )
        return [
            Sheet(
                title="",
                columns=("way off by cm", "engine", "odometry", "as located"),
                rows=tuple(rows),
                note="root mean square over the way, nothing aligned; median over the drives",
                left=(1,),
            )
        ]

    def _level(self, level: float, engine: str) -> Level:
        rows = [row for row in self.rows if (row.level, row.engine) == (level, engine)]
        good = [row for row in rows if row.error is None]
        stops = sum(row.stops for row in good)
        f1, well = (None, None) if not good else (_share(good, well=False), _share(good, well=True))
        return Level(
            level=level,
            engine=engine,
            f1=f1,
            well_f1=well,
            f1_ci95=_interval(good, well=False),
            well_f1_ci95=_interval(good, well=True),
            center_error_max_m=_median([row.center_error_max_m for row in good]),
            size_error_max_m=_median([row.size_error_max_m for row in good]),
            points=sum(row.points or 0 for row in good) / stops if stops else None,
            ms_per_stop=_median([row.ms_per_stop for row in good]),
            odometry_ape_m=_median([row.odometry_ape_m for row in good]),
            located_ape_m=_median([row.located_ape_m for row in good]),
            drives=len(rows),
            failed=len(rows) - len(good),
        )


def half_lost(levels: Sequence[float], figures: Sequence[float | None]) -> float | None:
    """Where a figure first falls to half of its first value, on straight lines between the levels; None: nowhere."""
    known = [(level, figure) for level, figure in zip(levels, figures, strict=True) if figure is not None]
    if not known or known[0][1] <= 0.0:
        return None
    half = known[0][1] / 2.0
    for (low, before), (high, after) in pairwise(known):
        if after <= half:
            return low + (high - low) * (before - half) / (before - after)
    return None


def _share(rows: Sequence[Row], *, well: bool) -> float:
    """F1 of all rows' obstacles together."""
    found = sum(row.found for row in rows)
    right = sum(row.found_well for row in rows) if well else found
    visible, claimed = sum(row.visible for row in rows), found + sum(row.false for row in rows)
    recall = right / visible if visible else 1.0
    return harmonic(right / claimed if claimed else float(not visible), recall)


def _interval(rows: Sequence[Row], *, well: bool) -> tuple[float, float] | None:
    counts = [(row.found, row.found_well, row.visible, row.false) for row in rows]
    return share_interval(counts, "well_f1" if well else "f1")


def _median(values: Sequence[float | None]) -> float | None:
    there = [value for value in values if value is not None]
    return float(np.median(there)) if there else None


def _cells(one: Level) -> tuple[str, ...]:
    interval = NOTHING if one.f1_ci95 is None else f"{one.f1_ci95[0]:.2f}-{one.f1_ci95[1]:.2f}"
    return (
        one.engine,
        number(one.f1, 3),
        interval,
        number(one.well_f1, 3),
        number(None if one.center_error_max_m is None else 100.0 * one.center_error_max_m),
        number(None if one.size_error_max_m is None else 100.0 * one.size_error_max_m),
        number(one.points, 0),
        number(one.ms_per_stop),
    )


def _level(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.3g}"
