import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.geometry.frames import (
    R_BODY_OPTICAL,
    Pose2,
    from_quaternion_xyzw,
    frozen,
    inverse,
    pose6,
    quaternion_xyzw,
    rotation_rpy,
    se3,
    transform,
    wrap_angle,
    yaw_of,
)

angles = st.floats(-3.1, 3.1)
lengths = st.floats(-5.0, 5.0)
poses = st.tuples(lengths, lengths, lengths, angles, angles, angles).map(lambda p: pose6(*p))


def test_a_robot_that_turned_left_sees_forward_as_the_worlds_left():
    T_world_base = Pose2(1.0, 2.0, math.pi / 2).matrix
    # 3 m ahead, 0.5 m to the left, 0.2 m up; forward is now world y, left is world -x.
    np.testing.assert_allclose(transform(T_world_base, [3.0, 0.5, 0.2]), [0.5, 5.0, 0.2], atol=1e-12)


def test_the_optical_axes_are_those_of_rep_103():
    # Right, down and forward of the camera are -y, -z and x of the body.
    np.testing.assert_array_equal(R_BODY_OPTICAL @ np.eye(3), np.transpose([[0, -1, 0], [0, 0, -1], [1, 0, 0]]))
    assert np.linalg.det(R_BODY_OPTICAL) == pytest.approx(1.0)


def test_names_cancel_along_a_chain_worked_by_hand():
    # A camera 0.1 m ahead of and 0.3 m above base_link; the robot at (2, 0) faces backwards.
    T_base_optical = se3(R_BODY_OPTICAL, (0.1, 0.0, 0.3))
    T_world_base = Pose2(2.0, 0.0, math.pi).matrix
    # 1.5 m in front, 0.4 m to the right and 0.2 m below the camera.
    p_world = transform(T_world_base @ T_base_optical, [0.4, 0.2, 1.5])
    np.testing.assert_allclose(p_world, [2.0 - 1.6, 0.4, 0.1], atol=1e-12)


@given(poses, poses, st.tuples(lengths, lengths, lengths))
def test_a_product_of_transforms_is_one_after_the_other(T_a_b, T_b_c, p_c):
    np.testing.assert_allclose(transform(T_a_b @ T_b_c, p_c), transform(T_a_b, transform(T_b_c, p_c)), atol=1e-9)


@given(poses)
def test_the_inverse_undoes_a_transform_from_both_sides(T_a_b):
    np.testing.assert_allclose(inverse(T_a_b) @ T_a_b, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(T_a_b @ inverse(T_a_b), np.eye(4), atol=1e-12)


@given(lengths, lengths, lengths, angles, angles, angles)
def test_pose6_turns_about_the_fixed_x_then_y_then_z_axis_as_sdf_says(x, y, z, roll, pitch, yaw):
    def c(a):
        return math.cos(a)

    def s(a):
        return math.sin(a)

    Rx = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    Ry = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    Rz = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    T = pose6(x, y, z, roll, pitch, yaw)
    np.testing.assert_allclose(T[:3, :3], Rz @ Ry @ Rx, atol=1e-12)
    np.testing.assert_array_equal(T[:, 3], [x, y, z, 1.0])
    np.testing.assert_array_equal(T[3], [0, 0, 0, 1])


def test_pose6_by_hand():
    # Roll and yaw of a quarter turn each: body x to world y, body y to world z, body z to world x.
    T = pose6(1.0, 2.0, 3.0, math.pi / 2, 0.0, math.pi / 2)
    np.testing.assert_allclose(transform(T, np.eye(3)), [[1, 3, 3], [1, 2, 4], [2, 2, 3]], atol=1e-12)
    # A positive pitch lowers the nose.
    assert transform(pose6(0, 0, 0, 0, 0.1, 0), [1.0, 0.0, 0.0])[2] == pytest.approx(-math.sin(0.1))


@given(angles, angles, angles)
def test_a_quaternion_keeps_the_rotation_and_puts_w_last(roll, pitch, yaw):
    R = rotation_rpy(roll, pitch, yaw)
    np.testing.assert_allclose(from_quaternion_xyzw(quaternion_xyzw(R)), R, atol=1e-12)
    half = np.abs(quaternion_xyzw(rotation_rpy(0, 0, yaw)))
    np.testing.assert_allclose(half, [0, 0, abs(math.sin(yaw / 2)), abs(math.cos(yaw / 2))], atol=1e-12)


@given(lengths, lengths, angles)
def test_yaw_of_reads_a_pose_back(x, y, yaw):
    assert yaw_of(Pose2(x, y, yaw).matrix) == pytest.approx(yaw, abs=1e-12)


@given(st.floats(-50.0, 50.0))
def test_wrapping_changes_an_angle_by_whole_turns_only(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    turns = (angle - wrapped) / (2 * math.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


def test_distance_on_the_floor_is_straight():
    assert Pose2(1.0, 1.0, 0.3).distance(Pose2(4.0, 5.0, -2.0)) == pytest.approx(5.0)


def test_what_a_record_stores_is_a_copy_nobody_can_change():
    mine = np.zeros(3)
    kept = frozen(mine)
    mine[0] = 1.0
    assert kept[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0
