import math

import numpy as np
import pytest

from flysim.common.catalogue import names
from flysim.errors import FlysimError
from flysim.geometry.frames import Pose2, wrap_angle
from flysim.runs.scenario import read_scenario
from flysim.sim import driving as drive
from flysim.sim.driving import SMOOTH, DriveParams, drive_to
from flysim.sim.simulation import STEP_S, Simulation
from flysim.worlds.sdf.reader import read_world
from flysim.worlds.shapes import Box, Cylinder


def deviation(asked, got):
    """Distance [m] and turn [degrees] between two poses."""
    return asked.distance(got), math.degrees(abs(wrap_angle(asked.yaw - got.yaw)))


@pytest.fixture
def commands(monkeypatch):
    """Every (v, w) that is sent to the wheels."""
    sent = []
    advance = Simulation.advance
    monkeypatch.setattr(
        Simulation, "advance", lambda self, v, w, steps: (sent.append((v, w)), advance(self, v, w, steps))[1]
    )
    return sent


def test_two_metres_straight_by_odometry_and_in_truth(made):
    with made.simulation() as simulation:
        assert drive_to(simulation, Pose2(2.0, 0.0, 0.0)).blocked is None
        odometry, true = simulation.odometry.pose, simulation.true_pose()
    assert odometry.x == pytest.approx(2.0, abs=1e-3)
    assert odometry.distance(true) < 2e-3
    assert abs(true.y) < 2e-3


def test_forty_centimetres_a_second_for_five_seconds_are_two_metres(made):
    with made.simulation() as simulation:
        for k in range(320):  # up to speed at 0.3 m/s^2
            simulation.step(min(0.4, 0.3 * k * STEP_S), 0.0)
        before, odometry_before = simulation.true_pose().x, simulation.odometry.pose.x
        for _ in range(round(5.0 / STEP_S)):
            simulation.step(0.4, 0.0)
        assert simulation.true_pose().x - before == pytest.approx(2.0, abs=2e-3)
        assert simulation.odometry.pose.x - odometry_before == pytest.approx(2.0, abs=2e-3)


def test_a_full_turn_in_four_quarters(made):
    with made.simulation() as simulation:
        turned, last = 0.0, simulation.true_pose().yaw
        for quarter in (90, 180, -90, 0):
            drive_to(simulation, Pose2(0.0, 0.0, math.radians(quarter)))
            yaw = simulation.true_pose().yaw
            turned, last = turned + wrap_angle(yaw - last), yaw
        odometry, true = simulation.odometry.pose, simulation.true_pose()
    assert math.degrees(turned) == pytest.approx(360.0, abs=0.2)
    assert math.degrees(wrap_angle(odometry.yaw - true.yaw)) == pytest.approx(0.0, abs=0.1)
    assert true.distance(Pose2(0.0, 0.0, 0.0)) < 1e-3


@pytest.mark.parametrize("name", names("runs"))
def test_every_stop_of_a_shipped_path_is_met(name):
    plan = read_scenario(name)
    with Simulation(read_world(plan.world_path), read_scenario_robot(plan), plan.stops[0].pose) as simulation:
        for index, stop in enumerate(plan.stops):
            assert drive_to(simulation, stop.pose).blocked is None
            place, turn = deviation(stop.pose, simulation.odometry.pose)
            assert place < 0.002, index
            assert turn < 0.2, index
            place, turn = deviation(stop.pose, simulation.true_pose())  # with the odometry's drift over 40-115 s
            assert place < 0.008, index
            assert turn < 0.5, index


def read_scenario_robot(plan):
    from flysim.robots.robot import read_robot

    return read_robot(plan.robot_path)


def test_speed_and_acceleration_are_bounded_and_the_robot_stands_at_the_end(made, commands):
    with made.simulation() as simulation:
        commands.clear()
        places = [simulation.true_pose()]
        advance = simulation.advance

        def watched(v, w, steps):
            hit = advance(v, w, steps)
            places.append(simulation.true_pose())
            return hit

        simulation.advance = watched
        drive_to(simulation, Pose2(1.2, 0.6, math.radians(-120)))
    v, w = np.array(commands).T
    assert np.abs(v).max() <= SMOOTH.v_max
    assert np.abs(w).max() <= SMOOTH.w_max
    held = drive.CONTROL_STEPS
    assert np.abs(np.diff(v[::held])).max() <= SMOOTH.acceleration * held * STEP_S + 1e-12
    assert np.abs(np.diff(w[::held])).max() <= SMOOTH.turn_acceleration * held * STEP_S + 1e-12
    assert np.abs(v).max() > 0.3  # it did drive
    xy = np.array([(p.x, p.y) for p in places])
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=1) / STEP_S
    assert speed.max() < SMOOTH.v_max * 1.02
    assert speed[-10:].max() < 1e-3
    tenth = round(0.1 / STEP_S)  # what the body does, over a tenth of a second: springs and slip average out
    smooth = np.convolve(speed, np.ones(tenth) / tenth, "valid")
    assert np.abs(smooth[tenth:] - smooth[:-tenth]).max() / 0.1 < SMOOTH.acceleration * 1.5


@pytest.mark.parametrize(
    ("target", "forwards"),
    [
        ((1.0, 0.0, 0), True),
        ((-1.0, 0.0, 0), False),  # behind, facing as now
        ((-1.0, 0.0, 180), True),  # behind, facing away: turn once and drive
        ((-1.0, 0.3, 10), False),
        ((0.0, 1.0, 90), True),
        ((0.0, 1.0, -90), False),
    ],
)
def test_it_drives_in_reverse_where_that_turns_less(made, commands, target, forwards):
    x, y, yaw_deg = target
    goal = Pose2(x, y, math.radians(yaw_deg))
    with made.simulation() as simulation:
        commands.clear()
        assert drive_to(simulation, goal).blocked is None
        place, turn = deviation(goal, simulation.odometry.pose)
    v = np.array(commands)[:, 0]
    assert (v.max() > 0.1) == forwards
    assert (v.min() < -0.1) == (not forwards)
    assert place < 0.002
    assert turn < 0.2


def test_a_stop_where_it_stands_is_no_drive(made):
    with made.simulation() as simulation:
        leg = drive_to(simulation, simulation.odometry.pose)
        assert simulation.true_pose().distance(Pose2(0.0, 0.0, 0.0)) < 1e-4
        assert simulation.sim_time < 0.5
    assert leg.blocked is None
    assert leg.track.shape[1] == 7


def test_the_track_holds_odometry_and_truth_in_order(made):
    with made.simulation() as simulation:
        leg = drive_to(simulation, Pose2(0.6, 0.2, 0.3))
        odometry, true = simulation.odometry.pose, simulation.true_pose()
        assert leg.track[-1] == pytest.approx(
            (simulation.sim_time, odometry.x, odometry.y, odometry.yaw, true.x, true.y, true.yaw)
        )
    assert (np.diff(leg.track[:, 0]) > 0.0).all()
    assert np.diff(leg.track[:, 0]).max() <= 0.15
    assert np.abs(leg.track[:, 1:3] - leg.track[:, 4:6]).max() < 2e-3


@pytest.mark.parametrize(
    ("obstacle", "pose"),
    [
        (Box((0.1, 4.0, 1.0)), (1.0, 0.0, 0.5)),
        (Box((0.1, 2.0, 0.1)), (1.0, 0.0, 0.05)),  # a kerb 10 cm high
        (Cylinder(0.03, 1.0), (1.0, 0.05, 0.5)),
    ],
)
def test_what_stands_in_the_way_ends_the_drive_there(made, obstacle, pose):
    with made.simulation(made.link("thing", obstacle, (*pose, 0, 0, 0))) as simulation:
        leg = drive_to(simulation, Pose2(2.0, 0.0, 0.0))
        true = simulation.true_pose()
        before = simulation.true_pose().x
        for _ in range(60):
            simulation.step(0.0, 0.0)
        assert abs(simulation.true_pose().x - before) < 1e-3  # it stands
    assert leg.blocked == "by thing"
    assert 0.6 < true.x < 0.95
    assert leg.track[-1, 4] == pytest.approx(true.x)


def test_a_light_box_that_could_be_pushed_is_a_contact_too(made):
    box = made.link("carton", Box((0.2, 0.2, 0.2)), (0.8, 0, 0.1, 0, 0, 0), static=False, mass=0.2)
    with made.simulation(box) as simulation:
        assert drive_to(simulation, Pose2(2.0, 0.0, 0.0)).blocked == "by carton"
        assert simulation.T_world_links()[1, 0, 3] < 0.95


def test_a_bump_in_reverse_and_one_while_turning_are_noticed(made):
    behind = made.link("behind", Box((0.1, 1.0, 0.4)), (-0.6, 0, 0.2, 0, 0, 0))
    with made.simulation(behind) as simulation:
        assert drive_to(simulation, Pose2(-1.0, 0.0, 0.0)).blocked == "by behind"
    beside = made.link("beside", Box((0.04, 0.04, 0.4)), (-0.05, 0.175, 0.2, 0, 0, 0))
    with made.simulation(beside) as simulation:
        assert simulation.occupied(Pose2(0.0, 0.0, 0.0)) == "beside"
        assert drive_to(simulation, Pose2(0.0, 0.0, 2.0)).blocked == "by beside"


def test_a_sill_of_one_centimetre_is_driven_over(made):
    sill = made.link("sill", Box((0.02, 1.0, 0.008)), (0.5, 0, 0.004, 0, 0, 0))
    with made.simulation(sill) as simulation:
        assert drive_to(simulation, Pose2(1.0, 0.0, 0.0)).blocked is None
        assert simulation.true_pose().x == pytest.approx(1.0, abs=0.02)


def test_a_robot_that_gets_nowhere_gives_up(made, monkeypatch):
    monkeypatch.setattr(drive, "_patience", lambda distance, params: 2.0)
    for figure in ("WHEEL_TORQUE", "GRAVITY"):
        monkeypatch.setattr(f"flysim.sim.motors.{figure}", 0.0)
    with made.simulation() as simulation:
        leg = drive_to(simulation, Pose2(2.0, 0.0, 0.0))
        assert 2.0 <= simulation.sim_time < 2.5
    assert leg.blocked == "without progress"


def test_patience_exceeds_what_an_undisturbed_leg_takes(made):
    for target in (Pose2(2.0, 0.0, 0.0), Pose2(0.02, 0.02, math.radians(-135)), Pose2(-0.3, 0.4, 3.0)):
        with made.simulation() as simulation:
            drive_to(simulation, target)
            assert simulation.sim_time < drive._patience(math.hypot(target.x, target.y), SMOOTH) / 2.0


def track(made, *links):
    with made.simulation(*links) as simulation:
        legs = [drive_to(simulation, pose).track for pose in (Pose2(0.5, 0.1, 0.2), Pose2(0.3, -0.2, -1.0))]
        return np.concatenate(legs).tobytes(), simulation.T_world_base().tobytes()


def test_the_same_drive_twice_has_the_same_bytes(made):
    ball = made.link("box", Box((0.2, 0.2, 0.2)), (2.0, 0, 0.5, 0.3, 0.2, 0), static=False)
    assert track(made, ball) == track(made, ball)


def test_two_simulations_in_turns_do_not_disturb_each_other(made):
    alone = track(made)
    targets = (Pose2(0.5, 0.1, 0.2), Pose2(0.3, -0.2, -1.0))
    with made.simulation() as one, made.simulation(made.link("box", Box((1, 1, 1)), (3, 0, 0.5, 0, 0, 0))) as two:
        tracks = []
        advance = one.advance

        def in_turns(v, w, steps):
            two.step(0.1, -0.3)
            return advance(v, w, steps)

        one.advance = in_turns
        tracks = [drive_to(one, pose).track for pose in targets]
        assert (np.concatenate(tracks).tobytes(), one.T_world_base().tobytes()) == alone
        assert two.sim_time > 1.0


def test_a_drive_is_as_fast_and_as_careful_as_it_is_told(made, commands):
    times = []
    for params in (SMOOTH, DriveParams(v_max=0.2), DriveParams(v_max=1.0, acceleration=0.8, halt_s=0.0)):
        commands.clear()
        with made.simulation() as simulation:
            assert drive_to(simulation, Pose2(1.5, 0.0, 0.0), params).blocked is None
            times.append(simulation.sim_time)
            assert simulation.odometry.pose.x == pytest.approx(1.5, abs=1e-3)
        v = np.array([v for v, _ in commands])
        assert v.max() <= params.v_max
        assert (
            np.abs(np.diff(v[:: drive.CONTROL_STEPS])).max()
            <= params.acceleration * drive.CONTROL_STEPS * STEP_S + 1e-12
        )
    assert times[1] > times[0] > times[2]


@pytest.mark.parametrize(
    ("given", "complaint"),
    [({"v_max": 0.0}, "v_max must be"), ({"patience": 0.5}, "patience must be"), ({"halt_s": math.nan}, "halt_s")],
)
def test_a_drive_that_cannot_be_is_refused(given, complaint):
    with pytest.raises(ValueError, match=complaint):
        DriveParams(**given)
    (name, value), *_ = given.items()
    with pytest.raises(FlysimError, match=f"drive: {complaint}"):
        read_scenario("paper_a", [f"drive.{name}={value}"])
