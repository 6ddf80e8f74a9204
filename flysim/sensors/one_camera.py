"""The only camera of a robot: what is drawn for it, what it makes of it, and what the robot takes it for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.records import changed
from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.sensors.calibration import CalibrationParams, believed_camera
from flysim.sensors.cameras import IDEAL, OFF
from flysim.sensors.chip import read_out, stream
from flysim.sensors.distortion import margin
from flysim.sensors.exposure import AutoExposure, exposed
from flysim.sensors.optics import Lens
from flysim.sensors.parameters import SensorParams


class OneCamera:
    """A camera at work; with every setting at its default images pass untouched.

    Attributes:
        believed: the camera of the images that are taken, as the robot has it.
        drawn: what is to be drawn for `take`: the true pinhole, with a margin where a lens sees more than that.
    """

    def __init__(
        self,
        camera: Camera,
        sensors: SensorParams = OFF,
        calibration: CalibrationParams = IDEAL,
        *,
        seed: int = 0,
    ) -> None:
        """The camera before its first picture.

        Args:
            camera: as the robot's file has it.
            sensors: what it does to a picture.
            calibration: how it differs from what is believed.
            seed: of the run, for noise.

        Raises:
            FlysimError: a lens that folds the image, or a setting of a second camera.
        """
        self._sensors, self._calibration, self._seed = sensors, calibration, seed
        for table, settings in self.disturbed.items():
            for name in settings:
                if "right" in name or name in ("row_shift_px", "baseline_error"):
                    raise FlysimError(
                        f"{table}.{name} is of a second camera, and one camera makes these pairs: leave it out."
                    )
        self.believed, self.true = believed_camera(camera, calibration), camera
        self.drawn, self._lens = camera, None
        self._exposure = AutoExposure(sensors.auto_exposure, sensors.exposure_lag)
        if sensors != OFF:
            more = margin(camera, sensors)
            self._lens = Lens(camera, sensors, right=False, margin=more)
            if sensors.distorts:
                self.drawn = more.round(camera)

    def take(self, image: NDArray[np.uint8], index: int) -> NDArray[np.uint8]:
        """What the robot gets to see of what was drawn for `drawn`; the image itself where nothing is disturbed.

        Args:
            image: `[H, W, 3]` uint8.
            index: of the stop, for noise.
        """
        if self._lens is None:
            return image
        light = self._lens.light(image, 0.0)
        levels = exposed(light, self._sensors, right=False, factor=self._exposure.factor(light))
        return read_out(levels, self._sensors, stream(self._seed, index, 0))

    @property
    def disturbed(self) -> dict[str, dict[str, Any]]:
        """What is not as it should be, by table ("sensors", "calibration") and name; empty where all is."""
        tables = {"sensors": changed(self._sensors), "calibration": changed(self._calibration)}
        return {name: table for name, table in tables.items() if table}
