"""What comes from a file reaches the terminal as plain text."""

import json
import os
import pty

import pytest

from flysim.cli import terminal
from flysim.common.sheet import Sheet

EVIL = "res[final] [/x] [bold]b[/bold] :smile: \x1b[31mred\x1b]8;;http://x\x07 \u202eabc\n1.5"
PLAIN = "res[final] [/x] [bold]b[/bold] :smile: ?[31mred?]8;;http://x? ?abc?1.5"


def test_lines_and_errors(capsys):
    terminal.say("a\x1bb\nc", 3)
    terminal.complain(EVIL)
    terminal.warn(EVIL)
    out, err = capsys.readouterr()
    assert out == "a?b\nc\n3\n"
    assert err == f"flysim: {PLAIN}\nflysim: warning: {PLAIN}\n"


def test_json_is_ascii(capsys):
    terminal.say_json({"a": EVIL})
    out, _ = capsys.readouterr()
    assert out.isascii() and "\x1b" not in out
    assert json.loads(out) == {"a": EVIL}


def test_a_table_shows_titles_columns_cells_and_notes_as_they_stand(capsys):
    terminal.show([Sheet(title=EVIL, columns=(EVIL, "b"), rows=((EVIL, EVIL),), note=EVIL)])
    out, _ = capsys.readouterr()
    assert out.count(PLAIN) == 5
    assert "\x1b" not in out


def shown_on_a_terminal(show, monkeypatch, width="300"):
    monkeypatch.setenv("COLUMNS", width)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    near, far = pty.openpty()
    try:
        with os.fdopen(far, "w") as stream:
            monkeypatch.setattr("sys.stdout", stream)
            monkeypatch.setattr("sys.stderr", stream)
            show()
            stream.flush()
            return os.read(near, 2**16).decode()
    finally:
        monkeypatch.undo()
        os.close(near)


def test_a_table_on_a_terminal_has_no_colour_in_its_cells(monkeypatch):
    sheet = Sheet(title="", columns=("a", "b"), rows=(("1.5 'x' http://y", EVIL),))
    text = shown_on_a_terminal(lambda: terminal.show([sheet]), monkeypatch)
    assert f"1.5 'x' http://y  {PLAIN}" in text


def test_a_bar_shows_what_it_is_told_as_it_stands(monkeypatch):
    def run():
        with terminal.Bar(EVIL, quiet=False) as bar:
            bar(EVIL, 0.5)
            bar._progress.refresh()

    text = shown_on_a_terminal(run, monkeypatch)
    assert text.count(PLAIN) >= 2


@pytest.mark.parametrize("quiet", [True, False])
def test_a_bar_is_silent_elsewhere(capsys, quiet):
    with terminal.Bar("x", quiet=quiet) as bar:
        bar("y", 0.5)
    assert capsys.readouterr() == ("", "")


FIGURES = tuple((name, *["1.000 (0.900-1.000)"] * 7, "-38.7 +0.2 +0.2") for name in ("flies", "sgbm", "bm", "chance"))
NAMES = ("engine", *(f"figure {i}" for i in range(7)), "missed > 15 cm")
TEXTS = (("paper_a", "3", "Past the object, and then a long way round it, to where nobody has ever been before."),)


@pytest.mark.parametrize("wide", [200, 120, 80, 60, 40])
@pytest.mark.parametrize(
    "sheet",
    [
        Sheet(title="t" * 150, columns=NAMES, rows=FIGURES, note="a note of many words " * 9),
        Sheet(title="", columns=("name", "stops", "description"), rows=TEXTS, left=(0, 2)),
        Sheet(title="", columns=("engine", "ms a stop", "missed > 15 cm"), rows=(("flies", "1.5", "3"),)),
    ],
)
def test_a_table_fits_its_lines_and_breaks_no_figure(sheet, wide, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(wide))
    terminal.show([sheet])
    out, _ = capsys.readouterr()
    assert max(map(len, out.split("\n"))) <= wide
    if sheet.rows is FIGURES:
        assert out.count("1.000 (0.900-1.000)") == 28
        assert out.count("-38.7 +0.2 +0.2") == 4
    for name in sheet.columns:
        assert all(word in out for word in name.split())
    for row in sheet.rows:
        assert all(word in out for cell in row for word in cell.split())


def test_a_table_in_a_pipe_has_a_line_a_row_as_far_as_200_characters_go(monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    terminal.show([Sheet(title="t", columns=NAMES[:8], rows=tuple(row[:8] for row in FIGURES))])
    out, _ = capsys.readouterr()
    assert [line[:5].strip() for line in out.splitlines()] == ["t", "engin", "flies", "sgbm", "bm", "chanc", ""]
