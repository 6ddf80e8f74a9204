"""SE(3) as 4x4 arrays, named target first: `p_world = T_world_optical @ p_optical` (REP-103, REP-105)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

# base_link (x forward, y left, z up) <- optical frame (x right, y down, z forward), REP-103.
R_BODY_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
R_BODY_OPTICAL.flags.writeable = False


@dataclass(frozen=True, slots=True)
class Pose2:
    """A robot's place on the floor: x, y [m], yaw [rad, counter-clockwise], in the frame its name says."""

    x: float
    y: float
    yaw: float

    @property
    def matrix(self) -> Array:
        """`[4, 4]` transform from the robot's base_link (on the floor) to the frame of this pose."""
        return se3(rotation_rpy(0.0, 0.0, self.yaw), (self.x, self.y, 0.0))

    def distance(self, other: Pose2) -> float:
        """Straight distance on the floor [m]."""
        return math.hypot(self.x - other.x, self.y - other.y)


def se3(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """`[4, 4]` transform from a `[3, 3]` rotation and a `[3]` translation [m]."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = translation
    return T


def inverse(T_a_b: Array) -> Array:
    """`T_b_a` of a rigid `T_a_b`."""
    R = T_a_b[:3, :3].T
    return se3(R, -R @ T_a_b[:3, 3])


def transform(T_a_b: Array, points_b: ArrayLike) -> Array:
    """`[..., 3]` points in frame b [m] expressed in frame a."""
    return np.asarray(points_b, dtype=np.float64) @ T_a_b[:3, :3].T + T_a_b[:3, 3]


def rotation_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """`[3, 3]` rotation of fixed-axis roll, pitch, yaw [rad], as SDF and URDF write it."""
    return Rotation.from_euler("xyz", (roll, pitch, yaw)).as_matrix()


def pose6(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Array:
    """`[4, 4]` transform of an SDF `<pose>`: x y z [m] roll pitch yaw [rad]."""
    return se3(rotation_rpy(roll, pitch, yaw), (x, y, z))


def quaternion_xyzw(R: Array) -> Array:
    """`[4]` unit quaternion (x, y, z, w) of a `[3, 3]` rotation."""
    return Rotation.from_matrix(R).as_quat()


def from_quaternion_xyzw(q: ArrayLike) -> Array:
    """`[3, 3]` rotation of a quaternion (x, y, z, w)."""
    return Rotation.from_quat(q).as_matrix()


def yaw_of(T_world_body: Array) -> float:
    """Heading [rad] of a body frame's x axis about the world's z axis."""
    return math.atan2(T_world_body[1, 0], T_world_body[0, 0])


def wrap_angle(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def frozen(array: ArrayLike, dtype: object = None) -> NDArray:
    """A read-only copy: what a record stores."""
    copy = np.array(array, dtype=dtype)  # type: ignore[arg-type]
    copy.flags.writeable = False
    return copy
