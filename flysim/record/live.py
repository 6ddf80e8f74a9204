"""A rerun viewer that follows an episode while it is driven."""

from __future__ import annotations

import math
import weakref
from contextlib import ExitStack

import numpy as np

from flysim.geometry.frames import Array, Pose2
from flysim.geometry.rig import ImagePair
from flysim.record.viewer import Viewer, has_screen, open_live


class LiveView:
    """Logs to the recording that the program has set up, by `rerun.init` and the like, else to a window of its own."""

    def __init__(self) -> None:
        """Opens a window if one is needed.

        Raises:
            RecordError: there is no viewer, or it ends at once.
        """
        import rerun

        self._rerun = rerun
        self._stream = rerun.get_global_data_recording()
        self._viewer: Viewer | None = None
        window = ExitStack()
        if self._stream is None and has_screen():
            self._viewer = window.enter_context(open_live())
            self._stream = rerun.RecordingStream("flysim-nav")
            self._stream.connect_grpc(self._viewer.url)
            window.callback(self._stream.disconnect)  # what is under way arrives before the window ends
        # No window outlives the program, whether or not somebody closes it.
        self._close = weakref.finalize(self, window.close)

    @property
    def watched(self) -> bool:
        """False where there is neither such a recording nor a screen, and when the window is gone."""
        return self._stream is not None and (self._viewer is None or self._viewer.process.poll() is None)

    def close(self) -> None:
        """Ends the window, if it is its own. Safe to call twice."""
        self._close()

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
        rr, stream = self._rerun, self._stream
        if stream is None or not self.watched:
            return
        stream.set_time("sim_time", duration=seconds)
        stream.log("eye/left", rr.Image(pair.left))
        stream.log("map/flies", rr.Points3D(flies, radii=0.02, colors=(220, 70, 30)))
        if seconds < 1e-9:
            stream.log("map/outline", rr.Points3D(np.c_[outline, np.zeros(len(outline))], radii=0.008))
            stream.log("map/goal", rr.Points3D([(*goal, 0.0)], radii=0.1, colors=(30, 150, 60)))
        tip = (0.3 * math.cos(robot.yaw), 0.3 * math.sin(robot.yaw), 0.0)
        stream.log("map/robot", rr.Arrows3D(origins=[(robot.x, robot.y, 0.1)], vectors=[tip], radii=0.04))
