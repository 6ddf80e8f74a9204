"""Closed-loop driving on odometry: turn, go, turn; halt within 1 cm and 1 degree of where odometry says."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import Array, Pose2, wrap_angle
from flysim.sim.simulation import STEP_S, Simulation

V_MAX = 0.5  # [m/s]
W_MAX = 1.2  # [rad/s]
ACCELERATION = 0.3  # [m/s^2] measured: odometry stays within 0.1 mm of the truth on 2 m
TURN_ACCELERATION = 1.5  # [rad/s^2]
AT_PLACE = 0.0005  # [m]
AT_HEADING = math.radians(0.1)
CONTROL_STEPS = 4  # physics steps a command holds: 60 Hz
HALT_S = 0.15  # simulated seconds of standing still before the picture
TRACK_EVERY_S = 0.1  # how often a pose is kept for the record
PATIENCE = 3.0  # a leg may take this many times its undisturbed duration, and 3 s


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

    def __init__(self, simulation: Simulation, budget: float) -> None:
        self.simulation = simulation
        self.v = self.w = 0.0
        self.deadline = simulation.sim_time + budget
        self.track: list[tuple[float, ...]] = []

    def command(self, v: float, w: float) -> None:
        dt = CONTROL_STEPS * STEP_S
        self.v += _limited(v - self.v, ACCELERATION * dt)
        self.w += _limited(w - self.w, TURN_ACCELERATION * dt)
        for _ in range(CONTROL_STEPS):
            self.simulation.step(self.v, self.w)
            hit = self.simulation.bumped()
            if hit is not None:
                raise _Blocked(f"by {hit}")
        if self.simulation.sim_time > self.deadline:
            raise _Blocked("without progress")
        if not self.track or self.simulation.sim_time - self.track[-1][0] >= TRACK_EVERY_S:
            self.keep()

    def keep(self) -> None:
        odometry, true = self.simulation.odometry.pose, self.simulation.true_pose()
        self.track.append((self.simulation.sim_time, odometry.x, odometry.y, odometry.yaw, true.x, true.y, true.yaw))

    def turn_to(self, yaw: float) -> None:
        while abs(error := wrap_angle(yaw - self.simulation.odometry.pose.yaw)) > AT_HEADING or abs(self.w) > 0.02:
            # The speed from which TURN_ACCELERATION still brakes in time, with a little in hand.
            speed = min(W_MAX, math.sqrt(1.4 * TURN_ACCELERATION * abs(error)), 6.0 * abs(error))
            self.command(0.0, math.copysign(speed, error))

    def go_to(self, x: float, y: float, direction: float) -> None:
        while True:
            pose = self.simulation.odometry.pose
            dx, dy = x - pose.x, y - pose.y
            ahead = direction * (dx * math.cos(pose.yaw) + dy * math.sin(pose.yaw))
            if ahead < AT_PLACE and abs(self.v) < 0.01:
                return
            speed = min(V_MAX, math.sqrt(1.4 * ACCELERATION * max(ahead, 0.0)), 4.0 * max(ahead, 0.0))
            aside = dy * math.cos(pose.yaw) - dx * math.sin(pose.yaw)
            # Steer at a point half a metre ahead at least: close to the target the bearing is all noise.
            bearing = math.atan2(aside, max(ahead, 0.5))
            self.command(direction * speed, direction * _limited(2.0 * bearing, 0.5))

    def halt(self) -> None:
        for _ in range(math.ceil(HALT_S / (CONTROL_STEPS * STEP_S))):
            self.command(0.0, 0.0)


def drive_to(simulation: Simulation, target: Pose2) -> Leg:
    """Drives to `target` (odometry frame) and halts there, forwards or in reverse, whichever turns less."""
    start = simulation.odometry.pose
    distance = start.distance(target)
    driver = _Driver(simulation, budget=_patience(distance))
    blocked = None
    try:
        if distance > AT_PLACE:
            bearing = math.atan2(target.y - start.y, target.x - start.x)
            direction = _direction(start.yaw, bearing, target.yaw)
            driver.turn_to(bearing if direction > 0.0 else wrap_angle(bearing + math.pi))
            driver.go_to(target.x, target.y, direction)
        driver.turn_to(target.yaw)
        driver.halt()
    except _Blocked as block:
        blocked = str(block)
        for _ in range(round(HALT_S / STEP_S)):
            simulation.step(0.0, 0.0)
    driver.keep()
    return Leg(blocked=blocked, track=np.array(driver.track))


def _limited(value: float, most: float) -> float:
    return min(max(value, -most), most)


def _direction(yaw: float, bearing: float, goal_yaw: float) -> float:
    """+1 to drive forwards, -1 for reverse."""
    forwards = abs(wrap_angle(bearing - yaw)) + abs(wrap_angle(goal_yaw - bearing))
    back = wrap_angle(bearing + math.pi)
    return 1.0 if forwards <= abs(wrap_angle(back - yaw)) + abs(wrap_angle(goal_yaw - back)) + 1e-6 else -1.0


def _patience(distance: float) -> float:
    drive = distance / V_MAX + 2.0 * V_MAX / ACCELERATION
    turns = 2.0 * (math.pi / W_MAX + 2.0 * W_MAX / TURN_ACCELERATION)
    return 3.0 + PATIENCE * (drive + turns)
