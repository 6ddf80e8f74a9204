"""From corners to cameras: OpenCV's calibration (Zhang 2000) of one camera or of two at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.calibration.board import Board
from flysim.calibration.detect import Corners
from flysim.calibration.rectify import rectified_infos
from flysim.errors import FlysimError
from flysim.geometry.camera_info import CameraInfo
from flysim.geometry.frames import Array

# Brown's k1, k2, p1, p2. A k3 is left out: what 15 images tell of it is noise, and it bends the corners of the image.
LENS = cv2.CALIB_FIX_K3
ENOUGH = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-10)
LEAST_BOARDS = 3
NO_CAMERA = "OpenCV finds no camera that could have seen these boards: are the images of one camera, and one board?"
SIDEWAYS = 0.5  # of the baseline that must be along the rows
Points = Sequence[NDArray[np.float32]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolvedEye:
    """What was found of one camera.

    Attributes:
        info: its figures.
        used: of each image, the corners that counted; None where it saw no board, or too little.
        residuals: of each image `[N, 2]` corners seen less corners expected [px]; None where it saw no board.
        focal_std: standard deviation of its focal length [px], by what the corners scatter.
    """

    info: CameraInfo
    used: tuple[Corners | None, ...]
    residuals: tuple[Array | None, ...]
    focal_std: float

    @property
    def rms(self) -> float:
        """Of all corners [px]."""
        return rms(np.concatenate([one for one in self.residuals if one is not None]))

    @property
    def rms_of_images(self) -> tuple[float | None, ...]:
        """Of the corners of each image [px]."""
        return tuple(None if one is None else rms(one) for one in self.residuals)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solved:
    """One camera, or two and how they stand.

    Attributes:
        eyes: the camera, or the left and the right one.
        rms: of all corners, by the cameras as they stand together [px].
        tilts: of each image, the board against the image plane [rad].
        T_right_left: `[4, 4]` of a pair; None of one camera.
    """

    eyes: tuple[SolvedEye, ...]
    rms: float
    tilts: tuple[float, ...]
    T_right_left: Array | None = None

    @property
    def baseline(self) -> float | None:
        """Between the two eyes [m]."""
        return None if self.T_right_left is None else float(np.linalg.norm(self.T_right_left[:3, 3]))


def rms(residuals: Array) -> float:
    """Root of the mean square of `[N, 2]` residuals."""
    return float(np.sqrt((residuals**2).sum(axis=1).mean()))


def solve_camera(shots: Sequence[Corners], board: Board, size: tuple[int, int], name: str = "camera") -> Solved:
    """One camera by what its images show.

    Args:
        shots: of each image, `LEAST_BOARDS` at least.
        board: that was shown.
        size: width and height of the images [px].
        name: of the camera, for its file.

    Raises:
        FlysimError: too few, or corners that no camera could have seen.
    """
    objects, points = _arrays(shots, board)
    _refuse_few(len(shots))
    _, K, D, turns, moves, spread = _opencv(
        lambda: cv2.calibrateCameraExtended(objects, points, size, None, None, flags=LENS, criteria=ENOUGH)[:6]  # type: ignore[call-overload]
    )
    residuals = tuple(_residuals(o, p, r, t, K, D) for o, p, r, t in zip(objects, points, turns, moves, strict=True))
    eye = SolvedEye(
        info=_info(name, size, K, D), used=tuple(shots), residuals=residuals, focal_std=float(np.ravel(spread)[0])
    )
    return Solved(eyes=(eye,), rms=eye.rms, tilts=tuple(map(_tilt, turns)))


def solve_pair(
    shots: Sequence[tuple[Corners | None, Corners | None]],
    board: Board,
    size: tuple[int, int],
    name: str = "stereo",
) -> Solved:
    """Two cameras by what their images of one moment show: each by all that it saw, how they stand by what both saw.

    Raises:
        FlysimError: as `solve_camera`; the eyes stand one above the other, or the left one on the right.
    """
    together = [_common(left, right) for left, right in shots if left is not None and right is not None]
    _refuse_few(len(together), " of both eyes")
    alone = [solve_camera([one for shot in shots if (one := shot[eye]) is not None], board, size) for eye in (0, 1)]
    first = [figure.copy() for one in alone for figure in (one.eyes[0].info.K, one.eyes[0].info.D)]
    found = _stand(together, board, size, first, settled=len(together) < len(shots))
    K, D, R, t, turns, moves = found[1:5:2], found[2:5:2], found[5], np.ravel(found[6]), found[9], found[10]
    _refuse_stand(t)
    seen = _of_each(shots, board, alone, (K, D, R, t), zip(turns, moves, strict=True))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    raw = [_info(f"{name}/{side}", size, K[eye], D[eye]) for eye, side in enumerate(("left", "right"))]
    eyes = tuple(
        SolvedEye(
            info=info,
            used=tuple(one[1][eye] for one in seen),
            residuals=tuple(one[2][eye] for one in seen),
            focal_std=alone[eye].eyes[0].focal_std,
        )
        for eye, info in enumerate(rectified_infos(raw, T))
    )
    both = np.concatenate([one for _, _, offs in seen for one in offs if one is not None])
    return Solved(eyes=eyes, rms=rms(both), tilts=tuple(one[0] for one in seen), T_right_left=T)


def _stand(
    together: Sequence[tuple[Corners, Corners]], board: Board, size: Any, first: Sequence[Array], settled: bool
) -> Any:
    """OpenCV's stereo calibration. `settled`: each eye saw more than both did, and its figures stay what that says."""
    objects, left = _arrays([shot[0] for shot in together], board)
    _, right = _arrays([shot[1] for shot in together], board)
    flags = cv2.CALIB_FIX_INTRINSIC if settled else LENS | cv2.CALIB_USE_INTRINSIC_GUESS
    start = (size, np.eye(3), np.zeros((3, 1)))
    return _opencv(
        lambda: cv2.stereoCalibrateExtended(objects, left, right, *first, *start, flags=flags, criteria=ENOUGH)  # type: ignore[call-overload]
    )


def _of_each(
    shots: Sequence[tuple[Corners | None, Corners | None]], board: Board, alone: Sequence[Solved], pair: Any, poses: Any
) -> list[tuple[float, tuple[Corners | None, ...], tuple[Array | None, ...]]]:
    """Of each image: how the board leans [rad], the corners that counted and what is left over of them [px], by eye."""
    K, D, R, t = pair
    own = [iter(zip(one.tilts, one.eyes[0].residuals, strict=True)) for one in alone]
    found: list[tuple[float, tuple[Corners | None, ...], tuple[Array | None, ...]]] = []
    for shot in shots:
        each = [(0.0, None) if one is None else next(eye) for one, eye in zip(shot, own, strict=True)]
        left, right = shot
        if left is None or right is None:
            found.append((max(tilt for tilt, _ in each), shot, tuple(off for _, off in each)))
            continue
        turn, move = next(poses)
        common = _common(left, right)
        objects, points = _arrays(common, board)
        turned, moved = cv2.Rodrigues(R @ cv2.Rodrigues(turn)[0])[0], R @ np.ravel(move) + t
        offs = (
            _residuals(objects[0], points[0], turn, move, K[0], D[0]),
            _residuals(objects[1], points[1], turned, moved, K[1], D[1]),
        )
        found.append((_tilt(turn), common, offs))
    return found


def _common(left: Corners, right: Corners) -> tuple[Corners, Corners]:
    """The corners that both eyes saw, counted from one end of the board."""
    right = _same_way(left, right)
    ids = np.intersect1d(left.ids, right.ids)
    return Corners(ids=ids, uv=left.picked(ids)), Corners(ids=ids, uv=right.picked(ids))


def _arrays(shots: Sequence[Corners], board: Board) -> tuple[Points, Points]:
    objects = [board.corners[shot.ids].astype(np.float32).reshape(-1, 1, 3) for shot in shots]
    return objects, [shot.uv.astype(np.float32).reshape(-1, 1, 2) for shot in shots]


def _same_way(left: Corners, right: Corners) -> Corners:
    """The right eye's corners counted from the end that the left eye's are counted from."""
    ids = np.intersect1d(left.ids, right.ids)
    if len(ids) < len(left.ids) or len(ids) < len(right.ids):  # a ChArUco board, whose marks say which end is which
        return right
    along = [one.picked(ids)[-1] - one.picked(ids)[0] for one in (left, right)]
    return right.turned() if along[0] @ along[1] < 0.0 else right


def _residuals(
    objects: NDArray[np.float32], points: NDArray[np.float32], turn: Array, move: Array, K: Array, D: Array
) -> Array:
    expected, _ = cv2.projectPoints(objects, np.asarray(turn, np.float64), np.asarray(move, np.float64), K, D)
    return (np.asarray(points, np.float64) - expected).reshape(-1, 2)


def _tilt(turn: Array) -> float:
    """Between the board's normal and the optical axis [rad]."""
    return float(np.arccos(min(abs(cv2.Rodrigues(np.asarray(turn))[0][2, 2]), 1.0)))


def _info(name: str, size: tuple[int, int], K: Array, D: Array) -> CameraInfo:
    try:
        return CameraInfo(name=name, width=size[0], height=size[1], K=K, D=np.ravel(D)[:5])
    except ValueError as error:
        raise FlysimError(NO_CAMERA) from error


def _refuse_few(boards: int, of: str = "") -> None:
    if boards < LEAST_BOARDS:
        raise FlysimError(
            f"the board was found in {boards} image{'s' * (boards != 1)}{of}, a calibration needs {LEAST_BOARDS} at "
            "least and is good from about 15: take more, the board tilted and all over the image."
        )


def _refuse_stand(t: Array) -> None:
    baseline = float(np.linalg.norm(t))
    if abs(t[0]) < SIDEWAYS * baseline:
        raise FlysimError("the two cameras stand one above or behind the other: a pair stands side by side.")
    if t[0] > 0.0:
        raise FlysimError("the right eye's images were taken on the left: exchange the two.")


def _opencv(work: Callable[[], Any]) -> Any:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)  # so that sums are made in one order, and the same images give the same figures
    try:
        found = work()
    except cv2.error as error:
        raise FlysimError(NO_CAMERA) from error
    finally:
        cv2.setNumThreads(threads)
    if not all(np.isfinite(np.asarray(one, np.float64)).all() for one in found[:5] if one is not None):
        raise FlysimError(NO_CAMERA)
    return found
