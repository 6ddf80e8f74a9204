import itertools
import json
import os
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from flysim.common.whole_folder import reserved, whole_folder
from flysim.errors import RecordError
from flysim.record.run_folder import REPORT, default_folders, find_run, read_report


def one_line(error) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


def test_the_default_name_says_scenario_time_and_seed_and_never_repeats(tmp_path):
    now = datetime(2030, 5, 6, 7, 8, 9, tzinfo=UTC)
    names = itertools.islice(default_folders(tmp_path, "paper_a", 7, now), 3)
    first = "paper_a-20300506T070809Z-s7"
    assert list(names) == [tmp_path / first, tmp_path / f"{first}-2", tmp_path / f"{first}-3"]
    assert next(default_folders(tmp_path, "table1", None, now)).name == "table1-20300506T070809Z"
    with reserved(default_folders(tmp_path, "paper_a", 7, now)) as one, one.writing() as room:
        (room / REPORT).touch()
    with (
        reserved(default_folders(tmp_path, "paper_a", 7, now)) as two,
        reserved(default_folders(tmp_path, "paper_a", 7, now)) as three,
    ):
        assert [place.out.name for place in (two, three)] == [f"{first}-2", f"{first}-3"]


def test_a_scenarios_name_cannot_lead_out_of_the_folder(tmp_path):
    assert next(default_folders(tmp_path, "../../etc/x", 0)).parent == tmp_path


FACTS = {"scenario": "paper_a", "seed": 0, "status": "ok", "obstacles": []}


def make_run(folder: Path, age: int = 0) -> Path:
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(json.dumps(FACTS))
    os.utime(folder / "report.json", (1e9 - age, 1e9 - age))
    return folder


def test_a_report_is_read_back(tmp_path):
    assert read_report(make_run(tmp_path / "r")) == FACTS


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
    with whole_folder(tmp_path / "yard-20300104T000000Z-s1") as room:
        shutil.copy(done / "report.json", room)
        assert find_run("latest", tmp_path) == done
