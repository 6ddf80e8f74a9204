"""The files of a calibration: what ROS tools read, the figures, the picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from flysim.calibration.result import BoardCalibration
from flysim.geometry.camera_info import CameraInfo, write_camera_info
from flysim.studies.calibration.figure import calibration_png

FIGURES, PICTURE = "calibration.json", "residuals.png"


def write_calibration(room: Path, calibration: BoardCalibration, more: dict[str, Any]) -> None:
    """Writes `camera.yaml`, or `left.yaml` and `right.yaml`, the figures and the picture into a folder that is there.

    Raises:
        OSError: the disk is full or refuses.
    """
    write_infos(room, calibration.infos)
    (room / FIGURES).write_text(json.dumps({**calibration.to_json(), **more}, indent=1) + "\n", encoding="utf-8")
    (room / PICTURE).write_bytes(calibration_png(calibration))


def write_infos(room: Path, infos: dict[str, CameraInfo]) -> None:
    """A file an eye, by its name."""
    for name, info in infos.items():
        write_camera_info(room / f"{name}.yaml", info)
