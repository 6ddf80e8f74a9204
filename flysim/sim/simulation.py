"""The owner of one pybullet world with one robot in it: it steps, and tells what is so."""

from __future__ import annotations

import itertools
import os
import tempfile
from pathlib import Path
from types import TracebackType

import numpy as np

from flysim.common.one_of_a_kind import OneOfAKind
from flysim.common.scratch import Scratch
from flysim.errors import FlysimError, RobotError, WorldError
from flysim.geometry.frames import Array, Pose2, inverse, quaternion_xyzw, transform, yaw_of
from flysim.robots.robot import Robot
from flysim.sim.bodies import build_link, hide
from flysim.sim.bullet import pybullet as p
from flysim.sim.encoders import Encoders
from flysim.sim.motors import Motors
from flysim.sim.odometry import Odometry
from flysim.sim.rest import falling
from flysim.sim.urdf_write import number_of, write_urdf
from flysim.worlds.ground import refuse_weightless
from flysim.worlds.model import World
from flysim.worlds.sdf.elements import shown_path
from flysim.worlds.shapes import Plane

STEP_S = 1.0 / 240.0  # pybullet's own default; its contact solver is tuned to it
SETTLE_CHUNK = 8  # physics steps at once meanwhile
SETTLE_S = 0.5  # simulated seconds in which the robot comes to rest on its wheels
SETTLE_MOST_S = 10.0  # and that bodies of the world which still fall then are given
GROUND_CLEARANCE = 0.02  # [m] what is lower than this blocks no robot
MAX_PATH = 900  # bytes of the folder with what pybullet loads; it has 1024 for a path
BUMP_NORMAL_Z = 0.7  # a contact whose normal is flatter than this is a bump, not a floor
FALLEN = 0.1  # [m] lower than this below z = 0, there is no floor under the robot


class Simulation(OneOfAKind):
    """A context manager round one pybullet client; nothing outside of it touches pybullet's state."""

    def __init__(
        self, world: World, robot: Robot, start: Pose2, *, textured: bool = False, encoders: Encoders | None = None
    ) -> None:
        """Builds the world, sets the robot down at `start` and lets it settle.

        Args:
            world: what stands there.
            robot: who drives.
            start: its pose in the world frame; the odometry frame starts there as well.
            textured: build visual shapes, which only TinyRenderer needs.
            encoders: what tells how far the wheels turned; None: without a flaw.

        Raises:
            FlysimError: pybullet refuses the world or the robot, nothing carries the robot, or the disk is full.
        """
        self.world, self.robot = world, robot
        self.encoders, self._settled = encoders or Encoders(), False
        self.client, self._at_once = -1, 0  # the second: physics steps that a call makes
        refuse_weightless(world)
        try:
            self._scratch = Scratch()
        except OSError as error:
            raise _no_scratch(error) from error
        try:
            self.client = p.connect(p.DIRECT)
            p.setGravity(0, 0, world.gravity, physicsClientId=self.client)
            # Bullet would keep every mesh and texture for as long as the process lives, and no name comes twice.
            p.setPhysicsEngineParameter(
                deterministicOverlappingPairs=1, enableFileCaching=0, physicsClientId=self.client
            )
            scratch = Path(self._scratch.name)
            if len(os.fsencode(scratch)) > MAX_PATH:
                raise FlysimError(
                    f"the temporary folder {shown_path(scratch)} has too long a path for pybullet, which takes "
                    f"{MAX_PATH} bytes: set TMPDIR to another folder."
                )
            meshes = (scratch / f"mesh_{i}.obj" for i in itertools.count())
            self.bodies = [build_link(link, self.client, meshes, textured=textured) for link in world.links]
            self.link_of_body = {body: i for i, bodies in enumerate(self.bodies) for body in bodies}
            self._dynamic = [i for i, link in enumerate(world.links) if not link.static]
            self._static_poses = np.array([link.T_world_link for link in world.links]).reshape(-1, 4, 4)
            self._load_robot(start, scratch / "robot.urdf", textured=textured)
        except BaseException as error:
            self.close()
            if isinstance(error, OSError):
                raise _no_scratch(error) from error
            raise

    def _load_robot(self, start: Pose2, path: Path, *, textured: bool) -> None:
        """Sets the robot down, by a URDF of flysim's own at `path`."""
        write_urdf(self.robot.links, self.robot.joints, path, textured=textured)
        try:
            self.body = p.loadURDF(
                str(path),
                basePosition=[start.x, start.y, 0.0],
                baseOrientation=quaternion_xyzw(start.matrix[:3, :3]).tolist(),
                flags=p.URDF_USE_INERTIA_FROM_FILE | p.URDF_USE_IMPLICIT_CYLINDER,
                physicsClientId=self.client,
            )
        except p.error as error:
            raise RobotError(f"{shown_path(self.robot.path)}: pybullet cannot load it: {error}.") from error
        self.link_index = {self.robot.body: -1}
        joints = {}
        for j in range(p.getNumJoints(self.body, physicsClientId=self.client)):
            joint = self.robot.joints[number_of(p.getJointInfo(self.body, j, physicsClientId=self.client)[1])]
            joints[joint.name] = self.link_index[joint.child] = j
        self.encoders.begin(self.robot.wheel_radius, self.robot.track, (0.0, 0.0))
        self._motors = Motors(self.robot, self.body, joints, self.client, self.encoders)
        for link in self.robot.links if textured else ():
            if link.collisions and not link.visuals:  # TinyRenderer would draw what it touches with
                hide(self.body, self.link_index[link.name], self.client)
        for link, mu in self.robot.friction.items():
            p.changeDynamics(self.body, self.link_index[link], lateralFriction=mu, physicsClientId=self.client)
        com = p.getDynamicsInfo(self.body, -1, physicsClientId=self.client)
        self._T_com_base = inverse(_pose(com[3], com[4]))
        T_base_body = self.robot.T_base_links[self.robot.body]
        self._T_base_body = None if np.array_equal(T_base_body, np.eye(4)) else T_base_body
        if self._T_base_body is not None:
            self._T_com_base = self._T_com_base @ inverse(self._T_base_body)
        T_world_com = start.matrix @ inverse(self._T_com_base)
        p.resetBasePositionAndOrientation(  # loadURDF places the frame, this call the centre of mass
            self.body,
            T_world_com[:3, 3].tolist(),
            quaternion_xyzw(T_world_com[:3, :3]).tolist(),
            physicsClientId=self.client,
        )
        self.sim_time = 0.0
        self._settle(start)

    def _settle(self, start: Pose2) -> None:
        """Lets the robot come to rest on its wheels, and the bodies of the world that still fall where they will."""
        self._motors.drive(0.0, 0.0)
        moving, least = [self.bodies[i][0] for i in self._dynamic], round(SETTLE_S / STEP_S / SETTLE_CHUNK)
        for n in range(round(SETTLE_MOST_S / STEP_S / SETTLE_CHUNK)):
            if n >= least and not falling(moving, self.client):
                break
            self._step(SETTLE_CHUNK)
        self._refuse_fallen(start)
        self.sim_time, self._settled = 0.0, True
        read = self.encoders.begin(self.robot.wheel_radius, self.robot.track, self._motors.turned())
        radius, track = self.encoders.radius, self.encoders.track
        self.odometry = Odometry(pose=self.true_pose(), wheels=read, radius=radius, track=track)

    def _refuse_fallen(self, start: Pose2) -> None:
        """Refuses a robot that came apart, or that nothing carries where it was set down."""
        T_world_base = self.T_world_base()
        if not np.isfinite(T_world_base).all():
            raise RobotError(
                f"{shown_path(self.robot.path)}: the robot's motion breaks down before it drives: "
                "look for masses and inertias that differ by orders of magnitude."
            )
        if T_world_base[2, 3] < -FALLEN:
            p.removeBody(self.body, physicsClientId=self.client)
            above, below = (start.x, start.y, FALLEN), (start.x, start.y, -FALLEN)
            if p.rayTest(above, below, physicsClientId=self.client)[0][0] >= 0:
                raise RobotError(
                    f"{shown_path(self.robot.path)}: the robot sinks into the floor that it stands on: "
                    "look for masses that no floor carries, or wheels that have no size."
                )
            raise WorldError(
                f"{shown_path(self.world.path)}: nothing carries the robot at ({start.x:g}, {start.y:g}): it falls. "
                "Give the world a floor at z = 0, such as a plane."
            )

    def step(self, v: float, w: float) -> None:
        """One physics step with the wheels driven at v [m/s] and yaw rate w [rad/s]."""
        self._motors.drive(v, w)
        self._step(1)
        self._read_encoders(1)

    def advance(self, v: float, w: float, steps: int) -> str | None:
        """So many physics steps with one command, the encoders and the contacts read once, at the end.

        The same motion as by as many calls of `step`, in half the time, for whoever drives for hours.

        Args:
            v: speed [m/s].
            w: yaw rate [rad/s].
            steps: a power of two: Bullet divides the time by it, and only then are the parts exactly equal.

        Returns:
            Name of the model the robot touches sideways then, or None.
        """
        if steps < 1 or steps & (steps - 1):
            raise ValueError(f"steps must be a power of two, got {steps}")
        self._motors.drive(v, w)
        self._step(steps)
        self._read_encoders(steps)
        return self.bumped()

    def _step(self, steps: int) -> None:
        """So many physics steps by one call, which spares what pybullet does round each."""
        if steps != self._at_once:
            self._at_once = steps
            p.setPhysicsEngineParameter(
                fixedTimeStep=steps * STEP_S, numSubSteps=steps if steps > 1 else 0, physicsClientId=self.client
            )
        if self._settled and (push := self.encoders.push(self.sim_time)):
            p.applyExternalForce(self.body, -1, (0, push, 0), (0, 0, 0), p.LINK_FRAME, physicsClientId=self.client)
        p.stepSimulation(physicsClientId=self.client)
        self.sim_time += steps * STEP_S

    def _read_encoders(self, steps: int) -> None:
        self.odometry = self.odometry.advanced(*self.encoders.read(*self._motors.turned(), steps * STEP_S))

    def T_world_base(self) -> Array:
        """`[4, 4]` true pose of the robot's own frame, on the floor between its wheels."""
        position, q = p.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
        return _pose(position, q) @ self._T_com_base

    def true_pose(self) -> Pose2:
        """True pose of the robot's own frame on the floor."""
        T = self.T_world_base()
        return Pose2(float(T[0, 3]), float(T[1, 3]), yaw_of(T))

    def T_world_links(self) -> Array:
        """`[n, 4, 4]` true poses of the world's links."""
        poses = self._static_poses.copy()
        for i in self._dynamic:
            position, q = p.getBasePositionAndOrientation(self.bodies[i][0], physicsClientId=self.client)
            poses[i] = _pose(position, q)
        return poses

    def T_world_robot_link(self, name: str) -> Array:
        """`[4, 4]` true pose of one of the robot's links."""
        index = self.link_index[name]
        if index < 0:
            T_world_base = self.T_world_base()
            return T_world_base if self._T_base_body is None else T_world_base @ self._T_base_body
        state = p.getLinkState(self.body, index, computeForwardKinematics=1, physicsClientId=self.client)
        return _pose(state[4], state[5])

    def bumped(self) -> str | None:
        """Name of the model the robot touches sideways, or None."""
        for contact in p.getContactPoints(bodyA=self.body, physicsClientId=self.client):
            other, normal_z, distance = contact[2], contact[7][2], contact[8]
            if other in self.link_of_body and distance <= 0.0 and abs(normal_z) < BUMP_NORMAL_Z:
                return self.world.links[self.link_of_body[other]].model
        return None

    def occupied(self, pose: Pose2) -> str | None:
        """Name of a model that the robot would overlap if it stood at `pose`, or None."""
        height = self.robot.height - GROUND_CLEARANCE
        shape = p.createCollisionShape(
            p.GEOM_CYLINDER, radius=self.robot.radius, height=height, physicsClientId=self.client
        )
        z = GROUND_CLEARANCE + height / 2.0
        probe = p.createMultiBody(0.0, shape, basePosition=[pose.x, pose.y, z], physicsClientId=self.client)
        try:
            for link, bodies in zip(self.world.links, self.bodies, strict=True):
                if any(p.getClosestPoints(probe, body, 0.0, physicsClientId=self.client) for body in bodies):
                    return link.model
            return None
        finally:
            p.removeBody(probe, physicsClientId=self.client)

    def bounds(self) -> Array:
        """`[2, 3]` corners [m] of the box that holds every link but planes, which have no end."""
        corners = [
            transform(T_world_link @ part.T_link_part, part.shape.outline())
            for link, T_world_link in zip(self.world.links, self.T_world_links(), strict=True)
            for part in link.visuals or link.collisions
            if not isinstance(part.shape, Plane)
        ]
        if not corners:
            return np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]])
        points = np.concatenate(corners)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def close(self) -> None:
        """Frees the client and its scratch files. Safe to call twice."""
        if self.client >= 0:
            p.disconnect(physicsClientId=self.client)
            self.client = -1
        self._scratch.cleanup()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _pose(position: tuple[float, ...], quaternion_xyzw: tuple[float, ...]) -> Array:
    """`[4, 4]`, in a tenth of scipy's time: it is asked for at every contact check."""
    T = np.eye(4)
    T[:3, :3] = np.reshape(p.getMatrixFromQuaternion(quaternion_xyzw), (3, 3))
    T[:3, 3] = position
    return T


def _no_scratch(error: OSError) -> FlysimError:
    return FlysimError(
        f"cannot write the meshes and textures that pybullet reads to {tempfile.gettempdir()}: "
        f"{error.strerror or error}. Free some space there, or set TMPDIR to another folder."
    )
