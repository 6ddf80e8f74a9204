"""All that flysim shows on a terminal goes through here, as plain text.

Names, titles and warnings come from files that somebody else wrote. So nothing of a text is an order: characters that
are not printable are shown as `?`, square brackets are no markup, `:smile:` is no emoji, nothing is a link, and only
where stdout is a terminal is anything coloured.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import typer

from flysim.plain import one_line, plain

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from flysim.common.sheet import Sheet

WIDE = 200  # [characters]


def say(*lines: object) -> None:
    """Lines on stdout. A text may have several; what is not printable in them is shown as `?`."""
    typer.echo("\n".join(plain(line) for text in lines for line in str(text).split("\n")))


def say_json(data: Any) -> None:
    """Data as JSON on stdout; ASCII alone, so that no terminal takes a string of it for an order."""
    typer.echo(json.dumps(data, indent=1, allow_nan=False))


def complain(what: str) -> None:
    """One line of less than 300 characters on stderr."""
    typer.echo(f"flysim: {one_line(what)}", err=True)


def warn(what: str) -> None:
    """One line on stderr, however long."""
    typer.echo(f"flysim: warning: {plain(what)}", err=True)


def show(sheets: Iterable[Sheet]) -> None:
    """Tables on stdout, each with an empty line after it."""
    out = _console()
    # Where it is no terminal a table may be wide, so that a pipe gets each row as one line.
    out = out if out.is_terminal else _console(width=WIDE)
    for sheet in sheets:
        out.print(_table(sheet), "")


class Bar:
    """A progress bar on stderr where that is a terminal; silent elsewhere."""

    def __init__(self, title: str, *, quiet: bool) -> None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        console = _console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.fields[title]}", markup=False),
            BarColumn(),
            TextColumn("{task.description}", markup=False),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=quiet or not console.is_terminal,
        )
        self._task = self._progress.add_task("start", total=1.0, title=plain(title))

    def __enter__(self) -> Bar:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def __call__(self, what: str, share: float) -> None:
        """Says what is going on and the share that is done."""
        self._progress.update(self._task, description=plain(what), completed=share)


def _console(**more: Any) -> Console:
    from rich.console import Console

    return Console(markup=False, emoji=False, highlight=False, **more)


def _table(sheet: Sheet) -> Table:
    """A sheet as the terminal lays it out: the first column flush left, figures flush right."""
    from rich.table import Table
    from rich.text import Text

    laid = Table(
        title=Text(plain(sheet.title)) if sheet.title else None,
        title_justify="left",
        box=None,
        pad_edge=False,
        caption=Text(plain(sheet.note)) if sheet.note else None,
        caption_justify="left",
    )
    for i, column in enumerate(sheet.columns):
        laid.add_column(Text(plain(column)), justify="left" if i in sheet.left else "right")
    for row in sheet.rows:
        laid.add_row(*(Text(plain(cell)) for cell in row))
    return laid
