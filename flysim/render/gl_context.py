"""OpenGL contexts without a screen: opened here alone, and refused where they would only hang."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any

import moderngl

from flysim.errors import FlysimError, RendererError

_opened = False  # whether this process, or one it was forked from, has opened a context
_forked = False  # whether it was forked after that


def _after_fork() -> None:
    global _forked
    _forked = _opened


# A driver's threads (Mesa's llvmpipe has one a core) do not come along, and whoever draws waits for them for ever.
os.register_at_fork(after_in_child=_after_fork)


def open_context() -> moderngl.Context:
    """A headless OpenGL 3.3 context.

    Raises:
        RendererError: this machine has no EGL or no driver behind it.
        FlysimError: this process was forked after pictures were drawn.
    """
    global _opened
    _refuse_fork()
    # moderngl's type hints take settings for one dict a keyword; they are strings.
    settings: dict[str, Any] = {"backend": "egl", "libegl": "libEGL.so.1", "libgl": "libGL.so.1"}
    try:
        context = moderngl.create_context(standalone=True, **settings)
    except Exception as error:  # moderngl raises bare Exception, OSError or ImportError
        raise RendererError(
            f"no OpenGL context opens ({' '.join(str(error).split())}). Install Mesa's libEGL, or use --renderer tiny."
        ) from error
    _opened = True
    return context


def close_context(context: moderngl.Context) -> None:
    """Frees a context and all it holds. Safe to call twice."""
    if not _forked:  # else it is the parent's, and the driver would wait here as well
        context.release()


@contextlib.contextmanager
def entered(context: moderngl.Context, what: str) -> Iterator[None]:
    """Makes a context this thread's own within the block, and turns a driver's refusal into one line.

    Raises:
        RendererError: the driver refuses `what`.
        FlysimError: as `open_context`.
    """
    _refuse_fork()
    try:
        with context:
            yield
    except moderngl.Error as error:
        reason = " ".join(str(error).split())[:200]
        raise RendererError(f"OpenGL cannot {what} ({reason}). Use --renderer tiny.") from error


def _refuse_fork() -> None:
    if _forked:
        raise FlysimError(
            "this process was forked after a picture was drawn with OpenGL, whose threads do not come along. Start "
            'workers afresh: gymnasium.vector.AsyncVectorEnv(..., context="spawn"), or make the renderer "tiny".'
        )
