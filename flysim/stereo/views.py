"""A pair made ready for evolution: bytes in a row, and how a fly of the left image falls into the right one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.compute.rooms import room
from flysim.geometry.frames import inverse
from flysim.geometry.rig import ImagePair, StereoRig

_FLOATS = (
    *(f"m{i}{j}" for i in range(3) for j in range(3)),  # to_right, row by row
    *("s0", "s1", "s2"),  # shift
    *("el0", "el1", "el2", "er0", "er1", "er2"),  # the other camera's centre, seen in the left and the right image
    *("fx", "fy", "cx", "cy"),  # of the left camera
    "gain",
)
RECORD = np.dtype(
    [(name, np.uint64) for name in ("left", "right", "grey_left", "grey_right")]  # where their bytes begin
    + [(name, np.int64) for name in ("width", "height", "right_width", "right_height", "rectified")]
    + [(name, np.float64) for name in _FLOATS]
)
# The same, of a pair whose rows meet: one interpolation is enough, and the kernels take the short way by the type.
LEVEL = np.dtype([("level", np.int64), *RECORD.descr])  # in front: numba takes records that go on for subtypes


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Views:
    """What the kernels read, as a record that is handed on by address: arrays would be counted at every call.

    A fly is a left pixel (u, v) and an inverse depth q [1/m]. Its right projection is, in homogeneous pixels,
    `to_right @ (u, v, 1) + q * shift`: the plane-at-infinity homography and the epipole (Hartley and Zisserman,
    section 9.6).

    Attributes:
        left, right: `[H, W, 3]` uint8.
        grey_left, grey_right: `[H, W]` uint8.
        record: `[1]` of `RECORD` or `LEVEL`, its addresses valid as long as this object lives. `gain` is f B, the
            pixels that a projection moves along its row for 1/m of inverse depth where rows meet; elsewhere it is
            the pixel's own (`told.coarser`). `rectified` says that rows meet.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    grey_left: NDArray[np.uint8]
    grey_right: NDArray[np.uint8]
    record: np.recarray

    def contrast(self) -> float:
        """The steepest slope of the left image along the epipolar lines [grey levels / px]."""
        down, across = np.gradient(self.grey_left.astype(np.float32))
        v, u = np.indices(self.grey_left.shape)
        one = self.record[0]
        du, dv = one["el0"] - u * one["el2"], one["el1"] - v * one["el2"]
        return float(np.max(np.abs(across * du + down * dv) / (np.hypot(du, dv) + 1e-12)))


def prepare(pair: ImagePair, *, fast: bool = True) -> Views:
    """Everything of a pair that does not change while its flies evolve. Gradients are taken where flies sit.

    Args:
        pair: the images and their rig.
        fast: take the short way through rectified windows where the rig is rectified; the long way gives the same.
    """
    return views_of(pair.left, pair.right, pair.rig, fast=fast)


def views_of(left: NDArray[np.uint8], right: NDArray[np.uint8], rig: StereoRig, *, fast: bool = True) -> Views:
    """As `prepare`, of two pictures that need not be copied and checked for it; both of the rig's sizes."""
    blank = _blank(rig, fast)
    left, right = np.ascontiguousarray(left), np.ascontiguousarray(right)
    images = {
        "left": left,
        "right": right,
        "grey_left": _grey(left),
        "grey_right": _grey(right),
    }
    record = blank.copy()
    for name, image in images.items():
        record[name] = image.ctypes.data
    return Views(**images, record=record.view(np.recarray))


def _grey(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY, room(*image.shape[:2])), np.uint8)


@lru_cache(maxsize=16)
def _blank(rig: StereoRig, fast: bool) -> NDArray[np.void]:
    """The record of a rig's pairs, without images: what looks with one rig shares it."""
    R, t = rig.T_right_left[:3, :3], rig.T_right_left[:3, 3]
    to_right, shift = rig.right.K @ R @ np.linalg.inv(rig.left.K), rig.right.K @ t
    other_in_left = rig.left.K @ inverse(rig.T_right_left)[:3, 3]
    if rig.rectified:  # without the rounding: the short way leaves out what is 0 here
        to_right = np.array([[1.0, 0.0, rig.right.cx - rig.left.cx], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        shift = np.array([shift[0], 0.0, 0.0])
        other_in_left = -shift
    floats = np.concatenate(
        [
            to_right.ravel(),
            shift,
            other_in_left,
            shift,
            (rig.left.fx, rig.left.fy, rig.left.cx, rig.left.cy, rig.left.fx * rig.baseline),
        ]
    )
    # The short way has the right camera on the right.
    level = bool(fast and rig.rectified and shift[0] < 0.0)
    record = np.zeros(1, LEVEL if level else RECORD)
    for name, value in zip(_FLOATS, floats, strict=True):
        record[name] = value
    record["width"], record["height"] = rig.left.width, rig.left.height
    record["right_width"], record["right_height"] = rig.right.width, rig.right.height
    record["rectified"] = level
    return record
