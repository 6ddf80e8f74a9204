"""A pair as taken and its calibration become a pair that flies see: distortion removed, rows level, sizes checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.calibration.lens import Lookup, coefficients, through
from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import Calibration, LevelPair, RawCamera, check_size, pinhole
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.geometry.rig import ImagePair, StereoRig

NO_CALIBRATION = Calibration(name="none", metric=False)
WIDE = 1.0  # focal length that a camera is taken to have where nobody says [widths of its pictures]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Photograph:
    """A pair that flies can see.

    Attributes:
        name: of the pair.
        pair: both pictures and their rig.
        metric: whether the rig is in metres; else its focal length and its baseline are made up, and its disparities
            alone are true.
        disparities: least and largest [px] that the calibration says are there; None where it does not.
        calibration: the format that told it; "none" where nothing did.
        rectified_here: whether pixels were moved.
        notes: what a reader of the figures should know, one sentence each.
    """

    name: str
    pair: ImagePair
    metric: bool
    disparities: tuple[float, float] | None
    calibration: str
    rectified_here: bool
    notes: tuple[str, ...] = ()


class Leveller:
    """Makes pairs of one camera level; what it worked out for the first pair serves them all."""

    def __init__(
        self, calibration: Calibration | None, where: str = "", *, rectified: bool = False, as_is: bool = False
    ) -> None:
        """A leveller of one calibration.

        Args:
            calibration: of the pairs; None: they are taken to be rectified, and measured in pixels.
            where: the calibration is from, for errors.
            rectified: whether the pictures are rectified already, whatever the file knows of lenses.
            as_is: whether lenses are made straight alone, and the two cameras left as they stand.
        """
        self._calibration, self._where = calibration or NO_CALIBRATION, where
        self._rectified, self._as_is = rectified, as_is
        self._made: dict[tuple[int, ...], tuple[StereoRig, tuple[Lookup, Lookup] | None]] = {}

    def __call__(self, name: str, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> Photograph:
        """The pair that flies see.

        Raises:
            FlysimError: pictures and calibration do not go together.
        """
        sizes = (*left.shape[1::-1], *right.shape[1::-1])
        if sizes not in self._made:
            self._made[sizes] = self._work_out(name, sizes)
        rig, lookups = self._made[sizes]
        if lookups is not None:
            left, right = lookups[0](left), lookups[1](right)
        return Photograph(
            name=name,
            pair=ImagePair(left=left, right=right, rig=rig),
            metric=self._calibration.metric,
            disparities=self._calibration.disparities,
            calibration=self._calibration.name,
            rectified_here=lookups is not None,
            notes=self._calibration.notes,
        )

    def _work_out(self, name: str, sizes: tuple[int, ...]) -> tuple[StereoRig, tuple[Lookup, Lookup] | None]:
        known, left, right = self._calibration, (sizes[0], sizes[1]), (sizes[2], sizes[3])
        try:
            if known.maps is not None and not self._rectified:
                return self._by_maps(known.maps, name, left, right)
            if known.lenses is not None and known.T_right_left is not None and self._as_taken(left):
                for lens, size in zip(known.lenses, (left, right), strict=True):
                    check_size(lens.size, size, self._where, name)
                return _rectified(known, left, right, self._as_is)
            if left != right:
                raise FlysimError(
                    f"{name}: the left picture has {left[0]}x{left[1]} px, the right one {right[0]}x{right[1]}. "
                    "Rectify the pair, or give a calibration with lenses."
                )
            level = known.level
            if level is None and known.lenses is not None:  # they say how far apart, and the pictures are level
                raise FlysimError(f"{self._where}: has no projection of rectified pictures. Leave --rectified out.")
            if level is None:
                return StereoRig.parallel(guessed(*left), 1.0), None
            check_size(level.size, left, self._where, name)
            return level.rig(*left), None
        except ValueError as error:
            raise FlysimError(f"{self._where}: {error}.") from error
        except cv2.error as error:
            raise FlysimError(f"{self._where}: OpenCV cannot rectify by it: {error.err or error}.") from error

    def _as_taken(self, size: Sequence[int]) -> bool:
        """Whether pictures of that size are those of the lenses, and not rectified ones."""
        known = self._calibration
        assert known.lenses is not None
        if self._rectified:
            return False
        raw, level = known.lenses[0].size, None if known.level is None else known.level.size
        fits = [of is not None and None not in of and tuple(of) == tuple(size) for of in (raw, level)]
        if fits == [False, True]:
            return False
        return any(lens.bent for lens in known.lenses) or not _is_level(known)

    def _by_maps(
        self,
        maps: tuple[NDArray[np.float32], NDArray[np.float32]],
        name: str,
        left: Sequence[int],
        right: Sequence[int],
    ) -> tuple[StereoRig, tuple[Lookup, Lookup]]:
        height, width = maps[0].shape[:2]
        if maps[1].shape != maps[0].shape:
            raise FlysimError(f"{self._where}: its two maps have different sizes.")
        for at, size in zip(maps, (left, right), strict=True):
            if not (-size[0] < at.min() and at[..., 0].max() < 2 * size[0] and at[..., 1].max() < 2 * size[1]):
                raise FlysimError(f"{self._where}: its maps look far beyond {name} of {size[0]}x{size[1]} px.")
        level = self._calibration.level
        rig = level.rig(width, height) if level is not None else StereoRig.parallel(guessed(width, height), 1.0)
        both = [Lookup(x=np.ascontiguousarray(at[..., 0]), y=np.ascontiguousarray(at[..., 1])) for at in maps]
        return rig, (both[0], both[1])


def guessed(width: int, height: int) -> Camera:
    """A camera of pictures that nobody knows a calibration of."""
    focal = WIDE * width
    return Camera(width=width, height=height, fx=focal, fy=focal, cx=(width - 1) / 2.0, cy=(height - 1) / 2.0)


def _is_level(known: Calibration) -> bool:
    assert known.lenses is not None and known.T_right_left is not None
    left, right = known.lenses
    T = known.T_right_left
    return bool(np.array_equal(left.K, right.K) and np.allclose(T[:3, :3], np.eye(3)) and np.allclose(T[1:3, 3], 0.0))


def _rectified(
    known: Calibration, left: Sequence[int], right: Sequence[int], as_is: bool
) -> tuple[StereoRig, tuple[Lookup, Lookup]]:
    """Rig of, and way into, pictures as the lenses take them."""
    assert known.lenses is not None and known.T_right_left is not None
    T = known.T_right_left
    if abs(T[1, 3]) > abs(T[0, 3]):
        raise ValueError("one camera is above the other: only pairs side by side are read")
    if T[0, 3] >= 0.0:
        raise ValueError("the right camera is not to the right of the left one: swap the files")
    one, other = known.lenses
    if as_is:
        K = [_straight_matrix(lens, size) for lens, size in ((one, left), (other, right))]
        rig = StereoRig(left=pinhole(K[0], *left), right=pinhole(K[1], *right), T_right_left=T)
        return rig, (through(one, np.eye(3), K[0], left), through(other, np.eye(3), K[1], right))
    level = known.level if known.level is not None and known.level.turns is not None else worked_out(known, left)
    assert level.turns is not None
    width, height = (side or got for side, got in zip(level.size, left, strict=True))
    both = [
        through(lens, turn, K, (width, height))
        for lens, turn, K in zip(known.lenses, level.turns, (level.left, level.right), strict=True)
    ]
    return level.rig(width, height), (both[0], both[1])


def worked_out(known: Calibration, size: Sequence[int]) -> LevelPair:
    """How the two cameras become level, so that rectified pictures hold nothing that was not seen."""
    assert known.lenses is not None and known.T_right_left is not None
    (one, other), T = known.lenses, known.T_right_left
    R, t, whole = T[:3, :3].copy(), T[:3, 3:].copy(), (int(size[0]), int(size[1]))
    if one.model == "fisheye":
        args = (one.K, coefficients(one), other.K, coefficients(other), whole, R, t)
        R1, R2, P1, P2 = cv2.fisheye.stereoRectify(*args, flags=0, balance=0.0)[:4]
    else:
        args = (one.K, one.distortion, other.K, other.distortion, whole, R, t)
        R1, R2, P1, P2 = cv2.stereoRectify(*args, flags=0, alpha=0.0)[:4]
    R1, R2, P1, P2 = (np.asarray(one, np.float64) for one in (R1, R2, P1, P2))
    return LevelPair(left=P1[:, :3], right=P2[:, :3], baseline=float(np.linalg.norm(t)), turns=(R1, R2))


def _straight_matrix(lens: RawCamera, size: Sequence[int]) -> Array:
    """The pinhole of the pictures of a lens that was made straight, with nothing in them that was not seen."""
    if not lens.bent:
        return lens.K
    whole = (int(size[0]), int(size[1]))
    if lens.model == "fisheye":
        args = (lens.K, coefficients(lens), whole, np.eye(3))
        return np.asarray(cv2.fisheye.estimateNewCameraMatrixForUndistortRectify(*args, balance=0.0), np.float64)
    return np.asarray(cv2.getOptimalNewCameraMatrix(lens.K, lens.distortion, whole, 0.0)[0], np.float64)
