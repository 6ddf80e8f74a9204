"""Points that another program wrote: PLY, .npy, or lines of text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.arrays import parse_npy
from flysim.foreign.files import read_bytes
from flysim.plain import shown, shown_path

MAX_BYTES = 2**28
MAX_POINTS = 5_000_000
MAX_HEADER = 10_000  # bytes of a PLY
MAX_TEXT_BYTES = 2**25  # of points as text, which are read one by one
# PLY's names of a type -> numpy's.
KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"},
    **{"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"},
}
_PROPERTY = re.compile(r"property (\w{1,20}) (\w{1,40})")


def read_points(path: Path, what: str = "points", error: type[FlysimError] = FlysimError) -> NDArray[np.float64]:
    """`[N, 3]` x, y, z of a PLY (text or binary), of an `[N, 3 or more]` .npy, or of lines `x y z ...`.

    Points that are not finite are left out.

    Raises:
        error: the file cannot be read, is too large or damaged, or has more than `MAX_POINTS`.
    """
    data = read_bytes(path, what, MAX_BYTES, error)
    try:
        points = parse_points(data)
    except ValueError as refusal:
        raise error(f"{shown_path(path)}: cannot read the {what}: {refusal}.") from None
    return points[np.isfinite(points).all(axis=1)]


def parse_points(data: bytes) -> NDArray[np.float64]:
    """The same of a file's bytes, with points that are not finite.

    Raises:
        ValueError: it is none of the three, or damaged.
    """
    if data.startswith(b"ply"):
        return parse_ply(data)
    if data.startswith(b"\x93NUMPY"):
        values = parse_npy(data)
        if values.ndim != 2 or values.shape[1] < 3:
            raise ValueError(f"it has the shape {values.shape}, not [N, 3]")
        return _few(values[:, :3].astype(np.float64))
    return _few(_lines(data))


def parse_ply(data: bytes) -> NDArray[np.float64]:
    """`[N, 3]` the places of a PLY's vertices, which must be its first element; the rest is not looked at.

    Raises:
        ValueError: it is none, or damaged.
    """
    end = data.find(b"end_header", 0, MAX_HEADER)
    start = data.find(b"\n", end) + 1
    if end < 0 or not start:
        raise ValueError("its PLY header has no end")
    lines = [line.strip() for line in data[:end].decode("ascii", "replace").splitlines()]
    form = next((line.split()[1] for line in lines if re.fullmatch(r"format \w+ 1\.0", line)), "")
    head = [k for k, line in enumerate(lines) if line.startswith("element ")]
    count = re.fullmatch(r"element vertex (\d{1,8})", lines[head[0]]) if head else None
    if count is None or form not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise ValueError("it is no PLY whose first element is its vertices")
    n, columns = int(count[1]), []
    for line in lines[head[0] + 1 : head[1] if len(head) > 1 else None]:
        found = _PROPERTY.fullmatch(line)
        if line.startswith("property") and (found is None or found[1] not in KINDS):
            raise ValueError(f"its vertices have a property that is no number: {shown(line)}")
        if found is not None:
            columns.append((found[2], KINDS[found[1]]))
    names = [name for name, _ in columns]
    if not {"x", "y", "z"} <= set(names) or len(set(names)) < len(names):
        raise ValueError("its vertices have no x, y, z")
    if n > MAX_POINTS:
        raise ValueError(f"it has {n} points; at most {MAX_POINTS} are read")
    if form == "ascii":
        rows = data[start:].split(b"\n", n)[:n]
        values = _lines(b"\n".join(rows), [names.index(axis) for axis in "xyz"])
        if len(values) != n:
            raise ValueError(f"it holds {len(values)} vertices, not {n}")
        return values
    kind = np.dtype([(name, ("<" if form == "binary_little_endian" else ">") + of) for name, of in columns])
    if len(data) - start < n * kind.itemsize:
        raise ValueError(f"it ends before its {n} vertices do")
    table = np.frombuffer(data, kind, n, start)
    return np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _lines(data: bytes, columns: list[int] | None = None) -> NDArray[np.float64]:
    if len(data) > MAX_TEXT_BYTES:
        raise ValueError("it is too much text. Save the points as a binary PLY or .npy")
    columns = columns or [0, 1, 2]
    rows = []
    for k, line in enumerate(data.decode("ascii", "replace").splitlines(), start=1):
        words = line.replace(",", " ").split()
        if not words or words[0].startswith("#"):
            continue
        try:
            rows.append([float(words[i]) for i in columns])
        except (ValueError, IndexError):
            raise ValueError(f"line {k} is no x y z: {shown(line)}") from None
    return np.array(rows, np.float64).reshape(-1, 3)


def _few(points: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(points) > MAX_POINTS:
        raise ValueError(f"it has {len(points)} points; at most {MAX_POINTS} are read")
    return points
