"""A drive that is written down: each frame goes on with what truly was, and on the way too, many times a second."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flysim.errors import ScenarioError
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame
from flysim.render.choose import Renderer
from flysim.sim.simulation import Simulation
from flysim.sources.errand import Errand
from flysim.sources.eyes import TwoEyes
from flysim.sources.simulated import SimulatedDrive, stop_here
from flysim.sources.way import drive
from flysim.truth.stop import Stop
from flysim.worlds.model import World


class FilmedDrive(SimulatedDrive):
    """A simulated drive whose frames are for whoever writes them down.

    Raises:
        ScenarioError: its frames are pairs of two stops, each with a rig of its own.
    """

    def __init__(self, errand: Errand, simulation: Simulation, eyes: Renderer, began: float | None = None) -> None:
        super().__init__(errand, simulation, eyes, began)
        if not isinstance(self._looking, TwoEyes):
            raise ScenarioError(
                f"scenario '{errand.name}' has pairs of stops, each with a rig of its own, and a data set has one rig: "
                'write down one with pairs = "stereo".'
            )
        self._true_rig = self._looking.true

    @property
    def world(self) -> World:
        """What stands there."""
        return self._errand.world

    @property
    def true_rig(self) -> StereoRig:
        """The cameras as they truly are."""
        return self._true_rig

    @property
    def blocked(self) -> str | None:
        """None, or where and by what the drive was ended early."""
        return self._blocked

    @property
    def disturbed(self) -> dict[str, Any]:
        """What made the frames other than they should be, as `Truth.disturbed`."""
        return self._disturbed()

    def stops(self, sink: Callable[[Frame, Stop], None]) -> None:
        """Drives from stop to stop and hands on the frame of each, with what truly was."""
        for frame in self.frames():
            if not frame.glance:
                sink(frame, self._stops[-1])

    def film(self, fps: float, sink: Callable[[Frame, Stop], None]) -> None:
        """Drives the whole path and looks on the way; of what it sees it keeps nothing.

        Args:
            fps: frames a second of simulated time [1/s]; the driver looks 60 times.
            sink: is given each frame and what truly was, as it is taken.
        """
        simulation, taken = self._simulation, 0

        def look_on_the_way() -> None:
            nonlocal taken
            if simulation.sim_time + 1e-9 >= taken / fps:
                frame, stop = stop_here(simulation, self._eyes, looking=self._looking, index=taken)
                assert frame is not None  # two cameras make one at every look
                sink(frame, stop)
                taken += 1

        look_on_the_way()
        for index, halt in enumerate(self._errand.path):
            leg = drive(simulation, halt, self._errand.driving, watch=look_on_the_way)
            if leg.blocked is not None:
                self._blocked = f"blocked at stop {index + 1} of {self.planned} {leg.blocked}"
                return
