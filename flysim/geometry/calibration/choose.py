"""Which format a calibration file has, by what is in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flysim.errors import FlysimError
from flysim.foreign.data import parse_json
from flysim.foreign.files import read_text
from flysim.foreign.opencv_storage import MAX_BYTES as MAX_MAPS_BYTES
from flysim.geometry.calibration.calibration import MAX_CALIB_BYTES, Calibration, LevelPair, number, whole_sides
from flysim.geometry.calibration.euroc import euroc
from flysim.geometry.calibration.kitti import kitti
from flysim.geometry.calibration.middlebury import middlebury, middlebury_2006
from flysim.geometry.calibration.opencv import opencv
from flysim.geometry.calibration.ros import ros
from flysim.plain import shown_path

FORMATS = "Middlebury, KITTI, ROS camera_info, OpenCV, EuRoC"


def read_calibration(
    files: Sequence[str | Path], *, picture: str | Path | None = None, width: int | None = None
) -> Calibration:
    """The calibration of one file, or of two: one an eye, the left one first, or intrinsics and extrinsics.

    Args:
        files: Middlebury's calib.txt or dmin.txt, KITTI's calib_cam_to_cam.txt or calib.txt, OpenCV's FileStorage,
            EuRoC's two sensor.yaml, ROS's two camera_info.
        picture: the left one; the folder of KITTI's tells which cameras took it.
        width: of the pictures [px]; a dmin.txt needs it.

    Raises:
        FlysimError: a file cannot be read, is of no known format, or lacks a figure.
    """
    paths = [Path(file) for file in files]
    if not 1 <= len(paths) <= 2:
        raise FlysimError(f"give one calibration file, or two: one an eye, got {len(paths)}.")
    wheres = [shown_path(path) for path in paths]
    texts = [read_text(path, "calibration", MAX_MAPS_BYTES) for path in paths]
    kinds = [kind_of(text) for text in texts]
    if kinds[0] != "OpenCV" and any(len(text) > MAX_CALIB_BYTES for text in texts):
        raise FlysimError(f"{wheres[0]}: cannot read the calibration: it is larger than {MAX_CALIB_BYTES} bytes.")
    if None in kinds:
        raise FlysimError(f"{wheres[kinds.index(None)]}: no calibration of a known format: {FORMATS} are read.")
    if len(set(kinds)) > 1:
        raise FlysimError(f"{wheres[0]} is of {kinds[0]}, {wheres[1]} of {kinds[1]}: give two of one format.")
    kind, pair = str(kinds[0]), len(paths) == 2
    if kind in ("EuRoC", "ROS") and not pair:
        raise FlysimError(f"{wheres[0]}: {kind} has one file an eye: give --calib twice, the left one first.")
    if kind in ("Middlebury", "dmin", "KITTI", "plain") and pair:
        raise FlysimError(f"{wheres[1]}: one file of {kind} is for both eyes: leave the second one out.")
    left = None if picture is None else Path(picture)
    if kind == "Middlebury":
        return middlebury(texts[0], wheres[0])
    if kind == "dmin":
        if width is None:
            raise FlysimError(f"{wheres[0]}: a dmin.txt needs the width of its pictures.")
        return middlebury_2006(texts[0], wheres[0], width)
    if kind == "KITTI":
        return kitti(texts[0], wheres[0], left)
    if kind == "plain":
        return plain_numbers(parse_json(texts[0]), wheres[0])
    if kind == "EuRoC":
        return euroc(texts[0], texts[1], (wheres[0], wheres[1]))
    if kind == "ROS":
        return ros((texts[0], texts[1]), (wheres[0], wheres[1]))
    return opencv(texts, wheres)


def kind_of(text: str) -> str | None:
    """The format of a calibration's text; None for none that is known."""
    start = text.lstrip()[:400]
    if start.startswith("%YAML:1") or re.search("opencv-(nd-)?matrix", text) or "opencv_storage" in start:
        return "OpenCV"
    if re.search(r"^[^\S\n]*cam0[^\S\n]*=", text, re.MULTILINE) or re.search(r"^\s*baseline\s*=", text, re.MULTILINE):
        return "Middlebury"
    if re.search(r"^[^\S\n]*(P[0-3]|P_rect_0[0-3]):", text, re.MULTILINE):
        return "KITTI"
    if re.search(r"^[^\S\n]*T_BS\s*:", text, re.MULTILINE):
        return "EuRoC"
    if re.search(r"^[^\S\n]*(projection_matrix|rectification_matrix|distortion_model|K|P)\s*:", text, re.MULTILINE):
        return "ROS"
    if start.startswith("{"):
        return "plain"
    return "dmin" if re.fullmatch(r"\s*\d{1,4}\s*", text) else None


def plain_numbers(data: Any, where: str) -> Calibration:
    """The calibration of a JSON object with fx, cx, cy, doffs and baseline_mm or baseline, ndisp, width, height.

    What is null is not known; without fx and a baseline the pair is measured in pixels alone.

    Raises:
        FlysimError: a value is no number.
    """
    if not isinstance(data, dict):
        raise FlysimError(f"{where}: a calibration in JSON is an object with fx, cx, cy, doffs, baseline_mm.")
    names = ("fx", "fy", "cx", "cy", "doffs", "baseline_mm", "baseline", "ndisp")
    given = {name: number(data[name]) for name in names if data.get(name) is not None}
    wrong = [name for name, value in given.items() if not np.isfinite(value)]
    if wrong:
        raise FlysimError(f"{where}: {wrong[0]} must be a finite number, got {str(data[wrong[0]])[:40]!r}.")
    size = whole_sides([data.get("width"), data.get("height")], where)
    ndisp = given.get("ndisp")
    disparities = (0.0, ndisp - 1.0) if ndisp is not None and ndisp > 1.0 else None
    baseline = given["baseline_mm"] / 1000.0 if "baseline_mm" in given else given.get("baseline")
    if "fx" not in given or baseline is None:
        return Calibration(name="JSON", disparities=disparities, metric=False)
    if not (given["fx"] > 0.0 and baseline > 0.0):
        raise FlysimError(f"{where}: fx and the baseline must be > 0.")
    fx, fy = given["fx"], given.get("fy", given["fx"])
    middle = [None if side is None else (side - 1) / 2.0 for side in size]
    cx, cy = given.get("cx", middle[0]), given.get("cy", middle[1])
    if cx is None or cy is None:
        raise FlysimError(f"{where}: needs cx and cy, or width and height.")
    left = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    right = left.copy()
    right[0, 2] += given.get("doffs", 0.0)
    return Calibration(
        name="JSON", level=LevelPair(left=left, right=right, baseline=baseline, size=size), disparities=disparities
    )
