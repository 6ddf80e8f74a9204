"""A report as a person reads it, letter for letter."""
# ruff: noqa: E501 (the table is wider than our lines)

import json
from dataclasses import replace

import pytest

from flysim.evaluate.report import Report
from flysim.evaluate.scores import ObstacleReport, Spread, StopReport, SurfaceReport
from flysim.evaluate.table import aligned

POST = ObstacleReport(
    name="post",
    detected=True,
    visible=True,
    shape_true="cylinder",
    shape_estimated="box",
    center_error=0.0123,
    center_visible_error=0.0045,
    size_true=(0.12, 0.12, 0.9),
    size_visible=(0.11, 0.12, 0.9),
    size_estimated=(0.1304, 0.12, 0.85),
    size_error=(0.0104, -0.0004, -0.05),
    size_visible_error=(0.0204, 0.0, -0.05),
    yaw_error_deg=None,
)
MISSED = ObstacleReport(
    name="box behind",
    detected=False,
    visible=False,
    shape_true="box",
    shape_estimated=None,
    center_error=None,
    center_visible_error=None,
    size_true=(0.4, 0.3, 0.2),
    size_visible=None,
    size_estimated=None,
    size_error=None,
    size_visible_error=None,
    yaw_error_deg=None,
)
BOX = replace(POST, name="box", shape_true="box", yaw_error_deg=12.345, center_error=0.2)
STOP = StopReport(
    index=0, commanded=(0.0, 0.0, 0.0), odometry=(0.0, 0.0, 0.0), true=(0.0, 0.0, 0.0), iterations=5, converged=True,
    time={"render": 0.1},
)  # fmt: skip
SURFACE = SurfaceReport(
    accuracy_median=0.00123,
    accuracy_p90=0.0456,
    precision={"0.01": 0.5, "0.02": 0.75, "0.05": 1.0},
    completeness={"0.01": 0.1234, "0.02": 0.25, "0.05": 0.5},
    f_score={"0.01": 0.2, "0.02": 0.375, "0.05": 0.6667},
)
REPORT = Report(
    scenario="paper_a",
    seed=7,
    renderer="gl",
    engine="flies",
    world="paper",
    status="ok",
    blocked=None,
    stops_planned=3,
    stops=(STOP, STOP),
    obstacles=(POST, MISSED, BOX),
    false_obstacles=1,
    structure_obstacles=2,
    precision=2 / 3,
    recall=1.0,
    f1=0.8,
    center_error=Spread(median=0.1, max=0.2),
    center_visible_error=Spread(median=0.0045, max=0.0045),
    size_error=Spread(median=0.0104, max=0.05),
    size_visible_error=Spread(median=0.0204, max=None),
    surface=SURFACE,
    time={"total": 12.345, "drive": 1.0},
)
EXPECTED = """\
paper_a in world paper: seed 7, gl, flies, 2 of 3 stops

obstacle    found as          centre      true l x w x h             visible           estimated           error      to visible       yaw
post        box*                 1.2  12.0 x 12.0 x 90.0  11.0 x 12.0 x 90.0  13.0 x 12.0 x 85.0  +1.0 +0.0 -5.0  +2.0 +0.0 -5.0         -
box behind  no (not visible)       -  40.0 x 30.0 x 20.0                   -                   -               -               -         -
box         box                 20.0  12.0 x 12.0 x 90.0  11.0 x 12.0 x 90.0  13.0 x 12.0 x 85.0  +1.0 +0.0 -5.0  +2.0 +0.0 -5.0  12.3 deg
(lengths in cm; errors are estimated minus true, and estimated minus the part that was visible; * is another shape)

found      2 of 2 visible, 1 false, 2 on ground or walls: recall 1.00, precision 0.67, F1 0.80
well       0 of 2 to 3 cm, or 5 % of a dimension: F1 0.00
centre     0.4 / - / 0.4 cm from the visible part; 10.0 / - / 20.0 cm from the whole (median / 95 % / max)
size       2.0 / - / - cm from the visible part; 1.0 / - / 5.0 cm from the whole
height     - / - / - cm from the visible part; - / - / - cm from the whole
shape      - right; overlap - from above, - in space
flies      median 0.12 cm, 90 % within 4.56 cm of the visible surface
surface    within         1 cm   2 cm   5 cm
           precision     0.500  0.750  1.000
           completeness  0.123  0.250  0.500
           F-score       0.200  0.375  0.667
time       total 12.35 s, drive 1.00 s
"""


def test_the_whole_table():
    assert str(REPORT) + "\n" == EXPECTED


@pytest.mark.parametrize("width", [160, 120, 80])
def test_it_fits_its_lines_and_says_the_same(width):
    far = replace(POST, name="cylinder_between_the_walls_12", size_error=(-0.1234, 0.2345, -0.3456), yaw_error_deg=45.6)
    whole = replace(
        REPORT, obstacles=(*REPORT.obstacles, far), sensors={"noise": 5.0, "defocus_right": 1.5, "jpeg": 20}
    )
    text = whole.text(width)
    assert max(map(len, text.splitlines())) <= width
    for words in ("13.0 x 12.0 x 85.0", "-12.3 +23.4 -34.6", "+2.0 +0.0 -5.0", "45.6 deg", "0.123  0.250  0.500"):
        assert words in text
    if width == 80:
        assert "cylind..._12" in text and "unseen" in text
    said = " ".join(text.split("(lengths")[1].split())
    assert said == " ".join(str(whole).split("(lengths")[1].split())


def test_what_is_only_said_where_it_is_so():
    plain = replace(
        REPORT, obstacles=(replace(BOX, shape_estimated="box"),), structure_obstacles=0, blocked="blocked by it"
    )
    lines = str(replace(plain, texture="speckle")).splitlines()
    assert lines[0].endswith("2 of 3 stops, dressed in speckle, blocked by it")
    assert "visible)" in lines[4] and "another shape" not in str(plain)
    assert "found      1 of 1 visible, 1 false: recall" in str(plain)


def test_columns_are_as_wide_as_their_widest_cell():
    assert aligned([("a", "bb", "c"), ("aaa", "b", "ccc")]) == ["a    bb    c", "aaa  b   ccc"]


def test_every_figure_is_written_and_read_again():
    full = replace(
        REPORT, blocked="by it", status="blocked", texture="speckle", warnings=("one", "two"), versions={"a": "1"}
    )
    written = json.loads(json.dumps(full.to_json(), allow_nan=False))
    read = Report.from_json(written)
    assert read == replace(full, size_visible_error=Spread(median=0.0204, max=None), precision=0.666667)
    assert written["center_error_m"] == {"median": 0.1, "p95": None, "max": 0.2} and written["time_s"] == {
        "total": 12.345,
        "drive": 1.0,
    }
    assert written["obstacles"][1]["size_true_m"] == [0.4, 0.3, 0.2] and written["surface"]["accuracy_p90_m"] == 0.0456
    for key in ("texture", "warnings"):  # which older reports have not
        del written[key]
    assert (Report.from_json(written).texture, Report.from_json(written).warnings) == (None, ())


@pytest.mark.parametrize(("x", "shown"), [(0.00049, "+0.0"), (-0.00049, "+0.0"), (0.00051, "+0.1"), (-0.00051, "-0.1")])
def test_errors_are_rounded_to_a_millimetre_and_no_zero_has_a_minus(x, shown):
    report = replace(REPORT, obstacles=(replace(POST, size_error=(x, x, x)),))
    assert f"{shown} {shown} {shown}" in str(report)
