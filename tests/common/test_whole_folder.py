"""Folders that appear whole or not at all, under names that nobody else can have."""

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from flysim.common import whole_folder as module
from flysim.common.whole_file import whole_file, write_whole
from flysim.common.whole_folder import Taken, reserved, whole_folder
from flysim.errors import RecordError

ROOT = Path(__file__).resolve().parents[2]


def one_line(error) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


def test_what_is_written_appears_under_the_name_at_the_end_and_not_before(tmp_path):
    out = tmp_path / "deep" / "run"
    with whole_folder(out) as room:
        (room / "a.txt").write_text("a")
        assert not out.exists()
        assert room.parent == out.parent and room.name.startswith(".")
    assert [p.name for p in out.iterdir()] == ["a.txt"]
    assert [p.name for p in out.parent.iterdir()] == ["run"]


def test_an_empty_folder_may_be_there_already(tmp_path):
    out = tmp_path / "run"
    out.mkdir()
    with whole_folder(out) as room:
        (room / "a.txt").write_text("a")
    assert (out / "a.txt").read_text() == "a"


def test_the_folder_has_the_permissions_of_any_other(tmp_path):
    (tmp_path / "plain").mkdir()
    with whole_folder(tmp_path / "run"):
        pass
    assert (tmp_path / "run").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("error", [ValueError("x"), KeyboardInterrupt(), SystemExit(1)])
def test_nothing_is_left_after_an_error_or_an_interrupt_not_even_new_parents(tmp_path, error):
    with pytest.raises(type(error)), whole_folder(tmp_path / "a" / "b" / "run") as room:
        (room / "half.txt").write_text("half")
        raise error
    assert list(tmp_path.iterdir()) == []


def test_parents_that_were_there_stay_after_an_error(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(ValueError), whole_folder(tmp_path / "a" / "run"):
        raise ValueError
    assert (tmp_path / "a").is_dir()


def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path):
    with pytest.raises(RecordError) as error, whole_folder(tmp_path / "run") as room:
        (room / "half.txt").write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert "disk full" in one_line(error) and "--out DIR" in one_line(error)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_write_that_the_system_refuses_as_full_is_told_as_full(tmp_path):
    with pytest.raises(RecordError, match="disk full"), whole_folder(tmp_path / "run"):
        Path("/dev/full").write_bytes(b"x")


def test_a_refusal_that_is_not_about_the_folder_does_not_blame_it(tmp_path):
    with pytest.raises(RecordError) as error, whole_folder(tmp_path / "run"):
        Path("/nowhere/texture.png").read_bytes()
    assert "/nowhere/texture.png" in one_line(error) and "--out" not in one_line(error)


def test_a_folder_with_something_in_it_is_refused_and_kept(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(RecordError) as error, whole_folder(tmp_path):
        pytest.fail("was let in")
    assert "not empty" in one_line(error) and "--out DIR" in one_line(error)
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_a_file_of_that_name_is_refused(tmp_path):
    (tmp_path / "run").write_text("mine")
    with pytest.raises(RecordError, match="is a file"), whole_folder(tmp_path / "run"):
        pytest.fail("was let in")
    assert (tmp_path / "run").read_text() == "mine"


def test_a_parent_that_cannot_be_made_is_named_with_what_to_do(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordError) as error, whole_folder(tmp_path / "file" / "run"):
        pytest.fail("was let in")
    assert str(tmp_path / "file") in one_line(error) and "--out DIR" in one_line(error)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc on this system")
def test_a_place_that_nobody_may_write_is_refused():
    with (
        pytest.raises(RecordError, match=r"cannot write /proc/flysim/run.*--out DIR"),
        whole_folder(Path("/proc/flysim/run")),
    ):
        pytest.fail("was let in")


def test_the_folder_one_stands_in_is_not_replaced(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RecordError, match="name a new folder in it"), whole_folder(Path()):
        pytest.fail("was let in")


def test_too_long_a_name_is_refused_in_one_line(tmp_path):
    with pytest.raises(RecordError) as error, whole_folder(tmp_path / ("x" * 300)):
        pytest.fail("was let in")
    assert "too long" in one_line(error)


def test_a_folder_that_appears_meanwhile_is_not_overwritten(tmp_path):
    out = tmp_path / "run"
    with pytest.raises(RecordError, match="appeared while"), whole_folder(out) as room:
        (room / "a.txt").write_text("a")
        out.mkdir()
        (out / "theirs.txt").write_text("theirs")
    assert [p.name for p in out.iterdir()] == ["theirs.txt"]
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_whoever_comes_second_is_told_at_once_and_takes_nothing_away(tmp_path):
    with whole_folder(tmp_path / "run") as room:
        (room / "a.txt").write_text("a")
        with pytest.raises(Taken, match="being written by another run: name another folder"):
            whole_folder(tmp_path / "run").__enter__()
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["a.txt"]


def test_of_many_names_the_first_that_nobody_has(tmp_path):
    names = [tmp_path / name for name in "abcd"]
    names[0].mkdir()
    (names[0] / "mine").touch()
    names[1].touch()
    with reserved(names) as third, reserved(names) as fourth:
        assert [place.out.name for place in (third, fourth)] == ["c", "d"]
        with pytest.raises(Taken):
            reserved(names).__enter__()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]


def test_many_at_once_in_a_folder_that_is_not_there(tmp_path):
    got, start = [], threading.Barrier(16)

    def one(keep):
        start.wait()
        with reserved(tmp_path / "deep" / "er" / str(k) for k in range(99)) as place:
            if keep:
                (place.room / "mine").touch()
                place.keep()
                got.append(place.out)

    for _ in range(5):
        crowd = [threading.Thread(target=one, args=(k % 2,)) for k in range(16)]
        for thread in crowd:
            thread.start()
        for thread in crowd:
            thread.join()
    assert len(set(got)) == len(got) == 40
    assert set((tmp_path / "deep" / "er").iterdir()) == set(got)


def test_a_parent_that_another_takes_away_meanwhile_is_made_again(tmp_path, monkeypatch):
    held, tried = module.held_folder, []

    def late(path):
        tried.append(path)
        if len(tried) == 1:
            path.parent.rmdir()
        return None if len(tried) == 2 else held(path)  # swept before it was held

    monkeypatch.setattr(module, "held_folder", late)
    with whole_folder(tmp_path / "deep" / "run"):
        pass
    assert len(tried) == 3 and (tmp_path / "deep" / "run").is_dir()


def killed(code, folder):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    end = f"import os; os.kill(os.getpid(), {signal.SIGKILL:d})"
    done = subprocess.run([sys.executable, "-c", code + end], cwd=folder, env=environment, check=False, timeout=60)
    assert done.returncode == -signal.SIGKILL


FOLDER = """
from pathlib import Path; from flysim.common.whole_folder import reserved
with reserved([Path("{name}")]) as place: (place.room / "half").touch(); """
FILE = """
from pathlib import Path; from flysim.common.whole_file import whole_file
with whole_file(Path("{name}")) as part: part.write_text("half"); """


@pytest.mark.parametrize("next_name", ["run", "other"])
def test_what_a_killed_process_left_is_cleared_by_the_next_one_of_or_beside_that_name(tmp_path, next_name):
    killed(FOLDER.format(name="run"), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [".run.flysim.part"]
    (tmp_path / ".theirs.part").mkdir()  # another program's
    with reserved([tmp_path / "live"]), whole_folder(tmp_path / next_name) as room:
        assert not list(room.iterdir())
        assert (tmp_path / ".live.flysim.part").is_dir()
    assert {path.name for path in tmp_path.iterdir()} == {".theirs.part", next_name}


def test_a_name_that_just_fits_can_be_reserved(tmp_path):
    for name in ("x" * 255, "x" * 254 + "y", "ä" * 127):
        with whole_folder(tmp_path / name):
            pass
    assert len(list(tmp_path.iterdir())) == 3


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    killed(FILE.format(name="a.txt"), tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    path = tmp_path / "b.txt"
    write_whole(path, "old")
    assert [path.name for path in tmp_path.iterdir()] == ["b.txt"]
    with pytest.raises(KeyboardInterrupt), whole_file(path) as part:
        part.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    with whole_file(path) as first, whole_file(path) as second:  # side by side: the last one wins
        first.write_text("first")
        second.write_text("second")
    assert path.read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["b.txt"]
    assert path.stat().st_mode & 0o777 == 0o666 & ~umask()


def umask():
    now = os.umask(0)
    os.umask(now)
    return now
