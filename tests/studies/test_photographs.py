"""The suite of photographs on a folder of two drawn pairs, one of which cannot be read."""

import json

import numpy as np
import photographed
import pytest
from PIL import Image
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.errors import ScenarioError
from flysim.studies.suite.suites import cases


def test_pairs_of_a_folder_are_scored_by_every_engine(tmp_path):
    data = tmp_path / "data"
    left, right, disparity = photographed.room()
    for name in ("good", "torn"):
        (data / name).mkdir(parents=True)
        files = photographed.save(data / name, left, right)
        np.save(data / name / "disp_gt.npy", disparity)
    files[1].write_bytes(files[1].read_bytes()[:1000])
    (data / "no truth").mkdir()
    words = ["suite", "photographs", "--data", str(data), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*words, "--engines", "flies,bm", "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    (pair,) = told["pairs"]
    assert told["suite"] == "photographs"
    assert pair["name"] == "good"
    assert {"within_0_5px", "within_1px", "within_3px", "median_px", "coverage", "count", "ms"} <= pair["flies"].keys()
    assert {"within_1px", "within_3px", "median_px", "density", "ms"} <= pair["bm"].keys()
    assert pair["flies"]["within_1px"] > 0.97
    assert [one["name"] for one in told["failed"]] == ["torn"]
    with Image.open(tmp_path / "out" / "scores.png") as picture:
        assert picture.size[0] > 300
    assert json.loads((tmp_path / "out" / "suite.json").read_text())["pairs"] == told["pairs"]


def test_a_folder_without_a_pair_is_told(tmp_path):
    done = CliRunner().invoke(app, ["suite", "photographs", "--data", str(tmp_path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2 and "no pair with a truth" in done.stderr
    assert not (tmp_path / "out").exists()


def test_it_is_found_as_any_suite_is():
    done = CliRunner().invoke(app, ["suite", "photograhs"])
    assert done.exit_code == 2 and "no suite 'photograhs'. Did you mean 'photographs'?" in done.stderr
    listed = json.loads(CliRunner().invoke(app, ["list", "suites", "--json"]).stdout)["suites"]
    assert {"name": "photographs", "from": "flysim", "place": "flysim.studies.photographs.pairs:known_pairs"} in listed


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--keep"], "suite 'photographs' sees photographs, none of which drives: no --set, --keep, --resume."),
        (["--set", "flies.population=100"], "no --set, --keep, --resume."),
        (["--seeds", "0:2"], "suite photographs takes one seed: --seeds 3."),
    ],
)
def test_what_only_drives_take_is_refused(tmp_path, words, why):
    left, right, disparity = photographed.room()
    photographed.save(tmp_path, left, right)
    np.save(tmp_path / "disp_gt.npy", disparity)
    done = CliRunner().invoke(app, ["suite", "photographs", "--data", str(tmp_path), *words])
    assert done.exit_code == 2 and done.stderr.rstrip().endswith(why)


def test_a_suite_of_ones_own_may_be_of_pairs_but_not_of_both(tmp_path, monkeypatch):
    (tmp_path / "my_pairs.py").write_text(
        "from pathlib import Path\n"
        "from flysim.studies.photographs.pairs import KnownPair\n"
        "from flysim.studies.suite.suites import Case\n"
        "def one(seeds, data):\n"
        "    return [KnownPair(name='mine', left=Path('a'), right=Path('b'), truth=Path('c'))]\n"
        "def both(seeds, data):\n"
        "    return [*one(seeds, data), Case(name='corridor', seed=0)]\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert [pair.name for pair in cases("my_pairs:one")] == ["mine"]
    with pytest.raises(ScenarioError, match="suite 'my_pairs:both' gave no"):
        cases("my_pairs:both")
