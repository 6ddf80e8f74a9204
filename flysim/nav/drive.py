"""The robot under command: bounded acceleration, contact watched, the way driven measured."""

from __future__ import annotations

import math

from flysim.geometry.frames import Pose2, wrap_angle
from flysim.sim.simulation import STEP_S, Simulation

# Beyond these the wheels slip. Measured on 3.5 m of random driving: odometry's heading is off by 0.6 degrees; with
# 1 m/s^2 and 5 rad/s^2 by 6 degrees.
ACCELERATION = 0.8  # [m/s^2]
TURN_ACCELERATION = 2.5  # [rad/s^2]
GRIP = 0.8  # [m/s^2] sideways, in curves
CHUNK, CHUNKS = 8, 3  # physics steps that a wheel command holds; such commands in a period
PERIOD_S = CHUNK * CHUNKS * STEP_S  # 0.1 s


class Drive:
    """Drives one simulation, period by period."""

    def __init__(self, simulation: Simulation) -> None:
        """Takes over a robot that stands still."""
        self._simulation = simulation
        self._v = self._w = 0.0
        self.driven = 0.0  # [m] by the truth
        self.velocity = (0.0, 0.0)  # [m/s], [rad/s] mean of the last period, by odometry
        self.true: Pose2 = simulation.true_pose()
        self.track = [(self.true.x, self.true.y)]  # [m] where it truly was

    @property
    def odometry(self) -> Pose2:
        """Where the wheels say it is."""
        return self._simulation.odometry.pose

    @property
    def seconds(self) -> float:
        """Of simulated time since the start."""
        return self._simulation.sim_time

    def go(self, v: float, w: float) -> str | None:
        """One period towards speed v [m/s] and yaw rate w [rad/s]; the name of what is hit, which ends it early."""
        before, dt, hit, seconds = self.odometry, CHUNK * STEP_S, None, 0.0
        ahead = 0.0
        for _ in range(CHUNKS):
            self._v += _limited(v - self._v, ACCELERATION * dt)
            curve = _limited(w, GRIP / max(self._v, 1e-3))
            self._w += _limited(curve - self._w, TURN_ACCELERATION * dt)
            last = self.odometry
            hit = self._simulation.advance(self._v, self._w, CHUNK)
            now, seconds = self.odometry, seconds + dt
            heading = last.yaw + wrap_angle(now.yaw - last.yaw) / 2.0
            ahead += (now.x - last.x) * math.cos(heading) + (now.y - last.y) * math.sin(heading)
            true = self._simulation.true_pose()
            self.driven += true.distance(self.true)
            self.true = true
            if hit is not None:
                break
        self.velocity = (ahead / seconds, wrap_angle(self.odometry.yaw - before.yaw) / seconds)
        self.track.append((self.true.x, self.true.y))
        return hit


def _limited(value: float, most: float) -> float:
    return min(max(value, -most), most)
