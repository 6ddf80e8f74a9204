"""Photographs of a board."""

import pytest
from boards import write_pairs


@pytest.fixture(scope="session")
def album(tmp_path_factory):
    """A folder of ten pairs of a 7x5 board."""
    return write_pairs(tmp_path_factory.mktemp("album") / "pairs", 10)
