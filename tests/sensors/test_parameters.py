"""Every figure has a unit and a range, and what is no such figure is refused in one line that names it."""

import math
from dataclasses import FrozenInstanceError, fields, replace

import pytest

from flysim.common.records import changed, record_of
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.parameters import SensorParams


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"noise": -1.0}, "noise must be a number in [0, 255] grey levels, got -1.0"),
        ({"noise": math.nan}, "noise must be a number in [0, 255] grey levels, got nan"),
        ({"noise": "5"}, "noise must be a number in [0, 255] grey levels, got '5'"),
        ({"defocus_left": 51}, "defocus_left must be a number in [0, 50] px, got 51"),
        ({"vignetting": 1.1}, "vignetting must be a number in [0, 1] of the light, got 1.1"),
        ({"row_time_us": -3}, "row_time_us must be a number in [0, 1000] us, got -3"),
        ({"jpeg_quality": 101}, "jpeg_quality must be a whole number in [0, 100] (0: no JPEG), got 101"),
        ({"jpeg_quality": 50.5}, "jpeg_quality must be a whole number in [0, 100] (0: no JPEG), got 50.5"),
        (
            {"exposure_lag": True, "auto_exposure": 90},
            "exposure_lag must be a whole number in [0, 100] frames, got True",
        ),
        (
            {"exposure_lag": 2},
            "exposure_lag is of auto_exposure: set that too, such as auto_exposure = 110 grey levels",
        ),
        ({"bayer": 1}, "bayer must be true or false, got 1"),
    ],
)
def test_what_no_camera_has_is_refused(given, said):
    with pytest.raises(ValueError) as caught:
        SensorParams(**given)
    assert str(caught.value) == said


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"right_roll_deg": 90}, "right_roll_deg must be a number in [-45, 45] degrees, got 90"),
        ({"baseline_error": -1.0}, "baseline_error must be a number in [-0.9, 10] (a share), got -1.0"),
        ({"row_shift_px": math.inf}, "row_shift_px must be a number in [-1000, 1000] px, got inf"),
    ],
)
def test_what_no_rig_has_is_refused(given, said):
    with pytest.raises(ValueError) as caught:
        CalibrationParams(**given)
    assert str(caught.value) == said


@pytest.mark.parametrize("kind", [SensorParams, CalibrationParams])
def test_every_figure_has_a_range_and_says_its_unit(kind):
    for field in fields(kind):
        with pytest.raises(ValueError, match=rf"^{field.name} must be .* got 1(e\+09|000000000(\.0)?)$|^bayer must be"):
            replace(kind(), **{field.name: 10**9 if field.type == "int" else 1e9})
        assert f"{field.name}" in kind.__doc__


def test_a_record_stays_as_it_was_made():
    with pytest.raises(FrozenInstanceError):
        SensorParams().noise = 5.0


def test_what_was_changed_is_what_is_not_off():
    assert changed(SensorParams()) == {}
    assert changed(SensorParams(noise=5, gain_right=1.0, bayer=True)) == {"noise": 5, "bayer": True}


def test_a_record_is_had_from_itself_from_a_dict_and_from_nothing():
    made = SensorParams(noise=5)
    assert record_of(SensorParams, "sensors", made) is made
    assert record_of(SensorParams, "sensors", {"noise": 5}) == made
    assert record_of(SensorParams, "sensors", None) == SensorParams()
    with pytest.raises(ValueError, match=r"^sensors has no 'nois'\. Did you mean 'noise'\?$"):
        record_of(SensorParams, "sensors", {"nois": 5})
    with pytest.raises(ValueError, match=r"^sensors: noise must be a number in \[0, 255\] grey levels, got 999$"):
        record_of(SensorParams, "sensors", {"noise": 999})
    with pytest.raises(ValueError, match=r"^sensors must be a SensorParams or a dict of its fields, got 5$"):
        record_of(SensorParams, "sensors", 5)
