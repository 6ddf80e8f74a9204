"""The one driving loop: speeds that change no faster than they may, and contact watched at every command."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.common.ranges import ranged
from flysim.sim.simulation import STEP_S, Simulation


@dataclass(frozen=True, slots=True, kw_only=True)
class WheelLimits:
    """How fast a command to the wheels may change. Beyond what tyres hold they slip, and odometry drifts.

    Attributes:
        acceleration: of the speed [m/s^2].
        turn_acceleration: of the yaw rate [rad/s^2].
        grip: sideways, in curves: a faster robot turns more slowly [m/s^2].
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    acceleration: float
    turn_acceleration: float
    grip: float = 1e6

    def __post_init__(self) -> None:
        ranged(
            self,
            acceleration=(0.01, 100.0, "m/s^2"),
            turn_acceleration=(0.01, 1000.0, "rad/s^2"),
            grip=(0.01, 1e6, "m/s^2"),
        )


class Wheels:
    """Drives one simulation towards commanded speeds.

    Attributes:
        v: speed that the wheels turn for now [m/s].
        w: their yaw rate [rad/s].
    """

    def __init__(self, simulation: Simulation, limits: WheelLimits) -> None:
        """Takes over a robot that stands still."""
        self.v = self.w = 0.0
        self._simulation, self._limits = simulation, limits

    def towards(self, v: float, w: float, *, chunk: int, chunks: int = 1) -> str | None:
        """One command, held for `chunks` times `chunk` physics steps; the name of what is hit, which ends it early.

        Args:
            v: speed that is wanted [m/s].
            w: yaw rate that is wanted [rad/s].
            chunk: steps between two looks for contact and at the encoders, a power of two.
            chunks: so many times.
        """
        limits, dt = self._limits, chunk * chunks * STEP_S
        self.v += limited(v - self.v, limits.acceleration * dt)
        curve = limited(w, limits.grip / max(self.v, 1e-3))
        self.w += limited(curve - self.w, limits.turn_acceleration * dt)
        for _ in range(chunks):
            hit = self._simulation.advance(self.v, self.w, chunk)
            if hit is not None:
                return hit
        return None


def limited(value: float, most: float) -> float:
    """The value, at most so far from 0."""
    return min(max(value, -most), most)
