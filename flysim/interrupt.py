"""Ctrl-C that is obeyed: once, with one line, and never where Python would lose it.

A KeyboardInterrupt raised inside a callback from C (numba's compiler has such) is printed and forgotten; one raised
inside the import system may leave its lock held, and the thread that loads the recorder's libraries waits for ever.
"""

from __future__ import annotations

import _thread
import contextlib
import signal
import sys
import threading
import time
from collections.abc import Iterator
from types import FrameType
from typing import Any

EXIT_CODE = 130  # 128 + SIGINT, as shells have it
RETRY_S = 0.02
CLEANUP_S = 5.0  # a second Ctrl-C within this time does not cut the cleaning up short


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Ends the program with one line and exit code 130 on Ctrl-C. Does nothing where SIGINT is ignored or handled."""
    obeys = threading.current_thread() is threading.main_thread()
    if not obeys or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    interrupt, report = _Interrupt(), sys.unraisablehook
    sys.unraisablehook = interrupt.lost
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    except KeyboardInterrupt:
        _end()
    except SystemExit as end:  # typer turns some of them into this, without a word
        if end.code != EXIT_CODE:
            raise
        _end()
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = report


def _end() -> None:
    sys.stderr.write("flysim: stopped by Ctrl-C; nothing half-written is left.\n")
    raise SystemExit(EXIT_CODE) from None


class _Interrupt:
    """The signal's handler."""

    def __init__(self) -> None:
        self._raised: float | None = None
        self._report = sys.unraisablehook

    def __call__(self, _signal: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if self._raised is not None and now - self._raised < CLEANUP_S:
            return
        if _deaf(frame):
            _again()
            return
        self._raised = now
        raise KeyboardInterrupt

    def lost(self, what: Any) -> None:
        """For `sys.unraisablehook`: an interrupt that Python could not pass on is raised again elsewhere."""
        if what.exc_type is KeyboardInterrupt:
            self._raised = None
            _again()
        else:
            self._report(what)


def _deaf(frame: FrameType | None) -> bool:
    """Whether an exception raised in this frame would do harm or be lost."""
    if frame is not None and frame.f_code.co_filename.startswith("<frozen importlib"):
        return True
    while frame is not None:
        if "llvmlite" in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False


def _again() -> None:
    def soon() -> None:
        time.sleep(RETRY_S)
        _thread.interrupt_main()

    _thread.start_new_thread(soon, ())  # threading.Thread takes locks that the interrupted code may hold
