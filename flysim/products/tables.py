"""Columns as a file's bytes, in two formats that everybody reads: Parquet and PLY.

Made in memory, so that a full disk is an OSError in Python and not an error in a library's thread.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

PLY_KINDS = {"f4": "float", "u1": "uchar", "i4": "int"}  # numpy's name of a type -> PLY's


def ply(columns: Mapping[str, NDArray[Any]], comment: str = "") -> bytes:
    """A binary little-endian PLY: one vertex a row.

    Args:
        columns: name of a property -> `[N]` float32, int32 or uint8.
        comment: a line of the header.
    """
    table = np.zeros(
        len(next(iter(columns.values()))),
        dtype=[(name, column.dtype.newbyteorder("<")) for name, column in columns.items()],
    )
    for name, column in columns.items():
        table[name] = column
    header = ["ply", "format binary_little_endian 1.0", *([f"comment {comment}"] if comment else [])]
    header += [f"element vertex {len(table)}"]
    header += [f"property {PLY_KINDS[column.dtype.str[1:]]} {name}" for name, column in columns.items()]
    return ("\n".join([*header, "end_header"]) + "\n").encode("ascii") + table.tobytes()


def parquet(
    columns: Mapping[str, Any],
    *,
    about: Mapping[str, str] | None = None,
    about_columns: Mapping[str, Mapping[str, str]] | None = None,
    kinds: Mapping[str, str] | None = None,
    compression: str = "snappy",
) -> bytes:
    """A Parquet file of columns of one length; the same columns give the same bytes.

    Args:
        columns: name -> array, or list in which None is "there is none".
        about: metadata of the file.
        about_columns: metadata of columns, by their names.
        kinds: types of columns that are lists, by their names, as pyarrow calls them: "float64", "string".
        compression: as pyarrow has them.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    told, kinds = about_columns or {}, kinds or {}
    fields = [
        pa.field(
            name,
            pa.type_for_alias(kinds[name]) if name in kinds else pa.from_numpy_dtype(column.dtype),
            metadata=dict(told[name]) if name in told else None,
        )
        for name, column in columns.items()
    ]
    schema = pa.schema(fields, metadata=dict(about) if about else None)
    sink = io.BytesIO()
    pq.write_table(pa.table(list(columns.values()), schema=schema), sink, compression=compression)
    return sink.getvalue()
