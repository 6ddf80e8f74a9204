"""Baselines: what is worse, what may move, and what may be written."""

import json

import pytest

from flysim.errors import RecordError
from flysim.studies.regress.baseline import FIGURES, Baseline, Held, find_baselines, read_baseline, write_baseline


@pytest.fixture
def baseline(tmp_path):
    figures = {
        "f1": Held(value=0.9, tolerance=0.01, better="higher"),
        "size_error_m": Held(value=0.01, tolerance=0.002, better="lower"),
        "center_error_m": Held(value=None, tolerance=0.002, better="lower"),
    }
    return Baseline(
        path=tmp_path / "mine.json", scenario="paper_b", engine="flies", seed=0, renderer="tiny", stops=2,
        overrides=(), figures=figures, updates=({"date": "2026-01-01", "reason": "first"},),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("figure", "new", "verdict"),
    [
        ("f1", 0.9, "same"),
        ("f1", 0.9 + 1e-7, "same"),
        ("f1", 0.895, "moved"),
        ("f1", 0.89, "moved"),
        ("f1", 0.889, "worse"),
        ("f1", 0.92, "better"),
        ("f1", None, "worse"),
        ("size_error_m", 0.0119, "moved"),
        ("size_error_m", 0.0121, "worse"),
        ("size_error_m", 0.005, "better"),
        ("center_error_m", None, "same"),
        ("center_error_m", 0.5, "better"),
    ],
)
def test_a_figure_beside_its_old_self(baseline, figure, new, verdict):
    (moved,) = [one for one in baseline.judge({figure: new}) if one.figure == figure]
    assert moved.verdict == verdict


def test_an_update_keeps_tolerances_and_says_why(baseline):
    new = dict.fromkeys(FIGURES, 0.5)
    with pytest.raises(RecordError, match="need a reason"):
        baseline.updated(new, "  ", "2026-02-03")
    write_baseline(baseline.path, baseline.updated(new, "sharper eyes", "2026-02-03"))
    again = read_baseline(baseline.path)
    assert again.figures["f1"] == Held(value=0.5, tolerance=0.01, better="higher")
    assert again.figures.keys() == FIGURES.keys()
    assert [one["reason"] for one in again.updates] == ["first", "sharper eyes"]
    assert again.updates[-1]["date"] == "2026-02-03"
    assert [path.name for path in baseline.path.parent.iterdir()] == ["mine.json"]
    assert (again.scenario, again.stops) == ("paper_b", 2)


def test_no_time_is_held():
    assert not [name for name in FIGURES if "ms" in name.split("_") or "time" in name]


def test_files_that_are_none(tmp_path):
    with pytest.raises(RecordError, match="no baseline in"):
        find_baselines((), tmp_path)
    good = {"scenario": "paper_b", "seed": 0, "renderer": "tiny"}
    for text, why in (
        ("{", "no baseline: "),
        ("[]", "no baseline: "),
        (json.dumps({"seed": 0}), "lacks"),
        (json.dumps({**good, "renderer": "auto"}), "renderer must be gl or tiny"),
        (json.dumps({**good, "stops": 0}), "stops must be in"),
        (json.dumps({**good, "figures": {"f2": {"value": 1, "tolerance": 0}}}), "no figure 'f2'"),
        (json.dumps({**good, "figures": {"f1": {"value": 1, "tolerance": -1}}}), "must be >= 0"),
        (
            json.dumps({**good, "figures": {"f1": {"value": 10**400, "tolerance": 0}}}),
            "figures.f1.value: a whole number",
        ),
        (json.dumps({**good, "figures": {"f1": {"value": 1, "tolerance": float("inf")}}}), "Infinity is no number"),
        (json.dumps({**good, "figures": {"f1": {"value": [1], "tolerance": 0}}}), "no baseline: "),
        (json.dumps({**good, "figures": [1]}), "no baseline: "),
        (json.dumps({**good, "seed": -1}), "seed must be a whole number from 0, got -1"),
        (json.dumps({**good, "seed": 1.5}), "seed must be a whole number from 0, got 1.5"),
        (json.dumps(good).replace(": 0", ": 1e999"), "'1e999' is larger than any number can be"),
        (json.dumps({**good, "scenario": [1]}), "scenario is of another kind"),
        (json.dumps({**good, "overrides": [1]}), "an override is of another kind"),
        ("[" * 100_000, "nested deeper than 32"),
        (" " * 2_000_000, "cannot read the baseline: it is larger than"),
    ):
        (tmp_path / "mine.json").write_text(text, encoding="utf-8")
        with pytest.raises(RecordError, match=why):
            find_baselines((), tmp_path)
    with pytest.raises(RecordError, match="no baseline 'min'"):
        find_baselines(("min",), tmp_path)
