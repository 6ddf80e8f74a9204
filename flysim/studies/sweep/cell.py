"""One drive of a study: a scenario, a seed and a level, seen by some engines; a row for each of them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Any

from flysim.errors import FlysimError
from flysim.evaluate.report import Report
from flysim.render.choose import RendererName
from flysim.runs.scenario import Scenario
from flysim.studies.compare.figures_of import pooled


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """What one job does.

    Attributes:
        level: of the disturbance.
        scenario: what a table calls it.
        plan: the scenario with the disturbance in it.
        engines: who see.
    """

    level: float
    scenario: str
    seed: int
    plan: Scenario
    renderer: RendererName
    engines: tuple[str, ...]

    def key(self, engine: str) -> str:
        """What names a cell: a digest of the plan, the engine, the seed and the renderer.

        With an equal key it is not run again: a folder belongs to one version of flysim and of the files that it names.
        """
        said = {
            "plan": {
                **self.plan.model_dump(mode="json", exclude={"seed"}),
                "name": None,
                "description": None,
                "engine": engine,
            },
            "seed": self.seed,
            "renderer": self.renderer,
        }
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What an engine made of one trip.

    Attributes:
        level, scenario, seed, engine: the cell.
        f1, well_f1: of this drive; None where it could not be driven.
        center_error_max_m, size_error_max_m: the worst of what was found, against its visible part [m]; None where
            nothing was.
        points: of all stops together.
        ms_per_stop: median time of the engine and its share of the clustering; drawing is not in it.
        found, found_well, visible, false: obstacles, from which the shares follow.
        stops: that were reached.
        odometry_ape_m, located_ape_m: how far off the way is by odometry, and as the engine's points tell it where they
            are asked, root mean squares [m].
        error: why it could not be driven; None where it could.
        key: of the cell.
    """

    level: float
    scenario: str
    seed: int
    engine: str
    f1: float | None = None
    well_f1: float | None = None
    center_error_max_m: float | None = None
    size_error_max_m: float | None = None
    points: int | None = None
    ms_per_stop: float | None = None
    found: float = 0.0
    found_well: float = 0.0
    visible: int = 0
    false: int = 0
    stops: int = 0
    odometry_ape_m: float | None = None
    located_ape_m: float | None = None
    error: str | None = None
    key: str

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def run_trip(trip: Trip) -> list[Row]:
    """Drives once and lets every engine see. Whatever goes wrong goes wrong for this drive alone."""
    from flysim.studies.compare.compare import compare

    try:
        comparison = compare(trip.plan, trip.engines, seed=trip.seed, renderer=trip.renderer)
    except FlysimError as error:
        return _failed(trip, str(error))
    except Exception as error:  # a study of hours does not end by one world
        return _failed(trip, f"{type(error).__name__}: {error}")
    points = {
        name: sum(len(one.swarm.points) for one in findings.seen) for name, findings in comparison.findings.items()
    }
    return [_row(trip, name, report, points[name]) for name, report in comparison.reports.items()]


def _row(trip: Trip, engine: str, report: Report, points: int) -> Row:
    figures = pooled([report])
    seen = [o for o in report.obstacles if o.visible]
    return Row(
        level=trip.level,
        scenario=trip.scenario,
        seed=trip.seed,
        engine=engine,
        f1=report.f1,
        well_f1=report.well["f1"],
        center_error_max_m=report.center_visible_error.max,
        size_error_max_m=report.size_visible_error.max,
        points=points,
        ms_per_stop=figures["ms_per_stop"],
        found=sum(o.share for o in seen),
        found_well=sum(o.share for o in seen if o.found_well),
        visible=len(seen),
        false=report.false_obstacles,
        stops=len(report.stops),
        odometry_ape_m=report.whereabouts.get("odometry", {}).get("ape_m"),
        located_ape_m=report.whereabouts.get("located", {}).get("ape_m"),
        key=trip.key(engine),
    )


def _failed(trip: Trip, why: str) -> list[Row]:
    return [
        Row(
            level=trip.level,
            scenario=trip.scenario,
            seed=trip.seed,
            engine=engine,
            error=why.split("\n")[0],
            key=trip.key(engine),
        )
        for engine in trip.engines
    ]
