"""Closed-loop driving on odometry: turn, go, turn; halt within 1 cm and 1 degree of where odometry says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flysim.common.ranges import ranged
from flysim.geometry.frames import Array, Pose2, wrap_angle
from flysim.sim.simulation import STEP_S, Simulation
from flysim.sim.wheels import WheelLimits, Wheels, limited

CONTROL_STEPS = 4  # physics steps a command holds: 60 Hz
TRACK_EVERY_S = 0.1  # how often a pose is kept for the record
BRAKE = 1.4  # of twice the acceleration that a speed is chosen for: it brakes in time, with a little in hand


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveParams:
    """How a scripted path is driven. Refuses nonsense with a ValueError that names the figure.

    Attributes:
        v_max: largest speed [m/s].
        w_max: largest yaw rate [rad/s].
        acceleration: of the speed [m/s^2]; measured: with 0.3 odometry stays within 0.1 mm of the truth on 2 m.
        turn_acceleration: of the yaw rate [rad/s^2].
        at_place: it is where it was sent within this, by odometry [m].
        at_heading_deg: and looks where it was told to [degrees].
        halt_s: it stands so long before the picture [s].
        patience: a leg may take so many times its undisturbed duration, and 3 s, before the way counts as blocked.
        look_way: a robot that finds its way by what it sees looks where it has not been before at least once on such a
            way [m].
        look_turn_deg: and at least once in such a turn [degrees].
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 (how a scenario file reads this record)

    v_max: float = 0.5
    w_max: float = 1.2
    acceleration: float = 0.3
    turn_acceleration: float = 1.5
    at_place: float = 0.0005
    at_heading_deg: float = 0.1
    halt_s: float = 0.15
    patience: float = 3.0
    look_way: float = 1.2
    look_turn_deg: float = 35.0

    def __post_init__(self) -> None:
        ranged(
            self,
            v_max=(0.01, 10.0, "m/s"),
            w_max=(0.01, 10.0, "rad/s"),
            acceleration=(0.01, 10.0, "m/s^2"),
            turn_acceleration=(0.01, 100.0, "rad/s^2"),
            at_place=(0.0002, 0.1, "m"),
            at_heading_deg=(0.02, 10.0, "degrees"),
            halt_s=(0.0, 60.0, "s"),
            patience=(1.0, 1000.0, "(a factor)"),
            look_way=(0.1, 1000.0, "m"),
            look_turn_deg=(10.0, 360.0, "degrees"),
        )


SMOOTH = DriveParams()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Leg:
    """A finished or blocked drive from one stop to the next.

    Attributes:
        blocked: None, or what stopped it: "by box_2", a model's name, or "without progress".
        track: `[n, 7]` sim_time, odometry x, y, yaw, true x, y, yaw.
    """

    blocked: str | None
    track: Array


class _Blocked(Exception):
    pass


class _Driver:
    """One leg's commands: bounded acceleration, contact watched at every physics step."""

    def __init__(
        self, simulation: Simulation, params: DriveParams, distance: float, watch: Callable[[], None] | None
    ) -> None:
        self.simulation, self.params, self.watch = simulation, params, watch
        limits = WheelLimits(acceleration=params.acceleration, turn_acceleration=params.turn_acceleration)
        self.wheels = Wheels(simulation, limits)
        self.deadline = simulation.sim_time + _patience(distance, params)
        self.track: list[tuple[float, ...]] = []

    def command(self, v: float, w: float) -> None:
        hit = self.wheels.towards(v, w, chunk=1, chunks=CONTROL_STEPS)
        if hit is not None:
            raise _Blocked(f"by {hit}")
        if self.simulation.sim_time > self.deadline:
            raise _Blocked("without progress")
        if not self.track or self.simulation.sim_time - self.track[-1][0] >= TRACK_EVERY_S:
            self.keep()
        if self.watch is not None:
            self.watch()

    def keep(self) -> None:
        odometry, true = self.simulation.odometry.pose, self.simulation.true_pose()
        self.track.append((self.simulation.sim_time, odometry.x, odometry.y, odometry.yaw, true.x, true.y, true.yaw))

    def turn_to(self, yaw: float) -> None:
        p = self.params
        close = max(math.radians(p.at_heading_deg), 1.01 * self.simulation.encoders.turn_step)
        while abs(error := wrap_angle(yaw - self.simulation.odometry.pose.yaw)) > close or abs(self.wheels.w) > 0.02:
            speed = min(p.w_max, math.sqrt(BRAKE * p.turn_acceleration * abs(error)), 6.0 * abs(error))
            self.command(0.0, math.copysign(speed, error))

    def go_to(self, x: float, y: float, direction: float) -> None:
        p = self.params
        while True:
            pose = self.simulation.odometry.pose
            dx, dy = x - pose.x, y - pose.y
            ahead = direction * (dx * math.cos(pose.yaw) + dy * math.sin(pose.yaw))
            if ahead < p.at_place and abs(self.wheels.v) < 0.01:
                return
            speed = min(p.v_max, math.sqrt(BRAKE * p.acceleration * max(ahead, 0.0)), 4.0 * max(ahead, 0.0))
            aside = dy * math.cos(pose.yaw) - dx * math.sin(pose.yaw)
            # Steer at a point half a metre ahead at least: close to the target the bearing is all noise.
            bearing = math.atan2(aside, max(ahead, 0.5))
            self.command(direction * speed, direction * limited(2.0 * bearing, 0.5))

    def halt(self) -> None:
        for _ in range(math.ceil(self.params.halt_s / (CONTROL_STEPS * STEP_S))):
            self.command(0.0, 0.0)


def drive_to(
    simulation: Simulation, target: Pose2, params: DriveParams = SMOOTH, watch: Callable[[], None] | None = None
) -> Leg:
    """Drives to `target` (odometry frame) and halts there, forwards or in reverse, whichever turns less.

    Args:
        simulation: whose robot.
        target: where to.
        params: how it drives.
        watch: called after every command, 60 times a simulated second: what looks on the way.
    """
    start = simulation.odometry.pose
    distance = start.distance(target)
    driver = _Driver(simulation, params, distance, watch)
    blocked = None
    try:
        if distance > params.at_place:
            bearing = math.atan2(target.y - start.y, target.x - start.x)
            ahead = direction(start.yaw, bearing, target.yaw)
            driver.turn_to(bearing if ahead > 0.0 else wrap_angle(bearing + math.pi))
            driver.go_to(target.x, target.y, ahead)
        driver.turn_to(target.yaw)
        driver.halt()
    except _Blocked as block:
        blocked = str(block)
        for _ in range(round(params.halt_s / STEP_S)):
            simulation.step(0.0, 0.0)
    driver.keep()
    return Leg(blocked=blocked, track=np.array(driver.track))


def direction(yaw: float, bearing: float, goal_yaw: float) -> float:
    """+1 to drive forwards, -1 for reverse."""
    forwards = abs(wrap_angle(bearing - yaw)) + abs(wrap_angle(goal_yaw - bearing))
    back = wrap_angle(bearing + math.pi)
    return 1.0 if forwards <= abs(wrap_angle(back - yaw)) + abs(wrap_angle(goal_yaw - back)) + 1e-6 else -1.0


def _patience(distance: float, p: DriveParams) -> float:
    drive = distance / p.v_max + 2.0 * p.v_max / p.acceleration
    turns = 2.0 * (math.pi / p.w_max + 2.0 * p.w_max / p.turn_acceleration)
    return 3.0 + p.patience * (drive + turns)
