import errno
import math
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from flysim.common.catalogue import find_robot
from flysim.errors import FlysimError, RobotError, WorldError
from flysim.geometry.frames import Pose2, pose6
from flysim.robots.robot import read_robot
from flysim.sim import simulation as room
from flysim.sim.simulation import Simulation
from flysim.worlds.shapes import Box, Cylinder, Sphere
from flysim.worlds.surface.texture import write_png


def test_the_robot_is_set_down_where_the_path_starts(made):
    with made.simulation(start=(1.2, -0.7, 130)) as simulation:
        true, odometry = simulation.true_pose(), simulation.odometry.pose
        assert simulation.sim_time == 0.0
        assert odometry == true  # the odometry frame starts at the true start pose
    assert true.distance(Pose2(1.2, -0.7, 0.0)) < 1e-3
    assert math.degrees(true.yaw) == pytest.approx(130.0, abs=0.1)


def test_links_of_the_robot_are_where_its_urdf_has_them(made):
    with made.simulation(start=(0.5, 0.2, 90)) as simulation:
        base = simulation.T_world_base()
        for name in ("base_link", "caster", "camera_left", "left_wheel"):
            expected = base @ made.rover.T_base_links[name]
            assert simulation.T_world_robot_link(name)[:3, 3] == pytest.approx(expected[:3, 3], abs=1e-5)
        eye = simulation.T_world_robot_link("camera_left")
        assert (base @ made.rover.T_base_left)[:3, 3] == pytest.approx(eye[:3, 3], abs=1e-5)


@pytest.mark.parametrize(
    ("x", "y", "model"),
    [
        (2.0, 0.0, "box"),
        (1.5 - 0.19, 0.0, "box"),  # the robot's circle has a radius of 0.194 m
        (1.5 - 0.20, 0.0, None),
        (2.0, 2.0, "post"),
        (0.0, 2.0, "step"),  # 10 cm high
        (0.0, -2.0, None),  # a mat of 1 cm: it drives over that
        (-2.0, 0.0, None),  # a lamp above it
        (0.0, 0.0, None),
    ],
)
def test_what_stands_where_the_robot_would(made, x, y, model):
    links = (
        made.link("box", Box((1.0, 1.0, 0.5)), (2, 0, 0.25, 0, 0, 0)),
        made.link("post", Cylinder(0.03, 1.0), (2, 2, 0.5, 0, 0, 0)),
        made.link("step", Box((0.5, 0.5, 0.1)), (0, 2, 0.05, 0, 0, 0)),
        made.link("mat", Box((0.8, 0.8, 0.01)), (0, -2, 0.005, 0, 0, 0)),
        made.link("lamp", Sphere(0.2), (-2, 0, 0.8, 0, 0, 0)),
    )
    with made.simulation(*links) as simulation:
        assert simulation.occupied(Pose2(x, y, 0.3)) == model
        assert simulation.occupied(Pose2(x, y, 0.3)) == model  # asking leaves nothing behind


def test_a_world_without_a_floor_is_refused(made):
    with pytest.raises(
        WorldError, match=r"made-up.sdf: nothing carries the robot at \(1, 2\): it falls. Give the world"
    ):
        made.simulation(made.link("box", Box((1, 1, 1)), (5, 0, 0.5, 0, 0, 0)), floor=False, start=(1, 2, 0))


def test_a_robot_that_no_floor_carries_is_its_own_fault(made, tmp_path):
    path = tmp_path / "robot.urdf"
    text = find_robot("rover").read_text(encoding="utf-8")
    path.write_text(text.replace('<mass value="2.16"/>', '<mass value="99999"/>'), encoding="utf-8")
    with pytest.raises(RobotError, match=r"robot.urdf: the robot sinks into the floor that it stands on: look for"):
        Simulation(made.world(), read_robot(path), Pose2(0.0, 0.0, 0.0))


def test_a_floor_that_is_a_slab_carries(made):
    slab = made.link("slab", Box((4.0, 4.0, 0.2)), (0, 0, -0.1, 0, 0, 0), structure=True)
    with made.simulation(slab, floor=False) as simulation:
        assert abs(simulation.T_world_base()[2, 3]) < 1e-3


def test_poses_of_links_follow_what_moves_and_keep_what_does_not(made):
    box = made.link("box", Box((0.2, 0.2, 0.2)), (2, 0, 1, 0, 0, 0.3))
    ball = made.link("ball", Sphere(0.1), (2, 1, 1, 0, 0, 0), static=False)
    with made.simulation(box, ball) as simulation:
        poses = simulation.T_world_links()
        poses[1] = 0.0  # a copy
        again = simulation.T_world_links()
    assert np.array_equal(again[1], pose6(2, 0, 1, 0, 0, 0.3))
    assert again[2, 2, 3] < 0.5


def test_the_bounds_of_a_world_leave_its_planes_out(made):
    box = made.link("box", Box((0.2, 0.4, 0.6)), (2, 0, 0.3, 0, 0, math.pi / 2))
    with made.simulation(box) as simulation:
        assert simulation.bounds() == pytest.approx(np.array([[1.8, -0.1, 0.0], [2.2, 0.1, 0.6]]))
    with made.simulation() as simulation:
        assert simulation.bounds().shape == (2, 3)


def test_nothing_is_left_of_a_simulation(made, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    simulation = made.simulation(made.link("box", Box((1, 1, 1)), (3, 0, 0.5, 0, 0, 0)), textured=True)
    assert [path.name[:7] for path in tmp_path.iterdir()] == ["flysim-"]
    simulation.close()
    simulation.close()
    with pytest.raises(WorldError):
        made.simulation(floor=False)
    with pytest.raises(KeyboardInterrupt), made.simulation():
        raise KeyboardInterrupt
    assert not list(tmp_path.iterdir())


def test_a_robot_that_went_away_after_it_was_read(made, tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(find_robot("rover").read_text(encoding="utf-8"), encoding="utf-8")
    robot = read_robot(path)
    path.write_text("<robot", encoding="utf-8")
    with Simulation(made.world(), robot, Pose2(0.0, 0.0, 0.0)) as simulation:
        assert simulation.true_pose().distance(Pose2(0.0, 0.0, 0.0)) < 1e-3


def test_what_pybullet_refuses_and_what_breaks_down_is_the_robots_fault(made, monkeypatch):
    from flysim.sim.bullet import pybullet

    def refuse(*_args, **_more):
        raise pybullet.error("Cannot load URDF file.")

    with monkeypatch.context() as patch:
        patch.setattr(pybullet, "loadURDF", refuse)
        with pytest.raises(RobotError, match=r"robot.urdf: pybullet cannot load it: Cannot load URDF file"):
            made.simulation()
    monkeypatch.setattr(Simulation, "T_world_base", lambda _self: np.full((4, 4), np.nan))
    with pytest.raises(RobotError, match=r"robot.urdf: the robot's motion breaks down before it drives"):
        made.simulation()


def test_a_scratch_folder_of_too_long_a_path_is_one_line(made, monkeypatch, tmp_path):
    place = tmp_path.joinpath(*["y" * 200] * 5)
    place.mkdir(parents=True)
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    box = made.link("box", Box((1, 1, 1)), (3, 0, 0.5, 0, 0, 0))
    with pytest.raises(FlysimError, match=r"^the temporary folder .*too long a path.*set TMPDIR to another folder.$"):
        made.simulation(box, textured=True)
    assert not list(place.iterdir())


def test_files_that_pybullet_has_loaded_are_not_kept(made, tmp_path):
    """Of each such world a megabyte stayed, under the name of a file that is gone."""
    texture = tmp_path / "t.png"
    write_png(np.zeros((512, 512, 3), np.uint8), texture)
    box = made.link("box", Box((1, 1, 1)), (3, 0, 0.5, 0, 0, 0), texture=texture)

    def held():
        made.simulation(box, textured=True).close()
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    for _ in range(4):
        before = held()
    for _ in range(16):
        after = held()
    assert after < before + 6.0


def test_a_full_disk_under_the_scratch_files_is_one_line(made, monkeypatch):
    def full(*_args, **_more):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    box = made.link("box", Box((1, 1, 1)), (3, 0, 0.5, 0, 0, 0))
    with monkeypatch.context() as patch:
        patch.setattr("flysim.sim.bodies.write_obj", full)
        with pytest.raises(FlysimError, match=r"No space left on device. Free some space there, or set TMPDIR"):
            made.simulation(box, textured=True)
    monkeypatch.setattr(room, "Scratch", full)
    with pytest.raises(FlysimError, match=r"No space left on device. Free some space there, or set TMPDIR"):
        made.simulation(box)


def test_steps_at_once_move_as_single_steps_do(made):
    """Bullet divides the time of a call: for powers of two the parts are exactly a step's."""
    poses = []
    for at_once in (True, False):
        with made.simulation() as simulation:
            for k in range(12):
                v, w = 0.3, 0.8 * math.sin(k / 3.0)
                if at_once:
                    simulation.advance(v, w, 8)
                else:
                    for _ in range(8):
                        simulation.step(v, w)
                poses.append(simulation.T_world_base())
            assert simulation.sim_time == pytest.approx(12 * 8 / 240)
    np.testing.assert_array_equal(poses[:12], poses[12:])
