"""`flysim` and `python -m flysim`: the command line, with Ctrl-C obeyed from the first import on."""

from __future__ import annotations

from flysim.interrupt import interruptible


def main() -> None:
    """Entry point of the `flysim` command."""
    with interruptible():
        from flysim.cli import app

        app(prog_name="flysim")


if __name__ == "__main__":
    main()
