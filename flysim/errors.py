"""Everything flysim refuses, by one family: a user's mistake is one line, never a traceback."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class FlysimError(Exception):
    """What was wrong, what was got, what to do. The command line prints it in one line and exits with 2."""


class ScenarioError(FlysimError):
    """A scenario or a `--set` override that cannot be run."""


class WorldError(FlysimError):
    """A world file, its meshes or its textures cannot be used."""


class RobotError(FlysimError):
    """A robot file cannot be used."""


class RendererError(FlysimError):
    """The asked renderer cannot draw on this machine."""


class EngineError(FlysimError):
    """There is no such engine."""


class RecordError(FlysimError):
    """A run folder cannot be written or read."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """A sentence that helps after an unknown name: the nearest known one, else the list of all."""
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if near:
        return f"Did you mean '{near[0]}'?"
    return f"Known: {', '.join(known)}." if known else "There is none."
