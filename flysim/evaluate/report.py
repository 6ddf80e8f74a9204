"""The report of a run: what the flies found beside what stands there. Its JSON keys are stable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flysim.common.plain_data import plain_data
from flysim.evaluate.scores import ObstacleReport, Scores, Spread, StopReport, SurfaceReport
from flysim.evaluate.table import table

DIGITS = 6  # of every figure in the JSON: micrometres, so that the last bits of a sum do not show


@dataclass(frozen=True, slots=True, kw_only=True)
class Report(Scores):
    """What a run found beside the truth. `print(report)` shows a table; `to_json` has every figure.

    Its attributes are those of `scores.Scores`.
    """

    def to_json(self) -> dict[str, Any]:
        """Plain lists, dicts, numbers and None, ready for `json.dumps`: never a NaN, units in the keys."""
        return plain_data(
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
                "well": self.well,
                **{f"{name}_m": _write(getattr(self, name), SPREAD_KEYS) for name in (*SPREADS, *NEW_SPREADS)},
                **{name: getattr(self, name) for name in NEW_SHARES},
                "surface": _write(self.surface, SURFACE_KEYS),
                "time_s": self.time,
                "versions": self.versions,
                "texture": self.texture,
                "warnings": self.warnings,
                # Of a perfect drive nothing is said, so that its report stays as it was.
                **{name: getattr(self, name) for name in DISTURBED if getattr(self, name)},
                **({"failed": self.failed} if self.failed else {}),
                **({"whereabouts": self.whereabouts} if self.whereabouts else {}),
                "alignment": self.alignment,
                "plain": self.plain,
                **({"explained": self.explained} if self.explained else {}),
            },
            digits=DIGITS,
        )

    @classmethod
    def from_json(cls, report: dict[str, Any]) -> Report:
        """The report that `to_json` wrote.

        Raises:
            KeyError: a key is missing.
        """
        same: dict[str, Any] = {key: report[key] for key in SAME_KEYS}
        same |= {name: report.get(name) for name in NEW_SHARES}
        told = [*SPREADS, *(name for name in NEW_SPREADS if f"{name}_m" in report)]
        spreads: dict[str, Any] = {name: Spread(**_read(report[f"{name}_m"], SPREAD_KEYS)) for name in told}
        return cls(
            **same,
            **spreads,
            stops=tuple(StopReport(**_read(stop, STOP_KEYS)) for stop in report["stops"]),
            obstacles=tuple(ObstacleReport(**_read(obstacle, OBSTACLE_KEYS)) for obstacle in report["obstacles"]),
            surface=SurfaceReport(**_read(report["surface"], SURFACE_KEYS)),
            time=report["time_s"],
            well=dict(report.get("well", {})),  # reports of older versions have none
            texture=report.get("texture"),  # reports of 0.1.0 have neither
            warnings=tuple(report.get("warnings", ())),
            failed=tuple(report.get("failed", ())),
            sensors=dict(report.get("sensors", {})),
            calibration=dict(report.get("calibration", {})),
            light=dict(report.get("light", {})),
            odometry=dict(report.get("odometry", {})),
            whereabouts=dict(report.get("whereabouts", {})),
            alignment=report.get("alignment"),
            plain=report.get("plain"),
            explained=dict(report.get("explained", {})),
        )

    def __str__(self) -> str:
        return table(self)

    def text(self, width: int | None) -> str:
        """What a person reads, on lines of `width` characters; None: as many as it takes."""
        return table(self, width)


# Attributes that are written as they are.
SAME_KEYS = (
    *("scenario", "seed", "renderer", "engine", "world", "status", "blocked", "stops_planned"),
    *("false_obstacles", "structure_obstacles", "precision", "recall", "f1", "versions"),
)
DISTURBED = ("sensors", "calibration", "light", "odometry")
SPREADS = ("center_error", "center_visible_error", "size_error", "size_visible_error")
NEW_SPREADS = ("height_error", "height_visible_error")  # which reports of older versions lack, as they do NEW_SHARES
NEW_SHARES = ("shape_accuracy", "iou_plan", "iou_3d")

# Attribute -> JSON key, in the order they are written. The JSON has the unit in the key, the record in its
# docstring.
SPREAD_KEYS = {"median": "median", "p95": "p95", "max": "max"}
STOP_KEYS = {name: name for name in ("index", "commanded", "odometry", "true", "iterations", "converged")} | {
    "time": "time_s"
}
OBSTACLE_KEYS = {
    "name": "name",
    "detected": "detected",
    "visible": "visible",
    "shape_true": "shape_true",
    "shape_estimated": "shape_estimated",
    "center_error": "center_error_m",
    "center_visible_error": "center_visible_error_m",
    "size_true": "size_true_m",
    "size_visible": "size_visible_m",
    "size_estimated": "size_estimated_m",
    "size_error": "size_error_m",
    "size_visible_error": "size_visible_error_m",
    "yaw_error_deg": "yaw_error_deg",
    "found_well": "found_well",
    "share": "share",
    "pieces": "pieces",
}
NEW_KEYS = ("found_well", "p95", "share", "pieces")  # which reports of older versions lack
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
    got = {name: written[key] for name, key in keys.items() if key in written or key not in NEW_KEYS}
    return {name: tuple(value) if isinstance(value, list) else value for name, value in got.items()}
