"""The motors and the encoders of a robot's driven wheels; whatever else can turn on it turns freely."""

from __future__ import annotations

from flysim.robots.robot import Robot
from flysim.sim.bullet import pybullet as p
from flysim.sim.encoders import Encoders

WHEEL_TORQUE = 2.0  # [N m] a wheel can give at least: holds a 3 kg robot, slips against a wall
GRAVITY = 9.81  # [m/s^2] a heavier robot's wheels give as much as would lift it by one of them
HEAVIEST = 500.0  # [kg] whose wheels give no more


class Motors:
    """Drives the wheels of one robot in a simulation."""

    def __init__(self, robot: Robot, body: int, joints: dict[str, int], client: int, encoders: Encoders) -> None:
        """Takes over a robot that stands still.

        Args:
            robot: whose wheels they are.
            body: pybullet's number of it.
            joints: pybullet's number of each joint, by its name.
            client: pybullet's physics client.
            encoders: what the robot believes of its wheels.
        """
        self._body, self._client = body, client
        self._radius, self._track = encoders.radius, encoders.track
        self._wheels = [joints[wheel.joint] for wheel in robot.wheels]
        self._left, self._right = (wheel.sense for wheel in robot.wheels)
        mass = sum(link.inertial.mass for link in robot.links if link.inertial is not None)
        self._torques = [max(WHEEL_TORQUE, min(mass, HEAVIEST) * GRAVITY * robot.wheel_radius)] * len(self._wheels)
        for joint in robot.joints:
            if joint.kind == "continuous" and joints[joint.name] not in self._wheels:  # Bullet would brake it
                p.setJointMotorControl2(
                    body, joints[joint.name], p.VELOCITY_CONTROL, force=joint.friction, physicsClientId=client
                )

    def drive(self, v: float, w: float) -> None:
        """Turns the wheels as v [m/s] and yaw rate w [rad/s] ask."""
        half = w * self._track / 2.0
        left, right = (v - half) / self._radius, (v + half) / self._radius
        p.setJointMotorControlArray(
            self._body,
            self._wheels,
            p.VELOCITY_CONTROL,
            targetVelocities=[left * self._left, right * self._right],
            forces=self._torques,
            physicsClientId=self._client,
        )

    def turned(self) -> tuple[float, float]:
        """How far the left and the right wheel have turned forward [rad]."""
        left, right = p.getJointStates(self._body, self._wheels, physicsClientId=self._client)
        return left[0] * self._left, right[0] * self._right
