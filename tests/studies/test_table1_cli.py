"""`flysim table1` on the small study of this folder: what it prints, writes and refuses."""

import errno
import json
import os
import re

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """An empty folder to be in."""
    monkeypatch.chdir(tmp_path)
    for name in ("FORCE_COLOR", "PY_COLORS", "GITHUB_ACTIONS"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.fixture
def asked(table, monkeypatch):
    """What the study was asked for; it answers with the table that is there already."""
    known = []

    def run(**arguments):
        known.append({key: value for key, value in arguments.items() if key != "progress"})
        arguments["progress"]("seed 1 of 2", 0.5)
        return table

    monkeypatch.setattr("flysim.studies.table1.table1.run_table1", run)
    return known


def typed(*arguments):
    return CliRunner().invoke(app, ["table1", *map(str, arguments)], prog_name="flysim")


def test_json_is_one_object_and_the_same_as_in_the_folder(place, asked, table):
    result = typed("--seeds", 2, "--renderer", "tiny", "--json", "--out", "a/t")
    assert (result.exit_code, result.stderr) == (0, "")
    assert json.loads(result.stdout) == table.to_json()
    assert asked == [{"seeds": 2, "renderer": "tiny"}]
    assert json.loads((place / "a/t/table1.json").read_text(encoding="utf-8")) == table.to_json()
    written = {path.relative_to(place / "a/t").as_posix() for path in (place / "a/t").rglob("*.*")}
    assert written == {"table1.json", "figures/set_A.png", "figures/set_C.png", "figures/cost_quality.png"}


def test_each_cell_is_printed_beside_the_papers(place, asked, table):
    result = typed()
    assert (result.exit_code, result.stderr) == (0, "")
    assert asked == [{"seeds": 20, "renderer": "auto"}]
    assert "\x1b" not in result.stdout
    head, *rows = result.stdout.splitlines()
    assert " ".join(head.split()) == "set flies reg. stop iterations paper ms paper faster on object"
    for row, one in zip(rows, table.cells, strict=False):
        fields = row.replace(" ± ", "±").split()
        assert fields[:4] == [one.cell.operators, str(one.cell.population), str(one.cell.regions), f"{one.cell.stop}%"]
        assert fields[4] == f"{one.iterations_mean:.1f}±{one.iterations_ci95:.1f}"
        assert fields[6] == f"{one.ms_mean:.1f}±{one.ms_ci95:.1f}"
        assert (int(fields[5]), int(fields[7])) == one.paper
        assert fields[8:] == [f"{one.paper.ms / one.ms_mean:.0f}x", f"{100 * one.on_object:.1f}%"]
    assert f"rank correlation with the paper: iterations {table.rank_correlation['iterations']:.2f}" in result.stdout
    (folder,) = (place / "runs/out").iterdir()
    assert re.fullmatch(r"table1-\d{8}T\d{6}Z", folder.name)
    assert f"folder: runs/out/{folder.name} " in result.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--renderer", "gll"], "flysim: no renderer 'gll'. Did you mean 'gl'?\n"),
        (
            ["--out", "full"],
            "flysim: full exists and is not empty: name another folder with `--out DIR`, or empty it\n",
        ),
    ],
)
def test_a_mistake_is_one_line_before_the_work(place, asked, arguments, said):
    (place / "full").mkdir()
    (place / "full/thing").touch()
    result = typed(*arguments)
    assert (result.exit_code, result.stdout, result.stderr) == (2, "", said)
    assert not asked
    assert [path.name for path in place.iterdir()] == ["full"]


@pytest.mark.parametrize("seeds", ["0", "-3", "x"])
def test_no_seed_is_refused(place, asked, seeds):
    result = typed("--seeds", seeds)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "--seeds" in result.stderr and "Traceback" not in result.stderr
    assert not asked and not list(place.iterdir())


def test_a_full_disk_leaves_nothing(place, asked, monkeypatch):
    def full(folder, _figures):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder / "set_A.png"))

    monkeypatch.setattr("flysim.studies.table1.figures.write_pngs", full)
    result = typed("--out", "t")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("flysim: disk full while writing t: ")
    assert asked and not list(place.iterdir())
