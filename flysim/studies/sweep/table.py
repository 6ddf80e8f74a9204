"""The rows of a study as a Parquet file: one a cell, for pandas, polars or DuckDB."""

from __future__ import annotations

import io
from collections.abc import Sequence

from flysim.studies.sweep.cell import Row


def parquet(rows: Sequence[Row], study: str, unit: str) -> bytes:
    """A Parquet file's bytes; its metadata name the study and the unit of a level.

    The same rows give the same bytes.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = {
        "level": pa.float64(),
        "scenario": pa.string(),
        "seed": pa.int64(),
        "engine": pa.string(),
        "f1": pa.float64(),
        "well_f1": pa.float64(),
        "center_error_max_m": pa.float64(),
        "size_error_max_m": pa.float64(),
        "points": pa.int64(),
        "ms_per_stop": pa.float64(),
        "found": pa.int32(),
        "found_well": pa.int32(),
        "visible": pa.int32(),
        "false": pa.int32(),
        "stops": pa.int32(),
        "error": pa.string(),
        "key": pa.string(),
    }
    schema = pa.schema(list(kinds.items()), metadata={"study": study, "unit": unit})
    columns = {name: [getattr(row, name) for row in rows] for name in kinds}
    sink = io.BytesIO()
    pq.write_table(pa.table(columns, schema=schema), sink)
    return sink.getvalue()
