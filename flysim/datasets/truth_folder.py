"""The folder `truth/` of a data set: what truly was in each frame, exactly, and the way back to a `Truth`.

`world.json`, `calibration.json`, `frames/000000.json` (poses, bodies, obstacles with their dimensions), and as pictures
`depth_left/`, `depth_right/` (PFM [m]) and `mask_left/`, `mask_right/` (16-bit PNG: a body's id in `world.json` plus 1,
0 where there is none).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.common.plain_data import plain_data
from flysim.datasets.about import rig_json, rig_of
from flysim.datasets.world_file import read_world_file, rigid, write_world
from flysim.errors import FlysimError
from flysim.foreign.data import read_json
from flysim.foreign.disparity import parse_pfm, pfm, png16
from flysim.foreign.files import read_bytes
from flysim.foreign.folder import inside
from flysim.foreign.image import parse_png16
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Pose2, frozen
from flysim.geometry.rig import StereoRig
from flysim.plain import shown_path
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle, true_obstacles
from flysim.truth.sight import sights
from flysim.truth.stop import Stop
from flysim.truth.truth import Truth
from flysim.worlds.model import World
from flysim.worlds.view import TrueView

TRUTH = "truth"
CALIBRATION = "calibration.json"
SIDES = ("left", "right")
MAX_JSON = 2**25
MAX_PICTURE = 2**27
POSES = ("commanded", "odometry", "true")


class TruthWriter:
    """Writes the truth frame by frame."""

    def __init__(self, folder: Path, world: World, rig: StereoRig, *, max_range: float, merge_gap: float) -> None:
        """Makes `truth/`, with what all frames share.

        Args:
            folder: of the data set.
            world: what stands there.
            rig: the cameras as they truly are.
            max_range: [m] what is farther is no part of the truth.
            merge_gap: bodies that touch or stand closer than this are one obstacle [m].
        """
        self._folder, self._world = folder / TRUTH, world
        self._max_range, self._merge_gap = max_range, merge_gap
        self._folder.mkdir()
        write_world(self._folder, world)
        self._rig = rig
        for name in ("frames", *(f"{kind}_{side}" for kind in ("depth", "mask") for side in SIDES)):
            (self._folder / name).mkdir()

    def add(self, number: int, stop: Stop) -> tuple[TrueObstacle, ...]:
        """Writes one frame's; gives the obstacles as they stood and were seen then."""
        stem = f"{number:06d}"
        for side, view in zip(SIDES, stop.views, strict=True):
            (self._folder / f"depth_{side}" / f"{stem}.pfm").write_bytes(pfm(view.depth))
            png16(mask(view)).save(self._folder / f"mask_{side}" / f"{stem}.png")
        seen = sights([stop], self._max_range)
        obstacles = true_obstacles(self._world, seen, Motion.of(self._world, [stop]), merge_gap=self._merge_gap)
        data = {
            "index": stop.index,
            "sim_time": stop.sim_time,
            **{name: [getattr(getattr(stop, name), part) for part in ("x", "y", "yaw")] for name in POSES},
            "T_world_base": stop.T_world_base,
            "T_world_left": stop.views[0].T_world_optical,
            "T_world_right": stop.views[1].T_world_optical,
            "obstacles": [obstacle_row(one) for one in obstacles],
            "T_world_links": stop.T_world_links,
            "track": stop.track,
            "drive_s": stop.drive_s,
            "render_s": stop.render_s,
        }
        _write(self._folder / "frames" / f"{stem}.json", data)
        return obstacles

    def finish(self, disturbed: Mapping[str, Any]) -> None:
        """Writes `calibration.json`: the true rig, the range of the truth, and what was disturbed."""
        data = {
            "rig": rig_json(self._rig),
            "max_range": self._max_range,
            "merge_gap": self._merge_gap,
            "disturbed": disturbed,
        }
        _write(self._folder / CALIBRATION, data)


def mask(view: TrueView) -> NDArray[np.uint16]:
    """`[H, W]` the id of each pixel's body plus 1; 0 where there is none."""
    return (view.link + 1).astype(np.uint16)


def obstacle_row(true: TrueObstacle) -> dict[str, Any]:
    """An obstacle with its dimensions [m] in JSON, by the keys of a run's `obstacles.json`, and what was visible."""
    return {
        "name": true.name,
        "shape": true.shape,
        "center": true.center,
        "size": true.size,
        "yaw_deg": math.degrees(true.yaw),
        "links": true.links,
        "visible_pixels": true.visible_pixels,
    }


def has_truth(folder: Path) -> bool:
    """Whether a data set's folder has its truth."""
    return (folder / TRUTH / CALIBRATION).is_file()


def read_truth(
    folder: Path, pictures: Sequence[tuple[NDArray[np.uint8], NDArray[np.uint8]]], rows: Sequence[int]
) -> Truth:
    """The truth of some frames of a data set.

    Args:
        folder: of the data set.
        pictures: left and right picture of each of them.
        rows: which frames of the folder they are, by number.

    Raises:
        FlysimError: a file is missing, damaged, or does not fit the others.
    """
    root = inside(folder, TRUTH)
    path = inside(root, CALIBRATION)
    data = read_json(path, "calibration", MAX_JSON)
    world = read_world_file(root)
    try:
        rig = rig_of(data["rig"])
        max_range, merge_gap = float(data["max_range"]), float(data["merge_gap"])
        disturbed = {str(name): dict(table) for name, table in data["disturbed"].items()}
        if not (0.0 < max_range < math.inf and 0.0 <= merge_gap < math.inf):
            raise ValueError("max_range or merge_gap is no length")
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise FlysimError(f"{shown_path(path)}: no truth of a data set: {type(error).__name__}: {error}.") from None
    stops = [_stop(root, row, rig, world, pair) for row, pair in zip(rows, pictures, strict=True)]
    return Truth.of(world, stops, max_range=max_range, merge_gap=merge_gap, disturbed=disturbed)


def _stop(
    root: Path, row: int, rig: StereoRig, world: World, pair: tuple[NDArray[np.uint8], NDArray[np.uint8]]
) -> Stop:
    path = inside(root, f"frames/{row:06d}.json")
    data = read_json(path, "truth of a frame", MAX_JSON)
    try:
        poses = {name: Pose2(*map(_number, data[name])) for name in POSES}
        links = np.array([rigid(T) for T in data["T_world_links"]]).reshape(-1, 4, 4)
        track = np.array(data["track"], np.float64).reshape(-1, 7)
        if len(links) != len(world.links):
            raise ValueError(f"it has the poses of {len(links)} links, the world has {len(world.links)}")
        optical = [rigid(data[f"T_world_{side}"]) for side in SIDES]
        return Stop(
            index=int(data["index"]),
            **poses,
            T_world_base=frozen(rigid(data["T_world_base"])),
            views=(
                _view(root, row, "left", rig.left, optical[0], pair[0], len(links)),
                _view(root, row, "right", rig.right, optical[1], pair[1], len(links)),
            ),
            T_world_links=frozen(links),
            sim_time=_number(data["sim_time"]),
            track=frozen(track),
            drive_s=_number(data["drive_s"]),
            render_s=_number(data["render_s"]),
        )
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise FlysimError(f"{shown_path(path)}: no truth of a frame: {type(error).__name__}: {error}.") from None


def _view(
    root: Path, row: int, side: str, camera: Camera, T: np.ndarray, rgb: NDArray[np.uint8], links: int
) -> TrueView:
    depth = read_depth(root, row, side)
    path = inside(root, f"mask_{side}/{row:06d}.png")
    try:
        ids = parse_png16(read_bytes(path, "mask", MAX_PICTURE)).astype(np.int32) - 1
        for what, shape in (("depth", depth.shape), ("mask", ids.shape)):
            if shape != (camera.height, camera.width):
                raise ValueError(f"the {what} has {shape[1]}x{shape[0]} px, its camera {camera.width}x{camera.height}")
        if ids.max() >= links:
            raise ValueError(f"it has the value {ids.max() + 1}, the world has {links} links")
    except ValueError as refusal:
        raise FlysimError(f"{shown_path(path)}: cannot read the mask: {refusal}.") from None
    return TrueView(camera=camera, rgb=rgb, depth=depth, link=ids, T_world_optical=frozen(T))


def read_depth(root: Path, row: int, side: str) -> NDArray[np.float32]:
    """`[H, W]` true depth [m] of a frame, infinite where nothing is.

    Raises:
        FlysimError: the file is missing or damaged, or has a NaN or a depth that is not above 0.
    """
    path = inside(root, f"depth_{side}/{row:06d}.pfm")
    data = read_bytes(path, "depth", MAX_PICTURE)
    try:
        depth = parse_pfm(data)
        if not (depth > 0.0).all():
            raise ValueError("it has a NaN, or a depth that is not above 0")
    except ValueError as refusal:
        raise FlysimError(f"{shown_path(path)}: cannot read the depth: {refusal}.") from None
    return depth


def _number(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{value!r} is no number")
    return number


def _write(path: Path, data: Any) -> None:
    path.write_text(json.dumps(plain_data(data), allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")
