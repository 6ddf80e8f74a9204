"""The rows of a study as a Parquet file: one a cell, for pandas, polars or DuckDB."""

from __future__ import annotations

from collections.abc import Sequence

from flysim.products.tables import parquet
from flysim.studies.sweep.cell import Row

KINDS = {
    "level": "float64",
    "scenario": "string",
    "seed": "int64",
    "engine": "string",
    "f1": "float64",
    "well_f1": "float64",
    "center_error_max_m": "float64",
    "size_error_max_m": "float64",
    "points": "int64",
    "ms_per_stop": "float64",
    "found": "float64",
    "found_well": "float64",
    "visible": "int32",
    "false": "int32",
    "stops": "int32",
    "odometry_ape_m": "float64",
    "located_ape_m": "float64",
    "error": "string",
    "key": "string",
}


def cells_parquet(rows: Sequence[Row], study: str, unit: str) -> bytes:
    """A Parquet file's bytes; its metadata name the study and the unit of a level."""
    columns = {name: [getattr(row, name) for row in rows] for name in KINDS}
    return parquet(columns, about={"study": study, "unit": unit}, kinds=KINDS)
