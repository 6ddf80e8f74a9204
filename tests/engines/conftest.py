"""One rendered pair with the truth of each of its pixels."""

import pytest

from flysim.studies.bench.scene import scenes


@pytest.fixture(scope="session")
def scene():
    return scenes([(320, 240)], "tiny")[0][0]
