import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flysim.errors import RecordError
from flysim.record import scribe as module
from flysim.record.run_folder import read_report
from flysim.record.scribe import scribe

ROOT = Path(__file__).resolve().parents[2]


class FakeReport:
    def __init__(self, facts):
        self.facts = facts

    def to_json(self):
        return self.facts


@pytest.fixture(autouse=True)
def nobody_idle(monkeypatch):
    monkeypatch.setattr(module, "_idle", idle := [])
    yield
    while idle:
        idle.pop().end()


def write(one, folder, findings, truth, report, progress=lambda *_: None):
    folder.mkdir()
    one.begin(folder, findings=findings, truth=truth, config={})
    one.finish(FakeReport(report), progress)


def test_one_process_writes_one_run_after_the_other(tmp_path, findings, truth, report):
    pids = []
    for name in ("a", "b"):
        steps = []
        with scribe() as one:
            write(one, tmp_path / name, findings, truth, report, lambda *step, told=steps: told.append(step))
        assert read_report(tmp_path / name) == report
        assert (tmp_path / name / "recording.rrd").stat().st_size > 10_000
        assert [share for _, share in steps] == sorted(share for _, share in steps) and steps[-1] == ("written", 1.0)
        pids.append(one._process.pid)
    assert pids[0] == pids[1]


def test_an_error_comes_back_and_the_process_is_gone(tmp_path, findings, truth, report, monkeypatch):
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(RecordError, match="RERUN"), scribe() as one:
        write(one, tmp_path / "a", findings, truth, report)
    assert one._process.poll() is not None
    monkeypatch.delenv("RERUN")
    with scribe() as other:  # a new one, that sees the environment of now
        write(other, tmp_path / "b", findings, truth, report)
    assert read_report(tmp_path / "b") == report


def test_a_run_that_fails_before_its_report_came_leaves_the_process_whole(tmp_path, findings, truth, report, capfd):
    """As on a full disk. It ended by a traceback, since it took the report for the next run."""
    with pytest.raises(OSError, match="gone"), scribe() as one:
        one.begin(tmp_path / "gone", findings=findings, truth=truth, config={})
        try:
            one.finish(FakeReport(report), lambda *_: None)
        finally:
            time.sleep(0.5)
            assert one._process.poll() is None
    assert "Traceback" not in capfd.readouterr().err


def test_a_changed_environment_reaches_the_next_run(tmp_path, findings, truth, report, monkeypatch):
    with scribe() as one:
        write(one, tmp_path / "a", findings, truth, report)
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(RecordError, match="RERUN"), scribe() as one:
        write(one, tmp_path / "b", findings, truth, report)


def test_a_killed_process_is_told(tmp_path, findings, truth, report):
    with pytest.raises(RecordError, match="was it killed, or memory short"), scribe() as one:
        os.kill(one._process.pid, signal.SIGKILL)
        write(one, tmp_path / "a", findings, truth, report)


def test_no_process_outlives_its_parent(tmp_path):
    source = "import os; from flysim.record.scribe import scribe\nwith scribe() as one: print(one._process.pid)\n"
    for end in ("", "os._exit(0)"):
        done = subprocess.run(
            [sys.executable, "-c", source + end],
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        assert done.stderr == ""
        deadline = time.monotonic() + 30
        while Path(f"/proc/{done.stdout.strip()}").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not Path(f"/proc/{done.stdout.strip()}").exists()


def test_a_forked_child_leaves_its_parents_process_alone(tmp_path, findings, truth, report):
    with scribe() as one:
        write(one, tmp_path / "a", findings, truth, report)
    pid = os.fork()
    if pid == 0:
        os._exit(len(module._idle))
    assert os.waitpid(pid, 0)[1] == 0
