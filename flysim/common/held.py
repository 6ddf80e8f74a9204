"""Folders and files that bear a lock for as long as their maker lives: what bears none was left behind, and may go.

The lock is `flock`'s, on the thing itself: the system takes it away with the process, however that ends. Where a file
system has no such locks, nothing counts as left behind.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import stat
from collections.abc import Callable
from pathlib import Path

PART = ".flysim.part"  # ending of what is not whole yet


def held_folder(path: Path, mode: int = 0o777) -> int | None:
    """Makes a folder and holds it.

    Args:
        path: where; its parent must be there.
        mode: who may do what in it, less the user's mask.

    Returns:
        The descriptor that holds it until it is closed; None if somebody who swept took the folder for left behind.

    Raises:
        FileExistsError: something of that name is there.
        OSError: the system refuses.
    """
    path.mkdir(mode)
    return _held(path)


def held_file(path: Path) -> int | None:
    """Makes an empty file and holds it; otherwise as `held_folder`."""
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    return _held(path)


def _held(path: Path) -> int | None:
    try:
        return hold(path)
    except (BlockingIOError, FileNotFoundError):
        return None


def hold(path: Path, *, surely: bool = False) -> int:
    """Holds what is there already.

    Args:
        path: of a folder or file; no link.
        surely: refuse where the file system has no locks.

    Raises:
        BlockingIOError: somebody else holds it.
        FileNotFoundError: it is not there, or no longer.
        OSError: it cannot be opened, or not be locked and must `surely` be.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError:  # no such locks here
            if surely:
                raise
        if not os.path.samestat(os.fstat(descriptor), os.lstat(path)):
            raise FileNotFoundError(f"{path} was replaced")
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def sweep(folder: Path, ours: Callable[[str], bool]) -> None:
    """Removes what others left behind in a folder: of this user, by names that are `ours`, held by nobody."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if ours(entry.name):
                with contextlib.suppress(OSError):
                    _sweep_one(Path(entry.path), entry.stat(follow_symlinks=False))


def sweep_parts(folder: Path) -> None:
    """Removes what a killed writer left beside what it wrote."""
    sweep(folder, lambda name: name.startswith(".") and name.endswith(PART))


def _sweep_one(path: Path, status: os.stat_result) -> None:
    folder = stat.S_ISDIR(status.st_mode)
    if status.st_uid != os.getuid() or not (folder or stat.S_ISREG(status.st_mode)):
        return
    descriptor = hold(path, surely=True)
    try:
        if folder:
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
    finally:
        os.close(descriptor)
