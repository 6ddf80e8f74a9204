"""Jobs on several processes: one that dies takes its own job along and no other, and none outlives the caller.

The standard pools do one of the two: a dead process breaks an executor with all its jobs, and a `Pool` waits for its
result for ever; and both leave their processes at work when the caller is killed.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import threading
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from flysim.common.lifeline import follow, undisturbed
from flysim.common.scratch import sweep_scratch

# One thread each: what is timed does not depend on the neighbour, and nothing waits in busy loops.
ONE_THREAD: dict[str, str] = dict.fromkeys(
    ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)

T = TypeVar("T")


class Died(Exception):
    """A process ended in the middle of its job."""


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextlib.contextmanager
def finished(work: Callable[[Any], Any], jobs: Sequence[Any], processes: int) -> Iterator[Iterator[tuple[int, Any]]]:
    """Yields what yields (index of a job, `work(job)`) as each is done, a `Died` where its process died.

    At the end of the block no process is left, whatever ends it; nor is one if this process is killed.

    Args:
        work: a function of a module; it must not raise.
        jobs: what can be pickled.
        processes: at most so many, started afresh ("spawn"), each with one thread.
    """
    running: dict[Any, _Worker] = {}
    try:
        yield _results(work, jobs, processes, running)
    finally:
        killed = [worker.kill() for worker in running.values()]
        if killed:
            sweep_scratch()


@contextlib.contextmanager
def started(make: Callable[[], T]) -> Iterator[T]:
    """Yields what a function makes that starts processes by multiprocessing. At the end of the block none is left.

    It is called in a thread, so that this one can be interrupted while they start, and they cannot.
    """
    made: list[T] = []
    failed: list[BaseException] = []

    def call() -> None:
        try:
            with undisturbed():
                made.append(make())
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=call, name="flysim-start", daemon=True)
    try:
        thread.start()
        while thread.is_alive():
            thread.join(0.1)
        if failed:
            raise failed[0]
        yield made[0]
    finally:
        end_all()


def end_all() -> None:
    """Ends all processes that multiprocessing started for this one, and what they leave."""
    children = multiprocessing.active_children()
    for process in children:
        process.kill()
    for process in children:
        process.join()
    if children:
        sweep_scratch()


def follow_parent() -> None:
    """Called in a process that multiprocessing started: from now on it ends with the one that started it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        follow(parent.sentinel)


def _results(
    work: Callable[[Any], Any], jobs: Sequence[Any], processes: int, running: dict[Any, _Worker]
) -> Iterator[tuple[int, Any]]:
    todo = list(enumerate(jobs))[::-1]

    def start() -> _Worker:
        worker = _Worker(work)
        running[worker.pipe] = worker
        return worker

    for _ in range(min(processes, len(jobs))):
        start().take(todo.pop())
    while running:
        for pipe in wait(list(running)):
            worker = running[pipe]
            index, result = worker.result()
            yield index, result
            if isinstance(result, Died):
                sweep_scratch()  # what it had
                del running[pipe]
                if todo:
                    worker = start()
            if todo:
                worker.take(todo.pop())
            elif running.pop(worker.pipe, None):
                worker.end()


class _Worker:
    """One process and what it is at."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        # Pickled here, so that it loads nothing before it follows us.
        self.process = context.Process(target=_serve, args=(theirs, pickle.dumps(work)), daemon=True)
        with _environment(ONE_THREAD):
            _start_whole(self.process)
        theirs.close()
        self.index = -1

    def take(self, job: tuple[int, Any]) -> None:
        self.index = job[0]
        with contextlib.suppress(BrokenPipeError):  # it died before: its result says so
            self.pipe.send(job[1])

    def result(self) -> tuple[int, Any]:
        try:
            return self.index, self.pipe.recv()
        except (EOFError, OSError):
            self.process.join()
            return self.index, Died(f"its process died with exit code {self.process.exitcode}")

    def end(self) -> None:
        with contextlib.suppress(BrokenPipeError):
            self.pipe.send(None)
        self.process.join()

    def kill(self) -> None:
        self.process.kill()
        self.process.join()


def _start_whole(process: Any) -> None:
    """Starts a process of multiprocessing in a thread: what interrupts this one meanwhile never leaves it half-started.

    To block signals here is not enough: a library's thread may take one, and Python then obeys it in this thread.
    """
    failed: list[BaseException] = []

    def start() -> None:
        try:
            with undisturbed():
                process.start()
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=start, name="flysim-start", daemon=True)
    thread.start()
    try:
        thread.join()
    except BaseException:
        while thread.is_alive():
            with contextlib.suppress(KeyboardInterrupt):
                thread.join(0.1)
        if not failed:
            process.kill()
            process.join()
        raise
    if failed:
        raise failed[0]


def _serve(pipe: Connection, pickled: bytes) -> None:
    follow_parent()
    work = pickle.loads(pickled)  # from our own parent, not from a file
    while True:
        try:
            job = pipe.recv()
        except (EOFError, OSError):  # the parent is gone
            return
        if job is None:
            return
        result = work(job)
        with contextlib.suppress(OSError):
            pipe.send(result)


@contextlib.contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    """Variables for processes that are started within."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
