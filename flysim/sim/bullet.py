"""pybullet, imported without its greeting: it writes to the terminal from C, past Python's streams."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Drops what C code writes to stdout and stderr meanwhile: `--json` promises that stdout holds nothing else."""
    kept = {}
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        _flush()
        for descriptor in (1, 2):
            with contextlib.suppress(OSError):  # closed by whoever started us
                kept[descriptor] = os.dup(descriptor)
                os.dup2(null, descriptor)
        yield
    finally:
        _flush()
        for descriptor, copy in kept.items():
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(null)


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            with contextlib.suppress(OSError, ValueError):  # a full disk or a closed stream is told elsewhere
                stream.flush()
    ctypes.CDLL(None).fflush(None)


with silenced():
    import pybullet as pybullet
