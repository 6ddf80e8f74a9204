"""What hops and baselines cost: the drives of both studies, and their picture."""

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from flysim.cli.app import app
from flysim.errors import ScenarioError
from flysim.runs.pairs import BaselineRange, pair_rule
from flysim.runs.run import errand
from flysim.studies.sweep.cell import run_trip
from flysim.studies.sweep.figure import study_png
from flysim.studies.sweep.one_camera import BASELINE, HOP
from flysim.studies.sweep.result import SweepResult
from flysim.studies.sweep.study import STUDIES
from flysim.studies.sweep.sweep import trips


def plans(study, levels, scenario="paper_a_mono"):
    return [one.plan for one in trips(study, [scenario], (0,), ("flies",), levels=levels, renderer="tiny")]


def test_they_are_found_by_name():
    assert STUDIES.load("hop") is HOP and STUDIES.load("baseline") is BASELINE


def test_a_hop_changes_the_stops_of_the_way():
    few, many = plans(HOP, (1.2, 0.4))
    assert [stop.x for stop in few.stops] == pytest.approx([0.0, 1.2, 2.4])
    assert [stop.x for stop in many.stops] == pytest.approx([0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4])
    assert few.pairs == many.pairs == "consecutive"
    with pytest.raises(ScenarioError, match=r"its way is 2\.4 m long"):
        plans(HOP, (2.5,))


@pytest.mark.parametrize("scenario", HOP.scenarios)
def test_a_baseline_changes_the_partner_alone(scenario):
    near, far = plans(BASELINE, (0.2, 0.6), scenario)
    assert near.stops == far.stops
    assert far.pairs == BaselineRange(baseline=(0.54, 0.66))
    for plan, apart in ((near, 2), (far, 6)):
        eyes = errand(plan).eyes()
        # Where the way bends, the chord is shorter than the way, and the partner may be one further back.
        assert len(plan.stops) - apart - 2 <= eyes.planned <= len(plan.stops) - apart
        rule = pair_rule(plan.pairs)
        assert rule.least <= eyes.rig.baseline <= rule.most


def test_the_picture_has_centimetres():
    result = SweepResult(name="hop", study=HOP, levels=(0.1, 0.4), engines=("flies",), renderer="gl", rows=())
    assert study_png(result) != study_png(replace(result, study=replace(HOP, lengths=False)))


def test_a_drive_of_a_hop_is_a_row():
    (trip,) = trips(HOP, ["paper_a_mono"], (0,), ("chance",), levels=(1.2,), renderer="tiny")
    (row,) = run_trip(trip)
    assert (row.level, row.stops, row.error) == (1.2, 2, None)


def test_the_command_drives_the_studys_own_paths():
    done = CliRunner().invoke(app, ["study", "hop", "--levels", "2"])
    assert done.exit_code == 2
    assert "'paper_c_mono': its way is 1.50" in done.output
