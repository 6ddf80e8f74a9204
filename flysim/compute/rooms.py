"""Room for pictures, used again: fresh memory costs more than what is written into it.

A picture of 640 x 480 takes 225 pages of memory, and the system clears each one when it is first touched. Measured,
that is 0.5 ms a picture, as long as filtering it takes. So an array that nobody holds any more is handed out once more.
"""

from __future__ import annotations

import os
import sys
from threading import Lock

import numpy as np
from numpy.typing import NDArray

MOST = 12  # arrays that are remembered: of one pair, filtered, grey and levelled, about twice what is needed
FREE = 2  # references to an array that only the list holds: the list's, and that of the question itself

_known: list[NDArray[np.uint8]] = []
_asked = Lock()


def room(*shape: int) -> NDArray[np.uint8]:
    """An array of that shape, uint8, with anything in it.

    It is the caller's own for as long as the caller, or anybody it was given to, holds it or a part of it. Whoever
    reads by address alone must hold it too.
    """
    with _asked:
        for k in reversed(range(len(_known))):  # what was used last may still be in the processor's cache
            if _known[k].shape == shape and sys.getrefcount(_known[k]) <= FREE:
                array = _known.pop(k)
                break
        else:
            array = np.empty(shape, np.uint8)
            if len(_known) >= MOST:
                del _known[0]  # the one that was asked for least lately
        _known.append(array)
        return array


def _forked() -> None:
    """In a forked child: somebody may have held the lock."""
    global _asked
    _asked = Lock()
    _known.clear()


os.register_at_fork(after_in_child=_forked)
