"""A data set as a `Source`: frames from the files of its format, and their truth where its folder has one."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flysim.datasets.about import About, read_about
from flysim.datasets.layout import Eyes, Recorded, layout, layout_of
from flysim.datasets.level import levelled
from flysim.datasets.truth_folder import has_truth, read_truth
from flysim.errors import FlysimError
from flysim.geometry.frames import R_BODY_OPTICAL, Array, inverse, se3
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.plain import shown_path
from flysim.products.frame import Frame, FrameSequence
from flysim.truth.truth import Truth

MAX_BYTES = 2**33  # of all pictures and depths that are held at once


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DataSet:
    """A folder that was looked at and found to be sound, its pictures not yet read.

    Attributes:
        folder: where it lies.
        layout: its format's name.
        recorded: what the files of the format say.
        about: what `flysim.json` says; None: it is somebody else's.
        rig: the cameras, as believed.
        rows: the numbers of the frames that are asked for.
        height_known: whether anybody said how high the cameras stand, so that z = 0 is the floor.
    """

    folder: Path
    layout: str
    recorded: Recorded
    about: About | None
    rig: StereoRig
    rows: tuple[int, ...]
    height_known: bool

    @property
    def name(self) -> str:
        """Of the scenario, or of the folder."""
        return self.about.name if self.about is not None else self.folder.resolve().name

    @property
    def settings(self) -> dict[str, Any]:
        """The tables of a scenario by which it was to be seen, as far as anybody said."""
        return dict(self.about.settings) if self.about is not None else {}

    @property
    def known(self) -> bool:
        """Whether its truth is there."""
        return has_truth(self.folder)


def read_data_set(folder: str | Path, *, every: int = 1, height: float | None = None) -> DataSet:
    """Looks at a data set of any known format.

    Args:
        folder: its top folder.
        every: of its frames, one in so many.
        height: of the left camera above the floor in the first frame [m], where no file tells; None: nobody knows.

    Raises:
        FlysimError: no data set, or a file of it is missing, damaged, or says something else than another.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise FlysimError(f"{shown_path(folder)}: no data set: there is no such folder.")
    about = read_about(folder)
    name = about.layout if about is not None else layout_of(folder)
    recorded = layout(name).read(folder)
    if about is not None and len(about.indices) != len(recorded.times):
        raise FlysimError(
            f"{shown_path(folder)}: {len(recorded.times)} pairs of pictures, but flysim.json tells of "
            f"{len(about.indices)} frames."
        )
    if about is None and recorded.rig is None and recorded.calibration is not None:
        recorded = levelled(recorded, shown_path(folder))
    rig = recorded.rig if recorded.rig is not None else None if about is None else about.rig
    if rig is None:
        raise FlysimError(f"{shown_path(folder)}: no calibration of rectified pictures.")
    rows = tuple(range(0, len(recorded.times), every))
    size = len(rows) * rig.left.width * rig.left.height * (22 if has_truth(folder) else 6)
    if size > MAX_BYTES:
        raise FlysimError(
            f"{shown_path(folder)}: {len(rows)} frames of {rig.left.width}x{rig.left.height} px are more than fits. "
            f"Take one in {-(-size // MAX_BYTES) * every}: --every {-(-size // MAX_BYTES) * every}."
        )
    return DataSet(
        folder=folder,
        layout=name,
        recorded=_placed(recorded, about, height or 0.0),
        about=about,
        rig=rig,
        rows=rows,
        height_known=about is not None or height is not None,
    )


def on_floor(data: DataSet, row: int, T_floor_left: Array, note: str) -> DataSet:
    """A data set whose z = 0 is the floor that one of its frames shows.

    Args:
        data: of which nobody said how high its cameras stand.
        row: of the frame.
        T_floor_left: `[4, 4]` its left camera above the floor, x ahead and z up.
        note: what is said of it.
    """
    poses = data.recorded.T_world_left
    assert poses is not None
    # Poses told from the first one know nothing of up and down; others do, but for what they count heights from.
    up = T_floor_left @ inverse(poses[row])
    if not data.recorded.first_is_origin:
        up = se3(np.eye(3), (0.0, 0.0, T_floor_left[2, 3] - poses[row][2, 3]))
    notes = (*data.recorded.notes, note)
    recorded = replace(data.recorded, T_world_left=tuple(up @ T for T in poses), notes=notes)
    return replace(data, recorded=recorded, height_known=True)


def _placed(recorded: Recorded, about: About | None, height: float) -> Recorded:
    """With poses of the left camera in the world, whatever was said of them."""
    poses = recorded.T_world_left
    if recorded.T_world_base is not None:
        T_base_left = se3(R_BODY_OPTICAL, np.zeros(3)) if about is None else about.T_base_left
        poses = tuple(T @ T_base_left for T in recorded.T_world_base)
    if about is not None and (poses is None or recorded.first_is_origin):
        first = about.T_world_base[0] @ about.T_base_left
        if poses is None:
            poses = tuple(T @ about.T_base_left for T in about.T_world_base)
        else:
            back = first @ inverse(poses[0])
            poses = tuple(back @ T for T in poses)
    elif about is None:
        up = se3(np.eye(3), (0.0, 0.0, height))
        level = up @ se3(R_BODY_OPTICAL, np.zeros(3))
        # Without poses nobody knows how the frames hang together: each stands for itself, at the same place.
        if poses is None:
            return replace(recorded, T_world_left=tuple(level for _ in recorded.times), first_is_origin=True)
        poses = tuple(up @ T for T in poses)
    return replace(recorded, T_world_left=poses)


class DataSetSource:
    """A `Source` of a data set's frames, read one by one as they are seen."""

    def __init__(self, data: DataSet, *, seed: int) -> None:
        """The frames of a data set that was looked at.

        Args:
            data: which.
            seed: of whoever sees.
        """
        self._data, self._seed = data, seed
        self._frames: list[Frame] = []
        self._eyes: list[Eyes] = []
        self._seconds = 0.0

    @property
    def rig(self) -> StereoRig:
        """The cameras, as believed."""
        return self._data.rig

    @property
    def planned(self) -> int:
        """The frames that are asked for; of a whole data set, those that were planned when it was taken."""
        data = self._data
        whole = data.about is not None and len(data.rows) == len(data.recorded.times)
        return data.about.planned if whole and data.about is not None else len(data.rows)

    def frames(self) -> Iterator[Frame]:
        """Reads frame after frame.

        Raises:
            FlysimError: a picture is missing, damaged, or of another size than its camera's.
        """
        data = self._data
        poses = data.recorded.T_world_left
        assert poses is not None
        for row in data.rows:
            began = time.perf_counter()
            eyes = data.recorded.eyes(row)
            try:
                pair = ImagePair(left=eyes[0], right=eyes[1], rig=data.rig)
            except ValueError as refusal:
                raise FlysimError(f"{shown_path(data.folder)}: frame {row}: {refusal}.") from None
            self._eyes.append((pair.left, pair.right))
            self._frames.append(_frame(data, row, pair, poses[row]))
            self._seconds += time.perf_counter() - began
            yield self._frames[-1]

    def stands(self, T_world_base: Array) -> None:
        """Changes nothing: the frames are there already."""

    def sequence(self) -> FrameSequence:
        """What was read so far."""
        about, taken = self._data.about, tuple(self._frames)
        if about is None:
            return FrameSequence(
                name=self._data.name,
                frames=taken,
                planned=self.planned,
                seed=self._seed,
                notes=self._data.recorded.notes,
                seconds=self._seconds,
            )
        return FrameSequence(
            name=about.name,
            frames=taken,
            planned=self.planned,
            seed=self._seed,
            renderer=about.renderer,
            blocked=about.blocked,
            texture=about.texture,
            notes=about.notes,
            seconds=self._seconds,
        )

    def truth(self) -> Truth | None:
        """The truth of the frames that were read; None where the folder has none."""
        if not self._data.known:
            return None
        return read_truth(self._data.folder, self._eyes, self._data.rows[: len(self._frames)])


def _frame(data: DataSet, row: int, pair: ImagePair, T_world_left: Array) -> Frame:
    about = data.about
    if about is not None:
        T_base_left, index, when = about.T_base_left, about.indices[row], about.times[row]
    else:
        T_base_left, index, when = se3(R_BODY_OPTICAL, np.zeros(3)), row, data.recorded.times[row]
    return Frame(
        index=index,
        time=when,
        pair=pair,
        T_world_base=T_world_left @ inverse(T_base_left),
        T_base_left=T_base_left,
    )
