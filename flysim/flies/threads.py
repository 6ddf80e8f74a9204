"""The engine's kernels on several threads: compiled code that lets go of Python's lock, one lane of the work each.

numba's own parallel loops would do the same; compiling them takes half as long again, and their threads wait for each
other in busy loops, which costs dearly where the machine has other work.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numba

_lanes = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
_workers: list[SimpleQueue[Any]] = []  # where each thread takes its work from; made when first needed


def lanes() -> int:
    """Threads that share the work: numba's NUMBA_NUM_THREADS, else one a core."""
    return _lanes


@contextlib.contextmanager
def limited(threads: int) -> Iterator[None]:
    """Within it the engine takes so many threads.

    Raises:
        ValueError: fewer than one.
    """
    global _lanes
    if threads < 1:
        raise ValueError(f"threads must be >= 1, got {threads}")
    before, _lanes = _lanes, threads
    try:
        yield
    finally:
        _lanes = before


def share(kernel: Callable[..., Any], *arguments: Any) -> None:
    """Calls `kernel(lane, lanes, *arguments)` once for each lane, side by side, and waits for all."""
    count, done = _lanes, SimpleQueue()  # an executor's futures take twice as long as these queues
    while len(_workers) < count - 1:
        _workers.append(SimpleQueue())
        Thread(target=_work, args=(_workers[-1],), name=f"flysim-flies-{len(_workers)}", daemon=True).start()
    for lane in range(1, count):
        _workers[lane - 1].put((done, kernel, lane, count, arguments))
    try:
        kernel(0, count, *arguments)
    finally:  # they write into the caller's arrays: nobody leaves before them
        errors = [error for error in (done.get() for _ in range(1, count)) if error is not None]
    if errors:
        raise errors[0]


def _work(tasks: SimpleQueue[Any]) -> None:
    while True:
        done, kernel, lane, count, arguments = tasks.get()
        try:
            kernel(lane, count, *arguments)
            done.put(None)
        except BaseException as error:  # raised again where the work came from
            done.put(error)
        del done, kernel, arguments  # no array outlives its evolution here


os.register_at_fork(after_in_child=lambda: _workers.clear())  # threads do not come along
