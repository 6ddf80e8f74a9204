"""What all tests share; what takes longest comes first, for two workers side by side."""

import os
from pathlib import Path

import pytest
from hypothesis import settings


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: item.path.name != "test_wheel.py")


# Workers of xdist are told how wide the terminal is; what is tested is told by each test.
os.environ.pop("COLUMNS", None)


@pytest.fixture
def short(tmp_path):
    """The path of a scenario of two stops, small images and few flies: a drive of a second."""
    robot = (Path(__file__).resolve().parents[1] / "robots/rover/robot.urdf").read_text(encoding="utf-8")
    for large, small in (("<width>640<", "<width>160<"), ("<height>480<", "<height>120<")):
        robot = robot.replace(large, small)
    folder = tmp_path / "scenarios"
    folder.mkdir()
    (folder / "small.urdf").write_text(robot, encoding="utf-8")
    path = folder / "short.toml"
    path.write_text(
        'world = "paper"\nrobot = "small.urdf"\nstops = [{ x = 1.0, y = 0.0 }, { x = 1.1, y = 0.0, yaw_deg = 5 }]\n'
        "[flies]\npopulation = 200\nmax_iterations = 6\n",
        encoding="utf-8",
    )
    return path


# A shared machine makes single examples slow; the suite has its own time limit.
# The same examples each time: what a gate says does not hang on luck. `FLYSIM_EXPLORE=1 pytest ...` looks for new ones.
settings.register_profile("patient", deadline=None, derandomize="FLYSIM_EXPLORE" not in os.environ)
settings.load_profile("patient")
