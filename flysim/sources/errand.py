"""What a robot is sent to do: a path through a world, with all that is wrong with the robot and the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flysim.geometry.plan_view import APART
from flysim.render.light import DAY, LightParams
from flysim.robots.robot import Robot
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import IDEAL, OFF, Cameras
from flysim.sensors.parameters import SensorParams
from flysim.sim.driving import SMOOTH, DriveParams
from flysim.sim.encoders import EXACT, OdometryParams
from flysim.sources.way import Halt
from flysim.worlds.model import World


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
        seed: of all that is random about sensors, wheels and whoever sees.
        texture: what the surfaces were given, such as "speckle" or "contrast 0.5"; None: what the world's file has.
        notes: what a reader of the figures should know, one sentence each.
        sensors: what its cameras do to a picture.
        calibration: how its cameras differ from what it believes.
        light: in the world.
        driving: how it drives.
        odometry: how what its wheels tell differs from the way it goes.
        glances: whether it looks on the way, to find that by what it sees.
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
    light: LightParams = DAY
    driving: DriveParams = SMOOTH
    odometry: OdometryParams = EXACT
    glances: bool = False

    def cameras(self) -> Cameras:
        """The robot's two cameras as they are in this drive.

        Raises:
            FlysimError: a lens that folds the image.
        """
        return Cameras(self.robot.rig, self.sensors, self.calibration, seed=self.seed)
