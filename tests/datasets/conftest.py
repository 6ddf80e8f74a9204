"""One short drive with a disturbed rig, and the data sets that each format makes of it."""

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from flysim.datasets.layout import FORMATS
from flysim.datasets.write import SetWriter
from flysim.products.frame import FrameSequence
from flysim.runs.export import SETTINGS, staging
from flysim.runs.run import errand
from flysim.runs.scenario import Scenario, read_scenario
from flysim.sources.filmed import FilmedDrive
from flysim.sources.simulated import simulated
from flysim.truth.truth import Truth

ROOT = Path(__file__).resolve().parents[2]
SEED = 3


@dataclass(frozen=True, kw_only=True)
class Taken:
    plan: Scenario
    sequence: FrameSequence
    truth: Truth
    rig: object
    true_rig: object
    folders: dict[str, Path]

    def copy(self, name, folder):
        """A data set that a test may damage."""
        shutil.copytree(self.folders[name], folder)
        return folder


def scenario(folder):
    robot = (ROOT / "robots/rover/robot.urdf").read_text(encoding="utf-8")
    for large, small in (("<width>640<", "<width>160<"), ("<height>480<", "<height>120<")):
        robot = robot.replace(large, small)
    (folder / "small.urdf").write_text(robot, encoding="utf-8")
    path = folder / "short.toml"
    path.write_text(
        'world = "paper"\nrobot = "small.urdf"\nstops = [{ x = 0.9, y = 0.0 }, { x = 1.0, y = 0.0, yaw_deg = 5 }]\n'
        "[flies]\npopulation = 400\nmax_iterations = 8\n[calibration]\nrow_shift_px = 0.5\nbaseline_error = 0.01\n",
        encoding="utf-8",
    )
    return path


@pytest.fixture(scope="session")
def taken(tmp_path_factory):
    folder = tmp_path_factory.mktemp("datasets")
    plan = read_scenario(str(scenario(folder)))
    with simulated(errand(plan, SEED), "tiny", kind=FilmedDrive) as drive:
        frames = []
        drive.stops(lambda frame, stop: frames.append(frame))
        sequence, truth, rig, true_rig, given = (
            drive.sequence(), drive.truth(), drive.rig, drive.true_rig, staging(plan, drive)
        )  # fmt: skip
        disturbed = drive.disturbed
    kept, folders = plan.model_dump(mode="json"), {}
    for name in FORMATS.builtin:
        folders[name] = folder / name
        folders[name].mkdir()
        writer = SetWriter(folders[name], name, given)
        for frame, stop in zip(frames, truth.stops, strict=True):
            writer.add(frame, stop)
        writer.finish(
            disturbed, name=plan.name, seed=SEED, renderer="tiny", planned=len(frames),
            settings={table: kept[table] for table in SETTINGS},
        )  # fmt: skip
    return Taken(plan=plan, sequence=sequence, truth=truth, rig=rig, true_rig=true_rig, folders=folders)
