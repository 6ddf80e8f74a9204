"""From light to levels: how long a shutter is open, and what an amplifier makes of it."""

from __future__ import annotations

from collections import deque

import numpy as np

from flysim.sensors.optics import Levels
from flysim.sensors.parameters import SensorParams

WHITE, MIDDLE = 255.0, 128.0
MOST = 16.0  # an exposure is so many times the drawn one at most, and so many times less at least


class AutoExposure:
    """A control that wants a mean level and comes late by some frames, as a chip's registers do."""

    def __init__(self, target: float, lag: int) -> None:
        """A control before its first frame.

        Args:
            target: mean level that it wants; 0: it leaves the exposure alone.
            lag: frames from what it measures to when it counts.
        """
        self._target = target
        self._means: deque[float] = deque(maxlen=lag + 1)

    def factor(self, light: Levels) -> float:
        """Of the light in this frame: for what was measured `lag` frames ago, in the first frames for the first."""
        if not self._target:
            return 1.0
        self._means.append(float(light.mean(dtype=np.float64)))
        return min(max(self._target / max(self._means[0], 1e-3), 1.0 / MOST), MOST)


def exposed(light: Levels, params: SensorParams, *, right: bool, factor: float = 1.0) -> Levels:
    """Levels, not rounded and not bounded: gain, then gamma, offset and contrast.

    Args:
        light: `[H, W, 3]` levels that fall on the chip; may be changed.
        params: of both eyes.
        right: whether it is the right one.
        factor: of the exposure.
    """
    gain = factor * (params.gain_right if right else params.gain_left)
    gamma = params.gamma_right if right else params.gamma_left
    offset = params.offset_right if right else params.offset_left
    if gain != 1.0:
        light *= np.float32(gain)
    if gamma != 1.0:
        light = np.float32(WHITE) * (light / np.float32(WHITE)) ** np.float32(gamma)
    if offset:
        light += np.float32(offset)
    if params.contrast != 1.0:
        light = np.float32(MIDDLE) + np.float32(params.contrast) * (light - np.float32(MIDDLE))
    return light
