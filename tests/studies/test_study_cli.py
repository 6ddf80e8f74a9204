"""flysim compare, suite and regress as a user types them."""

import json

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app

FEW = {"f1": {"value": 0.0, "tolerance": 0.0}, "surface_f_0.05": {"value": 0.0, "tolerance": 0.0}}


@pytest.fixture
def flysim(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(app, [str(word) for word in words])


def test_compare_writes_its_folder_and_prints_a_row_an_engine(flysim, short, tmp_path):
    done = flysim("compare", short, "--engines", "flies,chance", "--renderer", "tiny", "--out", "mine")
    assert done.exit_code == 0, done.output
    assert [line.split()[0] for line in done.output.splitlines()[2:4]] == ["flies", "chance"]
    assert (tmp_path / "mine/compare.json").is_file()
    assert (tmp_path / "mine/figures/top.png").is_file()
    done = flysim("compare", short, "--engines", "chance", "--renderer", "tiny", "--json")
    (data,) = json.loads(done.stdout)["comparisons"]
    assert list(data["engine"]) == ["chance"]


def test_suite_pools_and_keeps_its_figures(flysim, short, tmp_path, monkeypatch):
    from flysim.studies.suite import suites

    monkeypatch.setattr(suites, "PAPER", (str(short),))
    done = flysim(
        "suite", "paper", "--seeds", "0:2", "--engines", "chance", "--renderer", "tiny", "--json", "--out", "o"
    )
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    assert [row["seed"] for row in data["runs"]] == [0, 1]
    assert {"f1", "precision", "recall"} <= data["engine"]["chance"].keys()
    kept = json.loads((tmp_path / "o/suite.json").read_text(encoding="utf-8"))
    assert kept["engine"] == data["engine"]
    assert all((tmp_path / row["folder"] / "compare.json").is_file() for row in data["worst"])


def test_suite_takes_keys_of_a_scenario(flysim, short, tmp_path, monkeypatch):
    from flysim.studies.suite import suites

    monkeypatch.setattr(suites, "PAPER", (str(short),))
    words = ("suite", "paper", "--seeds", "0:1", "--engines", "chance", "--renderer", "tiny", "--keep")
    assert flysim(*words, "--set", "obstacles.min_flies=1234", "--out", "o").exit_code == 0
    (kept,) = tmp_path.glob("o/**/scenario.json")
    assert json.loads(kept.read_text(encoding="utf-8"))["obstacles"]["min_flies"] == 1234


def test_regress_tells_what_moved_and_fails_on_what_got_worse(flysim, short, tmp_path):
    folder = tmp_path / "held"
    folder.mkdir()
    file = folder / "mine.json"
    run = {"scenario": str(short), "seed": 0, "renderer": "tiny", "stops": 1}
    file.write_text(json.dumps({**run, "figures": FEW}), encoding="utf-8")
    done = flysim("regress", "--baselines", folder, "--json")
    assert done.exit_code == 0, done.output
    assert {one["verdict"] for one in json.loads(done.stdout)["baselines"][0]["figures"]} <= {"same", "better"}

    refused = flysim("regress", "--baselines", folder, "--update")
    assert refused.exit_code == 2
    assert "--reason" in refused.output
    done = flysim("regress", "mine", "--baselines", folder, "--update", "--reason", "planted")
    assert done.exit_code == 0, done.output
    held = json.loads(file.read_text(encoding="utf-8"))
    assert held["updates"][0]["reason"] == "planted"
    assert flysim("regress", "--baselines", folder).exit_code == 0

    held["figures"]["surface_f_0.05"]["value"] += 0.1  # as if it had been better
    file.write_text(json.dumps(held), encoding="utf-8")
    done = flysim("regress", "--baselines", folder)
    assert done.exit_code == 1
    assert "surface_f_0.05" in done.output and "worse" in done.output


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("compare", "papr_a"), "Did you mean 'paper_a'?"),
        (("compare", "paper_a", "--engines", "flise"), "no engine 'flise'. Did you mean 'flies'?"),
        (("compare", "paper_a", "--engines", "bm,bm"), "name each engine once"),
        (("compare", "paper_a", "--engines", "bm,'exec:./no,ne {left} {right} {out}'"), "no program './no,ne'"),
        (("compare", "paper_a", "paper_a"), "share a folder"),
        (("compare", "paper_a", "--renderer", "gll"), "no renderer 'gll'"),
        (("suite", "papr"), "no suite 'papr'. Did you mean 'paper'?"),
        (("suite", "paper", "--seeds", "a:b"), "write A:B"),
        (("suite", "paper", "--seeds", "5:5"), "needs a seed"),
        (
            ("suite", "paper", "--set", "obstacles.clib=false"),
            "--set: unknown key 'obstacles.clib'. Did you mean 'climb'?",
        ),
        (("suite", "barn"), "no world of BARN"),
        (("regress", "papr_b"), "Did you mean 'paper_b'?"),
        (("regress", "--reason", "why"), "goes with --update"),
        (("run", "paper_a", "--engine", "sgmb"), "no engine 'sgmb'. Did you mean 'sgbm'?"),
    ],
)
def test_mistakes_are_one_line(flysim, words, why, tmp_path):
    done = flysim(*words)
    assert done.exit_code == 2
    assert why in done.output
    assert len(done.output.strip().splitlines()) == 1
    assert not list(tmp_path.glob("runs/**/*.json"))
