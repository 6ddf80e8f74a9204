import errno
import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from flysim.common.provenance import git_commit, versions
from flysim.common.whole_folder import whole_folder
from flysim.errors import RecordError
from flysim.record.recorder import write_run
from flysim.record.run_folder import read_report


class FakeReport:
    def __init__(self, facts):
        self.facts = facts

    def to_json(self):
        return self.facts


FILES = {
    "config.json",
    "report.json",
    "obstacles.json",
    "flies.parquet",
    "flies.ply",
    "trajectory_true.tum",
    "trajectory_odom.tum",
    "recording.rrd",
    "figures/path.png",
    "figures/planes.png",
    "figures/flies_on_image.png",
    "figures/flies_on_images.png",
}


def test_a_run_folder_holds_everything_and_says_how_far_it_is(tmp_path, findings, truth, report):
    steps = []
    with whole_folder(tmp_path / "run") as room:
        write_run(
            room,
            findings,
            truth,
            lambda: FakeReport(report),
            {"population": 3000},
            progress=lambda what, share: steps.append((what, share)),
        )
    found = {str(p.relative_to(tmp_path / "run")) for p in (tmp_path / "run").rglob("*") if p.is_file()}
    assert found == FILES
    assert all((tmp_path / "run" / name).stat().st_size > 0 for name in FILES)
    shares = [share for _, share in steps]
    assert shares == sorted(shares) and shares[0] == 0.0 and steps[-1] == ("written", 1.0)
    assert read_report(tmp_path / "run") == report
    config = json.loads((tmp_path / "run" / "config.json").read_text())
    assert config["population"] == 3000 and config["seed"] == findings.sequence.seed
    assert {"python", "numpy"} <= config["versions"].keys() and "git_commit" in config


@pytest.mark.parametrize("nth", range(1, len(FILES) + 1))
def test_a_disk_that_fills_at_any_file_leaves_no_folder(tmp_path, findings, truth, report, monkeypatch, nth):
    """Every file goes through Path.write_*: let the n-th find no room."""
    count = 0
    write_bytes, write_text = Path.write_bytes, Path.write_text

    def limited(write):
        def refuse(self, *arguments, **options):
            nonlocal count
            count += 1
            if count == nth:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self))
            return write(self, *arguments, **options)

        return refuse

    monkeypatch.setattr(Path, "write_bytes", limited(write_bytes))
    monkeypatch.setattr(Path, "write_text", limited(write_text))
    monkeypatch.setattr("flysim.record.canvas.png", lambda picture: b"png")  # its packing takes the time
    monkeypatch.setattr("flysim.record.canvas.drawn", lambda figure: None)
    with pytest.raises(RecordError, match="disk full"), whole_folder(tmp_path / "run") as room:
        write_run(room, findings, truth, lambda: FakeReport(report))
    assert list(tmp_path.iterdir()) == []


def test_the_commit_is_that_of_flysims_own_checkout_and_of_no_other(tmp_path):
    def git(*arguments: str) -> str:
        who = ["-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
        done = subprocess.run(["git", *who, *arguments], cwd=tmp_path, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    try:
        git("init", "-q")
    except OSError:
        pytest.skip("git is not installed")
    package = tmp_path / "flysim"
    package.mkdir()
    (package / "errors.py").write_text("# one\n")
    assert git_commit(package) is None  # installed in somebody's repository, and no part of it
    git("add", ".")
    git("commit", "-qm", "one")
    commit = git("rev-parse", "HEAD")
    assert git_commit(package) == commit
    (package / "errors.py").write_text("# two\n")
    assert git_commit(package) == commit + "-dirty"
    assert git_commit(tmp_path / "nowhere") is None


def test_versions_name_python():
    assert versions()["python"] == sys.version.split()[0]


@pytest.mark.parametrize(("installed", "told"), [("pybullet", "1.2"), ("pybullet-arm64", "1.2 (pybullet-arm64)")])
def test_versions_tell_which_bullet(monkeypatch, installed, told):
    def version(distribution):
        if distribution != installed:
            raise metadata.PackageNotFoundError(distribution)
        return "1.2"

    monkeypatch.setattr(metadata, "version", version)
    assert versions()["pybullet"] == told
