"""How the engine's functions are compiled, once, into a cache that outlives the process.

Where the package's folder cannot be written, numba keeps the cache in the user's own (NUMBA_CACHE_DIR names another).
"""

from __future__ import annotations

from functools import partial
from typing import Any

from numba import njit

# No wrapper for C callers, whom there are none, and divisions as numpy has them: both would only be compiled.
_njit: Any = njit
_jit: Any = partial(_njit, cache=True, no_cfunc_wrapper=True, error_model="numpy")
compiled: Any = _jit()
# A function with one caller: compiled as a part of it, it costs a little less than on its own.
inlined: Any = _jit(inline="always")
# What `threads.share` runs: without Python's lock.
kernel: Any = _jit(nogil=True)
