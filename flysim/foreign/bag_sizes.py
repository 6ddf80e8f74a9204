"""What the files of a bag of ROS 2 would take up unpacked, asked before anybody unpacks them.

An MCAP file is a row of records: a byte that says which, eight that say how long, and so much of it. Chunks are packed,
and rosbags unpacks what they hold whatever it comes to: a file of a megabyte can fill the memory. So each chunk is
unpacked once before, piece by piece, no further than it says it goes (mcap.dev/spec).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from flysim.errors import FlysimError
from flysim.foreign.yaml_text import parse_yaml
from flysim.plain import shown_path

MAGIC, FOOTER = b"\x89MCAP0\r\n", 0x02
CHUNK, CHUNK_INDEX = 0x06, 0x08
MOST_CHUNK = 2**28  # bytes of one, unpacked
PIECE = 2**20  # bytes unpacked at a time


def refuse_swelling(bag: Path, most: int) -> None:
    """Refuses a bag whose files are no rows of records, or hold more than they say, or than `most` bytes in all.

    Args:
        bag: the folder, with its metadata.yaml.
        most: bytes of all chunks, unpacked.

    Raises:
        FlysimError: the bag is so, or is packed as a whole or message by message, which cannot be asked.
        Exception: of a file that is damaged otherwise.
    """
    about = parse_yaml((bag / "metadata.yaml").read_text(encoding="utf-8"))
    mode = str(about["rosbag2_bagfile_information"].get("compression_mode") or "none").lower()
    if mode != "none":
        raise FlysimError(f"{shown_path(bag)}: packed by {mode}, which is not read. Unpack it: ros2 bag convert.")
    total = 0
    for path in sorted(bag.iterdir()):
        with path.open("rb") as file:
            if file.read(len(MAGIC)) == MAGIC:
                total += _unpacked(file, path.stat().st_size, shown_path(path))
    if total > most:
        raise FlysimError(f"{shown_path(bag)}: {total} bytes unpacked; more than {most} are not read.")


def _unpacked(file: BinaryIO, size: int, shown: str) -> int:
    """Bytes of all chunks of an MCAP file, each of which holds as much as it says."""
    chunks: dict[int, tuple[str, int, int]] = {}
    indexed: dict[int, tuple[str, int, int]] = {}
    starts: set[int] = {0}
    for kind, start, record in _records(file, size, shown):
        starts.add(start)
        if kind == CHUNK:
            unpacked = struct.unpack("<Q", record.read(24)[16:])[0]
            record.read(4)
            packing = _text(record)
            packed = record.read(struct.unpack("<Q", record.read(8))[0])
            if unpacked > MOST_CHUNK:
                raise FlysimError(f"{shown}: a chunk of {unpacked} bytes; more than {MOST_CHUNK} are not read.")
            if packing not in ("", "lz4", "zstd"):
                raise FlysimError(f"{shown}: chunks packed by {packing!r} are not read, only by lz4 or zstd.")
            if packing and _swells(packed, packing, unpacked):
                raise FlysimError(f"{shown}: a chunk holds more than the {unpacked} bytes that it says: not read.")
            chunks[start] = packing, len(packed), unpacked
        elif kind == CHUNK_INDEX:
            at = struct.unpack("<QQQQ", record.read(32))[2]
            record.read(struct.unpack("<I", record.read(4))[0] + 8)
            packing = _text(record)
            indexed[at] = packing, *struct.unpack("<QQ", record.read(16))
        elif kind == FOOTER and struct.unpack("<Q", record.read(8))[0] not in starts:
            raise FlysimError(f"{shown}: its summary begins within a record: not read.")
    if any(chunks.get(at) != said for at, said in indexed.items()):
        raise FlysimError(f"{shown}: its index tells of a chunk that is not there: not read.")
    return sum(unpacked for _, _, unpacked in chunks.values())


def _records(file: BinaryIO, size: int, shown: str) -> Iterator[tuple[int, int, BytesIO]]:
    """Kind, place and content of each record of a file whose magic was read; what is long and no chunk is cut short."""
    while True:
        start = file.tell()
        head = file.read(9)
        if len(head) < 9:
            return
        length = struct.unpack("<Q", head[1:])[0]
        if length > size - file.tell():
            raise FlysimError(f"{shown}: cannot read the bag: a record goes on behind the end of the file.")
        if head[0] in (CHUNK, CHUNK_INDEX, FOOTER):
            if length > MOST_CHUNK:
                raise FlysimError(f"{shown}: a record of {length} bytes; more than {MOST_CHUNK} are not read.")
            yield head[0], start, BytesIO(file.read(length))
        else:
            yield head[0], start, BytesIO()
            file.seek(length, 1)
        if head[0] == FOOTER:
            return


def _text(record: BytesIO) -> str:
    return record.read(struct.unpack("<I", record.read(4))[0]).decode()


def _swells(packed: bytes, packing: str, most: int) -> bool:
    """Whether some packed bytes come to more than `most`."""
    left = most
    while packed:
        one = _unpacker(packing)
        given: bytes = packed
        while not one.eof:
            piece = one.decompress(given, min(PIECE, left + 1))
            left -= len(piece)
            if left < 0:
                return True
            if not piece and one.needs_input:
                return False  # it ends too soon, which its reader tells
            given = b""
        packed = one.unused_data or b""
    return False


def _unpacker(packing: str) -> Any:
    if packing == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return LZ4FrameDecompressor()
    try:
        from compression.zstd import ZstdDecompressor  # type: ignore[import-not-found]
    except ImportError:  # before Python 3.14
        from backports.zstd import ZstdDecompressor
    return ZstdDecompressor()
