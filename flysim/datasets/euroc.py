"""EuRoC's layout, ASL's: `mav0/cam0/`, `cam1/` with data.csv, sensor.yaml and pictures named by nanoseconds.

Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 2016. `mav0/state_groundtruth_estimate0/data.csv` has the
true poses of the body, base_link, in the world; `mav0/odometry0/data.csv` the believed ones. Pictures stay in colour.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from flysim.datasets.layout import MAX_FRAMES, MAX_TEXT, Eyes, Header, Recorded, Writer, plain_line, save_picture
from flysim.datasets.poses import nearest, posed, read_rows
from flysim.errors import FlysimError
from flysim.foreign.files import read_text
from flysim.foreign.folder import inside
from flysim.foreign.image import read_image
from flysim.geometry.calibration.choose import read_calibration
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, inverse, quaternion_xyzw
from flysim.plain import shown, shown_path
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop

MAV = "mav0"
CAMERAS = ("cam0", "cam1")
STATES = ("odometry0", "state_groundtruth_estimate0")
NS = 1_000_000_000
SOON = 0.02  # [s] between a picture and its pose
_HEAD = (
    "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], "
    "v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], "
    "b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n"
)
_T_BS = re.compile(r"^T_BS:.*?data:\s*\[([^\]]*)\]", re.MULTILINE | re.DOTALL)


class Euroc:
    """The format `euroc`."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes `mav0`."""
        return _EurocWriter(folder, header)

    def holds(self, folder: Path) -> bool:
        """Whether it has `mav0` with two cameras, or is it."""
        return _mav(folder) is not None

    def read(self, folder: Path) -> Recorded:
        """The pairs of both cameras."""
        mav = _mav(folder)
        assert mav is not None
        lists = [_listed(folder, mav / camera) for camera in CAMERAS]
        stamps = [[stamp for stamp, _ in rows] for rows in lists]
        if not lists[0] or stamps[0] != stamps[1]:
            raise FlysimError(
                f"{shown_path(mav)}: {len(stamps[0])} pictures in cam0, {len(stamps[1])} in cam1: both eyes need the "
                "same timestamps."
            )
        times = tuple((stamp - stamps[0][0]) / NS for stamp in stamps[0])

        def read(k: int) -> Eyes:
            return read_image(lists[0][k][1]), read_image(lists[1][k][1])

        where = str(mav.relative_to(folder))
        files = [inside(folder, f"{where}/{camera}/sensor.yaml") for camera in CAMERAS]
        return Recorded(
            times=times,
            eyes=read,
            calibration=partial(read_calibration, files),
            T_world_left=_poses(folder, mav, stamps[0]),
        )


class _EurocWriter:
    def __init__(self, folder: Path, header: Header) -> None:
        self._mav, self._header = folder / MAV, header
        for camera in CAMERAS:
            (self._mav / camera / "data").mkdir(parents=True)
        for name in STATES:
            (self._mav / name).mkdir()
        for name, rig in (("sensor.yaml", header.believed), ("sensor_true.yaml", header.true)):
            poses = (header.T_base_left, header.T_base_left @ inverse(rig.T_right_left))
            for camera, pinhole, T in zip(CAMERAS, (rig.left, rig.right), poses, strict=True):
                text = sensor_text(pinhole, T, header.fps)
                (self._mav / camera / name).write_text(text, encoding="ascii")
        self._pictures: list[str] = []
        self._states: dict[str, list[str]] = {name: [] for name in STATES}

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
        stamp = round(frame.time * NS)
        for camera, image in zip(CAMERAS, (frame.pair.left, frame.pair.right), strict=True):
            save_picture(self._mav / camera / "data" / f"{stamp:019d}.png", image)
        self._pictures.append(f"{stamp},{stamp:019d}.png\n")
        for name, T in zip(STATES, (frame.T_world_base, stop.T_world_base), strict=True):
            x, y, z, w = quaternion_xyzw(T[:3, :3])
            values = plain_line([*T[:3, 3], w, x, y, z, *np.zeros(9)]).replace(" ", ",")
            self._states[name].append(f"{stamp},{values}\n")

    def add_obstacles(self, time: float, obstacles: tuple[TrueObstacle, ...]) -> None:
        pass

    def finish(self) -> None:
        for camera in CAMERAS:
            text = "#timestamp [ns],filename\n" + "".join(self._pictures)
            (self._mav / camera / "data.csv").write_text(text, encoding="ascii")
        for name, rows in self._states.items():
            (self._mav / name / "data.csv").write_text(_HEAD + "".join(rows), encoding="ascii")


def sensor_text(camera: Camera, T_base_camera: Array, fps: float | None) -> str:
    """A `sensor.yaml` of a pinhole; T_BS is the camera's optical frame in base_link."""
    rows = ",\n         ".join(", ".join(repr(float(x)) for x in row) for row in T_base_camera)
    figures = ", ".join(repr(float(x)) for x in (camera.fx, camera.fy, camera.cx, camera.cy))
    return (
        "sensor_type: camera\ncomment: flysim, rectified\n\n"
        f"T_BS:\n  cols: 4\n  rows: 4\n  data: [{rows}]\n\n"
        f"rate_hz: {repr(float(fps)) if fps else 0}\nresolution: [{camera.width}, {camera.height}]\n"
        f"camera_model: pinhole\nintrinsics: [{figures}]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n"
    )


def _mav(folder: Path) -> Path | None:
    for path in (folder / MAV, folder):
        if all((path / camera / "data.csv").is_file() for camera in CAMERAS):
            return path
    return None


def _listed(folder: Path, camera: Path) -> list[tuple[int, Path]]:
    """Timestamps [ns] and pictures of a camera.

    Raises:
        FlysimError: a line is none of the two, or a picture is out of the folder.
    """
    where, rows = str(camera.relative_to(folder)), []
    path = inside(folder, f"{where}/data.csv")
    for k, line in enumerate(read_text(path, "list of pictures", MAX_TEXT).split("\n"), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        stamp, _, name = (word.strip() for word in line.partition(","))
        if not re.fullmatch(r"\d{1,19}", stamp) or not name:
            raise FlysimError(f"{shown_path(path)}: line {k} is no timestamp and file: {shown(line)}.")
        rows.append((int(stamp), inside(folder, f"{where}/data/{name}")))
        if len(rows) > MAX_FRAMES:
            raise FlysimError(f"{shown_path(path)}: more than {MAX_FRAMES} pictures; that many are not read.")
    return rows


def _poses(folder: Path, mav: Path, stamps: list[int]) -> tuple[Array, ...] | None:
    where = str(mav.relative_to(folder))
    for name in STATES:
        path = mav / name / "data.csv"
        if path.exists():
            rows = read_rows(inside(folder, f"{where}/{name}/data.csv"), (8, 17), "poses")
            T_base_left = _mounted(inside(folder, f"{where}/cam0/sensor.yaml"))
            first = stamps[0]
            # Nanoseconds of a date have more digits than a float: what counts is from the first picture on.
            found = nearest((rows[:, 0] - first) / NS, [(stamp - first) / NS for stamp in stamps], SOON, path)
            bodies = (posed(rows[k, 1:4], rows[k, [5, 6, 7, 4]], path, k + 1) for k in found)
            return tuple(T @ T_base_left for T in bodies)
    return None


def _mounted(path: Path) -> Array:
    """T_BS of a sensor.yaml."""
    found = _T_BS.search(read_text(path, "calibration", MAX_TEXT))
    try:
        values = [float(word) for word in found[1].split(",")] if found else []
    except ValueError:
        values = []
    if len(values) != 16 or not np.isfinite(values).all():
        raise FlysimError(f"{shown_path(path)}: needs T_BS with 16 finite numbers.")
    return np.array(values).reshape(4, 4)
