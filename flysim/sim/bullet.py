"""pybullet, imported without its greeting: it writes to the terminal from C, past Python's streams."""

from __future__ import annotations

import os
import sys


def _silently_imported() -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, 1)
        os.dup2(null, 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(kept[0], 1)
        os.dup2(kept[1], 2)
        for descriptor in (*kept, null):
            os.close(descriptor)


_silently_imported()

import pybullet as pybullet  # noqa: E402
