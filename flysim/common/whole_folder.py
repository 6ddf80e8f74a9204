"""A folder that is written whole or not at all, under a name that nobody else can have meanwhile."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import stat
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from flysim.common.held import held_folder, sweep_parts
from flysim.common.whole_file import hidden
from flysim.errors import RecordError

_FULL = (errno.ENOSPC, errno.EDQUOT)
_CHOOSE = "name another folder with `--out DIR`"
ATTEMPTS = 100  # others may make and take away what stands in the way


class Taken(RecordError):
    """Another has the name: it exists already, or is written now."""


@contextlib.contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """Yield a hidden folder beside `out` to write into. At the end it becomes `out`; on any error it goes.

    An interrupt counts as an error. What ends the process at once (SIGKILL, a power cut) leaves the hidden folder,
    `.<name>.flysim.part`, until somebody reserves a name beside it; never a half-written `out`.

    Raises:
        RecordError: as `reserved`; or the disk is full.
    """
    with reserved([out]) as place, place.writing() as room:
        yield room


def _is_no_folder(path: Path) -> bool:
    """Whether something else than a folder is there; asked once, since others may take it away meanwhile."""
    try:
        return not stat.S_ISDIR(path.lstat().st_mode)
    except OSError:
        return False


class Reserved:
    """A name that is ours, and the hidden folder that will bear it.

    Attributes:
        out: the name, as it was given.
        room: what to write into; it lies beside `out`, and becomes it by `keep`.
        kept: whether it has.
    """

    def __init__(self, out: Path) -> None:
        self.out, self.kept = out, False
        self._target = _target(out)
        self.room = hidden(self._target)
        self._made: list[Path] = []
        self._held: int | None = None

    def keep(self) -> None:
        """Let the room become `out`; it stays held.

        Raises:
            RecordError: somebody who reserves nothing made `out` meanwhile.
        """
        try:
            self.room.rename(self._target)
        except OSError as error:
            if error.errno in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                raise RecordError(f"{self.out} appeared while it was written: {_CHOOSE}") from error
            raise
        self.kept = True

    @contextlib.contextmanager
    def writing(self) -> Iterator[Path]:
        """Yield the room; at the end it becomes `out`.

        Raises:
            RecordError: the disk is full, or another refusal of the system.
        """
        with explained(self.out):
            yield self.room
            self.keep()

    def take(self) -> None:
        """Make the room, and the parents it needs.

        Raises:
            Taken: somebody else has the name.
            RecordError: it cannot be made.
        """
        swept = False  # whether somebody took our room for left behind
        with explained(self.out):
            for attempt in range(1, ATTEMPTS + 1):
                try:
                    self._make_parents()
                    sweep_parts(self._target.parent)
                    self._held = held_folder(self.room)
                except FileNotFoundError:  # a parent that another made and takes away again
                    if attempt == ATTEMPTS:
                        raise
                except FileExistsError:
                    if _is_no_folder(self.room):
                        raise
                    if swept and attempt < ATTEMPTS:  # who took it for left behind is still at it
                        time.sleep(0.005)
                        continue
                    raise Taken(f"{self.out} is being written by another run: {_CHOOSE}") from None
                else:
                    if self._held is not None:
                        break
                    swept = True
            else:
                raise Taken(f"{self.out} is taken away again and again: {_CHOOSE}")
            _target(self.out)  # once more: it may have been written just before the name was ours

    def leave(self) -> None:
        """What is not kept goes, with the parents made for it."""
        if self._held is not None:
            if not self.kept:
                shutil.rmtree(self.room, ignore_errors=True)
            os.close(self._held)
            self._held = None
        for parent in reversed(self._made):  # a parent that now holds the run is not empty, and stays
            with contextlib.suppress(OSError):
                parent.rmdir()
        self._made.clear()

    def _make_parents(self) -> None:
        for parent in reversed([self._target.parent, *self._target.parent.parents]):
            if not parent.exists():
                with contextlib.suppress(FileExistsError):  # another was quicker
                    parent.mkdir()
                    self._made.append(parent)


@contextlib.contextmanager
def reserved(outs: Iterable[Path]) -> Iterator[Reserved]:
    """The first of some names that nobody has: it is ours until the end, whatever runs beside.

    Raises:
        RecordError: each is there and no empty folder, or is being written; its parent cannot be made or written.
    """
    place = _first(outs)
    try:
        yield place
    finally:
        place.leave()


def _first(outs: Iterable[Path]) -> Reserved:
    refused = None
    for out in outs:
        try:
            place = Reserved(out)
        except Taken as error:
            refused = error
            continue
        try:
            place.take()
        except Taken as error:
            place.leave()
            refused = error
        except BaseException:
            place.leave()
            raise
        else:
            return place
    assert refused is not None, "no name to reserve"
    raise refused


def _target(out: Path) -> Path:
    """The absolute path of `out`, refused where a rename cannot put a folder."""
    try:
        target = out.expanduser().resolve()
        if target.is_dir():
            if any(target.iterdir()):
                raise Taken(f"{out} exists and is not empty: {_CHOOSE}, or empty it")
            if target.is_mount() or target == Path.cwd():
                raise RecordError(
                    f"{out} is in use and cannot be replaced: name a new folder in it, `--out {out / 'run'}`"
                )
        elif target.exists():
            raise Taken(f"{out} is a file: {_CHOOSE}")
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder, or a loop of links
        raise RecordError(f"cannot write {out}: {_reason(error)}; {_CHOOSE}") from error
    return target


@contextlib.contextmanager
def explained(out: Path) -> Iterator[None]:
    """Turn the system's refusals to write `out` into one line each.

    Raises:
        RecordError: the disk is full, or whatever an OSError told.
    """
    try:
        yield
    except BrokenPipeError:  # whoever read what we print went away
        raise
    except OSError as error:
        if error.errno in _FULL:
            raise RecordError(f"disk full while writing {out}: free some space, or {_CHOOSE}") from error
        target = out.expanduser().absolute()
        about = Path(os.fsdecode(error.filename)) if isinstance(error.filename, (str, bytes)) else target
        if about.is_relative_to(target.parent) or target.is_relative_to(about):
            raise RecordError(f"cannot write {out}: {_reason(error)}; {_CHOOSE}") from error
        raise RecordError(f"cannot read or write {_reason(error)}") from error  # a file of the run, not of `out`


def _reason(error: Exception) -> str:
    """`permission denied (/the/path)`: the system's words in lower case, with the path they are about."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower() + (f" ({error.filename})" if error.filename else "")
    return str(error) or type(error).__name__
