"""Where an image shows a board's corners, to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.calibration.board import MARK, Board
from flysim.geometry.frames import Array, frozen

# Half the side of the window that a corner is settled in, of the least distance between two corners. On 28 photographs
# of a 9x6 board: 11 px, as OpenCV's examples have it, leaves 0.41 to 0.45 px rms, this 0.18 to 0.19.
WINDOW, LEAST_PX, MOST_PX = 0.3, 2, 11
MARKED = (1.0 - MARK) / 2.0 - 0.01  # of a ChArUco board: a window that reaches into a mark is drawn towards it
LEAST_CORNERS = 8  # of a ChArUco board that is seen in part
LEAST_SIDE = 40  # [px] of an image that OpenCV's search has room in
SETTLED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corners:
    """What one image shows of a board.

    Attributes:
        ids: `[N]` which of `Board.corners`.
        uv: `[N, 2]` where they are [px].
    """

    ids: NDArray[np.intp]
    uv: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", frozen(self.ids, np.intp))
        object.__setattr__(self, "uv", frozen(self.uv, np.float64))

    def turned(self) -> Corners:
        """The same corners counted from the board's other end."""
        return Corners(ids=self.ids.max() - self.ids, uv=self.uv)

    def picked(self, ids: NDArray[np.intp]) -> Array:
        """`[M, 2]` where some of its corners are, in ascending order of `ids`."""
        order = np.argsort(self.ids)
        return self.uv[order][np.isin(self.ids[order], ids)]


def find_corners(image: NDArray[np.uint8], board: Board) -> Corners | None:
    """The corners of a board in an `[H, W, 3]` image; None where there is none, or too little of one."""
    if min(image.shape[:2]) < LEAST_SIDE:
        return None
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
    return _charuco(grey, board) if board.charuco else _chessboard(grey, board)


def _chessboard(grey: NDArray[np.uint8], board: Board) -> Corners | None:
    # The newer search is ten times as quick where both find it, and finds a third more of tilted boards; of 28
    # photographs the older one alone found one.
    found, rough = cv2.findChessboardCornersSB(grey, (board.columns, board.rows))
    if not found:
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
        found, rough = cv2.findChessboardCorners(grey, (board.columns, board.rows), flags=flags)
    if not found:
        return None
    grid = np.asarray(rough, np.float32).reshape(board.rows, board.columns, 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1)]
    uv = _settled(grey, grid.reshape(-1, 2), WINDOW * float(min(steps)))
    return Corners(ids=np.arange(len(uv)), uv=uv)


def _charuco(grey: NDArray[np.uint8], board: Board) -> Corners | None:
    uv, ids, _, _ = cv2.aruco.CharucoDetector(board.marked).detectBoard(grey)
    if ids is None or len(ids) < LEAST_CORNERS:
        return None
    ids, uv = np.asarray(ids).ravel().astype(np.intp), np.asarray(uv, np.float32).reshape(-1, 2)
    if np.ptp(ids // board.columns) == 0 or np.ptp(ids % board.columns) == 0:
        return None  # all in one line
    apart = np.linalg.norm(uv[:, None] - uv[None], axis=-1)
    return Corners(ids=ids, uv=_settled(grey, uv, MARKED * float(apart[apart > 0.0].min())))


def _settled(grey: NDArray[np.uint8], uv: NDArray[np.float32], reach: float) -> Array:
    half = int(np.clip(round(reach), LEAST_PX, MOST_PX))
    start = np.ascontiguousarray(uv.reshape(-1, 1, 2))
    return np.asarray(cv2.cornerSubPix(grey, start, (half, half), (-1, -1), SETTLED)).reshape(-1, 2).astype(np.float64)
