"""Poses as lines of text: KITTI's twelve numbers, TUM's time, place and quaternion. All digits are written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flysim.datasets.layout import MAX_FRAMES, MAX_TEXT, plain_line
from flysim.errors import FlysimError
from flysim.foreign.files import read_text
from flysim.geometry.frames import Array, from_quaternion_xyzw, quaternion_xyzw, se3
from flysim.plain import shown, shown_path


def kitti_line(T: Array) -> str:
    """The first three rows of a pose, row by row."""
    return plain_line(T[:3])


def tum_line(time: float, T: Array) -> str:
    """Time [s], x y z [m], and the quaternion x y z w."""
    return plain_line([time, *T[:3, 3], *quaternion_xyzw(T[:3, :3])])


def read_rows(path: Path, columns: int | Sequence[int], what: str) -> Array:
    """`[n, columns]` finite numbers, a row a line; empty lines, and those that begin with a #, are passed over.

    Raises:
        FlysimError: the file cannot be read, or a line has other than so many numbers, or one that is not finite.
    """
    allowed = (columns,) if isinstance(columns, int) else tuple(columns)
    rows = []
    for k, line in enumerate(read_text(path, what, MAX_TEXT).split("\n"), start=1):
        words = line.replace(",", " ").split()
        if not words or words[0].startswith("#"):
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            row = []
        if len(row) not in allowed or not np.isfinite(row).all():
            wanted = " or ".join(map(str, allowed))
            raise FlysimError(f"{shown_path(path)}: line {k} is no row of {wanted} finite numbers: {shown(line)}.")
        rows.append(row)
        if len(rows) > MAX_FRAMES:
            raise FlysimError(f"{shown_path(path)}: more than {MAX_FRAMES} rows; that many are not read.")
    if len({len(row) for row in rows}) > 1:
        raise FlysimError(f"{shown_path(path)}: its rows have not all as many numbers.")
    return np.array(rows, np.float64).reshape(len(rows), -1 if rows else allowed[0])


def read_kitti_poses(path: Path) -> list[Array]:
    """`[4, 4]` a line.

    Raises:
        FlysimError: as `read_rows`, or a line holds no rotation.
    """
    rows = read_rows(path, 12, "poses")
    return [_rigid(np.vstack([row.reshape(3, 4), (0.0, 0.0, 0.0, 1.0)]), path, k) for k, row in enumerate(rows, 1)]


def read_tum_poses(path: Path) -> tuple[Array, list[Array]]:
    """`[n]` times [s] and a `[4, 4]` a line.

    Raises:
        FlysimError: as `read_rows`, or a quaternion is 0.
    """
    rows = read_rows(path, 8, "trajectory")
    return rows[:, 0], [posed(row[1:4], row[4:8], path, k) for k, row in enumerate(rows, 1)]


def posed(place: Array, xyzw: Array, path: Path, row: int) -> Array:
    """`[4, 4]` of a place and a quaternion.

    Raises:
        FlysimError: the quaternion is far from one of length 1.
    """
    if not 0.9 < np.linalg.norm(xyzw) < 1.1:
        raise FlysimError(f"{shown_path(path)}: row {row} has a quaternion of length {np.linalg.norm(xyzw):g}, not 1.")
    return se3(from_quaternion_xyzw(xyzw), place)


def nearest(times: Array, wanted: Sequence[float], most: float, path: Path) -> list[int]:
    """Of each wanted time the row whose time is nearest.

    Args:
        times: `[n]` [s] of the rows.
        wanted: [s]
        most: [s] by which they may differ.
        path: of the rows, for errors.

    Raises:
        FlysimError: a wanted time has no row so near.
    """
    found = []
    for time in wanted:
        k = int(np.abs(times - time).argmin()) if len(times) else -1
        if k < 0 or abs(times[k] - time) > most:
            raise FlysimError(f"{shown_path(path)}: no pose within {most:g} s of the picture at {time:.6f} s.")
        found.append(k)
    return found


def _rigid(T: Array, path: Path, row: int) -> Array:
    U, _, Vt = np.linalg.svd(T[:3, :3])
    near = U @ Vt
    if np.linalg.det(near) < 0.0 or np.abs(near - T[:3, :3]).max() > 1e-3:
        raise FlysimError(f"{shown_path(path)}: row {row} holds no rotation.")
    # What is one to its last digits stays as it is written.
    return T if np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max() < 1e-9 else se3(near, T[:3, 3])
