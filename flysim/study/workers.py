"""Jobs on several processes: one that dies takes its own job along and no other, and none outlives the caller.

The standard pools do one of the two: a dead process breaks an executor with all its jobs, and a `Pool` waits for its
result for ever.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any

# One thread each: what is timed does not depend on the neighbour, and nothing waits in busy loops.
ONE_THREAD: dict[str, str] = dict.fromkeys(
    ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)


class Died(Exception):
    """A process ended in the middle of its job."""


def finished(work: Callable[[Any], Any], jobs: Sequence[Any], processes: int) -> Iterator[tuple[int, Any]]:
    """(index of a job, `work(job)`) as each is done; the result is a `Died` where its process died.

    Args:
        work: a function of a module; it must not raise.
        jobs: what can be pickled.
        processes: at most so many, started afresh ("spawn"), each with one thread.
    """
    todo, running = list(enumerate(jobs))[::-1], {}
    try:
        with _environment(ONE_THREAD):
            for _ in range(min(processes, len(jobs))):
                worker = _Worker(work)
                running[worker.pipe] = worker
                worker.take(todo.pop())
            while running:
                for pipe in wait(list(running)):
                    worker = running[pipe]  # type: ignore[index]
                    index, result = worker.result()
                    yield index, result
                    if isinstance(result, Died):
                        del running[worker.pipe]
                        if todo:
                            worker = _Worker(work)
                            running[worker.pipe] = worker
                    if todo:
                        worker.take(todo.pop())
                    elif running.pop(worker.pipe, None):
                        worker.end()
    finally:
        for worker in running.values():
            worker.kill()


class _Worker:
    """One process and what it is at."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, work), daemon=True)
        self.process.start()
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
        self.process.terminate()
        self.process.join()


def _serve(pipe: Connection, work: Callable[[Any], Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's; it ends this process
    while (job := pipe.recv()) is not None:
        pipe.send(work(job))


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
