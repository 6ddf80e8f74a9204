"""The suite of photographs on a folder of two drawn pairs, one of which cannot be read."""

import json
from pathlib import Path

import numpy as np
import photographed
import pytest
from PIL import Image
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.studies.photographs.photographs import known_pairs, run_photographs


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


DATA = Path(__file__).parents[3] / "shared" / "data" / "stereo"


def test_flies_are_nearer_to_the_truth_than_block_and_semi_global_matching():
    if not DATA.is_dir():
        pytest.skip(f"the photographs are not here: {DATA}")
    scores = run_photographs(known_pairs(DATA), ("flies", "bm", "sgbm"), seed=41).pairs
    assert set(scores) == {"cones", "teddy", "motorcycle_q", "tsukuba"}
    for name, by_engine in scores.items():
        flies = by_engine["flies"]
        assert flies.seen.within_1px > by_engine["bm"].seen.within_1px, name
        assert flies.seen.within_1px > by_engine["sgbm"].seen.within_1px, name
        assert flies.matches > 1100 and flies.coverage > 0.65, name
    assert scores["motorcycle_q"]["flies"].seen.median_m < 0.006
