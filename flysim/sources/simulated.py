"""A robot that drives a path through a simulated world and looks at each stop: frames, and the truth behind them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from flysim.common.records import changed
from flysim.errors import ScenarioError
from flysim.geometry.camera_info import CameraInfo
from flysim.geometry.frames import Array, Pose2, frozen
from flysim.geometry.plan_view import APART
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame, FrameSequence
from flysim.render.choose import Renderer, RendererName
from flysim.render.light import DAY, LightParams
from flysim.render.studio import drawn
from flysim.robots.robot import Robot
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import IDEAL, OFF, Cameras
from flysim.sensors.one_camera import OneCamera
from flysim.sensors.parameters import SensorParams
from flysim.sim.driving import SMOOTH, DriveParams, Leg, drive_to
from flysim.sim.simulation import Simulation
from flysim.sources.eyes import Eyes, OneEye, TwoEyes
from flysim.sources.pairing import PairRule
from flysim.truth.stop import Stop
from flysim.truth.truth import Truth
from flysim.worlds.model import World


class Halt(Protocol):
    """Where a path stops, and how to get there."""

    @property
    def pose(self) -> Pose2:
        """Where to stop [m, rad, world frame]."""
        ...

    @property
    def via(self) -> Sequence[tuple[float, float]]:
        """Points x, y [m] that are driven through on the way there."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Errand:
    """A path to be driven, by whom, and where.

    Attributes:
        name: of the scenario.
        world: what stands there.
        robot: who drives.
        path: where it stops; it starts at the first one.
        max_range: [m] along the left optical axis; what is farther is no part of the truth.
        merge_gap: bodies that touch or stand closer than this are one obstacle of the truth [m].
        seed: of whoever sees; the drive itself takes nothing from it.
        texture: what the surfaces were given, such as "speckle" or "contrast 0.5"; None: what the world's file has.
        notes: what a reader of the figures should know, one sentence each.
        sensors: what its cameras do to a picture.
        calibration: how its cameras differ from what it believes.
        measured: what a calibration has it believe of its left and its right camera; None: what its file has.
        measured_by: what that is from, for who reads the figures.
        light: in the world.
        driving: how it drives.
        pairs: which stops are two eyes; None: the robot has two.
    """

    name: str
    world: World
    robot: Robot
    path: Sequence[Halt]
    max_range: float
    merge_gap: float = APART
    seed: int = 0
    texture: str | None = None
    notes: tuple[str, ...] = ()
    sensors: SensorParams = OFF
    calibration: CalibrationParams = IDEAL
    measured: tuple[CameraInfo, CameraInfo] | None = None
    measured_by: str = ""
    light: LightParams = DAY
    driving: DriveParams = SMOOTH
    pairs: PairRule | None = None

    def eyes(self) -> Eyes:
        """How the robot looks in this drive.

        Raises:
            FlysimError: a lens that folds the image, two eyes asked of a robot with one, or no two stops that make a
                pair of its one.
        """
        if self.pairs is None:
            cameras = Cameras(self.robot.rig, self.sensors, self.calibration, measured=self.measured, seed=self.seed)
            return TwoEyes(cameras)
        if self.measured is not None:
            raise ScenarioError(
                "a calibration of two cameras goes with a robot's pair: leave `calibration = FILE` out where one "
                "camera makes the pairs."
            )
        camera = OneCamera(self.robot.camera, self.sensors, self.calibration, seed=self.seed)
        path = [halt.pose.matrix @ self.robot.T_base_left for halt in self.path]
        return OneEye(camera, self.pairs, path, self.max_range, name=self.name)


@contextmanager
def simulated(
    errand: Errand,
    renderer: RendererName = "auto",
    *,
    began: float | None = None,
    kind: type[SimulatedDrive] | None = None,
) -> Iterator[Any]:
    """A drive that is about to begin, with its simulation and its renderer, which are closed when the block ends.

    Args:
        errand: what is to be driven.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.
        began: `time.perf_counter()` when work on it began; None: now.
        kind: of the drive; None: `SimulatedDrive`.

    Raises:
        FlysimError: a stop stands in an obstacle, the world or the robot cannot be used, or nothing draws them here.
    """
    began = time.perf_counter() if began is None else began
    with drawn(errand.world, errand.robot, errand.path[0].pose, renderer, errand.light) as (simulation, eyes):
        _refuse_taken(errand, simulation)
        yield (kind or SimulatedDrive)(errand, simulation, eyes, began)


def refuse_taken(errand: Errand) -> None:
    """Refuses what a drive would refuse before it sets out, without a renderer.

    Raises:
        FlysimError: as `simulated`.
    """
    errand.eyes()
    with Simulation(errand.world, errand.robot, errand.path[0].pose) as simulation:
        _refuse_taken(errand, simulation)


def _refuse_taken(errand: Errand, simulation: Simulation) -> None:
    for index, halt in enumerate(errand.path):
        model = simulation.occupied(halt.pose)
        if model is not None:
            raise ScenarioError(
                f"scenario '{errand.name}': stop {index + 1} of {len(errand.path)} at ({halt.pose.x:g}, "
                f"{halt.pose.y:g}) stands in '{model}': move it; the robot needs {simulation.robot.radius:.2f} m "
                "about its axis."
            )


class SimulatedDrive:
    """A `Source`: its frames are taken as it drives, so an engine may see each while the next is still far."""

    def __init__(self, errand: Errand, simulation: Simulation, eyes: Renderer, began: float | None = None) -> None:
        """A drive from where the robot of the simulation stands.

        Args:
            errand: what is to be driven.
            simulation: of its world and robot.
            eyes: what draws that simulation.
            began: `time.perf_counter()` when work on it began; None: now.
        """
        self._errand, self._simulation, self._eyes = errand, simulation, eyes
        self._looking = errand.eyes()
        now = time.perf_counter()
        self._seconds = 0.0 if began is None else now - began
        self._frames: list[Frame] = []
        self._stops: list[Stop] = []
        self._blocked: str | None = None

    @property
    def rig(self) -> StereoRig:
        """The robot's own cameras, as it believes them; of one camera, those of the first pair of its path."""
        return self._looking.rig

    @property
    def planned(self) -> int:
        """The stops of the path, or the pairs that they make of one camera."""
        return len(self._errand.path) if self._looking.planned is None else self._looking.planned

    def frames(self) -> Iterator[Frame]:
        """Drives from stop to stop; ends before the last one where the way is blocked."""
        for index, halt in enumerate(self._errand.path):
            began = time.perf_counter()
            leg = drive(self._simulation, halt, self._errand.driving)
            drive_s = time.perf_counter() - began
            if leg.blocked is not None:
                self._seconds += drive_s
                self._blocked = f"blocked at stop {index + 1} of {len(self._errand.path)} {leg.blocked}"
                return
            frame, stop = stop_here(
                self._simulation,
                self._eyes,
                looking=self._looking,
                index=index,
                commanded=halt.pose,
                track=leg.track,
                drive_s=drive_s,
            )
            self._stops.append(stop)
            self._seconds += time.perf_counter() - began
            if frame is not None:
                self._frames.append(frame)
                yield frame

    def sequence(self) -> FrameSequence:
        """What was taken so far."""
        return FrameSequence(
            name=self._errand.name,
            seed=self._errand.seed,
            renderer=self._eyes.name,
            frames=tuple(self._frames),
            planned=self.planned,
            blocked=self._blocked,
            texture=self._errand.texture,
            notes=(*self._errand.notes, *self._looking.notes()),
            seconds=self._seconds,
        )

    def truth(self) -> Truth:
        """What truly stood there, and what was visible of it from the stops so far."""
        return Truth.of(
            self._errand.world,
            self._stops,
            max_range=self._errand.max_range,
            merge_gap=self._errand.merge_gap,
            disturbed={
                **self._looking.disturbed,
                **self._measured(),
                **({"light": light} if (light := changed(self._errand.light)) else {}),
            },
        )

    def _measured(self) -> dict[str, dict[str, Any]]:
        """What is to be told of the robot's calibration, beside how its cameras truly stand."""
        if not self._errand.measured_by:
            return {}
        return {"calibration": {**self._looking.disturbed.get("calibration", {}), "by": self._errand.measured_by}}


def drive(
    simulation: Simulation, halt: Halt, params: DriveParams = SMOOTH, *, watch: Callable[[], None] | None = None
) -> Leg:
    """Drives to a stop over the points on the way; their tracks are one. `watch` is `drive_to`'s."""
    tracks, go = [], drive_to if watch is None else partial(drive_to, watch=watch)
    for x, y in halt.via:
        here = simulation.odometry.pose
        leg = go(simulation, Pose2(x, y, math.atan2(y - here.y, x - here.x)), params)
        tracks.append(leg.track)
        if leg.blocked is not None:
            return Leg(blocked=leg.blocked, track=np.concatenate(tracks))
    leg = go(simulation, halt.pose, params)
    return leg if not tracks else Leg(blocked=leg.blocked, track=np.concatenate([*tracks, leg.track]))


def stop_here(
    simulation: Simulation,
    eyes: Renderer,
    *,
    looking: Eyes | None = None,
    index: int = 0,
    commanded: Pose2 | None = None,
    track: Array | None = None,
    drive_s: float = 0.0,
) -> tuple[Frame | None, Stop]:
    """What the robot sees from where it stands now: what it believes of that, and what truly is.

    Args:
        simulation: where it stands.
        eyes: what draws that simulation.
        looking: how it looks; None: by its own two cameras, without a flaw. The truth is that of the pinholes.
        index: of the stop.
        commanded: where it was sent; None: where it is.
        track: `[n, 7]` of the way here, as `Stop.track`; None: it did not drive.
        drive_s: wall-clock seconds of the way here.
    """
    began = time.perf_counter()
    looking = TwoEyes(Cameras(simulation.robot.rig)) if looking is None else looking
    frame, views = looking.look(simulation, eyes, index)
    true = simulation.true_pose()
    stop = Stop(
        index=index,
        commanded=true if commanded is None else commanded,
        odometry=simulation.odometry.pose,
        true=true,
        T_world_base=frozen(simulation.T_world_base()),
        views=views,
        T_world_links=frozen(simulation.T_world_links()),
        sim_time=simulation.sim_time,
        track=np.zeros((0, 7)) if track is None else frozen(track),
        drive_s=drive_s,
        render_s=time.perf_counter() - began,
    )
    return frame, stop
