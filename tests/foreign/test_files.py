import os
from pathlib import Path

import pytest

from flysim.errors import FlysimError, RecordError
from flysim.foreign.files import read_bytes, read_text


def refusal(path, limit=100):
    with pytest.raises(RecordError) as caught:
        read_text(path, "report", limit, RecordError)
    return str(caught.value).removeprefix(str(path))


def test_text_with_and_without_a_byte_order_mark_and_of_any_system(tmp_path):
    for data in (b"a\nb\n", b"\xef\xbb\xbfa\r\nb\r\n", b"a\rb\r"):
        (tmp_path / "t").write_bytes(data)
        assert read_text(tmp_path / "t", "report", 100) == "a\nb\n"


def test_the_limit_itself_may_be_read(tmp_path):
    (tmp_path / "t").write_bytes(b"x" * 100)
    assert len(read_bytes(tmp_path / "t", "report", 100)) == 100
    assert refusal(tmp_path / "t", 99) == ": cannot read the report: it is larger than 99 bytes. Is it another file?"


def test_what_never_ends_is_not_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")  # opening it would wait for a writer
    for path in (tmp_path / "pipe", "/dev/zero", "/dev/stdin"):
        if Path(path).exists():
            with pytest.raises(FlysimError, match="cannot read the report: it is no regular file"):
                read_bytes(Path(path), "report", 100)


def test_a_file_that_says_it_is_empty_is_bounded_all_the_same():
    if Path("/proc/self/maps").exists():
        with pytest.raises(FlysimError, match="larger than 100 bytes"):
            read_bytes(Path("/proc/self/maps"), "report", 100)


def test_what_is_there_instead_of_text(tmp_path):
    assert refusal(tmp_path / "none") == ": cannot read the report: No such file or directory."
    assert refusal(tmp_path) == ": cannot read the report: it is a folder. Name a file."
    assert "cannot read the report: embedded null byte" in refusal(tmp_path / "a\0b")
    (tmp_path / "t").write_bytes(b"abc\xff")
    assert refusal(tmp_path / "t") == ": cannot read the report: byte 3 is not UTF-8. Save it as UTF-8 text."
