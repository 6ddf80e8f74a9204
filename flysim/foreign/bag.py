"""A bag of ROS 2 that somebody else recorded, weighed before rosbags reads it.

rosbags unpacks whatever a file holds, whatever it says it holds, and takes every length in it for true. So each record
of an MCAP is looked at first: it lies in the file, what is packed unpacks to as much as is said and no more, and the
index names the chunks that are there, each once. Format: https://mcap.dev/spec.
"""

from __future__ import annotations

import io
import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path, PurePath
from struct import error as StructError
from struct import unpack, unpack_from
from typing import Any, BinaryIO
from urllib.parse import quote

from flysim.errors import FlysimError
from flysim.foreign.files import opened, read_text
from flysim.foreign.folder import inside
from flysim.foreign.yaml_text import parse_yaml
from flysim.plain import shown, shown_path

METADATA = "metadata.yaml"
MAX_METADATA = 2**20  # bytes
MAX_BYTES = 2**33  # of all files, and of all that is packed in them
MAX_RECORD = 2**28  # bytes of one record, and of what one chunk unpacks to
MAX_INDEX = 2**26  # bytes of the records at a file's end that say where the chunks are
MAX_PACKED = 2**22  # messages in chunks: rosbags makes objects of all that lie at one time
MAGIC = b"\x89MCAP0\r\n"
FOOTER = b"\x02" + (20).to_bytes(8, "little")
FOOTER_BYTES = 37  # with the magic that follows it
CHUNK, INDEX, ATTACHMENT, MESSAGE = 0x06, 0x08, 0x09, 0x05
_UNLIKE_TABLES = re.compile(r"\b(VIRTUAL|GENERATED|AS)\b", re.IGNORECASE)


def weigh_bag(bag: Path) -> None:
    """Looks at all that rosbags would read of a bag's folder.

    Raises:
        FlysimError: it is damaged, larger than the limits above, packed in another way than chunk by chunk, or a file
            of it lies elsewhere.
    """
    where = shown_path(bag)
    text = read_text(inside(bag, METADATA), "bag", MAX_METADATA)
    try:
        about = parse_yaml(text)["rosbag2_bagfile_information"]
        files = [inside(bag, PurePath(str(name)).name) for name in about["relative_file_paths"]]
        mode, storage = str(about.get("compression_mode") or "none").lower(), about["storage_identifier"]
    except FlysimError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise FlysimError(f"{where}: cannot read the bag: {METADATA}: {type(error).__name__}: {error}.") from None
    if mode != "none":
        raise FlysimError(
            f"{where}: packed as a whole or message by message (compression_mode {shown(mode)}); a bag is read plain, "
            "or packed in the chunks of an MCAP. Type: ros2 bag convert."
        )
    total = 0
    for path in files:
        with opened(path, "bag", MAX_BYTES) as stream:
            total += stream.seek(0, io.SEEK_END)
            if total <= MAX_BYTES and storage == "mcap":
                try:
                    total += _weigh_mcap(stream, MAX_BYTES - total)
                except (ValueError, StructError) as error:
                    raise FlysimError(f"{shown_path(path)}: cannot read the bag: {error}.") from None
        if total > MAX_BYTES:
            raise FlysimError(f"{where}: more than {MAX_BYTES} bytes; a bag so large is not read. Cut it into parts.")
        if storage == "sqlite3":
            _weigh_tables(path)


def _weigh_mcap(stream: BinaryIO, room: int) -> int:
    """How many bytes its chunks hold; counted no further where they are more than `room`.

    Raises:
        ValueError: it is damaged or too large.
    """
    footer = stream.seek(0, io.SEEK_END) - FOOTER_BYTES
    stream.seek(max(footer, 0))
    end = stream.read(FOOTER_BYTES)
    if footer < len(MAGIC) or end[: len(FOOTER)] != FOOTER or end[-len(MAGIC) :] != MAGIC:
        raise ValueError("it is no MCAP, or ends too soon")
    index = unpack_from("<Q", end, len(FOOTER))[0] or footer
    if not len(MAGIC) <= index <= footer or footer - index > MAX_INDEX:
        raise ValueError(f"its index begins at byte {index}, it ends at byte {footer}")
    chunks, total, messages = {}, 0, 0
    for kind, place, length in _records(stream, len(MAGIC), index):
        if kind == CHUNK:
            packing, packed, size = _chunk(stream.read(length))
            chunks[place] = packing, len(packed), size
            total += size
            if total > room:
                return total
            inner = io.BytesIO(_unpacked(packing, packed, size))
            messages += sum(one == MESSAGE for one, _, _ in _records(inner, 0, size))
            if messages > MAX_PACKED:
                raise ValueError(f"more than {MAX_PACKED} messages in its chunks")
    for kind, _, length in _records(stream, index, footer):
        if kind == INDEX:
            _, _, place, _, offsets = unpack("<QQQQI", stream.read(36))
            rest = stream.read(length - 36)[offsets + 8 :]
            count = unpack_from("<I", rest)[0]
            told = (rest[4 : 4 + count], *unpack_from("<QQ", rest, 4 + count))
            if chunks.pop(place, None) != told:
                raise ValueError(f"its index names a chunk at byte {place} that is not there, or is another")
    return total


def _records(stream: BinaryIO, begin: int, end: int) -> Iterator[tuple[int, int, int]]:
    """What it is, where it begins and how long its content is, of each record; the stream stands at the content.

    Raises:
        ValueError: one reaches past the end, or is too large.
    """
    while begin < end:
        stream.seek(begin)
        head = stream.read(9)
        if len(head) < 9:
            raise ValueError(f"the record at byte {begin} ends too soon")
        kind, length = unpack("<BQ", head)
        if begin + 9 + length > end:
            raise ValueError(f"the record at byte {begin} has {length} bytes, there are {max(end - begin - 9, 0)}")
        if length > MAX_RECORD and kind != ATTACHMENT:
            raise ValueError(f"the record at byte {begin} has {length} bytes, at most {MAX_RECORD} are read")
        yield kind, begin, length
        begin += 9 + length


def _chunk(content: bytes) -> tuple[bytes, bytes, int]:
    """How it is packed, what is packed, and how many bytes that is said to be."""
    size, _, count = unpack_from("<QII", content, 16)
    packing, (length,) = content[32 : 32 + count], unpack_from("<Q", content, 32 + count)
    packed = content[40 + count : 40 + count + length]
    if len(packed) != length:
        raise ValueError(f"a chunk of {length} bytes ends after {len(packed)}")
    if size > MAX_RECORD:
        raise ValueError(f"a chunk says that it holds {size} bytes, at most {MAX_RECORD} are read")
    return packing, packed, size


def _unpacked(packing: bytes, packed: bytes, size: int) -> bytes:
    """What a chunk holds: never more than one byte beyond what it says is made."""
    if packing == b"":
        content = packed
    else:
        decoder = _decoder(packing)
        try:
            content = decoder.decompress(packed, max_length=size + 1)
        except MemoryError:
            raise
        except Exception as error:  # each of the two has its own
            raise ValueError(f"a chunk is damaged: {error}") from None
        if len(content) <= size and not decoder.eof:
            raise ValueError(f"a chunk of {size} bytes ends after {len(content)}")
        if decoder.unused_data:
            raise ValueError("a chunk goes on after its end")
    if len(content) != size:
        more = "more" if len(content) > size else f"{len(content)}"
        raise ValueError(f"a chunk says that it holds {size} bytes, it holds {more}")
    return content


def _decoder(packing: bytes) -> Any:
    """Both packages come with rosbags."""
    if packing == b"zstd":
        try:
            from compression import zstd  # type: ignore[import-not-found]  # Python 3.14
        except ImportError:
            from backports import zstd
        return zstd.ZstdDecompressor()
    if packing == b"lz4":
        from lz4.frame import LZ4FrameDecompressor

        return LZ4FrameDecompressor()
    raise ValueError(f"a chunk is packed by {shown(packing.decode('utf-8', 'replace'))}; lz4 and zstd are read")


def _weigh_tables(path: Path) -> None:
    """Refuses a data base some of whose tables are not stored but computed: of those there may be any amount."""
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path))}?immutable=1&mode=ro", uri=True)) as base:
            made = base.execute("SELECT type, sql FROM sqlite_master").fetchall()
    except sqlite3.Error as error:
        raise FlysimError(f"{shown_path(path)}: cannot read the bag: {error}.") from None
    for kind, sql in made:
        if kind not in ("table", "index") or _UNLIKE_TABLES.search(str(sql)):
            raise FlysimError(
                f"{shown_path(path)}: cannot read the bag: it has more than stored tables ({shown(kind)})."
            )
