"""`flysim export` and `run --data` as they are typed; frames on the way; and that nothing half-written stays."""

import json
import shlex
import sys
from collections import Counter

import data_sets
import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.datasets.source import DataSetSource, read_data_set
from flysim.evaluate.report import Report
from flysim.record.run_folder import report_file
from flysim.runs.scenario import read_scenario
from flysim.studies.suite.case import Job, run_case
from flysim.studies.suite.suites import Case


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("filmed")
    path = data_sets.scenario(folder, "")
    words = ["--format", "tum", "--fps", "2", "--out", str(folder / "set"), "--renderer", "tiny", "--json"]
    done = CliRunner().invoke(app, ["export", str(path), *words])
    assert done.exit_code == 0, done.output
    return folder / "set", json.loads(done.output)


def test_frames_on_the_way_are_as_far_apart_as_was_asked(filmed):
    folder, told = filmed
    data = read_data_set(folder)
    times = np.array(data.recorded.times)
    assert told["exports"][0]["frames"] == len(times) > 3
    assert np.diff(times) == pytest.approx(0.5, abs=1.01 / 60.0)
    assert times[0] < 0.1
    source = DataSetSource(data, seed=0)
    frames = list(source.frames())
    truth = source.truth()
    moved = [stop.true.x for stop in truth.stops]
    assert moved[0] == pytest.approx(0.9, abs=1e-3) and max(moved) > 0.95
    for frame, stop in zip(frames, truth.stops, strict=True):
        np.testing.assert_allclose(frame.T_world_base, stop.odometry.matrix, atol=1e-12)
        assert (frame.time, frame.index) == (stop.sim_time, stop.index)


@pytest.mark.accuracy
def test_a_set_is_run_as_it_is_typed(filmed, tmp_path):
    folder, _ = filmed
    arguments = ["run", "--data", str(folder), "--every", "3", "--engine", "chance", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(app, [*arguments, "--json"])
    assert done.exit_code == 0, done.output
    (report,) = json.loads(done.output)
    assert (report["scenario"], report["engine"], report["seed"]) == ("short", "chance", 0)
    assert json.loads((tmp_path / "run" / "report.json").read_text()) == report
    config = json.loads((tmp_path / "run" / "config.json").read_text())
    assert (config["format"], config["frames"][:2], config["engine"]) == ("tum", [0, 3], "chance")
    assert (tmp_path / "run" / "figures" / "planes.png").is_file()


MISTAKES = {
    "export paper_a --format kiti": "no format 'kiti'. Did you mean 'kitti'?",
    "export paper_a --stops --fps 3": "--stops and --fps: choose one of the two",
    "export paper_a --fps 99": "--fps must be from 0.01 to 60, got 99.0",
    "export papr": "no scenario 'papr'",
    "run --data nowhere": "nowhere: no data set: there is no such folder",
    "run paper_a --data SET": "--data goes without scenarios",
    "run paper_a --every 2": "--every and --height go with --data DIR",
    "run paper_a --engine onnx:": "names no file. Write onnx:model.onnx",
    "run --data SET --every 0": "--every must be from 1 to 100,000, got 0",
    "run --data SET --engine 'exec:false {left} {right} {out}'": "frame 0: 'false' ended with code 1",
    "run --data SET --set world=yard": "only flies.KEY and obstacles.KEY can be set",
    "compare paper_a --engines 'bm,exec:./none {left} {right} {out}'": "no program './none'",
    "score SET --points nowhere/*.ply": "no file that ends with .ply",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_one_line_and_leaves_nothing(filmed, tmp_path, monkeypatch, line):
    monkeypatch.chdir(tmp_path)
    words = [str(filmed[0]) if word == "SET" else word for word in shlex.split(line)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2, done.output
    said = done.output.strip().splitlines()
    assert MISTAKES[line] in said[-1] and said[-1].startswith("flysim: ")
    left = [path for path in tmp_path.rglob("*") if path.is_file() or path.name not in ("runs", "out")]
    assert not left


def test_a_suite_counts_a_program_that_fails_and_goes_on(filmed):
    case = Case(name="short", seed=0, scenario=str(filmed[0].parent / "short.toml"))
    failing = run_case(Job(case=case, engines=("exec:false {left} {right} {out}",), renderer="tiny"))
    assert failing.error == "frame 0: 'false' ended with code 1." and not failing.reports


def test_what_a_program_saw_can_be_run_again_by_naming_it(filmed, tmp_path):
    config = tmp_path / "config.json"
    kept = read_scenario(str(filmed[0].parent / "short.toml")).kept(tmp_path, 0)
    config.write_text(json.dumps({"scenario": {**kept, "engine": "exec:false {left} {right} {out}"}}))
    done = CliRunner().invoke(app, ["run", str(config), "--out", str(tmp_path / "run")])
    assert done.exit_code == 2 and "a scenario starts no program" in done.output
    words = ["--engine", "exec:true {left} {right} {out}", "--renderer", "tiny", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(app, ["run", str(config), *words])
    assert done.exit_code == 2 and "frame 0: 'true' left no file" in done.output
    assert not (tmp_path / "run").exists()


def test_an_engines_report_has_a_name_that_a_file_may_have():
    assert report_file("flies") == "flies.json"
    assert report_file("my_engine:Patient") == "my_engine:Patient.json"
    long = report_file("exec:/some/where/matcher {left} {right} {out} " + "x" * 300)
    assert "/" not in long and len(long) < 100
    assert report_file("exec:./a {left}") != report_file("exec:./a {right}")


SECOND_FAILS = """
import pathlib, sys
import numpy as np
count = pathlib.Path(__file__).with_suffix(".count")
count.write_text(count.read_text() + "." if count.exists() else ".")
if len(count.read_text()) == 2:
    sys.exit("not this one")
np.save(sys.argv[3], np.full((int(sys.argv[5]), int(sys.argv[4])), 20.0, np.float32))
"""


def test_of_a_program_that_fails_at_one_frame_the_others_are_kept(filmed, tmp_path):
    matcher = tmp_path / "matcher.py"
    matcher.write_text(SECOND_FAILS)
    data = read_data_set(filmed[0])
    camera = next(iter(DataSetSource(data, seed=0).frames())).pair.rig.left
    command = f"exec:{sys.executable} {matcher} {{left}} {{right}} {{out}} {camera.width} {camera.height}"
    out = tmp_path / "run"
    words = ["run", "--data", str(filmed[0]), "--engine", command, "--every", "2", "--out", str(out), "--json"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2, done.output
    (said,) = done.stderr.strip().splitlines()
    assert said.startswith("flysim: frame 2: ") and said.endswith("ended with code 1: not this one.")
    (report,) = json.loads(done.stdout)
    assert report["failed"] == [said.removeprefix("flysim: ")]
    assert json.loads((out / "report.json").read_text()) == report
    assert (out / "flies.parquet").is_file()
    stops = Counter(pq.read_table(out / "flies.parquet")["stop"].to_pylist())
    assert set(stops) == {stop["index"] for stop in report["stops"]} - {2} and len(stops) > 1
    assert Report.from_json(report).failed == tuple(report["failed"])
