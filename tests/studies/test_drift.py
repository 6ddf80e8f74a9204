"""The two studies of odometry: the same drift, believed or mended, and what the way is off by in every table."""

from dataclasses import replace
from io import BytesIO

from PIL import Image

from flysim.runs.scenario import read_scenario
from flysim.studies.sweep.cell import Row
from flysim.studies.sweep.drift import LOCALISATION, ODOMETRY
from flysim.studies.sweep.figure import study_png
from flysim.studies.sweep.result import SweepResult


def test_levels_are_figures_of_a_scenario():
    for study, who in ((ODOMETRY, "odometry"), (LOCALISATION, "flies")):
        plan = read_scenario("yard", study.overrides(2.0))
        assert (plan.odometry.distance_std, plan.odometry.yaw_std_deg_per_m, plan.localisation) == (0.02, 2.0, who)


def test_how_far_the_way_is_off_is_in_table_and_picture():
    row = Row(level=0.0, scenario="yard", seed=0, engine="flies", f1=1.0, well_f1=1.0, points=10, stops=1, key="a")
    far = replace(row, level=2.0, f1=0.8, odometry_ape_m=0.3, located_ape_m=0.004, center_error_max_m=0.02, key="b")
    result = SweepResult(
        name="localisation", study=LOCALISATION, levels=(0.0, 2.0), engines=("flies",), renderer="gl", rows=(row, far)
    )
    (way,) = [sheet for sheet in result.sheets() if sheet.columns[0] == "way off by cm"]
    assert way.rows == (("2", "flies", "30.00", "0.40"),)
    with Image.open(BytesIO(study_png(result))) as wide:
        assert wide.size == (1650, 740)  # three panels across where the other studies have two
