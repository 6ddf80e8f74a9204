"""Two studies of wheels that do not tell the truth: what it costs to believe them, and what flies mend of it."""

from __future__ import annotations

from typing import Any

from flysim.studies.sweep.study import Study

LEVELS = (0.0, 0.5, 1.0, 2.0, 3.0)


def _drift(level: float) -> dict[str, Any]:
    """As many degrees a metre as per cent of the way."""
    return {"odometry.distance_std": round(level / 100.0, 6), "odometry.yaw_std_deg_per_m": level}


ODOMETRY = Study(
    what="odometry astray, believed",
    unit="% of the way, and degrees per m",
    levels=LEVELS,
    settings=lambda level: {**_drift(level), "localisation": "odometry"},
)
LOCALISATION = Study(
    what="odometry astray, flies believed",
    unit="% of the way, and degrees per m",
    levels=LEVELS,
    settings=lambda level: {**_drift(level), "localisation": "flies"},
)
