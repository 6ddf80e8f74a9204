"""`flysim bench` as it is typed: what goes to stdout, what is written, what is refused."""

import functools
import json

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.studies.bench import engine as module
from flysim.studies.table1.grid import Cell
from flysim.studies.table1.published import Published


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """An empty folder to be in, and a benchmark of a second."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    monkeypatch.setattr(module, "PUBLISHED", {Cell("C", 500, 4, 90): Published(21, 665)})
    small = {"sizes": ((160, 120),), "populations": (200,), "reference": (160, 120)}
    monkeypatch.setattr(module, "bench_engine", functools.partial(module.bench_engine, **small))
    return folder


def typed(*arguments):
    return CliRunner().invoke(app, ["bench", *map(str, arguments)], prog_name="flysim")


def test_json_is_one_object_and_nothing_else(place):
    result = typed("engine", "--repeats", 1, "--json", "--out", "out")
    assert (result.exit_code, result.stderr) == (0, "")
    data = json.loads(result.stdout)
    assert data["repeats"] == 1
    assert data == json.loads((place / "out" / "bench.json").read_text(encoding="utf-8"))
    assert (place / "out" / "sizes.png").stat().st_size > 10_000


def test_tables_are_lines_when_nobody_watches(place):
    result = typed("engine", "--repeats", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    (row,) = [line for line in lines if line.startswith("C ")]
    assert row.split()[:5] == ["C", "500", "4", "90", "%"]
    assert len([line for line in lines if line.startswith("160x120")]) == 2
    assert not list(place.iterdir())


def test_a_folder_that_holds_something_is_refused_before_the_minutes_it_takes(place, monkeypatch):
    monkeypatch.setattr(module, "bench_engine", None)  # called, it would fail otherwise
    (place / "out").mkdir()
    (place / "out" / "mine.txt").write_text("mine", encoding="utf-8")
    result = typed("engine", "--out", "out")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("flysim: out ")
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("command", ["engine", "stop"])
def test_less_than_one_round_is_refused(command):
    result = typed(command, "--repeats", 0)
    assert result.exit_code == 2
    assert "--repeats" in result.stderr
    assert result.stdout == ""


def test_a_stop_of_a_scenario_of_ones_own(short):
    result = typed("stop", short, "--repeats", 1, "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    assert {stop["scenario"] for stop in json.loads(result.stdout)["stops"]} == {"short"}
