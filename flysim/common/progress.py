"""How far a long work is, told to whoever asked: a word for what is going on, and a share from 0 to 1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]


def silent(_what: str, _share: float) -> None:
    """A progress that tells nobody, for whoever does not ask."""


def within(told: Progress, begin: float, end: float) -> Progress:
    """What a part of a work tells, as the share of the whole: the part's 0 is `begin` there, its 1 is `end`."""

    def tell(what: str, share: float) -> None:
        told(what, begin + (end - begin) * share)

    return tell
