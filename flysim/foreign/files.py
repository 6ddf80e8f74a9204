"""Opens somebody else's file: a regular one, of a bounded size."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from flysim.errors import FlysimError
from flysim.plain import shown_path

CHUNK = 2**20  # bytes


def opened(path: Path, what: str, limit: int, error: type[FlysimError] = FlysimError) -> BinaryIO:
    """A stream of the file's bytes, for the caller to close. `what` names it in errors: "calibration".

    Raises:
        error: there is none, it cannot be opened, it is no regular file (a pipe or a device never ends), or it has
            more than `limit` bytes.
    """
    try:
        # Without waiting: opening a pipe that nobody writes to would.
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as refusal:  # ValueError: a zero byte in its name
        reason = refusal.strerror if isinstance(refusal, OSError) else refusal
        raise error(f"{shown_path(path)}: cannot read the {what}: {reason}.") from refusal
    about = os.fstat(number)
    if not stat.S_ISREG(about.st_mode):
        os.close(number)
        kind = "a folder" if stat.S_ISDIR(about.st_mode) else "no regular file"
        raise error(f"{shown_path(path)}: cannot read the {what}: it is {kind}. Name a file.")
    stream = os.fdopen(number, "rb")
    if about.st_size > limit:
        stream.close()
        raise _too_large(path, what, limit, error)
    return stream


def read_bytes(path: Path, what: str, limit: int, error: type[FlysimError] = FlysimError) -> bytes:
    """The whole file.

    Raises:
        error: as `opened`, or it cannot be read.
    """
    with opened(path, what, limit, error) as stream:
        try:
            data = stream.read(limit + 1)  # the size may have been none: of a file in /proc, or one that grows
        except OSError as refusal:
            raise error(f"{shown_path(path)}: cannot read the {what}: {refusal.strerror}.") from refusal
    if len(data) > limit:
        raise _too_large(path, what, limit, error)
    return data


def read_text(path: Path, what: str, limit: int, error: type[FlysimError] = FlysimError) -> str:
    """The whole file as text: UTF-8, with or without a byte-order mark, lines ended as anywhere.

    Raises:
        error: as `read_bytes`, or it is no UTF-8.
    """
    data = read_bytes(path, what, limit, error)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as refusal:
        raise error(
            f"{shown_path(path)}: cannot read the {what}: byte {refusal.start} is not UTF-8. Save it as UTF-8 text."
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _too_large(path: Path, what: str, limit: int, error: type[FlysimError]) -> FlysimError:
    return error(f"{shown_path(path)}: cannot read the {what}: it is larger than {limit} bytes. Is it another file?")
