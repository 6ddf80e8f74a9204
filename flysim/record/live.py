"""A rerun viewer that follows an episode while it is driven."""

from __future__ import annotations

import math

import numpy as np

from flysim.geometry.frames import Array, Pose2
from flysim.geometry.rig import ImagePair


class LiveView:
    """Logs to rerun's stream of this process; opens a viewer if nobody has set one up."""

    def __init__(self) -> None:
        """Uses the recording that the program has set up (`rerun.init`, `rerun.save`), else spawns a viewer."""
        import rerun

        if rerun.get_global_data_recording() is None:
            rerun.init("flysim-nav", spawn=True)
        self._rerun = rerun

    def show(
        self, seconds: float, pair: ImagePair, flies: Array, outline: Array, robot: Pose2, goal: tuple[float, float]
    ) -> None:
        """Logs one moment.

        Args:
            seconds: of simulated time.
            pair: what the robot sees.
            flies: `[n, 3]` [m], odometry frame.
            outline: `[m, 2]` [m] of all that stands there.
            robot: where it truly is.
            goal: x, y [m].
        """
        rr = self._rerun
        rr.set_time("sim_time", duration=seconds)
        rr.log("eye/left", rr.Image(pair.left))
        rr.log("map/flies", rr.Points3D(flies, radii=0.02, colors=(220, 70, 30)))
        if seconds < 1e-9:
            rr.log("map/outline", rr.Points3D(np.c_[outline, np.zeros(len(outline))], radii=0.008))
            rr.log("map/goal", rr.Points3D([(*goal, 0.0)], radii=0.1, colors=(30, 150, 60)))
        tip = (0.3 * math.cos(robot.yaw), 0.3 * math.sin(robot.yaw), 0.0)
        rr.log("map/robot", rr.Arrows3D(origins=[(robot.x, robot.y, 0.1)], vectors=[tip], radii=0.04))
