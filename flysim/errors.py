"""Everything flysim refuses, by one family: a user's mistake is one line, never a traceback."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from flysim.plain import one_line

LONGEST = 150  # characters of a name that are compared with others, and of the others that are told


class FlysimError(Exception):
    """What was wrong, what was got, what to do. The command line prints it in one line and exits with 2.

    Whatever of somebody else's file is in it, the text is printable and has less than 300 characters.
    """

    def __init__(self, what: str) -> None:
        super().__init__(one_line(str(what)))  # whoever passes an error on may do so as it is


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
    near = difflib.get_close_matches(name[:LONGEST], known, n=1, cutoff=0.5)
    if near:
        return f"Did you mean '{near[0]}'?"
    if not known:
        return "There is none."
    count = next((n for n in range(1, len(known)) if len(", ".join(known[: n + 1])) > LONGEST), len(known))
    more = f" and {len(known) - count} more" if count < len(known) else ""
    return f"Known: {', '.join(known[:count])}{more}."
