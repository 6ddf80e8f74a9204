"""Temporary folders that go with the process that made them, or with the next one if that was killed."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import tempfile
import uuid
import weakref
from pathlib import Path

from flysim.common.held import held_folder, sweep

NAME = re.compile(r"flysim-[0-9a-f]{12}\.scratch")  # of nothing that a person would name so: what bears it is removed
ATTEMPTS = 100


class Scratch:
    """A temporary folder, as `tempfile.TemporaryDirectory` is one; it goes with this object, with `clear`, or at exit.

    The first one of a process removes what processes that were killed have left.

    Attributes:
        name: the folder's path.
    """

    def __init__(self) -> None:
        """Makes it.

        Raises:
            OSError: there is no place for temporary files, or the disk is full.
        """
        _sweep_once()
        path, descriptor = _made(Path(tempfile.gettempdir()))
        self.name = str(path)
        self._remove = weakref.finalize(self, _remove, path, descriptor, os.getpid())
        _live.add(self)

    def cleanup(self) -> None:
        """Removes the folder. Safe to call twice."""
        self._remove()


_live: weakref.WeakSet[Scratch] = weakref.WeakSet()
_swept: set[str] = set()  # places for temporary files


def clear() -> None:
    """Removes all temporary folders of this process, for whoever ends it without Python's own end."""
    for one in list(_live):
        one.cleanup()


def sweep_scratch() -> None:
    """Removes the temporary folders of processes that are gone."""
    with contextlib.suppress(OSError):
        sweep(Path(tempfile.gettempdir()), lambda name: NAME.fullmatch(name) is not None)


def _sweep_once() -> None:
    place = tempfile.gettempdir()
    if place not in _swept:
        _swept.add(place)
        sweep_scratch()


def _made(place: Path) -> tuple[Path, int]:
    for _ in range(ATTEMPTS):
        path = place / f"flysim-{uuid.uuid4().hex[:12]}.scratch"
        try:
            descriptor = held_folder(path, 0o700)  # nobody else's to read
        except FileExistsError:
            continue
        if descriptor is not None:
            return path, descriptor
    raise FileExistsError(f"no free name for a temporary folder in {place}")


def _remove(path: Path, descriptor: int, maker: int) -> None:
    if os.getpid() == maker:  # what a fork inherits is its parent's
        shutil.rmtree(path, ignore_errors=True)
    with contextlib.suppress(OSError):
        os.close(descriptor)
