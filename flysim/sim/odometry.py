"""Where the wheels say the robot is: encoder readings integrated along arcs."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flysim.geometry.frames import Pose2, wrap_angle


@dataclass(frozen=True, slots=True, kw_only=True)
class Odometry:
    """A pose dead-reckoned from two wheel encoders.

    Attributes:
        pose: base_link in the odometry frame.
        wheels: last readings of the left and right encoder [rad].
        radius: wheel radius [m].
        track: distance between the wheels [m].
    """

    pose: Pose2
    wheels: tuple[float, float]
    radius: float
    track: float

    def advanced(self, left: float, right: float) -> Odometry:
        """The odometry after the encoders read `left`, `right` [rad]: the arc a rigid axle drives, exactly."""
        d_left = (left - self.wheels[0]) * self.radius
        d_right = (right - self.wheels[1]) * self.radius
        distance, turn = (d_left + d_right) / 2.0, (d_right - d_left) / self.track
        chord = distance if abs(turn) < 1e-9 else distance * math.sin(turn / 2.0) / (turn / 2.0)
        heading = self.pose.yaw + turn / 2.0
        pose = Pose2(
            self.pose.x + chord * math.cos(heading),
            self.pose.y + chord * math.sin(heading),
            wrap_angle(self.pose.yaw + turn),
        )
        return Odometry(pose=pose, wheels=(left, right), radius=self.radius, track=self.track)
