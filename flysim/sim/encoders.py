"""What wheels and their encoders do wrong: the robot's belief of its way, apart from the way it truly goes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flysim.common.ranges import ranged

STRETCH = 1.0  # [m] of way for which one draw of the two random errors holds
_STREAM = 0x0D0  # of the seed's random numbers: apart from those of cameras and engines
SHARE = "(a share)"


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryParams:
    """How the way that the wheels tell differs from the one that is driven; all 0: in nothing but physics' own slip.

    Nothing but the push moves the robot: the rest is what it believes. It drives by that belief, so that it is the
    truth that strays from the path. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        distance_std: standard deviation of the believed way, as a share of it, drawn anew for each metre.
        yaw_std_deg_per_m: standard deviation of the believed heading after a metre [degrees], drawn anew for each.
        wheel_radius_error: share by which the wheels' radius is believed too large.
        track_error: share by which the distance between the wheels is believed too large.
        ticks_per_turn: that an encoder counts in a turn of its wheel; 0: it reads every angle.
        load_slip: share of its turning that a wheel slips at an acceleration of 1 m/s^2 [s^2/m].
        turn_slip: share of a turn that the tyres scrub away at 1 rad/s [s/rad].
        drag: share by which the floor holds the left wheel back; below 0, the right one.
        push_n: somebody pushes the robot to its left, or below 0 to its right, by so much [N]: about 30 move the rover.
        push_at_s: when [s] since the start.
        push_for_s: for so long [s].
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    distance_std: float = 0.0
    yaw_std_deg_per_m: float = 0.0
    wheel_radius_error: float = 0.0
    track_error: float = 0.0
    ticks_per_turn: int = 0
    load_slip: float = 0.0
    turn_slip: float = 0.0
    drag: float = 0.0
    push_n: float = 0.0
    push_at_s: float = 1.0
    push_for_s: float = 0.2

    def __post_init__(self) -> None:
        ranged(
            self,
            distance_std=(0.0, 1.0, SHARE),
            yaw_std_deg_per_m=(0.0, 90.0, "degrees"),
            wheel_radius_error=(-0.9, 10.0, SHARE),
            track_error=(-0.9, 10.0, SHARE),
            ticks_per_turn=(0, 10_000_000),
            load_slip=(0.0, 1.0, "s^2/m"),
            turn_slip=(0.0, 1.0, "s/rad"),
            drag=(-0.9, 0.9, SHARE),
            push_n=(-1000.0, 1000.0, "N"),
            push_at_s=(0.0, 1e6, "s"),
            push_for_s=(0.0, 60.0, "s"),
        )
        if 0 < self.ticks_per_turn < 8:
            raise ValueError(f"ticks_per_turn must be 0 (every angle) or at least 8, got {self.ticks_per_turn}")


EXACT = OdometryParams()


class Encoders:
    """Two encoders at work; with every setting at its default they read what the wheels turned.

    Attributes:
        params: what is wrong with them.
        radius: of the wheels, as the robot believes it [m].
        track: between them, as it believes it [m].
    """

    def __init__(self, params: OdometryParams = EXACT, *, seed: int = 0) -> None:
        """The encoders of a robot that `begin` names.

        Args:
            params: what is wrong with them.
            seed: of the run, for what is random about them.
        """
        self.params, self._seed = params, seed
        self._reads = params != EXACT
        self.radius = self.track = math.nan

    def begin(self, radius: float, track: float, wheels: tuple[float, float]) -> tuple[float, float]:
        """A new drive of a robot that stands still; what the encoders read now [rad].

        Args:
            radius: of its wheels, as it is [m].
            track: between them, as it is [m].
            wheels: what both turned so far [rad].
        """
        p = self.params
        self.radius, self.track = radius * (1.0 + p.wheel_radius_error), track * (1.0 + p.track_error)
        self._true = (radius, track)
        self._rng = np.random.default_rng([self._seed, _STREAM])
        self._left_of_stretch, self._further, self._turned = 0.0, 0.0, 0.0
        self._wheels, self._speeds, self._sum = wheels, (0.0, 0.0), list(wheels)
        return self._counted()

    def read(self, left: float, right: float, seconds: float) -> tuple[float, float]:
        """What the encoders read [rad] once the wheels turned to `left`, `right` [rad] in so many seconds."""
        if not self._reads:
            return left, right
        p, (radius, track) = self.params, self._true
        turned = (left - self._wheels[0], right - self._wheels[1])
        told = []
        for angle, before, drag in zip(turned, self._speeds, (max(p.drag, 0.0), max(-p.drag, 0.0)), strict=True):
            acceleration = abs(angle / seconds - before) / seconds * radius
            told.append(angle * (1.0 + p.load_slip * acceleration) / (1.0 - drag))
        middle, half = (told[0] + told[1]) / 2.0, (told[1] - told[0]) / 2.0
        half *= 1.0 + p.turn_slip * abs(turned[1] - turned[0]) * radius / track / seconds
        further, turn = self._drawn(abs(turned[0] + turned[1]) / 2.0 * radius)
        middle *= 1.0 + further
        half += turn * track / radius / 2.0
        self._wheels, self._speeds = (left, right), (turned[0] / seconds, turned[1] / seconds)
        self._sum[0] += middle - half
        self._sum[1] += middle + half
        return self._counted()

    def _drawn(self, way: float) -> tuple[float, float]:
        """The random errors on so much way [m]: share of it, and turn [rad]."""
        p = self.params
        if not (p.distance_std or p.yaw_std_deg_per_m):
            return 0.0, 0.0
        if self._left_of_stretch <= 0.0:
            self._left_of_stretch += STRETCH
            distance, yaw = self._rng.standard_normal(2)
            self._further = float(p.distance_std * distance)
            self._turned = float(math.radians(p.yaw_std_deg_per_m) * yaw)  # [rad/m]
        self._left_of_stretch -= way
        return self._further, self._turned * way

    def _counted(self) -> tuple[float, float]:
        ticks = self.params.ticks_per_turn
        if not ticks:
            return self._sum[0], self._sum[1]
        tick = math.tau / ticks
        return math.floor(self._sum[0] / tick) * tick, math.floor(self._sum[1] / tick) * tick

    @property
    def turn_step(self) -> float:
        """The least turn [rad] that both encoders tell for sure: of a tick each way."""
        return math.tau * self.radius / self.params.ticks_per_turn / self.track if self.params.ticks_per_turn else 0.0

    def push(self, time: float) -> float:
        """What pushes the robot to its left at `time` [s] since the start [N]."""
        p = self.params
        return p.push_n if p.push_n and p.push_at_s <= time < p.push_at_s + p.push_for_s else 0.0
