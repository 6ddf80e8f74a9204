"""Somebody else's pictures made level by their calibration, and what that does to where the camera is said to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from flysim.datasets.layout import Eyes, Recorded
from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import Calibration, LevelPair
from flysim.geometry.frames import Array, se3
from flysim.photographs.level import Leveller, worked_out


def levelled(recorded: Recorded, where: str) -> Recorded:
    """The same frames with rectified pictures, their rig, and poses of the left camera that took them.

    Args:
        recorded: frames with a calibration.
        where: the data set is, for errors.

    Raises:
        FlysimError: the first pair cannot be read, or pictures and calibration do not go together.
    """
    assert recorded.calibration is not None
    first = recorded.eyes(0)
    calibration = _with_level(recorded.calibration(), first[0].shape[1::-1], where)
    leveller = Leveller(calibration, where)
    photograph = leveller("frame 0", *first)
    turn = np.eye(3)
    if photograph.rectified_here and calibration.level is not None and calibration.level.turns is not None:
        turn = calibration.level.turns[0]

    def eyes(k: int) -> Eyes:
        pair = leveller(f"frame {k}", *recorded.eyes(k)).pair
        return pair.left, pair.right

    # p_level = R p_lens: the levelled camera's axes are the lens's, turned back.
    T_lens_level = se3(turn.T, np.zeros(3))
    return replace(
        recorded,
        eyes=eyes,
        rig=photograph.pair.rig,
        T_world_left=_turned(recorded.T_world_left, T_lens_level),
        T_world_base=recorded.T_world_base,
        notes=(*recorded.notes, *photograph.notes),
    )


def _turned(poses: tuple[Array, ...] | None, T_lens_level: Array) -> tuple[Array, ...] | None:
    return None if poses is None else tuple(T @ T_lens_level for T in poses)


def _with_level(known: Calibration, size: Sequence[int], where: str) -> Calibration:
    """A calibration that knows what its pair is when rectified."""
    if known.lenses is None or known.T_right_left is None or known.level is not None:
        return known
    (left, right), T = known.lenses, known.T_right_left
    stands_level = np.allclose(T[:3, :3], np.eye(3), atol=1e-9) and np.allclose(T[1:3, 3], 0.0, atol=1e-9)
    if stands_level and np.array_equal(left.K, right.K) and not (left.bent or right.bent) and T[0, 3] < 0.0:
        level = LevelPair(left=left.K, right=right.K, baseline=-float(T[0, 3]), size=left.size)
        return replace(known, lenses=None, T_right_left=None, level=level)
    try:
        return replace(known, level=worked_out(known, size))
    except (cv2.error, ValueError) as error:
        raise FlysimError(f"{where}: the pair cannot be rectified by its calibration: {error}.") from None
