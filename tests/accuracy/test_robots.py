"""Two hundred generated robots against a plain reading of the URDF specification."""

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from robot_text import CUBE
from urdf_checked import checked
from urdf_corpus import robots

pytestmark = pytest.mark.accuracy


@settings(
    max_examples=200, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True, phases=[Phase.generate]
)
@given(text=robots())
def test_generated_robots_are_read_as_the_specification_says(tmp_path_factory, text):
    folder = tmp_path_factory.mktemp("robot")
    (folder / "cube.obj").write_text(CUBE)
    checked(folder, text, driven=True)
