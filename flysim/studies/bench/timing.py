"""Times that can be compared: one process, calls in turn, medians."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Result = TypeVar("Result")
Done = Callable[[float], None]  # told the share of the rounds that is done


class Timed(Generic[Result]):
    """What the calls of one work gave: `ms` of each that counts, and its `results`, in order."""

    __slots__ = ("ms", "results")

    def __init__(self) -> None:
        self.ms: list[float] = []
        self.results: list[Result] = []


def interleaved(
    works: Mapping[Key, Callable[[int], Result]], repeats: int, done: Done | None = None
) -> dict[Key, Timed[Result]]:
    """Calls every work once a round, so that a busy minute of the machine falls on all of them alike.

    Args:
        works: what is called, with the number of the round.
        repeats: rounds that count. One before them, also called with 0, does not: it compiles and fills the caches.
        done: told after each call.

    Raises:
        ValueError: fewer than one repeat.
    """
    if repeats < 1:
        raise ValueError(f"repeats must be >= 1, got {repeats}")
    timed: dict[Key, Timed[Result]] = {key: Timed() for key in works}
    calls, total = 0, (repeats + 1) * len(works)
    for turn in range(-1, repeats):
        for key, work in works.items():
            with _no_collection():
                began = time.perf_counter()
                result = work(max(turn, 0))
                ms = 1e3 * (time.perf_counter() - began)
            if turn >= 0:
                timed[key].ms.append(ms)
                timed[key].results.append(result)
            calls += 1
            if done is not None:
                done(calls / total)
    return timed


@contextmanager
def _no_collection() -> Iterator[None]:
    """The collector's pauses belong to none of the works."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
