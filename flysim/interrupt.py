"""Ctrl-C that is obeyed: with one line, all cleaning up done, and never where Python would lose it.

A KeyboardInterrupt that is raised inside a callback from C (numba's compiler has such) or a finaliser is printed and
forgotten; one raised inside the import system may leave its lock held, and whoever imports next waits for ever. So it
is raised again until it has got through, never inside the import system, and never while its own cleaning up runs.
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
RETRY_S = 0.05


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Ends the program with one line and exit code 130 on Ctrl-C. Does nothing where SIGINT is ignored or handled."""
    obeys = threading.current_thread() is threading.main_thread()
    if not obeys or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    interrupt, report = _Interrupt(sys.unraisablehook), sys.unraisablehook
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
        interrupt.over = True
        # An impatient user's second Ctrl-C does not break off Python's own end.
        signal.signal(signal.SIGINT, signal.SIG_IGN if interrupt.asked else signal.default_int_handler)
        sys.unraisablehook = report


def _end() -> None:
    sys.stderr.write("flysim: stopped by Ctrl-C; nothing half-written is left.\n")
    raise SystemExit(EXIT_CODE) from None


class _Interrupt:
    """The handler of the signal."""

    def __init__(self, report: Any) -> None:
        self.asked = self.over = False
        self._report = report

    def __call__(self, _signal: int, frame: FrameType | None) -> None:
        if not self.asked:
            self.asked = True
            _thread.start_new_thread(self._insist, ())  # threading.Thread takes locks that we may be holding
        if not _ending() and not _deaf(frame):
            raise KeyboardInterrupt

    def _insist(self) -> None:
        time.sleep(RETRY_S)
        while not self.over:
            _thread.interrupt_main()
            time.sleep(RETRY_S)

    def lost(self, what: Any) -> None:
        """For `sys.unraisablehook`: an interrupt that Python cannot pass on is not worth a word, it comes again."""
        if what.exc_type is not KeyboardInterrupt:
            self._report(what)


def _ending() -> bool:
    """Whether the interrupt is on its way: what runs now cleans up behind it."""
    error = sys.exc_info()[1]
    while error is not None:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            return True
        error = error.__context__
    return False


def _deaf(frame: FrameType | None) -> bool:
    """Whether an exception raised in this frame would do harm or be lost."""
    if frame is not None and frame.f_code.co_filename.startswith("<frozen importlib"):
        return True
    while frame is not None:
        if "llvmlite" in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False
