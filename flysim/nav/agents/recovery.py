"""What an agent does when it comes no farther: it turns to the widest opening, drives there, and plans anew."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from scipy import ndimage

from flysim.geometry.frames import Array, wrap_angle
from flysim.nav.agents.chart import Chart

BESIDE = 5  # directions side by side that make an opening wide


class Recovery:
    """Notices that a robot stays where it is, and leads it out."""

    def __init__(
        self, chart: Chart, period: float, *, patience: float, stay: float, escape: float, most: float
    ) -> None:
        """For the robot of a chart that is asked every `period` [s].

        Args:
            chart: where the robot is.
            patience: so long it may stay in one place [s].
            stay: radius of one place [m].
            escape: it goes so far [m] out of it, where the opening is as long.
            most: and takes at most so long for it [s].
        """
        self._chart, self._period, self._stay, self._escape, self._most = chart, period, stay, escape, most
        self._places: deque[tuple[float, float]] = deque(maxlen=max(2, round(patience / period)))
        self.clear()

    def clear(self) -> None:
        """A new episode."""
        self._places.clear()
        self._out: float | None = None  # [rad] heading of the opening, in the chart; None: nothing is wrong
        self._left = 0.0
        self._from = (0.0, 0.0)
        self.count = 0

    @property
    def active(self) -> bool:
        """Whether the robot is being led out."""
        return self._out is not None

    def due(self) -> bool:
        """Asked every period: whether the robot has stayed in one place for too long, and is not being led out yet."""
        here = self._chart.x, self._chart.y
        self._places.append(here)
        full = len(self._places) == self._places.maxlen
        return not self.active and full and all(math.dist(here, place) < self._stay for place in self._places)

    def begin(self, directions: Array, run: Array) -> None:
        """Leads out along the widest of the directions [rad, robot's frame], which are open for `run` [m].

        The place is avoided from then on, and what was seen seldom is forgotten.
        """
        widest = float(directions[int(np.argmax(ndimage.uniform_filter1d(run, BESIDE, mode="wrap")))])
        self._out, self._left = wrap_angle(self._chart.yaw + widest), self._most
        self._from = self._chart.x, self._chart.y
        self.count += 1
        self._chart.avoid(*self._from)
        self._chart.forget()

    def heading(self) -> float:
        """[rad] of the opening from the robot's heading; the last call of a recovery ends it."""
        assert self._out is not None
        bearing = wrap_angle(self._out - self._chart.yaw)
        self._left -= self._period
        if self._left < self._period / 2.0 or math.dist(self._from, (self._chart.x, self._chart.y)) > self._escape:
            self._out = None
            self._places.clear()
        return bearing
