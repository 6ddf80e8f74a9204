"""A flat board of squares: a chessboard, or a ChArUco board, whose white squares bear marks that tell them apart."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.plain import shown

LEAST, MOST = 3, 40  # inner corners along a side
MAX_SQUARE = 10.0  # [m]
MARK = 0.75  # side of a ChArUco mark, of its square's
CELLS = 4  # of a mark's code along a side
DICTIONARIES = (50, 100, 250, 1000)  # how many marks of 4x4 cells OpenCV's dictionaries have


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """A calibration board.

    Attributes:
        columns, rows: inner corners, where four squares meet; a board of 10x7 squares has 9x6.
        square: side of a square [m].
        charuco: whether its white squares bear marks (OpenCV's, 4x4 cells, three quarters of the square).

    Raises:
        ValueError: so few or so many corners, or a square that is no length.
    """

    columns: int
    rows: int
    square: float
    charuco: bool = False

    def __post_init__(self) -> None:
        if not (LEAST <= self.columns <= MOST and LEAST <= self.rows <= MOST):
            raise ValueError(
                f"a board must have {LEAST} to {MOST} inner corners a side, got {self.columns}x{self.rows}"
            )
        if not (math.isfinite(self.square) and 0.0 < self.square <= MAX_SQUARE):
            raise ValueError(f"the board's square must be > 0 m and at most {MAX_SQUARE:g} m, got {self.square:g} m")

    @property
    def name(self) -> str:
        """As a person says it."""
        return f"{'ChArUco board' if self.charuco else 'chessboard'} {self.columns}x{self.rows}"

    @property
    def corners(self) -> Array:
        """`[N, 3]` inner corners [m], row by row: x along a row, y down the rows, z = 0."""
        v, u = np.mgrid[0 : self.rows, 0 : self.columns].astype(np.float64)
        return np.stack([u.ravel(), v.ravel(), np.zeros(u.size)], axis=1) * self.square

    @property
    def size(self) -> tuple[float, float]:
        """Of its squares together [m]."""
        return (self.columns + 1) * self.square, (self.rows + 1) * self.square

    @property
    def outline(self) -> Array:
        """`[4, 3]` corners of its squares together [m]."""
        x, y = (self.columns * self.square, self.rows * self.square)
        return np.array(
            [[-self.square, -self.square, 0.0], [x, -self.square, 0.0], [x, y, 0.0], [-self.square, y, 0.0]]
        )

    @property
    def marked(self) -> cv2.aruco.CharucoBoard:
        """The ChArUco board as OpenCV has it."""
        count = ((self.columns + 1) * (self.rows + 1)) // 2
        marks = next(n for n in DICTIONARIES if n >= count)
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{CELLS}X{CELLS}_{marks}"))
        squares = (self.columns + 1, self.rows + 1)
        return cv2.aruco.CharucoBoard(squares, self.square, self.square * MARK, dictionary)

    def picture(self, square_px: int, margin: int = 1) -> NDArray[np.uint8]:
        """`[H, W, 3]` the board as it is printed, its first corner at the upper left, a white border about it.

        Args:
            square_px: side of a square [px].
            margin: width of the border [squares].
        """
        width, height = (self.columns + 1) * square_px, (self.rows + 1) * square_px
        if self.charuco:
            inner = np.asarray(self.marked.generateImage((width, height)), np.uint8)
        else:
            v, u = np.indices((self.rows + 1, self.columns + 1))
            inner = np.kron(((u + v) % 2 * 255).astype(np.uint8), np.ones((square_px, square_px), np.uint8))
        grey = np.pad(inner, margin * square_px, constant_values=255)
        return np.repeat(grey[..., None], 3, axis=2)


def parse_board(text: str, square: float, *, charuco: bool = False) -> Board:
    """The board of `9x6`: inner corners along and down.

    Raises:
        ValueError: it is not written so, or as `Board`.
    """
    found = re.fullmatch(r"(\d{1,3})x(\d{1,3})", text.strip().lower())
    if found is None:
        raise ValueError(f"a board is COLUMNSxROWS of inner corners, such as 9x6, got {shown(text)}")
    return Board(columns=int(found[1]), rows=int(found[2]), square=square, charuco=charuco)
