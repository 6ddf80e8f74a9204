"""Middlebury's layout, a folder a frame: im0.png, im1.png, calib.txt, and the true disparities disp0.pfm, disp1.pfm.

Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014. It has no poses.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.datasets.layout import MAX_FRAMES, Eyes, Header, Recorded, Writer, save_picture
from flysim.errors import FlysimError
from flysim.foreign.disparity import pfm
from flysim.foreign.folder import inside
from flysim.geometry.calib_text import calib_text
from flysim.geometry.frames import inverse, transform
from flysim.geometry.read_pair import read_pair
from flysim.plain import shown_path
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop
from flysim.worlds.view import TrueView

FILES = ("im0.png", "im1.png", "calib.txt")


class Middlebury:
    """The format `middlebury`."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes a folder a frame."""
        return _MiddleburyWriter(folder, header)

    def holds(self, folder: Path) -> bool:
        """Whether it is the folder of a pair, or has one in it."""
        return bool(_scenes(folder, most=1))

    def read(self, folder: Path) -> Recorded:
        """The pairs of all folders in it, in the order of their names."""
        scenes = _scenes(folder)
        first = _pair(folder, scenes[0])

        def read(k: int) -> Eyes:
            pair = _pair(folder, scenes[k])
            if (pair.rig.left, pair.rig.right) != (first.rig.left, first.rig.right):
                raise FlysimError(f"{shown_path(folder / scenes[k])}: another camera than in {scenes[0]}.")
            return pair.left, pair.right

        return Recorded(times=tuple(float(k) for k in range(len(scenes))), eyes=read, rig=first.rig)


class _MiddleburyWriter:
    def __init__(self, folder: Path, header: Header) -> None:
        self._folder = folder
        depths = {"min_depth": header.min_depth, "max_depth": header.max_depth}
        self._calib = {"calib.txt": header.believed, "calib_true.txt": header.true}
        self._text = {name: calib_text(rig, **depths) for name, rig in self._calib.items()}

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
        scene = self._folder / f"{number:06d}"
        scene.mkdir()
        for name, image in zip(FILES[:2], (frame.pair.left, frame.pair.right), strict=True):
            save_picture(scene / name, image)
        for name, text in self._text.items():
            (scene / name).write_text(text, encoding="ascii")
        for k in (0, 1):
            (scene / f"disp{k}.pfm").write_bytes(pfm(disparities(stop.views[k], stop.views[1 - k], 1 - 2 * k)))

    def add_obstacles(self, time: float, obstacles: tuple[TrueObstacle, ...]) -> None:
        pass

    def finish(self) -> None:
        pass


def disparities(view: TrueView, other: TrueView, sign: int) -> NDArray[np.float32]:
    """`[H, W]` true disparity of each pixel [px], infinite where there is none: u_left - u_right.

    Args:
        view: whose pixels.
        other: the other eye's.
        sign: 1 for the left eye's, -1 for the right one's.
    """
    camera = view.camera
    v, u = np.mgrid[: camera.height, : camera.width]
    known = np.isfinite(view.depth) & (view.link >= 0)
    points = camera.unproject(np.stack([u[known], v[known]], axis=1), view.depth[known])
    there = other.camera.project(transform(inverse(other.T_world_optical) @ view.T_world_optical, points))
    found = np.full(view.depth.shape, np.inf, np.float32)
    found[known] = sign * (u[known] - there[:, 0])
    return np.where(np.isnan(found), np.float32(np.inf), found)


def _scenes(folder: Path, most: int = MAX_FRAMES) -> list[str]:
    """Names of folders with a pair; "." where the folder itself is one."""
    if all((folder / name).is_file() for name in FILES):
        return ["."]
    found = []
    try:
        for path in sorted(folder.iterdir()):
            if all((path / name).is_file() for name in FILES):
                found.append(path.name)
                if len(found) >= most:
                    break
    except OSError:
        return []
    return found


def _pair(folder: Path, scene: str):
    left, right, calib = (inside(folder, f"{scene}/{name}") for name in FILES)
    return read_pair(left, right, calib=calib)
