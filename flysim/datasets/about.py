"""`flysim.json`: what of a data set no other format has a place for. What the robot believes, not the truth."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flysim.common.plain_data import plain_data
from flysim.datasets.world_file import rigid
from flysim.errors import FlysimError
from flysim.foreign.data import read_json
from flysim.foreign.folder import inside
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig
from flysim.plain import shown_path

ABOUT = "flysim.json"
VERSION = 1
MAX_BYTES = 2**26
CAMERA = ("width", "height", "fx", "fy", "cx", "cy")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class About:
    """What a data set is of.

    Attributes:
        name: of the scenario.
        layout: of the folder: "kitti", ...
        seed: of whoever sees, unless another is asked for.
        renderer: what drew it.
        rig: the cameras, as the robot believes them.
        T_base_left: `[4, 4]` where the left camera is mounted.
        planned: how many frames there were to be.
        blocked: None, or what the robot ran into.
        texture: what the surfaces were given, or None.
        notes: what a reader of the figures should know.
        settings: tables of the scenario by which its frames were to be seen: "flies", "obstacles".
        indices, times: of each frame; [s].
        T_world_base: `[4, 4]` of each frame, as believed.
    """

    name: str
    layout: str
    seed: int
    renderer: str
    rig: StereoRig
    T_base_left: Array
    planned: int
    blocked: str | None = None
    texture: str | None = None
    notes: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    indices: tuple[int, ...] = ()
    times: tuple[float, ...] = ()
    T_world_base: tuple[Array, ...] = ()


def rig_json(rig: StereoRig) -> dict[str, Any]:
    """A rig in JSON's own types, all digits kept."""
    return plain_data(
        {
            **{side: {name: getattr(getattr(rig, side), name) for name in CAMERA} for side in ("left", "right")},
            "T_right_left": rig.T_right_left,
        }
    )


def rig_of(data: Mapping[str, Any]) -> StereoRig:
    """The rig that `rig_json` wrote.

    Raises:
        LookupError, TypeError, ValueError: it is none.
    """
    cameras = {}
    for side in ("left", "right"):
        width, height, *rest = (data[side][name] for name in CAMERA)
        fx, fy, cx, cy = map(float, rest)
        cameras[side] = Camera(width=int(width), height=int(height), fx=fx, fy=fy, cx=cx, cy=cy)
    return StereoRig(**cameras, T_right_left=rigid(data["T_right_left"]))


def write_about(folder: Path, about: About) -> None:
    """Write `flysim.json`.

    Raises:
        OSError: the disk is full or refuses.
    """
    rows = zip(about.indices, about.times, about.T_world_base, strict=True)
    data = {
        "flysim": VERSION,
        "format": about.layout,
        **{name: getattr(about, name) for name in ("name", "seed", "renderer", "planned", "blocked", "texture")},
        "notes": about.notes,
        "settings": about.settings,
        "rig": rig_json(about.rig),
        "T_base_left": about.T_base_left,
        "frames": [{"index": i, "time": t, "T_world_base": T} for i, t, T in rows],
    }
    text = json.dumps(plain_data(data), indent=1, allow_nan=False, ensure_ascii=False)
    (folder / ABOUT).write_text(text + "\n", encoding="utf-8")


def read_about(folder: Path) -> About | None:
    """What `write_about` wrote; None where there is no such file.

    Raises:
        FlysimError: it is damaged, or of another version.
    """
    path = inside(folder, ABOUT)
    if not path.exists():
        return None
    data = read_json(path, "description of the data set", MAX_BYTES)
    try:
        if data["flysim"] != VERSION:
            raise ValueError(f"it is of version {data['flysim']}, not {VERSION}")
        frames = data["frames"]
        settings = data["settings"]
        if not isinstance(settings, dict):
            raise ValueError("its settings are no tables")
        return About(
            name=str(data["name"]),
            layout=str(data["format"]),
            renderer=str(data["renderer"]),
            blocked=_text_or_none(data["blocked"]),
            texture=_text_or_none(data["texture"]),
            seed=int(data["seed"]),
            planned=int(data["planned"]),
            notes=tuple(map(str, data["notes"])),
            settings=settings,
            rig=rig_of(data["rig"]),
            T_base_left=rigid(data["T_base_left"]),
            indices=tuple(int(frame["index"]) for frame in frames),
            times=tuple(float(frame["time"]) for frame in frames),
            T_world_base=tuple(rigid(frame["T_world_base"]) for frame in frames),
        )
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise FlysimError(
            f"{shown_path(path)}: no description of a data set: {type(error).__name__}: {error}. Export it again."
        ) from None


def _text_or_none(value: Any) -> str | None:
    return None if value is None else str(value)
