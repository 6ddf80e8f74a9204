"""The two cameras of a robot: what is drawn for them, what they make of it, and what the robot takes them for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.calibration.undistort import Straight
from flysim.common.records import changed
from flysim.geometry.camera_info import CameraInfo
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.sensors.calibration import CalibrationParams, believed_rig, true_rig
from flysim.sensors.chip import read_out, stream
from flysim.sensors.distortion import margin
from flysim.sensors.exposure import AutoExposure, exposed
from flysim.sensors.optics import Lens, Levels
from flysim.sensors.parameters import SensorParams

OFF, IDEAL = SensorParams(), CalibrationParams()


class Cameras:
    """A pair of cameras at work; with every setting at its default all three rigs are one, and images pass untouched.

    Attributes:
        believed: the rig of the images that are taken, as the robot has it.
        true: the pinholes as they truly stand.
        drawn: what is to be drawn for `take`: `true`, with a margin where a lens sees more than a pinhole.
    """

    def __init__(
        self,
        rig: StereoRig,
        sensors: SensorParams = OFF,
        calibration: CalibrationParams = IDEAL,
        *,
        measured: tuple[CameraInfo, CameraInfo] | None = None,
        seed: int = 0,
    ) -> None:
        """The cameras before their first frame.

        Args:
            rig: as the robot's file has it.
            sensors: what they do to a picture.
            calibration: how they differ from what is believed.
            measured: what a calibration has the robot believe of its left and its right camera, in place of its file:
                it then takes their lenses out of its images.
            seed: of the run, for noise.

        Raises:
            FlysimError: a lens that folds the image, or a calibration of no pair.
        """
        self._sensors, self._calibration = sensors, calibration
        self._straight = None if measured is None else Straight(*measured)
        own = rig if self._straight is None else self._straight.rig
        self.believed, self.true = believed_rig(own, calibration), true_rig(rig, calibration)
        self.drawn, self._lenses = self.true, ()
        if sensors != OFF:
            left, right = self.true.left, self.true.right
            more = margin(left, sensors).union(margin(right, sensors))  # one: who draws may want one size for both
            self._lenses = (
                Lens(left, sensors, right=False, margin=more),
                Lens(right, sensors, right=True, margin=more),
            )
            if sensors.distorts:
                self.drawn = replace(self.true, left=more.round(left), right=more.round(right))
        self.begin(seed)

    def begin(self, seed: int) -> None:
        """A new run or episode: no frame was taken, and noise is of that seed."""
        self._seed = seed
        self._exposure = AutoExposure(self._sensors.auto_exposure, self._sensors.exposure_lag)

    def take(self, pair: ImagePair, index: int, turn_rate: float = 0.0) -> ImagePair:
        """What the robot gets to see; the pair itself where nothing is disturbed.

        Args:
            pair: drawn for the rig `drawn`.
            index: of the frame in its run, for noise.
            turn_rate: [rad/s] of the robot, counter-clockwise.
        """
        if not self._lenses:
            return self._seen(pair.left, pair.right) if self._straight or pair.rig is not self.believed else pair
        left, right = self._lenses
        lights = (left.light(pair.left, turn_rate), right.light(pair.right, turn_rate))
        factor = self._exposure.factor(lights[0])
        images = [self._image(light, index, eye, factor) for eye, light in enumerate(lights)]
        return self._seen(*images)

    def _seen(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> ImagePair:
        if self._straight is not None:
            left, right = self._straight.images(left, right)
        return ImagePair(left=left, right=right, rig=self.believed)

    def _image(self, light: Levels, index: int, eye: int, factor: float) -> NDArray[np.uint8]:
        levels = exposed(light, self._sensors, right=eye == 1, factor=factor)
        return read_out(levels, self._sensors, stream(self._seed, index, eye))

    @property
    def disturbed(self) -> dict[str, dict[str, Any]]:
        """What is not as it should be, by table ("sensors", "calibration") and name; empty where all is."""
        tables = {"sensors": changed(self._sensors), "calibration": changed(self._calibration)}
        return {name: table for name, table in tables.items() if table}
