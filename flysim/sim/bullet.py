"""pybullet, imported without its greeting, which it writes from C, past Python's streams.

After that Bullet is silent, as what it loads is written by flysim and gives no cause to warn. No file descriptor is
turned round for it: that would take the output of every other thread along. pybullet keeps the interpreter's lock in
each call, so that simulations in several threads need no lock of their own.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
from collections.abc import Iterator


@contextlib.contextmanager
def _without_greeting() -> Iterator[None]:
    """Drops what C code prints to its own `stderr` meanwhile; Python's streams and descriptors stay as they are."""
    if platform.libc_ver()[0] != "glibc":  # elsewhere the variable may be constant: the greeting does no harm
        yield
        return
    libc = ctypes.CDLL(None)
    libc.fopen.argtypes, libc.fopen.restype = [ctypes.c_char_p, ctypes.c_char_p], ctypes.c_void_p
    libc.fclose.argtypes = [ctypes.c_void_p]
    stderr = ctypes.c_void_p.in_dll(libc, "stderr")
    kept, null = stderr.value, libc.fopen(os.devnull.encode(), b"w")
    if null is None:
        yield
        return
    stderr.value = null
    try:
        yield
    finally:
        stderr.value = kept
        libc.fclose(null)


with _without_greeting():
    import pybullet as pybullet
