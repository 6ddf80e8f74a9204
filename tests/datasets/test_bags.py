"""Bags that would fill the memory as they are unpacked, made from a sound one: refused before that."""

import struct
import tracemalloc

import numpy as np
import pytest

from flysim.datasets.source import DataSetSource, read_data_set
from flysim.errors import FlysimError
from flysim.foreign.bag import CHUNK, INDEX, MAX_RECORD

reader = pytest.importorskip("mcap.reader", reason="make test installs mcap")
writer = pytest.importorskip("mcap.writer", reason="make test installs mcap")


def packed(taken, folder, packing, more=0):
    """The bag with its chunks packed, and so many zeros in one more message; its folder and its file."""
    folder = taken.copy("mcap", folder)
    (path,) = (folder / "bag").glob("*.mcap")
    with path.open("rb") as file:
        messages = list(reader.make_reader(file).iter_messages())
    with path.open("wb") as file:
        out = writer.Writer(file, compression=getattr(writer.CompressionType, packing), chunk_size=10_000)
        out.start(profile="ros2")
        known = {}
        for schema, channel, message in messages:
            if channel.id not in known:
                number = out.register_schema(schema.name, schema.encoding, schema.data)
                known[channel.id] = out.register_channel(channel.topic, channel.message_encoding, number)
            out.add_message(known[channel.id], message.log_time, message.data, message.publish_time)
        if more:
            out.add_message(known[channel.id], message.log_time + 1, bytes(more), message.publish_time)
        out.finish()
    return folder, path


def records(path):
    """Kind and place of what each record holds."""
    data, at = path.read_bytes(), 8
    while at < len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, at)
        yield kind, at + 9
        at += 9 + length


def patched(path, kind, offset, form, value, which=-1):
    """Writes a number into a record of a kind: `offset` bytes behind its beginning."""
    at = [place for one, place in records(path) if one == kind][which] + offset
    data = bytearray(path.read_bytes())
    struct.pack_into(form, data, at, value)
    path.write_bytes(data)


def refusal(folder):
    with pytest.raises(FlysimError) as refused:
        read_data_set(folder)
    assert "\n" not in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize("packing", ["NONE", "LZ4", "ZSTD"])
def test_a_sound_bag_is_read_however_it_is_packed(taken, tmp_path, packing):
    folder, _ = packed(taken, tmp_path / "set", packing)
    for frame, before in zip(DataSetSource(read_data_set(folder), seed=0).frames(), taken.sequence.frames, strict=True):
        assert np.array_equal(frame.pair.left, before.pair.left)


@pytest.mark.parametrize("packing", ["LZ4", "ZSTD"])
def test_a_chunk_that_holds_more_than_it_says_is_not_unpacked(taken, tmp_path, packing):
    folder, path = packed(taken, tmp_path / "set", packing, more=200_000_000)
    patched(path, CHUNK, 16, "<Q", 20_000)
    tracemalloc.start()
    told = refusal(folder)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "a chunk says that it holds 20000 bytes, it holds more" in told and peak < 100e6


def test_a_chunk_beyond_the_limit_is_not_unpacked(taken, tmp_path):
    folder, path = packed(taken, tmp_path / "set", "ZSTD")
    patched(path, CHUNK, 16, "<Q", 2**40)
    assert f"a chunk says that it holds {2**40} bytes, at most {MAX_RECORD} are read" in refusal(folder)


def test_an_index_of_other_chunks_is_not_followed(taken, tmp_path):
    folder, path = packed(taken, tmp_path / "set", "ZSTD")
    patched(path, INDEX, 16, "<Q", 12)
    assert "its index names a chunk at byte 12 that is not there" in refusal(folder)


def test_a_summary_within_a_record_is_not_read(taken, tmp_path):
    folder, path = packed(taken, tmp_path / "set", "ZSTD")
    patched(path, 0x02, 0, "<Q", 30)
    assert "the record at byte 8 has" in refusal(folder)


def test_a_record_that_goes_on_behind_the_end_is_not_read(taken, tmp_path):
    folder, path = packed(taken, tmp_path / "set", "ZSTD")
    patched(path, CHUNK, -8, "<Q", 2**62)
    assert f"has {2**62} bytes, there are" in refusal(folder)


def test_chunks_of_more_in_all_than_is_read(taken, tmp_path, monkeypatch):
    folder, path = packed(taken, tmp_path / "set", "ZSTD")
    monkeypatch.setattr("flysim.foreign.bag.MAX_BYTES", path.stat().st_size + 10_000)
    assert "a bag so large is not read" in refusal(folder)


def test_a_bag_packed_as_a_whole_is_refused_with_what_to_do(taken, tmp_path):
    folder = taken.copy("mcap", tmp_path / "set")
    about = folder / "bag/metadata.yaml"
    text = about.read_text()
    assert "compression_mode: ''" in text
    about.write_text(text.replace("compression_mode: ''", "compression_mode: file"))
    assert "(compression_mode 'file'); a bag is read plain, or packed in the chunks of an MCAP" in refusal(folder)
