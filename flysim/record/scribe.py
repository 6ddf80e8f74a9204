"""A process beside this one that writes run folders: it loads its libraries while the robot still drives.

Figures and recording need libraries that take longer to load than a short run takes to drive. Threads share one
interpreter lock, so loading them in a thread slows the drive down; a process of its own has the second core to itself.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from flysim.common.lifeline import Lifeline, follow
from flysim.common.progress import Progress
from flysim.errors import RecordError

if TYPE_CHECKING:
    from flysim.evaluate.report import Report

# The parent's import path goes first: flysim itself may lie on it.
_START = "import sys; sys.path[:] = eval(sys.argv[1]); from flysim.record.scribe import serve; serve(int(sys.argv[2]))"
_idle: list[Scribe] = []  # loaded and waiting for the next run of this process


@contextlib.contextmanager
def scribe() -> Iterator[Scribe]:
    """A scribe that is loading or loaded. It is kept for the next run if nothing goes wrong, else ended."""
    one = _take()
    try:
        yield one
    except BaseException:
        one.end()
        raise
    _idle.append(one)


def _take() -> Scribe:
    while _idle:
        one = _idle.pop()
        if one.usable:
            return one
        one.end()
    return Scribe()


@atexit.register
def _end_idle() -> None:
    while _idle:
        _idle.pop().end()


os.register_at_fork(after_in_child=lambda: _idle.clear())  # theirs is the parent's pipe


class Scribe:
    """The parent's end of the process."""

    def __init__(self) -> None:
        self._environment = dict(os.environ)
        self._line = Lifeline()
        command = [sys.executable, "-c", _START, repr(sys.path), str(self._line.theirs)]
        try:
            self._process = self._line.start(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        except OSError as error:
            raise RecordError(f"cannot start the process that writes the run: {error}") from error

    @property
    def usable(self) -> bool:
        """Whether it still lives, in the environment that this process has now."""
        return self._process.poll() is None and self._environment == dict(os.environ)

    def begin(self, folder: Path, **of_the_run: Any) -> None:
        """Let it draw what needs no report; arguments as `recorder.write_run`'s. Returns at once."""
        self._send((folder, of_the_run))

    def finish(self, report: Report | None, progress: Progress) -> None:
        """Hand it the report and wait until everything is written.

        Raises:
            RecordError: as `recorder.write_run`, or the process was killed.
            OSError: as `recorder.write_run`.
        """
        self._send(report)
        while True:
            try:
                kind, what = pickle.load(self._stdout)  # from our own child, not from a file
            except (EOFError, OSError, pickle.UnpicklingError) as error:
                raise self._lost() from error
            if kind == "progress":
                progress(*what)
            elif kind == "error":
                raise what
            else:
                return

    def end(self) -> None:
        """Kill it, whatever it does, and wait until it is gone: after that it writes nothing more."""
        self._process.kill()
        self._process.wait()
        self._line.cut()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):  # what was not sent any more
                    pipe.close()

    @property
    def _stdout(self) -> IO[bytes]:
        assert self._process.stdout is not None
        return self._process.stdout

    def _send(self, message: Any) -> None:
        assert self._process.stdin is not None
        try:
            pickle.dump(message, self._process.stdin, protocol=5)
            self._process.stdin.flush()
        except OSError as error:
            raise self._lost() from error

    def _lost(self) -> RecordError:
        code = self._process.wait()
        return RecordError(f"the process that writes the run ended with code {code}: was it killed, or memory short?")


def serve(line: int) -> None:
    """The child's end: write one run after the other until the parent is gone, and then not even the one at work."""
    follow(line)
    orders, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints does not get between the answers

    def tell(kind: str, what: Any = None) -> None:
        pickle.dump((kind, what), answers)
        answers.flush()

    from flysim.record import figures, files, recording
    from flysim.record.recorder import write_run

    for room in (recording, figures, files):
        with contextlib.suppress(ImportError):  # told where it is needed
            room.load()
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            order = pickle.load(orders)
            if not isinstance(order, tuple):  # the report of a run that failed before it was asked for
                continue
            folder, of_the_run = order
            try:
                write_run(
                    folder, report=lambda: pickle.load(orders), progress=lambda *s: tell("progress", s), **of_the_run
                )
                tell("done")
            except Exception as error:
                tell("error", error)
