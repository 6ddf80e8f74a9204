"""Processes that end with the one that started them, however that ends.

The parent holds the writing end of a pipe, or what multiprocessing has like one; when the parent is gone, by whatever
signal, the other end tells so at once.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from typing import Any

from flysim.common import scratch

# A terminal, `timeout` or the end of a service sends these to children too: they are the parent's to obey.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SOON_MS = 500  # [ms] between the first and the last descriptor of a killed process that is closed
# Starts a program that knows nothing of us, kills it and itself when we are gone, and ends as the program did.
_GUARD = """
import os, select, signal, subprocess, sys, threading
ours = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
def default():
    for one in ours: signal.signal(one, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ours)
def watch(line):
    waiting = select.poll(); waiting.register(line, select.POLLIN); waiting.poll()
    os.killpg(0, signal.SIGKILL)
for one in ours: signal.signal(one, signal.SIG_IGN)
child = subprocess.Popen(sys.argv[2:], preexec_fn=default)
threading.Thread(target=watch, args=(int(sys.argv[1]),), daemon=True).start()
code = child.wait()
os._exit(code if code >= 0 else 128 - code)
"""


@contextlib.contextmanager
def undisturbed() -> Iterator[None]:
    """Blocks those signals in this thread: a process that is started within has them blocked until it follows."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Lifeline:
    """The parent's end: as long as it is open, whoever follows it goes on.

    Attributes:
        theirs: the descriptor to `follow`, which the child has by the same number.
    """

    def __init__(self) -> None:
        self.theirs, self._ours = os.pipe()

    def start(self, command: Sequence[str], **more: Any) -> subprocess.Popen[Any]:
        """Starts the process that is to follow, once; arguments as Popen's.

        Raises:
            OSError: it cannot be started.
        """
        try:
            with undisturbed():
                return subprocess.Popen(command, pass_fds=[self.theirs], **more)
        except BaseException:
            self.cut()
            raise
        finally:
            os.close(self.theirs)

    def start_guarded(self, command: Sequence[str], **more: Any) -> subprocess.Popen[Any]:
        """Starts somebody else's program, with all that it starts, as a session of its own that ends with us.

        Raises:
            OSError: it cannot be started.
        """
        guard = [sys.executable, "-I", "-S", "-c", _GUARD, str(self.theirs), *command]
        return self.start(guard, start_new_session=True, **more)

    def cut(self) -> None:
        """Lets go: who follows ends. Safe to call twice."""
        if self._ours >= 0:
            os.close(self._ours)
            self._ours = -1


def follow(line: int) -> None:
    """Called in a child's main thread: from now on it ends with its parent, its temporary folders with it.

    Args:
        line: a descriptor that becomes readable when the parent is gone.
    """
    for one in SIGNALS:
        signal.signal(one, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    sys.stderr = _Words(sys.stderr, line)
    threading.Thread(target=_watch, args=(line,), name="flysim-lifeline", daemon=True).start()


class _Words:
    """Stderr, without a traceback of somebody else's loop that finds its pipe broken a moment before we end it."""

    def __init__(self, stream: Any, line: int) -> None:
        self._stream, self._line = stream, line

    def write(self, text: str) -> int:
        if isinstance(sys.exc_info()[1], ConnectionError) and _gone(self._line, SOON_MS):
            _end()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _watch(line: int) -> None:
    if _gone(line, None):
        _end()


def _gone(line: int, milliseconds: int | None) -> bool:
    waiting = select.poll()
    waiting.register(line, select.POLLIN)
    return bool(waiting.poll(milliseconds))


def _end() -> None:
    scratch.clear()
    os._exit(1)
