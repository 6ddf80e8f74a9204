"""How the engine's functions are compiled: once, into a cache that outlives the process (`kernel_cache`)."""

from __future__ import annotations

import gc
import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba import config, njit
from numba.core import event
from numba.extending import overload

from flysim.compute.kernel_cache import KernelCache
from flysim.compute.uncompiled import plain_kernel


class _Uncollected(event.Listener):
    """No garbage is collected during compilation: what it makes lives until its end, and is looked through each time.

    Measured: 1 s of 15.
    """

    depth, was_on = 0, False

    def on_start(self, event: Any) -> None:
        if self.depth == 0:
            self.was_on = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        self.depth -= 1
        if self.depth == 0 and self.was_on:
            gc.enable()


event.register("numba:compile", _Uncollected())


def _kept(function: Callable[..., Any], **options: Any) -> Any:
    # No wrapper for C callers, whom there are none, and divisions as numpy has them: both would only be compiled.
    made: Any = njit(no_cfunc_wrapper=True, error_model="numpy", **options)(function)  # type: ignore[call-overload]
    if hasattr(made, "enable_caching"):  # else numba is told not to compile
        made._cache = KernelCache(function)  # as enable_caching does, with a cache of ours
    return made


compiled: Any = _kept
# A function with one caller: compiled as a part of it, it costs a little less than on its own.
inlined: Any = partial(_kept, inline="always")
# What `threads.share` runs: without Python's lock.
kernel: Any = partial(_kept, nogil=True)
if config.DISABLE_JIT:  # type: ignore[attr-defined]
    # NUMBA_DISABLE_JIT=1: all of it is plain Python, with numbers that behave as compiled ones do, silently.
    np.seterr(all="ignore")
    kernel = plain_kernel


def either(function: Callable[..., Any], plain: Callable[..., Any]) -> Any:
    """`function` compiled, or where nothing is compiled `plain`: the same for whole arrays, as numpy is quick at."""
    return plain if config.DISABLE_JIT else compiled(function)  # type: ignore[attr-defined]


def by_rows(short: Callable[..., Any], long: Callable[..., Any]) -> Any:
    """A function that is `short` for views of `views.LEVEL`, whose rows meet, and `long` for those of other pairs.

    It is chosen by the type of the first argument: the way that is not gone is not compiled either.
    """

    def chosen(*arguments: Any) -> Any:  # compiled code never calls it
        return (short if "level" in arguments[0].dtype.names else long)(*arguments)

    def choose(*arguments: Any) -> Any:
        return short if "level" in arguments[0].fields else long

    # The names of its arguments are those of both ways.
    choose.__signature__ = inspect.signature(short)  # type: ignore[attr-defined]
    overload(chosen, jit_options={"error_model": "numpy"}, strict=False)(choose)
    return chosen
