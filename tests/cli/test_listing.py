"""`flysim list` shows all that has a name, and says where it comes from."""

import json

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.cli.listing import KINDS, registry
from flysim.common import registry as registries
from flysim.studies.sweep.study import Study

RUNNER = CliRunner()


def listed(*words):
    done = RUNNER.invoke(app, ["list", *words])
    assert done.exit_code == 0, done.output
    return done.output


def test_everything_that_has_a_name_is_listed():
    data = json.loads(listed("--json"))
    assert {"scenarios", "worlds", "robots", *KINDS} == data.keys()
    assert {one["name"] for one in data["engines"]} >= {"flies", "sgbm", "bm"}
    text = listed()
    for kind, entries in data.items():
        for entry in entries:
            name = entry if isinstance(entry, str) else entry["name"]
            assert name in text, f"{kind}: {name}"


def test_some_kinds_alone():
    assert set(json.loads(listed("engines", "suites", "--json"))) == {"engines", "suites"}
    assert "paper_a" not in listed("engines")


def test_an_unknown_kind_is_told_the_nearest():
    done = RUNNER.invoke(app, ["list", "engine"])
    assert done.exit_code == 2
    assert "Did you mean 'engines'?" in done.output


@pytest.mark.parametrize("kind", KINDS)
def test_whatever_is_listed_can_be_loaded(kind):
    for entry in registry(kind).entries():
        if entry.origin == "flysim":
            found = registry(kind).load(entry.name)
            assert isinstance(found, Study) or callable(getattr(found, "function", found)), entry


def test_what_a_package_adds_is_listed_with_its_name(tmp_path, monkeypatch):
    info = tmp_path / "other_eyes-3.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: other-eyes\nVersion: 3.0\n")
    (info / "entry_points.txt").write_text("[flysim.engines]\nhawk = other_eyes:see\n")
    monkeypatch.syspath_prepend(tmp_path)
    registries._installed.cache_clear()
    try:
        entries = json.loads(listed("engines", "--json"))["engines"]
        assert entries[-1] == {"name": "hawk", "from": "other-eyes 3.0", "place": "other_eyes:see"}
        assert "hawk" in listed("engines") and "other-eyes 3.0" in listed("engines")
    finally:
        registries._installed.cache_clear()
