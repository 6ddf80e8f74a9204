"""All that flysim shows on a terminal goes through here, as plain text.

Names, titles and warnings come from files that somebody else wrote. So nothing of a text is an order: characters that
are not printable are shown as `?`, square brackets are no markup, `:smile:` is no emoji, nothing is a link, and only
where stdout is a terminal is anything coloured.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import typer

from flysim.cli.layout import GAP, Laid, fitted
from flysim.plain import one_line, plain

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from flysim.common.sheet import Sheet

WIDE = 200  # [characters]


def say(*lines: object) -> None:
    """Lines on stdout. A text may have several; what is not printable in them is shown as `?`."""
    typer.echo("\n".join(plain(line) for text in lines for line in str(text).split("\n")))


def say_folded(*lines: str) -> None:
    """Lines on stdout, each on as many as the width there is asks for."""
    room = width() or WIDE
    say(*(part for line in lines for part in textwrap.wrap(line, room, break_on_hyphens=False) or [""]))


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
    """Tables on stdout, each with an empty line after it; as wide as the terminal, or as $COLUMNS says."""
    out = _console(width=width() or WIDE)
    for sheet in sheets:
        if sheet.title:
            out.print(_words(sheet.title))
        for laid in fitted(_plain(sheet), out.width):
            out.print(_table(laid))
        if sheet.note:
            out.print(_words(sheet.note))
        out.print("")


def width() -> int | None:
    """Characters of a line; None: elsewhere than on a terminal, where nobody has set $COLUMNS: a row is one line."""
    given = os.environ.get("COLUMNS", "")
    if given.isdecimal() and int(given) > 0:
        return int(given)
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


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


def _plain(sheet: Sheet) -> Sheet:
    rows = tuple(tuple(map(plain, row)) for row in sheet.rows)
    return replace(sheet, columns=tuple(map(plain, sheet.columns)), rows=rows)


def _words(text: str) -> Text:
    from rich.text import Text

    return Text(plain(text), style="italic")


def _table(laid: Laid) -> Table:
    """As the terminal has it: the first column flush left, figures flush right."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, padding=(0, GAP, 0, 0))
    for i, (name, wide) in enumerate(zip(laid.columns, laid.widths, strict=True)):
        table.add_column(
            Text(name), justify="left" if i in laid.left else "right", width=wide, overflow="fold", vertical="top"
        )
    for row in laid.rows:
        table.add_row(*map(Text, row))
    return table
