"""Folders that appear with the first finished piece, and that whoever was stopped goes on with."""

import json

import pytest

from flysim.common.growing import growing
from flysim.errors import RecordError

ASKED = {"engines": ["flies"], "seeds": [0, 1, 2]}


@pytest.fixture
def open_(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return lambda resume=False, asked=ASKED, of=3: growing(
        [tmp_path / "deep" / "out"], "all.json", asked, of, "runs", resume=resume
    )


@pytest.fixture
def piece():
    return {"a.txt": b"a"}


def names(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def stopped(open_, piece, after=1):
    with pytest.raises(KeyboardInterrupt) as stop, open_() as folder:
        for done in range(1, after + 1):
            folder.keep({"done so far": done}, done, {f"runs/{done}": piece})
        raise KeyboardInterrupt
    return getattr(stop.value, "__notes__", [])


def test_it_appears_whole_with_the_first_piece(tmp_path, open_, piece):
    out = tmp_path / "deep" / "out"
    with open_() as folder:
        assert folder.before is None and not out.exists()
        folder.keep({"so far": 1}, 1, {"runs/1": piece})
        assert names(out) == ["all.json", "runs", "runs/1", "runs/1/a.txt"]
        told = json.loads((out / "all.json").read_text())
        assert told == {"so far": 1, "asked": ASKED, "complete": False, "done": 1, "of": 3}
        folder.keep({}, 2)
        folder.keep({}, 3, {"runs/3": piece})
        folder.finish({"all": 3}, drop=["runs/1"])
    assert names(out) == ["all.json", "runs", "runs/3", "runs/3/a.txt"]
    assert json.loads((out / "all.json").read_text()) == {
        "all": 3, "asked": ASKED, "complete": True, "done": 3, "of": 3,
    }  # fmt: skip
    with pytest.raises(RecordError, match="exists and is not empty"):
        open_().__enter__()
    with pytest.raises(RecordError, match="is complete, there is nothing to resume"):
        open_(resume=True).__enter__()


def test_what_is_stopped_before_the_first_piece_leaves_nothing_and_can_be_begun_by_resume(tmp_path, open_, piece):
    assert stopped(open_, piece, after=0) == []
    assert names(tmp_path) == []
    with open_(resume=True) as folder:
        assert folder.before is None


def test_who_is_stopped_is_told_what_is_kept_and_goes_on_with_it(tmp_path, open_, piece):
    out = tmp_path / "deep" / "out"
    assert stopped(open_, piece, after=2) == [f"2 of 3 runs are kept in {out}: the same command with --resume goes on"]
    with pytest.raises(RecordError, match=r"holds 2 of 3 runs .* go on with it by --resume"):
        open_().__enter__()
    (out / "runs" / "3").mkdir()  # a kill came between the piece and the file that tells of it
    (out / "runs" / "3" / "half").touch()
    with open_(resume=True) as folder:
        assert folder.before is not None and folder.before["done so far"] == 2
        with pytest.raises(RecordError, match="being written by another run"):
            open_(resume=True).__enter__()
        folder.keep({}, 3, {"runs/3": piece})
        folder.finish({})
    assert names(out / "runs" / "3") == ["a.txt"]
    with pytest.raises(RecordError, match="complete"):
        open_(resume=True).__enter__()


@pytest.mark.parametrize(
    ("asked", "of", "words"),
    [
        ({**ASKED, "engines": ["flies", "bm"]}, 3, r'begun with engines \["flies"\], not \["flies", "bm"\]'),
        ({**ASKED, "seeds": list(range(5000))}, 3, r"begun with seeds \[0, 1, 2\], not"),
        (ASKED, 4, "begun with 3 runs, not 4"),
    ],
)
def test_other_work_does_not_go_on_with_it(open_, piece, asked, of, words):
    stopped(open_, piece)
    with pytest.raises(RecordError, match=words) as error:
        open_(resume=True, asked=asked, of=of).__enter__()
    assert len(str(error.value)) < 300


@pytest.mark.parametrize("content", [b"", b"{}", b"[" * 100_000, b"\xff", b'{"complete": 1, "asked": {}}'])
@pytest.mark.parametrize("resume", [True, False])
def test_a_damaged_file_is_one_line(tmp_path, open_, piece, content, resume):
    stopped(open_, piece)
    (tmp_path / "deep" / "out" / "all.json").write_bytes(content)
    with pytest.raises(RecordError, match=r"all.json: (cannot|no record of what is done)") as error:
        open_(resume=resume).__enter__()
    assert "\n" not in str(error.value)


def test_a_folder_that_may_grow_goes_on_when_it_is_complete_or_asked_for_more(tmp_path, piece):
    out = tmp_path / "out"
    with growing([out], "all.json", ASKED, 1, "runs", more=True) as folder:
        folder.keep({}, 1, {"runs/1": piece}, {"sub/rows.txt": b"1"})
        folder.finish({"rows": [1]}, files={"sub/rows.txt": b"one"})
    assert (out / "sub" / "rows.txt").read_bytes() == b"one"
    with (
        pytest.raises(KeyboardInterrupt) as stop,
        growing([out], "all.json", ASKED, 2, "runs", resume=True, more=True) as folder,
    ):
        assert folder.before is not None and folder.before["rows"] == [1]
        folder.keep({"rows": [1, 2]}, 2, files={"sub/rows.txt": b"two"})
        raise KeyboardInterrupt
    assert stop.value.__notes__ == [f"2 of 2 runs are kept in {out}: the same command with --out {out} goes on"]
    assert names(out) == ["all.json", "runs", "runs/1", "runs/1/a.txt", "sub", "sub/rows.txt"]
    with pytest.raises(RecordError, match="was begun with"):
        growing([out], "all.json", {**ASKED, next(iter(ASKED)): "other"}, 2, "runs", resume=True, more=True).__enter__()
