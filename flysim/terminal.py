"""What the command line shows on a terminal beside lines of text: a progress bar, tables."""

from __future__ import annotations

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from flysim.study.sheet import Sheet

WIDE = 200  # [characters]


class Bar:
    """A progress bar on stderr where that is a terminal; silent elsewhere."""

    def __init__(self, title: str, *, quiet: bool) -> None:
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.fields[title]}"),
            BarColumn(),
            TextColumn("{task.description}"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=quiet or not console.is_terminal,
        )
        self._task = self._progress.add_task("start", total=1.0, title=title)

    def __enter__(self) -> Bar:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def __call__(self, what: str, share: float) -> None:
        """Says what is going on and the share that is done."""
        self._progress.update(self._task, description=what, completed=share)


def console() -> Console:
    """Stdout; as wide as a table may be where it is no terminal, so that a pipe gets each row as one line."""
    out = Console()
    return out if out.is_terminal else Console(width=WIDE)


def table(sheet: Sheet) -> Table:
    """A sheet as the terminal lays it out: the first column flush left, figures flush right."""
    laid = Table(title=sheet.title or None, title_justify="left", box=None, pad_edge=False, caption=sheet.note or None)
    laid.caption_justify = "left"
    for i, column in enumerate(sheet.columns):
        laid.add_column(column, justify="right" if i else "left")
    for row in sheet.rows:
        laid.add_row(*row)
    return laid
