"""What a calibration file tells of a stereo camera, whatever its format."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, frozen, se3
from flysim.geometry.rig import StereoRig
from flysim.plain import shown

MAX_NUMBER = 1e6  # [px] or [mm]: what is beyond is a typing error
MIN_FOCAL = 1e-3  # [px] the same
MAX_CALIB_BYTES = 2**16
LONG = 5.0  # [m] a baseline beyond it, in a format that states no unit, is in millimetres

Size = tuple[int | None, int | None]  # width, height [px]; None where a file does not say


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RawCamera:
    """One camera as it takes pictures.

    Attributes:
        K: `[3, 3]` its pinhole [px].
        size: of its pictures.
        model: "brown" (OpenCV's k1 k2 p1 p2 k3 k4 k5 k6 ...), or "fisheye" (equidistant, k1 k2 k3 k4).
        distortion: `[n]` coefficients in that order; none is a pinhole.
    """

    K: Array
    size: Size = (None, None)
    model: Literal["brown", "fisheye"] = "brown"
    distortion: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", frozen(self.K, np.float64))
        object.__setattr__(self, "distortion", frozen(self.distortion, np.float64))

    @property
    def bent(self) -> bool:
        """Whether it is no pinhole: a fisheye never is one."""
        return self.model == "fisheye" or bool(np.any(self.distortion != 0.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LevelPair:
    """A rectified pair: what the pictures are, or what they become.

    Attributes:
        left, right: `[3, 3]` their pinholes [px].
        baseline: [m], or in units of its own where the calibration is not metric.
        size: of the rectified pictures.
        turns: `[3, 3]` each, how the left and the right lens are turned to become level; None: nobody knows.
    """

    left: Array
    right: Array
    baseline: float
    size: Size = (None, None)
    turns: tuple[Array, Array] | None = None

    def rig(self, width: int, height: int) -> StereoRig:
        """The two cameras of pictures of that size.

        Raises:
            ValueError: a figure that no camera has.
        """
        left, right = (pinhole(K, width, height) for K in (self.left, self.right))
        return StereoRig(left=left, right=right, T_right_left=se3(np.eye(3), (-self.baseline, 0.0, 0.0)))

    def T_right_left(self) -> Array | None:
        """`[4, 4]` from the left lens to the right one, by how each is turned to become level."""
        if self.turns is None:
            return None
        left, right = self.turns
        R, _, Vt = np.linalg.svd(right.T @ left)  # a file has few digits
        return se3(R @ Vt, right.T @ np.array([-self.baseline, 0.0, 0.0]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Calibration:
    """A stereo camera as a file has it: how it takes pictures, how these are when rectified, or both.

    Attributes:
        name: of the format.
        lenses: the left and the right camera as they take pictures; None where the file knows rectified ones alone.
        T_right_left: `[4, 4]` from the left lens to the right one [m]; None with `lenses` alone.
        level: the pair when rectified; None where that is still to be worked out.
        maps: `[H, W, 2]` each, where in the left and the right picture each rectified pixel is looked up.
        disparities: least and largest [px] that the file says are there; None where it does not.
        metric: whether lengths are in metres.
        notes: what a reader of the figures should know, one sentence each.
    """

    name: str
    lenses: tuple[RawCamera, RawCamera] | None = None
    T_right_left: Array | None = None
    level: LevelPair | None = None
    maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
    disparities: tuple[float, float] | None = None
    metric: bool = True
    notes: tuple[str, ...] = ()


def pinhole(K: Array, width: int, height: int) -> Camera:
    """A camera of a matrix.

    Raises:
        ValueError: a figure that no camera has.
    """
    found = Camera(width=width, height=height, fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2])
    if min(found.fx, found.fy) < MIN_FOCAL:
        raise ValueError(f"focal lengths must be at least {MIN_FOCAL} px")
    return found


def number(word: Any) -> float:
    """The number that a word is; NaN for any other and for one that is too large."""
    try:
        text = str(word)
        value = float(text) if text.isascii() and "_" not in text and not isinstance(word, bool) else math.nan
    except ValueError:
        value = math.nan
    return value if abs(value) <= MAX_NUMBER else math.nan


def numbers(words: Any, count: int | Sequence[int], what: str, where: str) -> Array:
    """So many finite numbers.

    Args:
        words: what stands there.
        count: how many there must be, or may be.
        what: they are, as an error calls them.
        where: the file.

    Raises:
        FlysimError: there are more or less, or one is no number.
    """
    flat = list(_flat(words))
    allowed = (count,) if isinstance(count, int) else tuple(count)
    values = [number(word) for word in flat]
    if len(values) not in allowed:
        raise FlysimError(f"{where}: {what} must be {' or '.join(map(str, allowed))} numbers, got {len(values)}.")
    wrong = [word for word, value in zip(flat, values, strict=True) if not math.isfinite(value)]
    if wrong:
        raise FlysimError(f"{where}: {what} must be finite numbers up to {MAX_NUMBER:g}, got {shown(str(wrong[0]))}.")
    return np.array(values)


def _flat(words: Any) -> Iterable[Any]:
    if isinstance(words, str):
        yield from words.replace(",", " ").split()
    elif isinstance(words, list | tuple | np.ndarray):
        for word in words:
            yield from _flat(word) if isinstance(word, list | tuple | np.ndarray) else (word,)
    elif words is not None:
        yield words


def rotation(values: Array, what: str, where: str) -> Array:
    """`[3, 3]` the rotation nearest to nine numbers that are one but for their rounding.

    Raises:
        FlysimError: they are none.
    """
    R = np.asarray(values, np.float64).reshape(3, 3)
    U, _, Vt = np.linalg.svd(R)
    near = U @ Vt
    if np.linalg.det(near) < 0.0 or np.abs(near - R).max() > 1e-2:
        raise FlysimError(f"{where}: {what} must be a rotation, got a matrix that is not orthonormal, or a mirror.")
    return near


def whole_sides(words: Sequence[Any], where: str) -> Size:
    """Width and height [px]; None where there is no word.

    Raises:
        FlysimError: one is no whole number of pixels.
    """
    sides = []
    for word in words:
        value = None if word is None else number(word)
        if value is not None and not (value.is_integer() and 1 <= value <= MAX_NUMBER):
            raise FlysimError(f"{where}: width and height must be whole numbers of pixels, got {shown(str(word))}.")
        sides.append(None if value is None else int(value))
    return sides[0], sides[1]


def check_size(size: Size, of_picture: tuple[int, int], where: str, picture: str) -> None:
    """Refuses the calibration of another size: a scaled picture has another focal length.

    Raises:
        FlysimError: width or height of the picture are not what the calibration says.
    """
    if any(side is not None and side != got for side, got in zip(size, of_picture, strict=True)):
        told = "x".join("?" if side is None else str(side) for side in size)
        got = f"{of_picture[0]}x{of_picture[1]}"
        raise FlysimError(f"{where}: is for {told} px, {picture} has {got} px. Scale one of them.")


def metres(baseline: float) -> tuple[float, tuple[str, ...]]:
    """A baseline of a format that states no unit, in metres, and a note where it was taken for millimetres."""
    if abs(baseline) <= LONG:
        return baseline, ()
    told = f"the calibration's baseline of {abs(baseline):g} was taken for millimetres"
    return baseline / 1000.0, (told,)
