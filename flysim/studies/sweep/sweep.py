"""A study: one disturbance over levels, scenarios and seeds, every engine on the same frames, each cell kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from flysim.common.growing import Growing
from flysim.common.progress import Progress, silent
from flysim.common.runner import Runner
from flysim.common.workers import Died
from flysim.render.choose import RendererName, renderer_here
from flysim.runs.scenario import read_scenario
from flysim.studies.sweep.cell import Row, Trip, run_trip
from flysim.studies.sweep.result import SweepResult
from flysim.studies.sweep.study import Study
from flysim.studies.sweep.table import cells_parquet

STUDY = "study.json"
CELLS = "cells.parquet"


def trips(
    study: Study,
    scenarios: Sequence[str],
    seeds: Sequence[int],
    engines: Sequence[str],
    *,
    levels: Sequence[float] | None = None,
    renderer: RendererName = "auto",
    overrides: Sequence[str] = (),
) -> tuple[Trip, ...]:
    """What there is to drive, level by level.

    Args:
        study: the disturbance.
        scenarios: names or paths.
        seeds: of each scenario at each level.
        engines: who see.
        levels: None takes the study's own.
        renderer: "auto" is settled here, so that a cell is named by who drew it.
        overrides: `KEY=VALUE` for all scenarios at all levels; the study's own come after them.

    Raises:
        FlysimError: a scenario cannot be read, or a level is out of range.
    """
    here = renderer_here(renderer)
    found = []
    for level in study.levels if levels is None else levels:
        for name in scenarios:
            plan = study.changed(read_scenario(name, (*overrides, *study.overrides(level))), level)
            found += [
                Trip(
                    level=float(level),
                    scenario=plan.name,
                    seed=seed,
                    plan=plan,
                    renderer=here,
                    engines=tuple(engines),
                )
                for seed in seeds
            ]
    return tuple(found)


def run_study(
    name: str,
    study: Study,
    todo: Sequence[Trip],
    folder: Growing,
    run: Runner,
    *,
    progress: Progress | None = None,
) -> SweepResult:
    """Runs what the folder does not hold yet; each drive is kept as it is done.

    Args:
        name: of the study.
        study: its unit and title.
        todo: of `trips`.
        folder: holds `study.json` and `cells.parquet`, a row a cell; cells of an equal key are not run again.
        run: who does it.
        progress: called with a word and a share as the work goes on.

    Raises:
        RecordError: the folder cannot be written.
    """
    told = progress or silent
    rows = kept_rows(folder)
    jobs = [
        replace(one, engines=missing)
        for one in todo
        if (missing := tuple(engine for engine in one.engines if one.key(engine) not in rows))
    ]
    wanted = [one.key(engine) for one in todo for engine in one.engines]
    lost: dict[str, str] = {}

    def result() -> SweepResult:
        return SweepResult(
            name=name,
            study=study,
            levels=tuple(dict.fromkeys(one.level for one in todo)),
            engines=todo[0].engines,
            renderer=todo[0].renderer,
            rows=tuple(rows[key] for key in wanted if key in rows),
            lost=tuple(lost.values()),
        )

    def cells() -> list[Row]:  # what this folder was asked for before stays in it
        return sorted(rows.values(), key=lambda row: (row.level, row.scenario, row.seed, row.engine, row.key))

    def data(said: dict[str, Any]) -> dict[str, Any]:
        return {**said, "cells": [row.to_json() for row in cells()]}

    def files() -> dict[str, bytes]:
        return {CELLS: cells_parquet(cells(), name, study.unit)}

    done = len(todo) - len(jobs)
    told(f"{done} of {len(todo)} drives", done / len(todo))
    with run(run_trip, jobs) as found:
        for k, outcome in found:
            if isinstance(outcome, Died):
                where = jobs[k]
                lost[where.key("")] = f"{where.scenario}, seed {where.seed}, level {where.level:g}: {outcome}"
            else:
                rows.update({row.key: row for row in outcome})
                # Figures over all rows take a second, and are only asked for in the end.
                folder.keep(data({"study": name, "unit": study.unit}), done + 1, files=files())
            done += 1
            told(f"{done} of {len(todo)} drives", done / len(todo))
    whole = result()
    if not lost:
        folder.finish(data(whole.to_json()), files={**files(), **pictures(whole)})
    return whole


def pictures(result: SweepResult) -> dict[str, bytes]:
    """The pictures of a study, by their paths in its folder."""
    from flysim.studies.sweep.figure import study_png

    return {"figures/study.png": study_png(result)}


def kept_rows(folder: Growing) -> dict[str, Row]:
    """The cells that the folder holds, by key. Those whose drive failed get another chance."""
    found = {}
    for written in (folder.before or {}).get("cells", ()):
        try:
            row = Row(**written)
        except TypeError:  # an older version's: it is run again
            continue
        if row.error is None:
            found[row.key] = row
    return found
