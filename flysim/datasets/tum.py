"""TUM's layout for two eyes: lists `left.txt`, `right.txt`, `depth.txt` of times and files, trajectories a line a pose.

Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012. Poses are those of the left camera's
optical frame in the world. Depths are 16-bit PNG in 1/5000 m, 0 where there is none. `calibration.yml` and
`calibration_true.yml` are OpenCV's FileStorage: K1, D1, K2, D2, R, T, and P1, P2 of what is rectified.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from flysim.datasets.layout import MAX_FRAMES, MAX_TEXT, Eyes, Header, Recorded, Writer, save_picture
from flysim.datasets.poses import nearest, read_tum_poses, tum_line
from flysim.errors import FlysimError
from flysim.foreign.disparity import png16
from flysim.foreign.files import read_text
from flysim.foreign.folder import inside
from flysim.foreign.image import read_image
from flysim.geometry.calibration.choose import read_calibration
from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig
from flysim.plain import shown, shown_path
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop

STEP = 5000.0  # of a depth of 1 m
CALIBRATION = "calibration.yml"
LISTS = ("left.txt", "right.txt")
TRAJECTORIES = ("groundtruth_believed.txt", "groundtruth.txt")
SOON = 0.02  # [s] between a picture and its pose, or the other eye's, as the benchmark's own tools take it


class Tum:
    """The format `tum`."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes pictures, lists and trajectories."""
        return _TumWriter(folder, header)

    def holds(self, folder: Path) -> bool:
        """Whether it has the lists of both eyes."""
        return all((folder / name).is_file() for name in LISTS)

    def read(self, folder: Path) -> Recorded:
        """The pairs of both lists."""
        lists = [_listed(folder, name) for name in LISTS]
        times = [[time for time, _ in rows] for rows in lists]
        if not lists[0] or len(lists[0]) != len(lists[1]):
            raise FlysimError(f"{shown_path(folder)}: {len(lists[0])} left pictures and {len(lists[1])} right ones.")
        pairs = nearest(np.array(times[1]), times[0], SOON, folder / LISTS[1])

        def read(k: int) -> Eyes:
            return tuple(read_image(inside(folder, name)) for name in (lists[0][k][1], lists[1][pairs[k]][1]))  # type: ignore[return-value]

        calibration = None
        if (folder / CALIBRATION).exists():
            calibration = partial(read_calibration, [inside(folder, CALIBRATION)])
        return Recorded(
            times=tuple(times[0]), eyes=read, calibration=calibration, T_world_left=_poses(folder, times[0])
        )


class _TumWriter:
    def __init__(self, folder: Path, header: Header) -> None:
        self._folder = folder
        for name in ("left", "right", "depth"):
            (folder / name).mkdir()
        for name, rig in ((CALIBRATION, header.believed), ("calibration_true.yml", header.true)):
            (folder / name).write_text(storage_text(rig), encoding="ascii")
        self._rows: dict[str, list[str]] = {name: [] for name in (*LISTS, "depth.txt", *TRAJECTORIES)}

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
        name, when = f"{number:06d}.png", repr(float(frame.time))
        save_picture(self._folder / "left" / name, frame.pair.left)
        save_picture(self._folder / "right" / name, frame.pair.right)
        with np.errstate(over="ignore"):
            steps = np.rint(stop.views[0].depth * np.float32(STEP))
        steps[~(steps <= np.iinfo(np.uint16).max)] = 0.0
        png16(steps.astype(np.uint16)).save(self._folder / "depth" / name)
        for side in ("left", "right", "depth"):
            self._rows[f"{side}.txt"].append(f"{when} {side}/{name}\n")
        self._rows[TRAJECTORIES[0]].append(f"{tum_line(frame.time, frame.T_world_left)}\n")
        self._rows[TRAJECTORIES[1]].append(f"{tum_line(frame.time, stop.views[0].T_world_optical)}\n")

    def add_obstacles(self, time: float, obstacles: tuple[TrueObstacle, ...]) -> None:
        pass

    def finish(self) -> None:
        for name, rows in self._rows.items():
            head = "# timestamp tx ty tz qx qy qz qw\n" if name in TRAJECTORIES else "# timestamp filename\n"
            (self._folder / name).write_text(head + "".join(rows), encoding="ascii")


def storage_text(rig: StereoRig) -> str:
    """A rig as OpenCV's FileStorage in YAML, all digits kept: `stereo_calib`'s names."""
    rows = {}
    for k, camera in ((1, rig.left), (2, rig.right)):
        rows |= {f"K{k}": camera.K, f"D{k}": np.zeros((1, 5))}
    rows |= {"R": rig.T_right_left[:3, :3], "T": rig.T_right_left[:3, 3:]}
    if rig.rectified:
        # As stereoRectify has it: fx times the way to the right camera, in units of T.
        shift = np.array([[rig.right.fx * rig.T_right_left[0, 3]], [0.0], [0.0]])
        rows |= {"R1": np.eye(3), "R2": np.eye(3)}
        rows |= {"P1": np.column_stack([rig.left.K, np.zeros(3)]), "P2": np.column_stack([rig.right.K, shift])}
    head = f"%YAML:1.0\n---\nimage_width: {rig.left.width}\nimage_height: {rig.left.height}\n"
    return head + "".join(_matrix(name, value) for name, value in rows.items())


def _matrix(name: str, value: Array) -> str:
    data = ", ".join(repr(float(x)) for x in value.ravel())
    rows, columns = value.shape
    return f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"


def _listed(folder: Path, name: str) -> list[tuple[float, str]]:
    """Times and files, in the order of the list.

    Raises:
        FlysimError: a line is none of the two, or a file is out of the folder.
    """
    path, rows = inside(folder, name), []
    for k, line in enumerate(read_text(path, "list of pictures", MAX_TEXT).split("\n"), start=1):
        words = line.split(maxsplit=1)
        if not words or words[0].startswith("#"):
            continue
        try:
            time = float(words[0])
        except ValueError:
            time = np.nan
        if len(words) < 2 or not np.isfinite(time):
            raise FlysimError(f"{shown_path(path)}: line {k} is no time and file: {shown(line)}.")
        inside(folder, words[1].strip())
        rows.append((time, words[1].strip()))
        if len(rows) > MAX_FRAMES:
            raise FlysimError(f"{shown_path(path)}: more than {MAX_FRAMES} pictures; that many are not read.")
    return rows


def _poses(folder: Path, times: list[float]) -> tuple[Array, ...] | None:
    for name in TRAJECTORIES:
        if (folder / name).exists():
            when, poses = read_tum_poses(inside(folder, name))
            if len(poses) < len(times):
                raise FlysimError(f"{shown_path(folder)}: {len(times)} pairs of pictures, but {len(poses)} poses.")
            return tuple(poses[k] for k in nearest(when, times, SOON, folder / name))
    return None
