"""OpenCV's calibrations: K, D, R, T, or R1 R2 P1 P2, or Q, or ready maps, in one file or two, under usual names.

Usual are the names of OpenCV's own samples (M1 D1 M2 D2, R T R1 R2 P1 P2 Q), those with left and right in them in any
place (`cameraMatrixLeft`, `LEFT.K`), and those of maps (`stereoMapL_x`, `map11`). No unit is stated in such a file:
lengths are metres, unless that makes the baseline longer than five of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.opencv_storage import Storage, parse_storage
from flysim.geometry.calibration.calibration import (
    Calibration,
    LevelPair,
    RawCamera,
    Size,
    metres,
    numbers,
    rotation,
    whole_sides,
)
from flysim.geometry.frames import Array, se3
from flysim.plain import shown

SIDES = (("left", "right"), ("l", "r"), ("1", "2"), ("0", "1"))
K_NAMES = ("k", "m", "cameramatrix", "mtx", "intrinsics", "intrinsic", "intrinsicmatrix", "cm")
D_NAMES = (
    "d",
    "dist",
    "distcoeffs",
    "distcoeff",
    "distortion",
    "distortioncoefficients",
    "distcoef",
    "distortioncoeffs",
)
R_NAMES = ("r", "rotation", "rmat", "rotationmatrix", "rot", "rstereo")
T_NAMES = ("t", "translation", "tvec", "translationvector", "trans", "tstereo")
P_NAMES = ("p", "projection", "projectionmatrix", "proj")
TURN_NAMES = ("r", "rect", "rectification", "rectificationmatrix", "rectificationtransform", "rotation", "rrect")
Q_NAMES = ("q", "disparitytodepth", "disparitytodepthmatrix", "disptodepthmatrix", "disptodepth", "reprojection")
MAP_NAMES = ("map", "stereomap", "rectifymap", "undistortmap", "undistortionmap")
COUNTS = (0, 4, 5, 8, 12, 14)  # coefficients that OpenCV knows


def opencv(texts: Sequence[str], wheres: Sequence[str]) -> Calibration:
    """The calibration of one FileStorage, or of two that go together: intrinsics and extrinsics, or one an eye.

    Args:
        texts: of the files.
        wheres: they are, for errors.

    Raises:
        FlysimError: something is missing or nonsense.
    """
    where = wheres[0] if len(wheres) == 1 else " and ".join(wheres)
    data = _merged([_read(text, place) for text, place in zip(texts, wheres, strict=True)])
    size = _size(data, where)
    lenses = _lenses(data, size, where)
    level, notes = _level(data, where)
    maps = _maps(data, where)
    between, more = _between(data, where)
    if lenses is not None and between is None and level is not None and level.turns is not None:
        between = level.T_right_left()
    if level is None and (lenses is None or between is None):
        known = ", ".join(sorted(data)[:12]) or "nothing"
        raise FlysimError(f"{where}: needs K, D, R, T of both eyes, or P1 and P2, or Q; it has {shown(known)}.")
    return Calibration(
        name="OpenCV",
        lenses=lenses if between is not None else None,
        T_right_left=between,
        level=level,
        maps=maps,
        notes=tuple(dict.fromkeys((*notes, *more))),
    )


def _read(text: str, where: str) -> Storage:
    try:
        return {re.sub(r"[^a-z0-9]", "", name.lower()): value for name, value in parse_storage(text).items()}
    except ValueError as refusal:
        raise FlysimError(f"{where}: cannot read the calibration: {refusal}.") from None


def _merged(files: Sequence[Storage]) -> Storage:
    """All in one; where two files have a camera each without saying which, the first is the left one."""
    if len(files) == 2 and all(_one(file, K_NAMES[2:]) is not None for file in files):
        return {
            f"{side}{name}": value for side, file in zip(SIDES[0], files, strict=True) for name, value in file.items()
        }
    return {name: value for file in files for name, value in file.items()}


def _one(data: Storage, names: Sequence[str]) -> Any:
    return next((data[name] for name in names if name in data), None)


def _forms(stem: str, side: str) -> Iterator[str]:
    yield from (f"{stem}{side}", f"{side}{stem}")


def _both(data: Storage, stems: Sequence[str]) -> tuple[Any, Any] | None:
    """What two eyes have of one kind."""
    for left, right in SIDES:
        found = [
            [data[form] for stem in stems for form in _forms(stem, side) if form in data] for side in (left, right)
        ]
        if all(found):
            return found[0][0], found[1][0]
    return None


def _size(data: Storage, where: str) -> Size:
    given = _one(data, ("imagesize", "size", "resolution", "imgsize", "leftimagesize"))
    if isinstance(given, np.ndarray | list) and np.size(given) == 2:
        return whole_sides([str(int(float(side))) for side in numbers(given, 2, "image size", where)], where)
    words = [_one(data, [f"{before}{name}" for before in ("image", "", "left", "camera", "leftimage")])
             for name in ("width", "height")]  # fmt: skip
    return whole_sides([None if word is None else str(word).rstrip(".") for word in words], where)


def _lenses(data: Storage, size: Size, where: str) -> tuple[RawCamera, RawCamera] | None:
    K, D = _both(data, K_NAMES), _both(data, D_NAMES)
    if K is None:
        return None
    told = str(_one(data, ("distortionmodel", "model", "cameramodel", "leftdistortionmodel")) or "").lower()
    fisheye = any(word in told for word in ("fisheye", "equidistant", "kannala"))
    counts = (0, 4) if fisheye else COUNTS
    made = [
        RawCamera(
            K=numbers(k, 9, "K", where).reshape(3, 3),
            distortion=numbers(d, counts, "D", where),
            size=size,
            model="fisheye" if fisheye else "brown",
        )
        for k, d in zip(K, D or (None, None), strict=True)
    ]
    return made[0], made[1]


def _between(data: Storage, where: str) -> tuple[Array | None, tuple[str, ...]]:
    """`T_right_left`: OpenCV's R and T take points of the left camera to the right one."""
    R, T = _one(data, R_NAMES), _one(data, T_NAMES)
    if T is None:
        return None, ()
    t = numbers(T, 3, "T", where)
    if R is None:
        R = np.eye(3)
    values = numbers(R, (3, 9), "R", where)
    if len(values) == 3:
        from scipy.spatial.transform import Rotation

        values = Rotation.from_rotvec(values).as_matrix().ravel()
    length, notes = metres(float(np.linalg.norm(t)))
    if not length > 0.0:
        raise FlysimError(f"{where}: T is 0: two cameras in one place see no depth.")
    return se3(rotation(values, "R", where), t * (length / np.linalg.norm(t))), notes


def _level(data: Storage, where: str) -> tuple[LevelPair | None, tuple[str, ...]]:
    P, turns = _both(data, P_NAMES), _both(data, TURN_NAMES)
    rotations = None
    if turns is not None and all(np.size(turn) == 9 for turn in turns):
        left, right = (rotation(numbers(turn, 9, "R1, R2", where), "R1, R2", where) for turn in turns)
        rotations = left, right
    if P is not None:
        left, right = (numbers(p, 12, "P1, P2", where).reshape(3, 4) for p in P)
        if abs(right[1, 3]) > abs(right[0, 3]):
            raise FlysimError(f"{where}: one camera is above the other: only pairs side by side are read.")
        length, notes = metres(-float(right[0, 3] / right[0, 0]) if right[0, 0] else 0.0)
        K0, K1 = left[:, :3], right[:, :3]
    elif (Q := _one(data, Q_NAMES)) is not None:
        q = numbers(Q, 16, "Q", where).reshape(4, 4)
        if not (q[2, 3] > 0.0 and q[3, 2] != 0.0):
            raise FlysimError(f"{where}: Q has no focal length or no baseline.")
        length, notes = metres(abs(1.0 / q[3, 2]))
        K0 = np.array([[q[2, 3], 0.0, -q[0, 3]], [0.0, q[2, 3], -q[1, 3]], [0.0, 0.0, 1.0]])
        K1 = K0.copy()
        K1[0, 2] += q[3, 3] / q[3, 2]
    else:
        return None, ()
    if not length > 0.0:
        raise FlysimError(f"{where}: the right camera is not to the right of the left one: swap the files or pictures.")
    return LevelPair(left=K0, right=K1, baseline=length, turns=rotations), notes


def _maps(data: Storage, where: str) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """Where in each picture the rectified pixels are looked up, of files that have ready maps."""
    found = []
    for eyes in SIDES:
        for stem in MAP_NAMES:
            for one, two in (("x", "y"), ("1", "2")):
                names = [
                    [[f"{stem}{side}{axis}", f"{side}{stem}{axis}", f"{stem}{axis}{side}"] for axis in (one, two)]
                    for side in eyes
                ]
                found = [[_one(data, forms) for forms in eye] for eye in names]
                if all(value is not None for eye in found for value in eye):
                    left, right = (_map(eye[0], eye[1], where) for eye in found)
                    return left, right
    return None


def _map(first: NDArray, second: NDArray, where: str) -> NDArray[np.float32]:
    if not all(isinstance(part, np.ndarray) for part in (first, second)):
        raise FlysimError(f"{where}: a map is no matrix.")
    if first.ndim == 3 and first.shape[2] == 2:
        # Whole pixels, and beside them which of 32 x 32 steps within a pixel (OpenCV's CV_16SC2 and CV_16UC1).
        step = second if second.shape == first.shape[:2] else np.zeros(first.shape[:2])
        return np.stack([first[..., 0] + step % 32 / 32.0, first[..., 1] + step // 32 / 32.0], axis=2).astype(
            np.float32
        )
    if first.ndim != 2 or first.shape != second.shape:
        raise FlysimError(f"{where}: the two parts of a map have different sizes.")
    return np.stack([first, second], axis=2).astype(np.float32)
