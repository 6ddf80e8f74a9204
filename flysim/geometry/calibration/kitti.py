"""KITTI's calibrations: calib_cam_to_cam.txt of the raw recordings, calib.txt of odometry and of the object sets.

Geiger, Lenz, Stiller and Urtasun, "Vision meets robotics: the KITTI dataset", IJRR 2013. Cameras 0 and 1 are grey,
2 and 3 colour; even ones are the left eyes. Lengths are in metres.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import Calibration, LevelPair, RawCamera, numbers, rotation, whole_sides
from flysim.geometry.frames import inverse, se3

GREY, COLOUR = 0, 2


def left_camera(picture: Path | None, known: set[int]) -> int:
    """The number of the left camera that a picture is of: by the folder it lies in, else colour where there is one.

    Args:
        picture: its path, as `.../image_02/data/0000000000.png` or `.../image_2/000000.png`.
        known: the cameras that the calibration has.
    """
    for part in reversed(picture.parts if picture is not None else ()):
        found = re.fullmatch(r"image_0?([0-3])", part)
        if found:
            return int(found[1]) // 2 * 2
    return COLOUR if {COLOUR, COLOUR + 1} <= known else GREY


def kitti(text: str, where: str, picture: Path | None = None) -> Calibration:
    """The calibration of a KITTI file of either layout.

    Args:
        text: of the file.
        where: it is, for errors.
        picture: the left one, whose folder tells which cameras took the pair.

    Raises:
        FlysimError: a line is missing or nonsense.
    """
    lines = dict(re.findall(r"^[^\S\n]*(\w+):[^\S\n]*(.*?)[^\S\n]*$", text, re.MULTILINE))
    raw = any(name.startswith("P_rect_") for name in lines)
    pattern = r"P_rect_0([0-3])" if raw else r"P([0-3])"
    known = {int(found[1]) for name in lines if (found := re.fullmatch(pattern, name))}
    left = left_camera(picture, known)
    if not {left, left + 1} <= known:
        raise FlysimError(f"{where}: no line '{'P_rect_0' if raw else 'P'}{left}' or of its right eye {left + 1}.")
    return _raw(lines, left, where) if raw else _level_only(lines, left, where)


def _level_only(lines: dict[str, str], left: int, where: str) -> Calibration:
    return Calibration(name="KITTI odometry", level=_level(lines, "P{}", left, where))


def _level(lines: dict[str, str], name: str, left: int, where: str) -> LevelPair:
    names = [name.format(camera) for camera in (left, left + 1)]
    P = [numbers(lines[one], 12, one, where).reshape(3, 4) for one in names]
    offsets = [p[0, 3] / p[0, 0] if p[0, 0] else 0.0 for p in P]
    baseline = offsets[0] - offsets[1]
    if not baseline > 0.0:
        raise FlysimError(f"{where}: {names[1]} is not to the right of {names[0]}: their baseline is {baseline:g} m.")
    return LevelPair(left=P[0][:, :3], right=P[1][:, :3], baseline=float(baseline))


def _raw(lines: dict[str, str], left: int, where: str) -> Calibration:
    """Both: rectified pictures (the `sync` recordings), and those as taken (`extract`)."""
    level = _level(lines, "P_rect_0{}", left, where)
    names = [f"0{left}", f"0{left + 1}"]
    sizes = [_size(lines, f"S_rect_{one}", where) for one in names]
    level = LevelPair(left=level.left, right=level.right, baseline=level.baseline, size=sizes[0])
    if not all(f"{kind}_{one}" in lines for one in names for kind in ("K", "D", "R", "T", "R_rect")):
        return Calibration(name="KITTI raw", level=level)

    def read(kind: str, one: str, count: int) -> np.ndarray:
        return numbers(lines[f"{kind}_{one}"], count, f"{kind}_{one}", where)

    lenses = [
        RawCamera(
            K=read("K", one, 9).reshape(3, 3),
            distortion=read("D", one, 5),
            size=_size(lines, f"S_{one}", where),
        )
        for one in names
    ]
    # R, T: from camera 0, rotations written with few digits.
    T_camera_0 = [se3(rotation(read("R", one, 9), f"R_{one}", where), read("T", one, 3)) for one in names]
    turns = [rotation(read("R_rect", one, 9), f"R_rect_{one}", where) for one in names]
    return Calibration(
        name="KITTI raw",
        lenses=(lenses[0], lenses[1]),
        T_right_left=T_camera_0[1] @ inverse(T_camera_0[0]),
        level=LevelPair(
            left=level.left, right=level.right, baseline=level.baseline, size=sizes[0], turns=(turns[0], turns[1])
        ),
    )


def _size(lines: dict[str, str], name: str, where: str) -> tuple[int | None, int | None]:
    if name not in lines:
        return None, None
    return whole_sides(list(numbers(lines[name], 2, name, where)), where)
