"""Lets an engine see the frames of a data set, holds what it finds against the truth where there is one, records it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from flysim.common.overrides import override
from flysim.common.progress import Progress, within
from flysim.datasets.source import DataSet, DataSetSource, on_floor
from flysim.engines.choose import DEFAULT, alone, engine
from flysim.errors import ScenarioError
from flysim.evaluate.evaluator import evaluate
from flysim.evaluate.report import Report
from flysim.photographs.floor import find_floor
from flysim.plain import shown_path
from flysim.products.findings import Findings
from flysim.runs.run import DRIVEN, EVALUATED
from flysim.runs.scenario import Scenario, make_scenario
from flysim.runs.see import see
from flysim.truth.truth import Truth

ALLOWED = ("flies", "obstacles")
LOOKS = 3  # frames in which the floor is sought


def plan_of(data: DataSet, overrides: Iterable[str] = (), seed: int | None = None) -> Scenario:
    """How a data set is seen: by the settings that it was exported with, else the defaults. No world is in it.

    Args:
        data: which.
        overrides: `KEY=VALUE` of the tables flies and obstacles.
        seed: of whoever sees; None: the one it was exported with, or 0.

    Raises:
        ScenarioError: a key that is no setting of who sees, or a bad value.
    """
    where = shown_path(data.folder)
    tables = {name: table for name, table in data.settings.items() if name in ALLOWED}
    for one in overrides:
        if one.partition("=")[0].partition(".")[0] not in ALLOWED:
            raise ScenarioError(f"--set {one}: of a data set only flies.KEY and obstacles.KEY can be set.")
        override(tables, one)
    told = 0 if data.about is None else data.about.seed
    fixed = {"name": data.name, "world": "none", "stops": [{"x": 0.0, "y": 0.0}]}
    return make_scenario({**fixed, **tables, "seed": told if seed is None else seed}, where)


def see_data(data: DataSet, plan: Scenario, name: str, *, progress: Progress) -> tuple[Findings, Truth | None]:
    """What an engine finds in a data set, and the truth of it.

    Raises:
        FlysimError: there is no such engine, or a file of the data set is missing or damaged.
    """
    engine(name)
    source = DataSetSource(standing(data, plan), seed=plan.seed)
    findings = see(source, name, plan.flies, plan.obstacles, seed=plan.seed, keep=True, progress=progress)
    return findings, source.truth()


def standing(data: DataSet, plan: Scenario) -> DataSet:
    """A data set on its floor: where nobody said how high the cameras stand, flies find it in the first frames.

    Where they find none heights are counted from the left camera of the first frame, as poses have them.
    """
    if data.height_known:
        return data
    rng = np.random.default_rng(plan.seed)
    few = replace(data, rows=data.rows[:LOOKS])
    for row, frame in zip(few.rows, DataSetSource(few, seed=plan.seed).frames(), strict=True):
        swarm = alone(engine(DEFAULT), frame.pair, plan.flies, rng=rng)
        floor = find_floor(swarm.points, swarm.normals, swarm.spread, rng=rng)
        if floor is not None:
            note = (
                f"the floor was found {floor.height:.3g} m below the left camera of frame {row}, which looks down by "
                f"{floor.pitch_deg:.1f} degrees"
            )
            return on_floor(data, row, floor.T_base_left, note)
    note = f"no floor was found up to {plan.flies.max_depth:g} m: heights are told from where the poses have them"
    return replace(data, recorded=replace(data.recorded, notes=(*data.recorded.notes, note)))


def run_data_into(
    room: Path, data: DataSet, plan: Scenario, name: str, *, progress: Progress
) -> tuple[Findings, Report | None]:
    """Sees a data set and writes a run's files into a folder that is there already."""
    from flysim.record.scribe import scribe

    with scribe() as writer:
        findings, truth = see_data(data, plan, name, progress=within(progress, 0.0, DRIVEN))
        progress("evaluate", DRIVEN)
        config = {
            "data": str(data.folder.resolve()),
            "format": data.layout,
            "frames": list(data.rows),
            "engine": name,
            **{table: plan.model_dump(mode="json")[table] for table in ALLOWED},
            "seed": plan.seed,
            "written": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        writer.begin(room, findings=findings, truth=truth, config=config)
        report = None if truth is None else evaluate(findings, truth)
        writer.finish(report, within(progress, EVALUATED, 1.0))
    return findings, report
