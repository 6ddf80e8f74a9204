"""The data files of a run folder, for people and for other programs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.plain_data import plain_data
from flysim.evaluate.track import whole_track
from flysim.geometry.frames import Array
from flysim.products.cloud import FlyCloud
from flysim.products.findings import Findings
from flysim.products.obstacle import Obstacle
from flysim.products.tables import parquet, ply
from flysim.record.run_folder import REPORT
from flysim.truth.truth import Truth

# column: (type, unit, meaning)
FLY_COLUMNS = {
    "x": ("float64", "m", "position in the world frame, as far as odometry knows it"),
    "y": ("float64", "m", "position in the world frame, as far as odometry knows it"),
    "z": ("float64", "m", "height above the ground"),
    "fitness": ("float32", "1", "unshared fitness at the last generation"),
    "stop": ("int32", "1", "index of the stop that saw the fly"),
    "u": ("float32", "px", "column in the left image of that stop, pixel centres at integers"),
    "v": ("float32", "px", "row in the left image"),
    "u_right": ("float32", "px", "column in the right image"),
    "v_right": ("float32", "px", "row in the right image"),
    "r": ("uint8", "1", "red of the left pixel"),
    "g": ("uint8", "1", "green of the left pixel"),
    "b": ("uint8", "1", "blue of the left pixel"),
}


def write_files(
    folder: Path,
    findings: Findings,
    truth: Truth | None,
    report: Mapping[str, Any] | None,
    config: Mapping[str, Any],
) -> None:
    """Write every data file of a run: those about the truth where it is known, the report where there is one.

    Args:
        folder: an existing one.
        findings: what was found.
        truth: of the same frames, or None.
        report: `Report.to_json()`, or None.
        config: all parameters of the run, seed, commit and versions, as JSON.

    Raises:
        OSError: the disk is full or refuses.
    """
    _write_json(folder / "config.json", config)
    if report is not None:
        _write_json(folder / REPORT, report)
    _write_json(folder / "obstacles.json", [obstacle_json(obstacle) for obstacle in findings.obstacles])
    # Made in memory first, so that a full disk is an OSError in Python and not in a library's thread.
    sequence, track = findings.sequence, whole_track(findings, truth)
    (folder / "flies.parquet").write_bytes(parquet_bytes(findings.cloud, sequence.name, sequence.seed))
    (folder / "flies.ply").write_bytes(ply_bytes(findings.cloud))
    (folder / "trajectory_odom.tum").write_text(tum_text(track.times, track.believed), encoding="ascii")
    if track.true is not None:
        (folder / "trajectory_true.tum").write_text(tum_text(track.times, track.true), encoding="ascii")
    if track.located is not None and findings.located is not None:
        name = f"trajectory_{findings.located.by}.tum"
        (folder / name).write_text(tum_text(track.times, track.located), encoding="ascii")


def load() -> None:
    """Import pyarrow, which takes a while."""
    import_module("pyarrow.parquet")


def obstacle_json(obstacle: Obstacle) -> dict[str, Any]:
    """Shape, centre, size and diameter [m], heading [degrees] and number of flies of an estimated obstacle."""
    return {
        "shape": obstacle.shape,
        "center": [round(float(v), 6) for v in obstacle.center],
        "size": [round(float(v), 6) for v in obstacle.size],
        "diameter": None if obstacle.diameter is None else round(obstacle.diameter, 6),
        "yaw_deg": round(math.degrees(obstacle.yaw), 6),
        "flies": len(obstacle.flies),
    }


def fly_columns(cloud: FlyCloud) -> dict[str, NDArray[Any]]:
    """The cloud by columns, in the order and types of `FLY_COLUMNS`."""
    points, uv, uv_right, rgb = (
        np.reshape(a, (-1, k)) for a, k in ((cloud.points, 3), (cloud.uv, 2), (cloud.uv_right, 2), (cloud.rgb, 3))
    )
    values = (*points.T, cloud.fitness, cloud.stop, *uv.T, *uv_right.T, *rgb.T)
    return {
        name: np.ascontiguousarray(column, dtype=spec[0])
        for (name, spec), column in zip(FLY_COLUMNS.items(), values, strict=True)
    }


def parquet_bytes(cloud: FlyCloud, scenario: str, seed: int, *, metric: bool = True) -> bytes:
    """A Parquet file of the flies; units and meanings are in the metadata of its columns.

    Where lengths are not `metric` their unit is "1": they are true but for a scale that nobody knows.
    """
    return parquet(
        fly_columns(cloud),
        about={"frame": "world", "scenario": scenario, "seed": str(seed)},
        about_columns={
            name: {"unit": unit if metric or unit != "m" else "1", "meaning": meaning}
            for name, (_, unit, meaning) in FLY_COLUMNS.items()
        },
        compression="zstd",
    )


def ply_bytes(cloud: FlyCloud, *, metric: bool = True) -> bytes:
    """A binary little-endian PLY of the flies with their colours, fitness and stop; its comment names the unit."""
    columns = fly_columns(cloud)
    names = {"x": "x", "y": "y", "z": "z", "r": "red", "g": "green", "b": "blue", "fitness": "fitness", "stop": "stop"}
    exact = {np.dtype(np.float64): np.float32, np.dtype(np.int64): np.int32}  # what PLY's readers take
    cast = {name: columns[key].astype(exact.get(columns[key].dtype, columns[key].dtype)) for key, name in names.items()}
    return ply(cast, f"flies of flysim: world frame, {'metres' if metric else 'no unit: nobody knows the scale'}")


def tum_text(times: Array, poses: Array) -> str:
    """Lines `t x y z qx qy qz qw` of times `[n]` [s] and planar poses `[n, 3]` x, y [m], yaw [rad]."""
    half = poses[:, 2] / 2.0
    lines = (
        f"{t:.6f} {x:.6f} {y:.6f} 0.000000 0.000000 0.000000 {qz:.9f} {qw:.9f}\n"
        for t, (x, y, _), qz, qw in zip(times, poses, np.sin(half), np.cos(half), strict=True)
    )
    return "# t[s] x[m] y[m] z[m] qx qy qz qw of base_link\n" + "".join(lines)


def _write_json(path: Path, value: Any) -> None:
    path.write_text(
        json.dumps(plain_data(value), indent=2, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8"
    )
