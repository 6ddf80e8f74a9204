"""The engine's kernels on several threads: compiled code that lets go of Python's lock, one lane of the work each.

numba's own parallel loops would do the same; compiling them takes half as long again, and their threads wait for each
other in busy loops, which costs dearly where the machine has other work.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any

import numba

# Each of a program's own threads has its say for itself.
_lanes = ContextVar("lanes", default=int(numba.config.NUMBA_NUM_THREADS))  # type: ignore[attr-defined]
_workers: list[SimpleQueue[Any]] = []  # where each thread takes its work from; made when first needed
_hiring = Lock()


def lanes() -> int:
    """Threads that share the work: numba's NUMBA_NUM_THREADS, else one a core."""
    return _lanes.get()


@contextlib.contextmanager
def limited(threads: int) -> Iterator[None]:
    """Within it the engine takes so many threads, for the thread that asks; others are not touched.

    Raises:
        ValueError: fewer than one.
    """
    if threads < 1:
        raise ValueError(f"threads must be >= 1, got {threads}")
    before = _lanes.set(threads)
    try:
        yield
    finally:
        _lanes.reset(before)


def share(kernel: Callable[..., Any], *arguments: Any) -> None:
    """Calls `kernel(lane, *arguments)` in several lanes, side by side, and waits for all.

    The kernel takes work from a counter among its arguments until there is no more. So a thread that another program
    keeps from running holds nobody up: one that comes when the work is done is no longer waited for.
    """
    others = lanes() - 1
    task = _Task(kernel, arguments, others)
    for lane, worker in enumerate(_hired(others), start=1):
        worker.put((lane, task))
    try:
        kernel(0, *arguments)
    finally:  # they write into the caller's arrays: nobody leaves before those that began
        replies = others - task.close()
        errors = [error for error in (task.done.get() for _ in range(replies)) if error is not None]
    if errors:
        raise errors[0]


def _hired(count: int) -> list[SimpleQueue[Any]]:
    """The queues of so many threads, which all callers share."""
    with _hiring:
        while len(_workers) < count:
            _workers.append(SimpleQueue())
            name = f"flysim-flies-{len(_workers)}"
            Thread(target=_work, args=(_workers[-1],), name=name, daemon=True).start()
        return _workers[:count]


class _Task:
    """A call that some lanes may still join."""

    def __init__(self, kernel: Callable[..., Any], arguments: tuple[Any, ...], places: int) -> None:
        self.kernel, self.arguments = kernel, arguments
        self.places = [None] * places  # popped: of two threads only one gets the last
        self.done: SimpleQueue[BaseException | None] = SimpleQueue()  # an executor's futures take twice as long

    def join(self) -> bool:
        """Whether there was a place left."""
        try:
            self.places.pop()
        except IndexError:
            return False
        return True

    def close(self) -> int:
        """How many places nobody took; nobody will."""
        free = 0
        while self.join():
            free += 1
        self.arguments = ()  # no array outlives its evolution in a thread
        return free


def _work(tasks: SimpleQueue[tuple[int, _Task]]) -> None:
    while True:
        lane, task = tasks.get()
        arguments = task.arguments
        if task.join():
            try:
                task.kernel(lane, *arguments)
                task.done.put(None)
            except BaseException as error:  # raised again where the work came from
                task.done.put(error)
        del task, arguments


def _forked() -> None:
    """In a forked child: threads do not come along, and somebody may have held the lock."""
    global _hiring
    _hiring = Lock()
    _workers.clear()


os.register_at_fork(after_in_child=_forked)
