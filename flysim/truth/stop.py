"""What truly was at a stop of a drive. For the truth's side alone: what the robot believes is a `products.Frame`."""

from __future__ import annotations

from dataclasses import dataclass

from flysim.geometry.frames import Array, Pose2
from flysim.worlds.view import TrueView


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stop:
    """One halt of a path, as it was and not as the robot believes.

    Attributes:
        index: of the frame that was taken here.
        commanded: where the scenario sends the robot, world frame.
        odometry: where its wheels say it is, for comparison. The odometry frame starts at the true start pose.
        true: where it is.
        T_world_base: `[4, 4]` true pose of base_link, with the tilt of a robot on real wheels.
        views: left and right true view; the right one is that of an earlier stop where one camera makes pairs. One
            alone where no frame was taken.
        T_world_links: `[n, 4, 4]` true poses of `World.links` at this moment.
        sim_time: seconds of simulated time since the start.
        track: `[n, 7]` since the stop before: sim_time, odometry x, y, yaw, true x, y, yaw.
        drive_s: wall-clock seconds spent driving here.
        render_s: wall-clock seconds spent drawing the pair.
    """

    index: int
    commanded: Pose2
    odometry: Pose2
    true: Pose2
    T_world_base: Array
    views: tuple[TrueView, TrueView] | tuple[TrueView]
    T_world_links: Array
    sim_time: float
    track: Array
    drive_s: float
    render_s: float

    @property
    def paired(self) -> bool:
        """Whether a frame was taken here."""
        return len(self.views) == 2
