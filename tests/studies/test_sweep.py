"""A study: one disturbance over levels, each cell kept, the same rows whoever runs it."""

import importlib.util
import json
import math
import subprocess
import sys
from dataclasses import replace

import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.common.growing import growing
from flysim.common.runner import runner
from flysim.common.workers import Died
from flysim.engines.choose import ENGINES
from flysim.errors import FlysimError
from flysim.runs.scenario import read_scenario
from flysim.studies.sweep.cell import Row, run_trip
from flysim.studies.sweep.result import SweepResult, half_lost
from flysim.studies.sweep.study import STUDIES, Study
from flysim.studies.sweep.sweep import CELLS, STUDY, run_study, trips
from flysim.studies.sweep.table import cells_parquet

GAIN = Study(
    what="right eye darker", unit="%", levels=(0.0, 60.0), settings=lambda x: {"sensors.gain_right": 1 - x / 100}
)


class Here:
    """A runner that does the jobs in this process, and counts them."""

    def __init__(self, lose=()):
        self.jobs, self.lose = [], lose

    def __call__(self, work, jobs):
        self.jobs += jobs
        return self

    def __enter__(self):
        done, self.jobs_now = len(self.jobs), self.jobs
        del done
        return ((k, Died("killed") if k in self.lose else run_trip(job)) for k, job in enumerate(self.jobs))

    def __exit__(self, *_):
        return None


def studied(short, out, run, *, seeds=(0,), engines=("flies", "chance"), levels=None):
    todo = trips(GAIN, [str(short)], seeds, engines, levels=levels, renderer="tiny")
    with growing([out], STUDY, {}, len(todo), "drives", resume=True, more=True) as folder:
        return run_study("gain", GAIN, todo, folder, run)


@pytest.fixture
def done(short, tmp_path):
    here = Here()
    return studied(short, tmp_path / "out", here), tmp_path / "out", here


def test_each_cell_has_a_row_in_json_and_parquet(done):
    result, out, here = done
    assert len(here.jobs) == 2  # a drive a level; both engines saw it
    told = json.loads((out / STUDY).read_text(encoding="utf-8"))
    assert {"study", "unit", "rows", "half_level"} <= told.keys() and told["complete"]
    assert [(row["level"], row["engine"]) for row in told["rows"]] == [
        (level, engine) for level in (0.0, 60.0) for engine in ("flies", "chance")
    ]
    assert set(told["half_level"]) == {"flies", "chance"}
    table = pq.read_table(out / CELLS)
    assert table.num_rows == 4 and table.schema.metadata[b"unit"] == b"%"
    written = {row["key"]: row for row in table.to_pylist()}
    for row in told["rows"]:
        assert written[row["key"]] == row
        assert row["scenario"] == "short" and row["points"] > 0 and row["error"] is None
        for name in ("f1", "well_f1"):
            assert 0.0 <= row[name] <= 1.0
    with Image.open(out / "figures/study.png") as picture:
        assert picture.width > 500
    assert any("half is lost at" in sheet.columns for sheet in result.sheets())


def test_what_a_folder_holds_is_not_run_again(done, short):
    result, out, _ = done
    again = Here()
    assert studied(short, out, again).rows == result.rows and again.jobs == []
    more = Here()
    grown = studied(short, out, more, seeds=(0, 1), engines=("flies", "chance", "bm"))
    assert sorted((job.seed, job.level, job.engines) for job in more.jobs) == [
        (0, 0.0, ("bm",)), (0, 60.0, ("bm",)),
        (1, 0.0, ("flies", "chance", "bm")), (1, 60.0, ("flies", "chance", "bm")),
    ]  # fmt: skip
    assert {row.key: row for row in result.rows}.items() <= {row.key: row for row in grown.rows}.items()
    less = studied(short, out, Here(), engines=("chance",))
    assert {row.engine for row in less.rows} == {"chance"}
    assert pq.read_table(out / CELLS).num_rows == len(grown.rows)  # it holds all that it was ever asked for


def test_a_change_of_anything_that_a_figure_follows_from_is_another_cell(short):
    (one,) = trips(GAIN, [str(short)], (0,), ("flies",), levels=(0.0,), renderer="tiny")
    other = replace(one, plan=read_scenario(str(short), ["flies.population=201"]))
    assert len({one.key("flies"), one.key("bm"), replace(one, seed=1).key("flies"), other.key("flies")}) == 4
    assert replace(one, engines=("flies", "bm"), scenario="x").key("flies") == one.key("flies")


def test_a_drive_that_was_lost_is_done_by_the_next_call(short, tmp_path):
    out = tmp_path / "out"
    lost = studied(short, out, Here(lose=(1,)))
    assert len(lost.rows) == 2 and len(lost.lost) == 1 and "killed" in lost.lost[0]
    assert not json.loads((out / STUDY).read_text(encoding="utf-8"))["complete"]
    rest = Here()
    assert len(studied(short, out, rest).rows) == 4
    assert [job.level for job in rest.jobs] == [60.0]


def test_a_drive_that_fails_is_told_and_tried_again(short, tmp_path, monkeypatch):
    def broken(*_, **__):
        raise FlysimError("the world is gone.")

    with monkeypatch.context() as patch:
        patch.setattr("flysim.studies.compare.compare.compare", broken)
        failed = studied(short, tmp_path / "out", Here(), engines=("chance",))
    assert [row.error for row in failed.rows] == ["the world is gone."] * 2
    assert failed.half_level() == {"chance": None}
    assert any("the world is gone." in cell for sheet in failed.sheets() for row in sheet.rows for cell in row)
    assert all(row.error is None for row in studied(short, tmp_path / "out", Here(), engines=("chance",)).rows)


def test_rows_are_the_same_for_any_number_of_processes(done, short, tmp_path):
    result, _, _ = done
    other = studied(short, tmp_path / "other", runner(2))
    assert timeless(other.rows) == timeless(result.rows)


def timeless(rows):
    return cells_parquet([replace(row, ms_per_stop=None) for row in rows], "gain", "%")


def row(level=0.0, engine="flies", seed=0, found=1, well=1, visible=1, false=0):
    return Row(
        level=level, scenario="s", seed=seed, engine=engine, f1=0.0, well_f1=0.0, found=found, found_well=well,
        visible=visible, false=false, stops=2, points=100, key=f"{level}{engine}{seed}",
    )  # fmt: skip


def test_figures_of_a_level_are_of_all_its_obstacles_together():
    rows = (
        row(found=3, well=2, visible=4, false=1),
        row(seed=1, found=1, well=1, visible=1),
        row(level=9.0, found=0, well=0, visible=5),
    )
    result = SweepResult(name="n", study=GAIN, levels=(0.0, 9.0), engines=("flies",), renderer="gl", rows=rows)
    first, last = result.summary()
    assert first.f1 == pytest.approx(2 * 4 / (5 + 5)) and first.well_f1 == pytest.approx(2 * 3 / (5 + 5))
    assert first.points == 50.0 and (first.drives, last.drives) == (2, 1)
    assert first.f1_ci95 is not None and first.f1_ci95[0] <= first.f1 <= first.f1_ci95[1]
    assert last.f1 == 0.0 and last.f1_ci95 is not None and last.f1_ci95[0] == 0.0 < last.f1_ci95[1]
    assert result.half_level() == {"flies": pytest.approx(4.5)}


def test_half_is_lost_between_two_levels():
    assert half_lost((0.0, 10.0, 20.0), (1.0, 0.8, 0.2)) == pytest.approx(15.0)
    assert half_lost((1.0, 0.5, 0.1), (0.8, 0.4, 0.0)) == pytest.approx(0.5)  # levels may fall
    assert half_lost((0.0, 10.0), (1.0, 0.51)) is None
    assert half_lost((0.0, 10.0), (0.0, 0.0)) is None
    assert half_lost((0.0, 10.0, 20.0), (1.0, None, 0.0)) == pytest.approx(10.0)


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=6))
def test_where_half_is_lost_the_line_is_at_half(figures):
    levels = [float(k) for k in range(len(figures))]
    at = half_lost(levels, figures)
    if at is None:
        assert figures[0] == 0.0 or min(figures) > figures[0] / 2
        return
    k = min(max(math.ceil(at), 1), len(figures) - 1)
    on_line = figures[k - 1] + (figures[k] - figures[k - 1]) * (at - (k - 1))
    assert on_line == pytest.approx(figures[0] / 2, abs=1e-9)


@pytest.mark.parametrize("name", STUDIES.builtin)
def test_every_study_begins_with_the_scenario_as_it_is_and_gets_worse(name):
    study = STUDIES.load(name)
    where = study.scenarios[0]
    plans = [study.changed(read_scenario(where, study.overrides(level)), level) for level in study.levels]
    # Of a length there is no level without any; who says where the robot is, a study may choose.
    assert study.lengths or plans[0].model_copy(update={"localisation": "odometry"}) == read_scenario(where)
    assert len({plan.model_dump_json() for plan in plans}) == len(plans)
    assert len(study.levels) >= 5


def test_the_command(short, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = ["study", "exposure", "--scenarios", str(short), "--engines", "flies,bm", "--seeds", "3"]
    command += ["--levels", "0,20", "--renderer", "tiny", "--processes", "1"]
    shown = CliRunner().invoke(app, [*command, "--out", "out"], env={"COLUMNS": "80"})
    assert shown.exit_code == 0, shown.output
    assert "study exposure: right eye darker [%]" in shown.output and "folder: out" in shown.output
    assert max(map(len, shown.output.splitlines())) <= 80
    again = CliRunner().invoke(app, [*command, "--out", "out", "--json", "--resume"])
    told = json.loads(again.stdout)
    assert told["study"] == "exposure" and told["unit"] == "%" and len(told["rows"]) == 4
    assert {
        "level",
        "scenario",
        "seed",
        "engine",
        "f1",
        "well_f1",
        "center_error_max_m",
        "size_error_max_m",
        "points",
    } <= (told["rows"][0].keys())


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["exposur"], "no study 'exposur'. Did you mean 'exposure'?"),
        (["noise", "--engines", "fly"], "no engine 'fly'"),
        (["noise", "--scenarios", "paper_x"], "no scenario 'paper_x'"),
        (["noise", "--levels", "0,x"], "--levels 0,x: write numbers"),
        (["noise", "--levels", "0,999"], "noise must be"),
        (["noise", "--levels", "5,5"], "name each once"),
        (["noise", "--seeds", "4:4"], "0 drives"),
        (["noise", "--resume"], "--out DIR"),
        (["noise", "--set", "sensor.noise=1"], "sensors"),
    ],
)
def test_mistakes_are_one_line(words, complaint, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = CliRunner().invoke(app, ["study", *words])
    assert shown.exit_code == 2 and complaint in shown.output and len(shown.output.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_engines_of_a_study_are_those_of_the_registry():
    assert {"flies", "sgbm", "bm"} <= set(ENGINES.builtin)


@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="Ray is not installed (flysim[cluster])")
def test_a_study_on_ray_has_the_rows_of_one_on_processes(short, tmp_path):
    tables = []
    for name, more in (("here", ["--processes", "2"]), ("ray", ["--ray", "local", "--processes", "2"])):
        command = [sys.executable, "-m", "flysim", "study", "exposure", "--scenarios", str(short), "--engines", "flies"]
        command += ["--seeds", "0:2", "--levels", "0,50", "--renderer", "tiny", "--out", name, *more]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        tables.append(pq.read_table(tmp_path / name / CELLS).drop(["ms_per_stop"]))
    assert tables[0].num_rows == 4 and tables[0].equals(tables[1])
