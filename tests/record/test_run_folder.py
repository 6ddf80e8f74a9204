import errno
import json
import os
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from flysim.errors import RecordError
from flysim.record.run_folder import check_target, default_folder, find_run, read_report, run_folder


def one_line(error) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


def test_what_is_written_appears_under_the_name_at_the_end_and_not_before(tmp_path):
    out = tmp_path / "deep" / "run"
    with run_folder(out) as room:
        (room / "a.txt").write_text("a")
        assert not out.exists()
        assert room.parent == out.parent and room.name.startswith(".")
    assert [p.name for p in out.iterdir()] == ["a.txt"]
    assert [p.name for p in out.parent.iterdir()] == ["run"]


def test_an_empty_folder_may_be_there_already(tmp_path):
    out = tmp_path / "run"
    out.mkdir()
    with run_folder(out) as room:
        (room / "a.txt").write_text("a")
    assert (out / "a.txt").read_text() == "a"


def test_the_folder_has_the_permissions_of_any_other(tmp_path):
    (tmp_path / "plain").mkdir()
    with run_folder(tmp_path / "run"):
        pass
    assert (tmp_path / "run").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("error", [ValueError("x"), KeyboardInterrupt(), SystemExit(1)])
def test_nothing_is_left_after_an_error_or_an_interrupt_not_even_new_parents(tmp_path, error):
    with pytest.raises(type(error)), run_folder(tmp_path / "a" / "b" / "run") as room:
        (room / "half.txt").write_text("half")
        raise error
    assert list(tmp_path.iterdir()) == []


def test_parents_that_were_there_stay_after_an_error(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(ValueError), run_folder(tmp_path / "a" / "run"):
        raise ValueError
    assert (tmp_path / "a").is_dir()


def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path):
    with pytest.raises(RecordError) as error, run_folder(tmp_path / "run") as room:
        (room / "half.txt").write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert "disk full" in one_line(error) and "--out DIR" in one_line(error)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_write_that_the_system_refuses_as_full_is_told_as_full(tmp_path):
    with pytest.raises(RecordError, match="disk full"), run_folder(tmp_path / "run"):
        Path("/dev/full").write_bytes(b"x")


def test_a_refusal_that_is_not_about_the_folder_does_not_blame_it(tmp_path):
    with pytest.raises(RecordError) as error, run_folder(tmp_path / "run"):
        Path("/nowhere/texture.png").read_bytes()
    assert "/nowhere/texture.png" in one_line(error) and "--out" not in one_line(error)


def test_a_folder_with_something_in_it_is_refused_and_kept(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(RecordError) as error, run_folder(tmp_path):
        pytest.fail("was let in")
    assert "not empty" in one_line(error) and "--out DIR" in one_line(error)
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_a_file_of_that_name_is_refused(tmp_path):
    (tmp_path / "run").write_text("mine")
    with pytest.raises(RecordError, match="is a file"), run_folder(tmp_path / "run"):
        pytest.fail("was let in")
    assert (tmp_path / "run").read_text() == "mine"


@pytest.mark.parametrize("check", [check_target, lambda out: run_folder(out).__enter__()])
def test_a_parent_that_cannot_be_made_is_named_with_what_to_do(tmp_path, check):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError) as error:
        check(tmp_path / "file" / "run")
    assert str(tmp_path / "file") in one_line(error) and "--out DIR" in one_line(error)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc on this system")
def test_a_place_that_nobody_may_write_is_refused():
    with pytest.raises(RecordError, match=r"cannot write /proc/flysim/run.*--out DIR"):
        check_target(Path("/proc/flysim/run"))


def test_the_folder_one_stands_in_is_not_replaced(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RecordError, match="name a new folder in it"), run_folder(Path()):
        pytest.fail("was let in")


def test_too_long_a_name_is_refused_in_one_line(tmp_path):
    with pytest.raises(RecordError) as error, run_folder(tmp_path / ("x" * 300)):
        pytest.fail("was let in")
    assert "too long" in one_line(error)


def test_checking_a_target_leaves_no_trace(tmp_path):
    check_target(tmp_path / "a" / "run")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_appears_meanwhile_is_not_overwritten(tmp_path):
    out = tmp_path / "run"
    with pytest.raises(RecordError, match="appeared while"), run_folder(out) as room:
        (room / "a.txt").write_text("a")
        out.mkdir()
        (out / "theirs.txt").write_text("theirs")
    assert [p.name for p in out.iterdir()] == ["theirs.txt"]
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_the_default_name_says_scenario_time_and_seed_and_never_repeats(tmp_path):
    now = datetime(2030, 5, 6, 7, 8, 9, tzinfo=UTC)
    first = default_folder(tmp_path, "paper_a", 7, now)
    assert first == tmp_path / "paper_a-20300506T070809Z-s7"
    first.mkdir()
    second = default_folder(tmp_path, "paper_a", 7, now)
    assert second.name == first.name + "-2"
    second.mkdir()
    assert default_folder(tmp_path, "paper_a", 7, now).name == first.name + "-3"
    assert default_folder(tmp_path, "table1", None, now).name == first.name.replace("paper_a", "table1").removesuffix(
        "-s7"
    )


def test_a_scenarios_name_cannot_lead_out_of_the_folder(tmp_path):
    assert default_folder(tmp_path, "../../etc/x", 0).parent == tmp_path


REPORT = {"scenario": "paper_a", "seed": 0, "status": "ok", "obstacles": []}


def make_run(folder: Path, age: int = 0) -> Path:
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(json.dumps(REPORT))
    os.utime(folder / "report.json", (1e9 - age, 1e9 - age))
    return folder


def test_a_report_is_read_back(tmp_path):
    assert read_report(make_run(tmp_path / "r")) == REPORT


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'{"scenario": ', "damaged at line 1"),
        (b"\xff\xfe", "cannot read"),
        (b"[1, 2]", "no report of flysim"),
        (b'{"scenario": "a"}', "lacks seed, status, obstacles"),
        (b"[" * 100_000, "cannot read|damaged"),
    ],
)
def test_a_damaged_report_is_one_line(tmp_path, content, words):
    (tmp_path / "report.json").write_bytes(content)
    with pytest.raises(RecordError, match=words) as error:
        read_report(tmp_path)
    one_line(error)


def test_a_missing_report_or_folder_is_one_line(tmp_path):
    with pytest.raises(RecordError, match="has no report"):
        read_report(tmp_path)
    with pytest.raises(RecordError, match="no run folder at"):
        read_report(tmp_path / "nowhere")


def test_a_run_is_found_by_path_name_scenario_and_as_the_latest(tmp_path):
    old = make_run(tmp_path / "paper_a-20300101T000000Z-s0", age=20)
    new = make_run(tmp_path / "paper_a-20300102T000000Z-s0-2", age=10)
    other = make_run(tmp_path / "yard-20300103T000000Z-s1", age=5)
    assert find_run(str(old), tmp_path / "elsewhere") == old
    assert find_run(old.name, tmp_path) == old
    assert find_run("paper_a", tmp_path) == new
    assert find_run("latest", tmp_path) == other


def test_an_unknown_run_names_the_nearest(tmp_path):
    make_run(tmp_path / "paper_a-20300101T000000Z-s0")
    with pytest.raises(RecordError, match="Did you mean 'paper_a'"):
        find_run("papre_a", tmp_path)
    with pytest.raises(RecordError, match="holds none yet"):
        find_run("paper_a", tmp_path / "empty")
    with pytest.raises(RecordError, match="is no run folder"):
        find_run(str(tmp_path), tmp_path)


def test_a_run_that_is_being_written_is_not_the_latest(tmp_path):
    done = make_run(tmp_path / "yard-20300103T000000Z-s1")
    with run_folder(tmp_path / "yard-20300104T000000Z-s1") as room:
        shutil.copy(done / "report.json", room)
        assert find_run("latest", tmp_path) == done
