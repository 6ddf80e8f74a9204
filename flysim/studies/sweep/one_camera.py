"""What the distance of two stops costs a robot with one camera, whose baseline it is."""

from __future__ import annotations

from flysim.runs.pairs import BaselineRange
from flysim.runs.respaced import respaced
from flysim.runs.scenario import Scenario
from flysim.studies.sweep.study import Study

GRID = 0.1  # [m] from stop to stop where the baseline is studied: the number of pairs hardly changes with it
APART = 0.6 * GRID  # [m] by which a baseline may differ from what is asked: some stop lies there
PATHS = ("paper_a_mono", "paper_b_mono", "paper_c_mono")


def _baseline(plan: Scenario, level: float) -> Scenario:
    pairs = BaselineRange(baseline=(round(level - APART, 6), round(level + APART, 6)))
    return respaced(plan, GRID).model_copy(update={"pairs": pairs})


BASELINE = Study(
    what="baseline of a pair of stops, one every 0.1 m",
    unit="m",
    levels=(0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2),
    changed=_baseline,
    scenarios=PATHS,
    engines=("flies",),
    lengths=True,
)
HOP = Study(
    what="hop from stop to stop, each a pair with the one before",
    unit="m",
    levels=(0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2),
    changed=respaced,
    scenarios=PATHS,
    engines=("flies",),
    lengths=True,
)
