"""How a robot looks at a stop: by two cameras at once, or by one, whose other eye is an earlier stop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from flysim.errors import ScenarioError
from flysim.geometry.frames import Array, inverse
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame
from flysim.products.shot import Shot
from flysim.render.choose import Renderer
from flysim.render.look import glance, look
from flysim.sensors.cameras import Cameras
from flysim.sensors.one_camera import OneCamera
from flysim.sim.simulation import Simulation
from flysim.sources.pairing import Pairing, PairRule, Refusal, partner, refused
from flysim.worlds.view import TrueView

Views = tuple[TrueView, TrueView] | tuple[TrueView]  # what truly was to be seen; one alone where there is no frame


class Eyes(Protocol):
    """Looks where a simulated robot stands."""

    @property
    def rig(self) -> StereoRig:
        """Of the frames, as the robot believes it; of one camera, that of the first pair of its path."""
        ...

    @property
    def planned(self) -> int | None:
        """Frames that a path gives; None: one a stop."""
        ...

    @property
    def disturbed(self) -> dict[str, dict[str, Any]]:
        """As `Cameras.disturbed`."""
        ...

    def look(self, simulation: Simulation, renderer: Renderer, index: int) -> tuple[Frame | None, Views]:
        """The frame of a stop, if there is one, and the truth behind it."""
        ...

    def glance(self, simulation: Simulation, renderer: Renderer, index: int) -> Frame:
        """A frame on the way, of which no truth is made."""
        ...

    def notes(self) -> tuple[str, ...]:
        """What became of the looks so far, one sentence each."""
        ...


class TwoEyes:
    """A stereo pair: each look is a frame.

    Attributes:
        true: the cameras as they truly are.
    """

    def __init__(self, cameras: Cameras) -> None:
        self._cameras = cameras
        self.rig, self.disturbed, self.planned = cameras.believed, cameras.disturbed, None
        self.true = cameras.true

    def look(self, simulation: Simulation, renderer: Renderer, index: int) -> tuple[Frame, Views]:
        """Both pictures, where odometry says that they were taken."""
        cameras = self._cameras
        pair, views = look(simulation, renderer, cameras.true)
        if cameras.drawn is not cameras.true:
            pair, _ = look(simulation, renderer, cameras.drawn)
        frame = Frame(
            index=index,
            time=simulation.sim_time,
            pair=cameras.take(pair, index),
            T_world_base=simulation.odometry.pose.matrix,
            T_base_left=simulation.robot.T_base_left,
        )
        return frame, views

    def glance(self, simulation: Simulation, renderer: Renderer, index: int) -> Frame:
        """Both pictures on the way."""
        cameras = self._cameras
        return Frame(
            index=index,
            time=simulation.sim_time,
            pair=cameras.take(glance(simulation, renderer, cameras.drawn), index),
            T_world_base=simulation.odometry.pose.matrix,
            T_base_left=simulation.robot.T_base_left,
            glance=True,
        )

    def notes(self) -> tuple[str, ...]:
        """None."""
        return ()


class OneEye:
    """One camera: a look is a frame where it makes a pair with an earlier one."""

    def __init__(
        self, camera: OneCamera, rule: PairRule, path: Sequence[Array], max_range: float, *, name: str = ""
    ) -> None:
        """Before the first look.

        Args:
            camera: the only one, or the left one.
            rule: which stops make a pair.
            path: `[4, 4]` optical frames in the world as the stops are planned, in order.
            max_range: depth of the farthest that is searched [m].
            name: of the scenario, for errors.

        Raises:
            ScenarioError: no two stops make a pair.
        """
        found = [partner(rule, camera.believed, path[: k + 1], max_range) for k in range(len(path))]
        pairs = [(k, other) for k, other in enumerate(found) if not isinstance(other, Refusal)]
        if not pairs:
            none = refused([one for one in found[1:] if isinstance(one, Refusal)], len(path), 0)
            why = none[0] if none else "one camera needs two stops."
            raise ScenarioError(
                f"scenario '{name}' has one camera and no pair: {why} Move the stops, or widen 'pairs'."
            )
        later, earlier = pairs[0]
        self.rig = StereoRig(
            left=camera.believed, right=camera.believed, T_right_left=inverse(path[earlier]) @ path[later]
        )
        self.planned, self.disturbed = len(pairs), camera.disturbed
        self._camera, self._pairing = camera, Pairing(rule, max_range)
        self._views: dict[int, TrueView] = {}

    def look(self, simulation: Simulation, renderer: Renderer, index: int) -> tuple[Frame | None, Views]:
        """The picture with an earlier one, both where odometry says that they were taken."""
        camera, T_base_left = self._camera, simulation.robot.T_base_left
        T_world_left = simulation.T_world_base() @ T_base_left
        view = renderer.view(camera.true, T_world_left)
        drawn = view if camera.drawn is camera.true else renderer.view(camera.drawn, T_world_left)
        self._views[index] = view
        shot = Shot(
            index=index,
            time=simulation.sim_time,
            image=camera.take(drawn.rgb, index),
            camera=camera.believed,
            T_world_base=simulation.odometry.pose.matrix,
            T_base_left=T_base_left,
        )
        frame = self._pairing.add(shot)
        if frame is None or frame.other is None:
            return None, (view,)
        return frame, (view, self._views[frame.other])

    def glance(self, simulation: Simulation, renderer: Renderer, index: int) -> Frame:
        """Nobody asks one camera to: its hops are short, and a glance has no pair (`SimulatedDrive`)."""
        raise AssertionError("a glance needs two cameras")

    def notes(self) -> tuple[str, ...]:
        """Which stops made no pair, and why."""
        return self._pairing.notes()
