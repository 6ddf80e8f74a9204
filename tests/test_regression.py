"""The figures of runs/baselines are not allowed to get worse than their tolerances."""

import pytest

from flysim.studies.regress.baseline import FIGURES, find_baselines
from flysim.studies.regress.regress import check_baseline

BASELINES = find_baselines(())


@pytest.mark.parametrize("baseline", BASELINES, ids=lambda baseline: baseline.name)
def test_no_figure_is_worse_than_it_may_be(baseline):
    assert baseline.figures.keys() == FIGURES.keys()
    assert baseline.updates and all(one["reason"] for one in baseline.updates)
    checked = check_baseline(baseline)
    assert [one for one in checked.moved if one.verdict == "worse"] == []
