"""The report of a run: what the flies found beside what stands there. Its JSON keys are stable."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flysim.evaluate.table import table

DIGITS = 6  # of every figure in the JSON: micrometres, so that the last bits of a sum do not show
TAUS = ("0.01", "0.02", "0.05")  # [m] keys of the surface figures

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Median and greatest of some errors; None where there are none."""

    median: float | None
    max: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StopReport:
    """One stop: poses are (x, y, yaw) in m and rad.

    Attributes:
        time: [s] by part: render, evolve, obstacles. Obstacles are found once over all stops; a stop has an
            equal share.
    """

    index: int
    commanded: Triple
    odometry: Triple
    true: Triple
    iterations: int
    converged: bool
    time: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObstacleReport:
    """One true obstacle and the estimate that stands for it, lengths in m; None where there is none.

    Attributes:
        visible: both cameras saw enough of it; if not, it counts neither as found nor as missed.
        center_error: distance of the centres on the ground, to the whole obstacle's.
        center_visible_error: the same to the centre of what was visible of it.
        size_true: length, width, height above the ground; the other sizes are along the same axes.
        size_visible: of what was visible.
        size_error: estimated - true.
        size_visible_error: estimated - visible.
        yaw_error_deg: in [0, 45]; None for what is round.
    """

    name: str
    detected: bool
    visible: bool
    center_error: float | None
    center_visible_error: float | None
    size_true: Triple
    size_visible: Triple | None
    size_estimated: Triple | None
    size_error: Triple | None
    size_visible_error: Triple | None
    yaw_error_deg: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceReport:
    """Flies against the visible true surface [m]; the dicts are by threshold."""

    accuracy_median: float | None
    accuracy_p90: float | None
    precision: dict[str, float]
    completeness: dict[str, float]
    f_score: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """What a run found beside the truth. `print(report)` shows a table; `to_json` has every figure.

    Attributes:
        blocked: None, or where and by what the drive was ended early.
        false_obstacles: estimates that stand for nothing, those on ground or walls apart.
        structure_obstacles: estimates that lie on ground or walls.
        center_error, center_visible_error: over the visible obstacles that were detected.
        size_error, size_visible_error: over all axes of those, without sign.
        time: [s] by part.
        versions: of the packages that made the figures.
        texture: "speckle" where what had no texture was dressed in one, else None.
        warnings: what was skipped of the world's file and left out of the path, one sentence each.
    """

    scenario: str
    seed: int
    renderer: str
    engine: str
    world: str
    status: str
    blocked: str | None
    stops_planned: int
    stops: tuple[StopReport, ...]
    obstacles: tuple[ObstacleReport, ...]
    false_obstacles: int
    structure_obstacles: int
    precision: float
    recall: float
    f1: float
    center_error: Spread
    center_visible_error: Spread
    size_error: Spread
    size_visible_error: Spread
    surface: SurfaceReport
    time: dict[str, float]
    versions: dict[str, str] = field(default_factory=dict)
    texture: str | None = None
    warnings: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain lists, dicts, numbers and None, ready for `json.dumps`: never a NaN, units in the keys."""
        return _plain(
            {
                "scenario": self.scenario,
                "seed": self.seed,
                "renderer": self.renderer,
                "engine": self.engine,
                "world": self.world,
                "status": self.status,
                "blocked": self.blocked,
                "stops_planned": self.stops_planned,
                "stops": [_write(stop, STOP_KEYS) for stop in self.stops],
                "obstacles": [_write(obstacle, OBSTACLE_KEYS) for obstacle in self.obstacles],
                "false_obstacles": self.false_obstacles,
                "structure_obstacles": self.structure_obstacles,
                "precision": self.precision,
                "recall": self.recall,
                "f1": self.f1,
                **{f"{name}_m": _write(getattr(self, name), SPREAD_KEYS) for name in SPREADS},
                "surface": _write(self.surface, SURFACE_KEYS),
                "time_s": self.time,
                "versions": self.versions,
                "texture": self.texture,
                "warnings": self.warnings,
            }
        )

    @classmethod
    def from_json(cls, report: dict[str, Any]) -> Report:
        """The report that `to_json` wrote.

        Raises:
            KeyError: a key is missing.
        """
        same: dict[str, Any] = {key: report[key] for key in SAME_KEYS}
        spreads: dict[str, Any] = {name: Spread(**_read(report[f"{name}_m"], SPREAD_KEYS)) for name in SPREADS}
        return cls(
            **same,
            **spreads,
            stops=tuple(StopReport(**_read(stop, STOP_KEYS)) for stop in report["stops"]),
            obstacles=tuple(ObstacleReport(**_read(obstacle, OBSTACLE_KEYS)) for obstacle in report["obstacles"]),
            surface=SurfaceReport(**_read(report["surface"], SURFACE_KEYS)),
            time=report["time_s"],
            texture=report.get("texture"),  # reports of 0.1.0 have neither
            warnings=tuple(report.get("warnings", ())),
        )

    def __str__(self) -> str:
        return table(self)


# Attributes that are written as they are.
SAME_KEYS = (
    *("scenario", "seed", "renderer", "engine", "world", "status", "blocked", "stops_planned"),
    *("false_obstacles", "structure_obstacles", "precision", "recall", "f1", "versions"),
)
SPREADS = ("center_error", "center_visible_error", "size_error", "size_visible_error")

# Attribute -> JSON key, in the order they are written. The JSON has the unit in the key, the record in its
# docstring.
SPREAD_KEYS = {"median": "median", "max": "max"}
STOP_KEYS = {name: name for name in ("index", "commanded", "odometry", "true", "iterations", "converged")} | {
    "time": "time_s"
}
OBSTACLE_KEYS = {
    "name": "name",
    "detected": "detected",
    "visible": "visible",
    "center_error": "center_error_m",
    "center_visible_error": "center_visible_error_m",
    "size_true": "size_true_m",
    "size_visible": "size_visible_m",
    "size_estimated": "size_estimated_m",
    "size_error": "size_error_m",
    "size_visible_error": "size_visible_error_m",
    "yaw_error_deg": "yaw_error_deg",
}
SURFACE_KEYS = {
    "accuracy_median": "accuracy_median_m",
    "accuracy_p90": "accuracy_p90_m",
    "precision": "precision",
    "completeness": "completeness",
    "f_score": "f_score",
}


def _write(record: object, keys: dict[str, str]) -> dict[str, Any]:
    return {key: getattr(record, name) for name, key in keys.items()}


def _read(written: dict[str, Any], keys: dict[str, str]) -> dict[str, Any]:
    got = {name: written[key] for name, key in keys.items()}
    return {name: tuple(value) if isinstance(value, list) else value for name, value in got.items()}


def _plain(value: Any) -> Any:
    """The same in types JSON has: floats rounded, -0.0 made 0.0, what is not finite made None."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return round(float(value), DIGITS) + 0.0 if math.isfinite(value) else None
    return value
