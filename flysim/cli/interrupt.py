"""Ctrl-C, SIGTERM and SIGHUP that are obeyed: with one line, all cleaning up done, and never where Python loses them.

All three are a KeyboardInterrupt to whatever is at work; what is to be told beside goes into its notes. One that is
raised inside a callback from C (numba's compiler has such) or a finaliser is printed and forgotten; one raised inside
the import system may leave its lock held, and whoever imports next waits for ever. So it is raised again until it has
got through, never inside the import system, and never while its own cleaning up runs.
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

# What stops a program, how a person calls it, and what does unless somebody has it ignored or handled.
SIGNALS = {
    signal.SIGINT: ("Ctrl-C", signal.default_int_handler),
    signal.SIGTERM: ("SIGTERM", signal.SIG_DFL),  # timeout, docker stop, a batch system
    signal.SIGHUP: ("SIGHUP", signal.SIG_DFL),  # a terminal that is closed
}
NAMED = 128  # a shell's exit code of a program that a signal ended, less the signal
TYPERS = NAMED + signal.SIGINT  # what typer makes of an interrupt, without a word
RETRY_S = 0.05


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Ends the program with one line and a shell's exit code (130, 143, 129) on Ctrl-C, SIGTERM and SIGHUP.

    Leaves each signal alone that is ignored or handled: `nohup`, a shell's background.
    """
    ours = [one for one, (_, usual) in SIGNALS.items() if signal.getsignal(one) == usual]
    if threading.current_thread() is not threading.main_thread() or not ours:
        yield
        return
    interrupt, report = _Interrupt(sys.unraisablehook), sys.unraisablehook
    sys.unraisablehook = interrupt.lost
    for one in ours:
        signal.signal(one, interrupt)
    try:
        yield
    except KeyboardInterrupt as stop:
        _end(interrupt.asked, stop)
    except SystemExit as end:
        if end.code != TYPERS:
            raise
        _end(interrupt.asked, end)
    finally:
        interrupt.over = True
        # An impatient user's second Ctrl-C does not break off Python's own end.
        for one in ours:
            signal.signal(one, signal.SIG_IGN if interrupt.asked else SIGNALS[one][1])
        sys.unraisablehook = report


def _end(asked: int, stop: BaseException) -> None:
    asked = asked or signal.SIGINT  # a KeyboardInterrupt that somebody else raised
    told = [note for error in _chain(stop) for note in getattr(error, "__notes__", ())]
    words = [f"stopped by {SIGNALS[signal.Signals(asked)][0]}", "nothing half-written is left", *told]
    with contextlib.suppress(OSError):  # the terminal is gone
        sys.stderr.write(f"flysim: {'; '.join(words)}.\n")
        sys.stderr.flush()
    raise SystemExit(NAMED + asked) from None


class _Interrupt:
    """The handler of the signals."""

    def __init__(self, report: Any) -> None:
        self.asked: Any = 0  # the first signal that came
        self.over = False
        self._report = report

    def __call__(self, which: int, frame: FrameType | None) -> None:
        if not self.asked:
            self.asked = which
            _thread.start_new_thread(self._insist, ())  # threading.Thread takes locks that we may be holding
        if not _ending() and not _deaf(frame):
            raise KeyboardInterrupt

    def _insist(self) -> None:
        time.sleep(RETRY_S)
        while not self.over:
            _thread.interrupt_main(self.asked)
            time.sleep(RETRY_S)

    def lost(self, what: Any) -> None:
        """For `sys.unraisablehook`: an interrupt that Python cannot pass on is not worth a word, it comes again."""
        if what.exc_type is not KeyboardInterrupt:
            self._report(what)


def _ending() -> bool:
    """Whether the interrupt is on its way: what runs now cleans up behind it."""
    return any(isinstance(error, KeyboardInterrupt | SystemExit) for error in _chain(sys.exc_info()[1]))


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """An error, what was being handled when it came, and so on."""
    while error is not None:
        yield error
        error = error.__context__


def _deaf(frame: FrameType | None) -> bool:
    """Whether an exception raised in this frame would do harm or be lost."""
    if frame is not None and frame.f_code.co_filename.startswith("<frozen importlib"):
        return True
    while frame is not None:
        if "llvmlite" in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False
