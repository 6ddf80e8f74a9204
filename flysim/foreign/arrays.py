"""Arrays of numbers that somebody else saved with numpy: .npy, and .npz of a few of them."""

from __future__ import annotations

import io
import math
import re
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.files import read_bytes
from flysim.plain import shown, shown_path

MAX_MEMBERS = 100
# All that may be in a header: a plain number type, an order, a shape. numpy evaluates it as Python, and makes room for
# what the shape says before it looks whether so much is there.
_HEADER = re.compile(
    r"\{'descr': '(?P<type>[<>|][fiu][1248])', 'fortran_order': (?:True|False), "
    r"'shape': \((?P<shape>(?:\d{1,10},? ?){0,4})\),? *\} *\n?",
    re.ASCII,
)


def parse_npy(data: bytes) -> NDArray[Any]:
    """The array of a .npy file's bytes.

    Raises:
        ValueError: it is none, an array of anything but plain numbers, or of another size than its header says.
    """
    if data[:8] != b"\x93NUMPY\x01\x00" or len(data) < 10:
        raise ValueError("it is no array that numpy saved")
    end = 10 + struct.unpack("<H", data[8:10])[0]
    header = data[10:end].decode("latin1")
    found = _HEADER.fullmatch(header)
    if found is None:
        raise ValueError(f"its header is not that of an array of numbers: {shown(header)}")
    shape = [int(side) for side in found["shape"].replace(",", " ").split()]
    if math.prod(shape) * int(found["type"][2]) != len(data) - end:
        raise ValueError(f"it holds {len(data) - end} bytes, not an array of the shape {tuple(shape)}")
    return np.load(io.BytesIO(data), allow_pickle=False)


def read_npy(path: Path, what: str, limit: int, error: type[FlysimError] = FlysimError) -> NDArray[Any]:
    """The array of a .npy file.

    Raises:
        error: the file cannot be read, is too large, or as `parse_npy`.
    """
    data = read_bytes(path, what, limit, error)
    try:
        return parse_npy(data)
    except ValueError as refusal:
        raise error(f"{shown_path(path)}: cannot read the {what}: {refusal}.") from None


def read_npz(path: Path, what: str, limit: int, error: type[FlysimError] = FlysimError) -> dict[str, NDArray[Any]]:
    """The arrays of a .npz file by name; packed and unpacked it has at most `limit` bytes.

    Raises:
        error: the file cannot be read, is too large, is damaged, or as `parse_npy`.
    """
    data = read_bytes(path, what, limit, error)
    found: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > MAX_MEMBERS:
                raise ValueError(f"it holds {len(members)} arrays, at most {MAX_MEMBERS} are read")
            for member in members:
                content = _unpacked(archive, member, limit)
                limit -= len(content)
                found[member.filename.removesuffix(".npy")] = parse_npy(content)
    except (
        ValueError,
        RuntimeError,
        EOFError,
        OSError,
        LookupError,
        zipfile.BadZipFile,
        zlib.error,
        struct.error,
    ) as no:
        raise error(f"{shown_path(path)}: cannot read the {what}: {no or type(no).__name__}.") from None
    return found


def _unpacked(archive: zipfile.ZipFile, member: zipfile.ZipInfo, limit: int) -> bytes:
    # The two methods of numpy: the other unpackers know no limit. What a file says of its size may be false.
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{shown(member.filename)} is packed by another method than numpy's")
    with archive.open(member) as stream:
        content = stream.read(limit + 1)
    if len(content) > limit:
        raise ValueError("it unpacks to more than is read")
    return content
