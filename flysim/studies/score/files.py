"""The files that another algorithm left: one a frame, in the order of their names, or one with obstacles."""

from __future__ import annotations

import glob
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flysim.errors import FlysimError
from flysim.foreign.data import read_json
from flysim.foreign.folder import names_in
from flysim.geometry.plan_view import fold_yaw
from flysim.plain import shown, shown_path
from flysim.products.obstacle import Obstacle

POINTS = (".ply", ".npy", ".txt", ".xyz", ".csv")
DISPARITIES = (".pfm", ".png", ".npy")
SHAPES = ("box", "cylinder", "sphere", "other")
MAX_FILES = 100_000
MAX_BYTES = 2**24
MAX_OBSTACLES = 10_000
LARGEST = 1e6  # [m] of a centre or a size: what is beyond is a typing error


def found_files(named: Sequence[Path], endings: tuple[str, ...]) -> list[Path]:
    """The files that are meant: those of a folder that end so, those of a pattern, or those named.

    Raises:
        FlysimError: there is none.
    """
    files: list[Path] = []
    for path in named:
        if path.is_dir():
            files += [path / name for name in names_in(path, endings, MAX_FILES)]
        elif any(sign in str(path) for sign in "*?["):
            files += [Path(name) for name in sorted(glob.glob(str(path)))[:MAX_FILES]]  # noqa: PTH207 (absolute ones)
        else:
            files.append(path)
    if not files:
        raise FlysimError(f"{shown_path(named[0])}: no file that ends with {', '.join(endings)}.")
    return files


def one_a_frame(files: list[Path], rows: Sequence[int], frames: int) -> list[Path]:
    """The files of some frames: as many as there are frames, or as many as are asked for.

    Raises:
        FlysimError: there are more or less.
    """
    if len(files) == frames:
        return [files[row] for row in rows]
    if len(files) == len(rows):
        return files
    raise FlysimError(f"{len(files)} files for {frames} frames: give one a frame, in the order of their names.")


def read_obstacles(path: Path) -> tuple[Obstacle, ...]:
    """Obstacles of a JSON list of `{"center": [x, y, z], "size": [l, w, h]}` [m], with `yaw_deg` and `shape` if known.

    Raises:
        FlysimError: the file cannot be read, or one of them is none.
    """
    data = read_json(path, "list of obstacles", MAX_BYTES)
    where = shown_path(path)
    if isinstance(data, dict):
        data = data.get("obstacles")
    if not isinstance(data, list) or len(data) > MAX_OBSTACLES:
        raise FlysimError(f"{where}: no list of at most {MAX_OBSTACLES} obstacles.")
    found = []
    for k, one in enumerate(data, start=1):
        try:
            found.append(_obstacle(one))
        except (LookupError, TypeError, ValueError, AttributeError) as error:
            raise FlysimError(f"{where}: obstacle {k}: {error}. Give center and size, three metres each.") from None
    return tuple(found)


def _obstacle(data: dict[str, Any]) -> Obstacle:
    center, size = (np.array([float(x) for x in data[name]], np.float64) for name in ("center", "size"))
    shape, yaw = data.get("shape") or "box", math.radians(float(data.get("yaw_deg") or 0.0))
    if center.shape != (3,) or size.shape != (3,) or not np.isfinite([*center, *size, yaw]).all():
        raise ValueError("center, size or yaw_deg is not finite, or has not three numbers")
    if np.abs([*center, *size]).max() > LARGEST or size.min() < 0.0:
        raise ValueError(f"a size is below 0, or a length beyond {LARGEST:g} m")
    if shape not in SHAPES:
        raise ValueError(f"no shape {shown(str(shape))}: {', '.join(SHAPES)}")
    if size[1] > size[0]:
        size, yaw = size[[1, 0, 2]], yaw + math.pi / 2.0
    return Obstacle(
        shape=shape, center=center, size=size, yaw=fold_yaw(math.remainder(yaw, math.tau)), flies=np.empty(0, np.int64)
    )
