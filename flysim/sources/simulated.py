"""A robot that drives a path through a simulated world and looks at each stop: frames, and the truth behind them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from flysim.common.records import changed
from flysim.errors import ScenarioError
from flysim.geometry.frames import Array, Pose2, frozen, inverse, yaw_of
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame, FrameSequence
from flysim.render.choose import Renderer, RendererName
from flysim.render.studio import drawn
from flysim.sensors.cameras import Cameras
from flysim.sim.encoders import Encoders
from flysim.sim.simulation import Simulation
from flysim.sources.errand import Errand
from flysim.sources.eyes import Eyes, TwoEyes
from flysim.sources.glances import glances
from flysim.sources.way import Halt, drive
from flysim.truth.stop import Stop
from flysim.truth.truth import Truth

NEAR = 0.03  # [m] so near a stop, a robot that sees where it stands does not turn about for the rest


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
    start, wheels = errand.path[0].pose, Encoders(errand.odometry, seed=errand.seed)
    with drawn(errand.world, errand.robot, start, renderer, errand.light, wheels) as (simulation, eyes):
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
        self._taken: list[Frame] = []
        self._known: list[Pose2] = []
        self._stops: list[Stop] = []
        self._blocked: str | None = None
        self._T_odometry_world: Array | None = None  # the two begin as one
        self._near = NEAR if errand.glances else 0.0

    @property
    def rig(self) -> StereoRig:
        """The robot's own cameras, as it believes them; of one camera, those of the first pair of its path."""
        return self._looking.rig

    @property
    def planned(self) -> int:
        """The stops of the path, or the pairs that they make of one camera."""
        return len(self._errand.path) if self._looking.planned is None else self._looking.planned

    def frames(self) -> Iterator[Frame]:
        """Drives from stop to stop, with looks on the way if it glances; ends early where the way is blocked."""
        for index, halt in enumerate(self._errand.path):
            way, tracks, seconds = self._way(halt), [], 0.0
            for k, goal in enumerate(way):
                began = time.perf_counter()
                leg = drive(self._simulation, goal, self._errand.driving, self._T_odometry_world, near=self._near)
                tracks.append(leg.track)
                seconds += time.perf_counter() - began
                if leg.blocked is not None:
                    self._seconds += seconds
                    self._blocked = f"blocked at stop {index + 1} of {len(self._errand.path)} {leg.blocked}"
                    return
                if k < len(way) - 1:
                    yield self._glance()
            began, drive_s = time.perf_counter() - seconds, seconds
            frame, stop = stop_here(
                self._simulation,
                self._eyes,
                looking=self._looking,
                index=index,
                commanded=halt.pose,
                track=tracks[0] if len(tracks) == 1 else np.concatenate(tracks),
                drive_s=drive_s,
            )
            self._stops.append(stop)
            self._seconds += time.perf_counter() - began
            if frame is not None:
                self._take(frame)
                yield frame

    def _way(self, halt: Halt) -> list[Halt]:
        """The halts on the way to a stop, and that one."""
        if not self._errand.glances or self._errand.pairs is not None or not self._known:
            return [halt]
        return [*glances(self._here(), halt, self._known, self._errand.driving)]

    def _here(self) -> Pose2:
        """Where the robot believes to stand, world frame."""
        T = self._simulation.odometry.pose.matrix
        if self._T_odometry_world is not None:
            T = inverse(self._T_odometry_world) @ T
        return Pose2(float(T[0, 3]), float(T[1, 3]), yaw_of(T))

    def _glance(self) -> Frame:
        began = time.perf_counter()
        index = len(self._errand.path) + sum(frame.glance for frame in self._taken)
        frame = self._looking.glance(self._simulation, self._eyes, index)
        self._take(frame)
        self._seconds += time.perf_counter() - began
        return frame

    def _take(self, frame: Frame) -> None:
        self._taken.append(frame)
        self._known.append(self._here())

    @property
    def taken(self) -> tuple[Frame, ...]:
        """All frames so far, glances too."""
        return tuple(self._taken)

    def stands(self, T_world_base: Array) -> None:
        """The robot knows better than its wheels where it stands, and drives on from there; odometry stays as it is."""
        self._T_odometry_world = self._simulation.odometry.pose.matrix @ inverse(T_world_base)
        self._known[-1] = self._here()

    def sequence(self) -> FrameSequence:
        """What was taken so far."""
        return FrameSequence(
            name=self._errand.name,
            seed=self._errand.seed,
            renderer=self._eyes.name,
            frames=tuple(frame for frame in self._taken if not frame.glance),
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
            disturbed=self._disturbed(),
        )

    def _disturbed(self) -> dict[str, dict[str, Any]]:
        """What made the frames other than they should be, as `Truth.disturbed`."""
        tables = {"light": changed(self._errand.light), "odometry": changed(self._errand.odometry)}
        found = {**self._looking.disturbed, **{name: table for name, table in tables.items() if table}}
        if self._errand.measured_by:
            found["calibration"] = {**found.get("calibration", {}), "by": self._errand.measured_by}
        return found


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
