"""A file that is written whole or not at all."""

from __future__ import annotations

import contextlib
import hashlib
import os
import uuid
from collections.abc import Iterator
from pathlib import Path

from flysim.common.held import PART, held_file, sweep_parts

LONGEST = 180  # [bytes] of a name that a hidden one has room for
ATTEMPTS = 100


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a hidden file beside `path` to write to. At the end it takes the place of `path`; on any error it goes.

    What a killed writer left goes with the next file that is written to the folder. Of two who write one file at the
    same time the last one wins.

    Raises:
        OSError: the folder refuses, or the disk is full.
    """
    sweep_parts(path.parent)
    part, descriptor = _made(path)
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
        os.close(descriptor)


def write_whole(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; otherwise as `whole_file`."""
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")


def hidden(path: Path, mark: str = "") -> Path:
    """The name under which something lies beside `path` until it is whole: always the same for one path and mark."""
    name = path.name
    if len(os.fsencode(name)) > LONGEST:
        name = hashlib.sha256(os.fsencode(name)).hexdigest()
    return path.with_name(f".{name}{mark and f'.{mark}'}{PART}")


def _made(path: Path) -> tuple[Path, int]:
    for _ in range(ATTEMPTS):
        part = hidden(path, uuid.uuid4().hex[:8])
        descriptor = held_file(part)
        if descriptor is not None:
            return part, descriptor
    raise FileExistsError(f"{path}: what is written beside it is taken away again and again")
