"""A folder that is written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import uuid
from collections.abc import Iterator
from pathlib import Path

from flysim.errors import RecordError

_FULL = (errno.ENOSPC, errno.EDQUOT)


def check_target(out: Path) -> None:
    """Refuse a folder that `whole_folder` could not write to, before a long run instead of after it.

    Raises:
        RecordError: as `whole_folder`.
    """
    target = _target(out)
    with _explained(out, target), _room_beside(target) as room:
        room.mkdir()
        room.rmdir()


@contextlib.contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """Yield a hidden folder beside `out` to write into. At the end it becomes `out`; on any error it goes.

    An interrupt counts as an error. What ends the process at once (SIGKILL, a power cut) may leave the hidden
    folder, `.<name>.<random>.part`, never a half-written `out`.

    Raises:
        RecordError: `out` exists and is no empty folder, its parent cannot be made or written, the disk is
            full.
    """
    target = _target(out)
    with _explained(out, target), _room_beside(target) as room:
        room.mkdir()
        yield room
        try:
            room.rename(target)
        except OSError as error:
            if error.errno in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                raise RecordError(f"{out} appeared while it was written: {_CHOOSE}") from error
            raise


_CHOOSE = "name another folder with `--out DIR`"


def _target(out: Path) -> Path:
    """The absolute path of `out`, refused where a rename cannot put a folder."""
    try:
        target = out.expanduser().resolve()
        if target.is_dir():
            if any(target.iterdir()):
                raise RecordError(f"{out} exists and is not empty: {_CHOOSE}, or empty it")
            if target.is_mount() or target == Path.cwd():
                raise RecordError(
                    f"{out} is in use and cannot be replaced: name a new folder in it, `--out {out / 'run'}`"
                )
        elif target.exists():
            raise RecordError(f"{out} is a file: {_CHOOSE}")
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder, or a loop of links
        raise RecordError(f"cannot write {out}: {_reason(error)}; {_CHOOSE}") from error
    return target


@contextlib.contextmanager
def _room_beside(target: Path) -> Iterator[Path]:
    """A free hidden name beside `target`. What still bears it at the end goes, with parents made for it."""
    made: list[Path] = []
    room = target.with_name(f".{target.name[:200]}.{uuid.uuid4().hex[:8]}.part")
    try:
        for parent in reversed([target.parent, *target.parent.parents]):
            if not parent.exists():
                parent.mkdir()
                made.append(parent)
        yield room
    finally:
        if os.path.lexists(room):
            shutil.rmtree(room, ignore_errors=True)
        for parent in reversed(made):  # a parent that now holds the run is not empty, and stays
            with contextlib.suppress(OSError):
                parent.rmdir()


@contextlib.contextmanager
def _explained(out: Path, target: Path) -> Iterator[None]:
    """Turn the system's refusals into one line each."""
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise RecordError(f"disk full while writing {out}: free some space, or {_CHOOSE}") from error
        about = Path(os.fsdecode(error.filename)) if isinstance(error.filename, (str, bytes)) else target
        if about.is_relative_to(target.parent) or target.is_relative_to(about):
            raise RecordError(f"cannot write {out}: {_reason(error)}; {_CHOOSE}") from error
        raise RecordError(f"cannot read or write {_reason(error)}") from error  # a file of the run, not of `out`


def _reason(error: Exception) -> str:
    """`permission denied (/the/path)`: the system's words in lower case, with the path they are about."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower() + (f" ({error.filename})" if error.filename else "")
    return str(error) or type(error).__name__
