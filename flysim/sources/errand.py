"""What a robot is sent to do: a path through a world, with all that is wrong with the robot and the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flysim.errors import ScenarioError
from flysim.geometry.camera_info import CameraInfo
from flysim.geometry.plan_view import APART
from flysim.render.light import DAY, LightParams
from flysim.robots.robot import Robot
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import IDEAL, OFF, Cameras
from flysim.sensors.one_camera import OneCamera
from flysim.sensors.parameters import SensorParams
from flysim.sim.driving import SMOOTH, DriveParams
from flysim.sim.encoders import EXACT, OdometryParams
from flysim.sources.eyes import Eyes, OneEye, TwoEyes
from flysim.sources.pairing import PairRule
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
        measured: what a calibration has it believe of its left and its right camera; None: what its file has.
        measured_by: what that is from, for who reads the figures.
        light: in the world.
        driving: how it drives.
        odometry: how what its wheels tell differs from the way it goes.
        glances: whether it finds its way by what it sees; with two cameras it then looks on the way as well.
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
    odometry: OdometryParams = EXACT
    glances: bool = False
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
                "a calibration goes with a robot's two cameras: leave it out where one camera makes the pairs."
            )
        camera = OneCamera(self.robot.camera, self.sensors, self.calibration, seed=self.seed)
        path = [halt.pose.matrix @ self.robot.T_base_left for halt in self.path]
        return OneEye(camera, self.pairs, path, self.max_range, name=self.name)
