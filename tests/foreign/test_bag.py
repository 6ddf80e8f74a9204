"""A bag is looked through before rosbags reads it: none takes more memory than it says, or than is allowed."""

import sqlite3
import tracemalloc
from contextlib import closing
from struct import pack

import pytest

from flysim.errors import FlysimError
from flysim.foreign import bag
from flysim.foreign.bag import FOOTER, MAGIC, weigh_bag

zstd = pytest.importorskip("backports.zstd", reason="make test installs rosbags")
lz4 = pytest.importorskip("lz4.frame", reason="make test installs rosbags")

ABOUT = """rosbag2_bagfile_information:
  version: 9
  storage_identifier: {storage}
  compression_format: "{format}"
  compression_mode: "{mode}"
  relative_file_paths: [{name}]
"""


def record(kind, content):
    return pack("<BQ", kind, len(content)) + content


def told(text):
    return pack("<I", len(text)) + text


MESSAGES = record(0x05, pack("<HIQQ", 1, 0, 5, 5) + bytes(1000)) * 3


def mcap(packed, packing=b"zstd", size=len(MESSAGES), length=None, index=None, indices=1):
    """A file of one chunk, which the index may tell of in other words."""
    start = MAGIC + record(0x01, told(b"ros2") + told(b""))
    length = len(packed) if length is None else length
    chunk = record(0x06, pack("<QQQI", 5, 5, size, 0) + told(packing) + pack("<Q", length) + packed)
    data = start + chunk + record(0x0F, bytes(4))
    kind, small, large = index or (packing, length, size)
    one = pack("<QQQQIQ", 5, 5, len(start), len(chunk), 0, 0) + told(kind) + pack("<QQ", small, large)
    end = FOOTER + pack("<QQI", len(data) if indices else 0, 0, 0) + MAGIC
    return data + record(0x08, one) * indices + end


@pytest.fixture
def folder(tmp_path):
    def made(content, storage="mcap", mode="", name="a.mcap"):
        (tmp_path / "metadata.yaml").write_text(
            ABOUT.format(storage=storage, name=name, mode=mode, format="zstd" if mode else "")
        )
        if content is not None:
            (tmp_path / name).write_bytes(content)
        return tmp_path

    return made


ZEROS = bytes(2**26)
WHOLE = zstd.compress(MESSAGES)
GOOD = {
    "plain": mcap(MESSAGES, b""),
    "zstd": mcap(WHOLE),
    "lz4": mcap(lz4.compress(MESSAGES), b"lz4"),
    "without an index": mcap(WHOLE, indices=0),
}
BAD = {
    "zstd: says little, holds much": (mcap(zstd.compress(ZEROS), size=10), "holds 10 bytes, it holds more"),
    "lz4: says little, holds much": (mcap(lz4.compress(ZEROS), b"lz4", 10), "holds 10 bytes, it holds more"),
    "no index, says little": (mcap(zstd.compress(ZEROS), size=10, indices=0), "says that it holds 10 bytes"),
    "says much": (mcap(WHOLE, size=2**40), f"a chunk says that it holds {2**40} bytes, at most {2**28} are read"),
    "says much more than it holds": (mcap(WHOLE, size=2**27), f"says that it holds {2**27} bytes, it holds 3093"),
    "zstd: cut": (mcap(WHOLE[:-9]), "a chunk of 3093 bytes ends after"),
    "lz4: cut": (mcap(lz4.compress(MESSAGES)[:-9], b"lz4"), "a chunk of 3093 bytes ends after"),
    "not packed: cut": (mcap(MESSAGES[:-9], b""), "says that it holds 3093 bytes, it holds 3084"),
    "fewer bytes than it says": (mcap(WHOLE, length=len(WHOLE) + 9), "bytes ends after"),
    "damaged": (mcap(b"x" + WHOLE[1:]), "a chunk is damaged"),
    "two in one": (mcap(WHOLE + WHOLE), "goes on after its end"),
    "of another packing": (mcap(WHOLE, b"br"), "a chunk is packed by 'br'; lz4 and zstd are read"),
    "an index of another packing": (mcap(WHOLE, index=(b"lz4", len(WHOLE), 3093)), "its index names a chunk at byte"),
    "an index of another size": (mcap(WHOLE, index=(b"zstd", len(WHOLE), 2**40)), "its index names a chunk at byte"),
    "an index that tells twice": (mcap(WHOLE, indices=2), "its index names a chunk at byte"),
    "a message longer than its chunk": (
        mcap(zstd.compress(MESSAGES[:-9]), size=len(MESSAGES) - 9),
        "the record at byte 2062 has 1022 bytes, there are 1013",
    ),
    "a record longer than the file": (
        MAGIC + pack("<BQ", 1, 2**62) + mcap(WHOLE, indices=0)[-37:],
        f"the record at byte 8 has {2**62} bytes",
    ),
    "no footer": (mcap(WHOLE)[:-1], "it is no MCAP, or ends too soon"),
    "nothing": (b"", "it is no MCAP, or ends too soon"),
}  # fmt: skip


@pytest.mark.parametrize("case", GOOD)
def test_a_sound_bag_passes(folder, case):
    weigh_bag(folder(GOOD[case]))


@pytest.mark.parametrize("case", BAD)
def test_an_unsound_bag_is_one_line_and_little_memory(folder, case):
    content, why = BAD[case]
    bad = folder(content)
    tracemalloc.start()
    with pytest.raises(FlysimError, match=why) as refused:
        weigh_bag(bad)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert "\n" not in str(refused.value) and str(refused.value).startswith(str(bad / "a.mcap"))
    assert most < 2**22  # what was packed is 64 MB


def test_all_chunks_together_are_counted(folder, monkeypatch):
    good = folder(GOOD["zstd"])
    monkeypatch.setattr(bag, "MAX_BYTES", len(GOOD["zstd"]) + len(MESSAGES))
    weigh_bag(good)
    monkeypatch.setattr(bag, "MAX_BYTES", len(GOOD["zstd"]) + len(MESSAGES) - 1)
    with pytest.raises(FlysimError, match="a bag so large is not read"):
        weigh_bag(good)


@pytest.mark.parametrize(("limit", "why"), [("MAX_PACKED", "more than 2 messages"), ("MAX_INDEX", "its index begins")])
def test_many_small_things_are_too_many(folder, monkeypatch, limit, why):
    good = folder(GOOD["zstd"])
    monkeypatch.setattr(bag, limit, 2)
    with pytest.raises(FlysimError, match=why):
        weigh_bag(good)


@pytest.mark.parametrize("mode", ["file", "MESSAGE"])
def test_what_is_packed_as_a_whole_is_refused_with_what_to_do(folder, mode):
    with pytest.raises(FlysimError, match=rf"compression_mode '{mode.lower()}'\).*Type: ros2 bag convert"):
        weigh_bag(folder(GOOD["zstd"], mode=mode))


def test_metadata_are_read_as_other_yaml_is(folder, tmp_path):
    good = folder(GOOD["zstd"])
    (good / "metadata.yaml").write_text("rosbag2_bagfile_information: [1]")
    with pytest.raises(FlysimError, match=r"cannot read the bag: metadata\.yaml: TypeError"):
        weigh_bag(good)
    (good / "metadata.yaml").write_text("#" * (bag.MAX_METADATA + 1))
    with pytest.raises(FlysimError, match="it is larger than"):
        weigh_bag(good)


def test_a_file_that_lies_elsewhere_is_not_read(folder, tmp_path_factory):
    secret = tmp_path_factory.mktemp("elsewhere") / "a.mcap"
    secret.write_bytes(GOOD["zstd"])
    linked = folder(None)
    (linked / "a.mcap").symlink_to(secret)
    with pytest.raises(FlysimError, match="leads out of the folder"):
        weigh_bag(linked)


def test_a_data_base_has_stored_tables_alone(folder, tmp_path):
    with closing(sqlite3.connect(tmp_path / "a.db3")) as base:
        base.execute("CREATE TABLE messages (id INTEGER PRIMARY KEY, data BLOB NOT NULL)")
        base.execute("CREATE INDEX quick ON messages (id ASC)")
        weigh_bag(folder(None, storage="sqlite3", name="a.db3"))
        base.execute("CREATE VIEW topics AS SELECT zeroblob(1000000000) AS name")
        with pytest.raises(FlysimError, match=r"it has more than stored tables \('view'\)"):
            weigh_bag(tmp_path)
        base.execute("DROP VIEW topics")
        base.execute("CREATE TABLE topics (id INTEGER, name BLOB AS (zeroblob(1000000000)))")
        with pytest.raises(FlysimError, match=r"it has more than stored tables \('table'\)"):
            weigh_bag(tmp_path)
    (tmp_path / "a.db3").write_bytes(b"nothing")
    with pytest.raises(FlysimError, match="cannot read the bag: file is not a database"):
        weigh_bag(tmp_path)
