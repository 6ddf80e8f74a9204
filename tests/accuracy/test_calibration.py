"""What 15 images of a board make of a robot's own cameras, and what is measured with it."""

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.robots.robot import read_robot
from flysim.runs.calibrated import BOARD, simulated, true_infos
from flysim.runs.run import run
from flysim.sensors.parameters import SensorParams
from flysim.studies.calibration.beside import beside

LENS = {"k1": -0.18, "k2": 0.04, "p1": 0.001, "p2": -0.0008, "noise": 1.0}

pytestmark = pytest.mark.accuracy


@pytest.mark.parametrize("seed", range(100, 105))
def test_fifteen_images_find_the_robots_own_cameras(seed):
    robot, sensors = read_robot(find_robot("rover")), SensorParams(**LENS)
    found = simulated(robot, BOARD, sensors, images=15, seed=seed)
    apart = beside(list(found.infos.values()), true_infos(robot.rig, sensors))
    assert abs(apart.baseline_m) < 0.0005
    for eye in apart.eyes:
        assert abs(eye.focal) < 0.001 and eye.principal_px < 0.5
        assert eye.lens_px < 0.2  # in the corners, where no board reaches: half of the eyes are within 0.08


@pytest.mark.parametrize("scenario", ["paper_a", "paper_b", "paper_c"])
def test_what_is_measured_with_it_is_what_is_measured_with_the_truth(scenario):
    keys = [f"sensors.{key}={value}" for key, value in LENS.items()]
    sizes = [
        np.array([obstacle.size_visible_error for obstacle in report.obstacles])
        for report in (run(scenario, seed=101, overrides=[*keys, f"calibration={by}"]) for by in ("truth", "images:15"))
    ]
    assert np.abs(sizes[0] - sizes[1]).max() < 0.004
