"""One short drive with a disturbed rig, and the data sets that each format makes of it."""

import data_sets
import pytest

from flysim.datasets.layout import FORMATS


@pytest.fixture(scope="session")
def taken(tmp_path_factory):
    return data_sets.take(tmp_path_factory.mktemp("datasets"), FORMATS.builtin, data_sets.DISTURBED)
