"""`render_mode="rerun"`: an episode moment by moment, in a window or in the recording that the program has set up."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import gymnasium as gym

from flysim.geometry.frames import Array, transform
from flysim.geometry.rig import ImagePair
from flysim.nav.drive import Drive
from flysim.paths.course import Course, Ground

if TYPE_CHECKING:
    from flysim.record.live import LiveView


class Screen:
    """One environment's window; opened at the first moment that is shown."""

    def __init__(self) -> None:
        """Opens nothing yet."""
        self._live: LiveView | None = None

    def show(
        self, seen: Callable[[], tuple[ImagePair, Array, Array]], drive: Drive, ground: Ground, course: Course
    ) -> None:
        """Shows the present moment; without a screen and a recording it says once that it does not.

        Args:
            seen: as `FlyNavEnv.seen`; called if somebody watches.
            drive: how far it is.
            ground: what stands there.
            course: where it goes.

        Raises:
            RecordError: there is no viewer, or it ends at once.
        """
        if self._live is None:
            from flysim.record.live import LiveView

            self._live = LiveView()
            if not self._live.watched:
                gym.logger.warn(
                    "render_mode 'rerun' shows nothing: there is no screen for a window, and no recording. Call "
                    "rerun.init(...) and rerun.save(...) before the first reset."
                )
        if self._live.watched:
            pair, points, _ = seen()
            flies = transform(drive.odometry.matrix, points)
            self._live.show(drive.seconds, pair, flies, ground.outline, drive.true, course.goal)

    def close(self) -> None:
        """Ends the window. Safe to call twice."""
        if self._live is not None:
            self._live.close()
            self._live = None
