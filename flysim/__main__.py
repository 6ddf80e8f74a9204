"""`flysim` and `python -m flysim`: the command line, with Ctrl-C and its like obeyed from the first import on."""

from __future__ import annotations

import os
import sys

from flysim.cli.interrupt import interruptible


def main() -> None:
    """Entry point of the `flysim` command."""
    try:
        with interruptible():
            from flysim.cli.app import app

            app(prog_name="flysim")
    except SystemExit as end:
        _leave(end.code)
        raise


def _leave(code: object) -> None:
    """End without taking a thousand modules apart, which costs half a second; all files are closed by now.

    What Python's own end would do beside is done here: no process and no temporary folder outlives the program.
    """
    if (workers := sys.modules.get("flysim.common.workers")) is not None:
        workers.end_all()
    if (scratch := sys.modules.get("flysim.common.scratch")) is not None:
        scratch.clear()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        return  # Python's own end tells of a closed pipe
    if isinstance(code, int):
        os._exit(code)


if __name__ == "__main__":
    main()
