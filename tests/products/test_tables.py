"""Columns as Parquet and PLY, read back by those whose formats they are."""

import io

import numpy as np
import pyarrow.parquet as pq
import trimesh

from flysim.products.tables import parquet, ply

COLUMNS = {
    "x": np.array([0.5, 1.5], np.float32), "y": np.array([-1.0, 2.0], np.float32), "z": np.zeros(2, np.float32),
    "red": np.array([255, 0], np.uint8), "green": np.array([1, 2], np.uint8), "blue": np.array([3, 4], np.uint8),
    "stop": np.array([7, -8], np.int32),
}  # fmt: skip


def test_a_ply_is_read_back():
    content = ply(COLUMNS, "two points")
    assert b"comment two points\nelement vertex 2\nproperty float x\n" in content
    read = trimesh.load(io.BytesIO(content), file_type="ply")
    np.testing.assert_array_equal(read.vertices, np.column_stack([COLUMNS[name] for name in "xyz"]))
    np.testing.assert_array_equal(read.colors[:, :3], [[255, 1, 3], [0, 2, 4]])
    assert np.frombuffer(content[-4:], "<i4")[0] == -8


def test_a_parquet_file_is_read_back_with_what_it_says_of_itself():
    columns = {"x": COLUMNS["x"], "why": ["a", None]}
    told = {"about": {"frame": "world"}, "about_columns": {"x": {"unit": "m"}}, "kinds": {"why": "string"}}
    content = parquet(columns, **told)
    assert content == parquet(columns, **told)
    table = pq.read_table(io.BytesIO(content))
    assert table.to_pydict() == {"x": [0.5, 1.5], "why": ["a", None]}
    assert table.schema.metadata[b"frame"] == b"world" and table.field("x").metadata[b"unit"] == b"m"
