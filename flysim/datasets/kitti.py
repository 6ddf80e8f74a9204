"""KITTI's odometry layout: `sequences/00/` with image_2 and image_3, calib.txt, times.txt; `poses/00.txt`.

Geiger, Lenz and Urtasun, "Are we ready for autonomous driving?", CVPR 2012. Poses are those of the left camera in its
own frame at the first picture, x right, y down, z forward. Depths are 16-bit PNG in 1/256 m, 0 where there is none.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from flysim.datasets.layout import MAX_FRAMES, PICTURES, Eyes, Header, Recorded, Writer, plain_line, save_picture
from flysim.datasets.poses import kitti_line, read_kitti_poses, read_rows
from flysim.errors import FlysimError
from flysim.foreign.disparity import KITTI_STEP, png16
from flysim.foreign.folder import inside, names_in
from flysim.foreign.image import read_image
from flysim.geometry.calibration.choose import read_calibration
from flysim.geometry.frames import R_BODY_OPTICAL, Array, inverse, se3
from flysim.geometry.rig import StereoRig
from flysim.plain import shown_path
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop

SEQUENCE = "00"
EYES = (("image_2", "image_3"), ("image_0", "image_1"))  # colour, then grey
MOST_STEPS = 65535  # of a depth in 16 bits
BELIEVED = "_believed"


class Kitti:
    """The format `kitti`."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes `sequences/00` and `poses`."""
        return _KittiWriter(folder, header)

    def holds(self, folder: Path) -> bool:
        """Whether there are sequences, or the pictures of one."""
        return _sequence(folder) is not None

    def read(self, folder: Path) -> Recorded:
        """The first sequence of a folder, or the folder of a sequence."""
        sequence = _sequence(folder)
        assert sequence is not None
        eyes = next(pair for pair in EYES if (sequence / pair[0]).is_dir())
        left, right = (
            names_in(inside(folder, str((sequence / eye).relative_to(folder))), PICTURES, MAX_FRAMES) for eye in eyes
        )
        if left != right or not left:
            raise FlysimError(
                f"{shown_path(sequence)}: {len(left)} pictures in {eyes[0]}, {len(right)} in {eyes[1]}: "
                "both eyes need the same names."
            )
        times_file = sequence / "times.txt"
        if times_file.exists():
            times = read_rows(inside(sequence, "times.txt"), 1, "times")[:, 0]
        else:
            times = np.arange(len(left)) / 10.0
        poses = _poses(folder, sequence)
        for what, got in (("times", len(times)), ("poses", len(left) if poses is None else len(poses))):
            if got != len(left):
                raise FlysimError(f"{shown_path(sequence)}: {len(left)} pairs of pictures, but {got} {what}.")

        def read(k: int) -> Eyes:
            return tuple(read_image(inside(sequence, f"{eye}/{left[k]}")) for eye in eyes)  # type: ignore[return-value]

        calibration = None
        if (sequence / "calib.txt").exists():
            picture = sequence / eyes[0] / left[0]
            calib = inside(sequence, "calib.txt")
            calibration = partial(read_calibration, [calib], picture=picture)
        return Recorded(
            times=tuple(times.tolist()), eyes=read, calibration=calibration, T_world_left=poses, first_is_origin=True
        )


class _KittiWriter:
    def __init__(self, folder: Path, header: Header) -> None:
        self._sequence, self._poses_folder = folder / "sequences" / SEQUENCE, folder / "poses"
        self._header = header
        for name in (*EYES[0], "depth_2"):
            (self._sequence / name).mkdir(parents=True)
        self._poses_folder.mkdir()
        (self._sequence / "calib.txt").write_text(_calib(header.believed), encoding="ascii")
        (self._sequence / "calib_true.txt").write_text(_calib(header.true), encoding="ascii")
        self._times: list[str] = []
        self._true: list[Array] = []
        self._believed: list[Array] = []

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
        name = f"{number:06d}.png"
        for eye, image in zip(EYES[0], (frame.pair.left, frame.pair.right), strict=True):
            save_picture(self._sequence / eye / name, image)
        depth = stop.views[0].depth
        with np.errstate(over="ignore"):
            steps = np.rint(depth * np.float32(KITTI_STEP))
        steps[~(steps <= MOST_STEPS)] = 0.0
        png16(steps.astype(np.uint16)).save(self._sequence / "depth_2" / name)
        self._times.append(f"{frame.time!r}\n")
        self._true.append(stop.views[0].T_world_optical)
        self._believed.append(frame.T_world_left)

    def add_obstacles(self, time: float, obstacles: tuple[TrueObstacle, ...]) -> None:
        pass

    def finish(self) -> None:
        (self._sequence / "times.txt").write_text("".join(self._times), encoding="ascii")
        for name, poses in ((SEQUENCE, self._true), (SEQUENCE + BELIEVED, self._believed)):
            first = inverse(poses[0]) if poses else np.eye(4)
            text = "".join(f"{kitti_line(first @ T)}\n" for T in poses)
            (self._poses_folder / f"{name}.txt").write_text(text, encoding="ascii")


def _calib(rig: StereoRig) -> str:
    """P0 to P3, left ones even, as `K [R t]` of the left camera's frame; Tr turns base_link's axes to the camera's."""
    left = np.column_stack([rig.left.K, np.zeros(3)])
    right = rig.right.K @ rig.T_right_left[:3]
    rows = {"P0": left, "P1": right, "P2": left, "P3": right, "Tr": np.column_stack([R_BODY_OPTICAL.T, np.zeros(3)])}
    return "".join(f"{name}: {plain_line(P)}\n" for name, P in rows.items())


def _sequence(folder: Path) -> Path | None:
    """The folder of the pictures."""
    candidates = [folder]
    if (folder / "sequences").is_dir():
        candidates += sorted(path for path in inside(folder, "sequences").iterdir() if path.is_dir())[:100]
    for path in candidates:
        if any((path / left).is_dir() and (path / right).is_dir() for left, right in EYES):
            return path
    return None


def _poses(folder: Path, sequence: Path) -> tuple[Array, ...] | None:
    """What is believed, else what is true, of the left camera at the first picture: level, at the world's origin."""
    if sequence == folder:
        return None
    for name in (f"{sequence.name}{BELIEVED}.txt", f"{sequence.name}.txt"):
        if (folder / "poses" / name).exists():
            T_world_first = se3(R_BODY_OPTICAL, np.zeros(3))
            return tuple(T_world_first @ T for T in read_kitti_poses(inside(folder, f"poses/{name}")))
    return None
