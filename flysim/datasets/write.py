"""Writes a data set frame by frame: the files of its format, `flysim.json`, and the folder of its truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flysim.datasets.about import About, write_about
from flysim.datasets.layout import Header, Writer, layout
from flysim.datasets.preview import write_preview
from flysim.datasets.truth_folder import TruthWriter
from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame
from flysim.truth.stop import Stop
from flysim.worlds.model import World


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Staging:
    """What is known before the first frame.

    Attributes:
        world: what stands there.
        believed, true: the cameras as the robot takes them to be, and as they are.
        min_depth, max_depth: the range of depths that is searched, and what the truth reaches to [m].
        merge_gap: bodies that touch or stand closer than this are one obstacle [m].
        fps: frames a second [1/s]; None: one a stop.
    """

    world: World
    believed: StereoRig
    true: StereoRig
    min_depth: float
    max_depth: float
    merge_gap: float
    fps: float | None = None


class SetWriter:
    """A data set that grows in a folder; of its frames it keeps none."""

    def __init__(self, room: Path, layout_name: str, staging: Staging) -> None:
        """Nothing is written before the first frame.

        Args:
            room: a folder that is there and empty.
            layout_name: the format's name.
            staging: what all frames share.

        Raises:
            FlysimError: there is no such format, or what it needs is not installed.
        """
        self._room, self._name, self._staging = room, layout_name, staging
        self._layout = layout(layout_name)
        self._files: Writer | None = None
        self._truth: TruthWriter | None = None
        self._frames: list[tuple[int, float, Array]] = []

    @property
    def count(self) -> int:
        """The frames that were written."""
        return len(self._frames)

    def add(self, frame: Frame, stop: Stop) -> None:
        """Writes a frame: what was taken and believed, and what truly was.

        Raises:
            OSError: the disk is full or refuses.
        """
        number, given = len(self._frames), self._staging
        if self._files is None or self._truth is None:
            header = Header(
                believed=given.believed,
                true=given.true,
                T_base_left=frame.T_base_left,
                min_depth=given.min_depth,
                max_depth=given.max_depth,
                fps=given.fps,
            )
            self._files = self._layout.writer(self._room, header)
            self._truth = TruthWriter(
                self._room, given.world, given.true, max_range=given.max_depth, merge_gap=given.merge_gap
            )
            self._T_base_left = frame.T_base_left
            write_preview(self._room, frame, stop, given.max_depth)
        self._files.add(number, frame, stop)
        self._files.add_obstacles(frame.time, self._truth.add(number, stop))
        self._frames.append((frame.index, frame.time, frame.T_world_base))

    def finish(self, disturbed: Mapping[str, Any], **about: Any) -> None:
        """Writes what is known at the end; nothing where there was no frame.

        Args:
            disturbed: as `Truth.disturbed`.
            about: name, seed, renderer, planned and what else `About` has that is not known here.

        Raises:
            OSError: the disk is full or refuses.
        """
        if self._files is None or self._truth is None:
            return
        self._files.finish()
        self._truth.finish(disturbed)
        indices, times, poses = zip(*self._frames, strict=True)
        whole = About(
            layout=self._name,
            rig=self._staging.believed,
            T_base_left=self._T_base_left,
            indices=indices,
            times=times,
            T_world_base=poses,
            **about,
        )
        write_about(self._room, whole)
