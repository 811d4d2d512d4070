"""Poses: group properties, an independent 4-D matrix, and the ways in which a distance can mislead."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.pose import (
    double_quaternion,
    from_quaternion,
    interpolate,
    so4_distance,
    so4_distance_seen_from,
    to_quaternion,
)

number = st.floats(-2.0, 2.0).map(lambda x: round(x, 6))
vector = st.tuples(number, number, number).map(np.array)
turn = vector.map(lambda v: pin.exp3(1.5 * v))
pose = st.builds(pin.SE3, turn, vector)
share = st.floats(0.0, 1.0)


def door_pose(opening: float, lever: float = 0.3) -> pin.SE3:
    """Grip of a door with its hinge along z at the origin, opened by `opening` [rad]."""
    return pin.SE3(pin.utils.rotate("z", opening), np.zeros(3)) * pin.SE3(np.eye(3), np.array([0.0, lever, 0.0]))


@given(pose, pose, share)
def test_interpolation_is_straight_in_position_and_even_in_angle(a, b, s):
    between = interpolate(a, b, s)
    np.testing.assert_allclose(between.translation, (1 - s) * a.translation + s * b.translation, atol=1e-12)
    np.testing.assert_allclose(between.rotation @ between.rotation.T, np.eye(3), atol=1e-12)
    whole = np.linalg.norm(pin.log3(a.rotation.T @ b.rotation))
    part = np.linalg.norm(pin.log3(a.rotation.T @ between.rotation))
    if whole < 3.1:  # at half a turn both ways round are equally short
        assert part == pytest.approx(s * whole, abs=1e-6)


@given(pose, pose)
def test_interpolation_begins_and_ends_at_its_ends(a, b):
    assert interpolate(a, b, 0.0).isApprox(a, 1e-9)
    assert interpolate(a, b, 1.0).isApprox(b, 1e-9)


def test_interpolation_is_not_a_screw():
    """The position of a screw leaves the straight line; a fault that swaps both would be caught here."""
    a, b = door_pose(0.0), door_pose(1.5)
    assert np.linalg.norm(interpolate(a, b, 0.5).translation - pin.SE3.Interpolate(a, b, 0.5).translation) > 0.05


@given(pose, st.sampled_from(["wxyz", "xyzw"]))
def test_quaternion_round_trip(a, order):
    position, q = to_quaternion(a, order)
    assert q[0 if order == "wxyz" else 3] >= 0
    assert from_quaternion(position, 3.0 * q, order).isApprox(a, 1e-9)


def test_quaternion_orders_are_those_of_the_libraries():
    import mujoco

    a = pin.SE3.Random()
    w_first, w_last = to_quaternion(a)[1], to_quaternion(a, "xyzw")[1]
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, w_first)
    np.testing.assert_allclose(rotation.reshape(3, 3), a.rotation, atol=1e-12)
    np.testing.assert_allclose(pin.Quaternion(w_last).matrix(), a.rotation, atol=1e-12)


@given(pose, vector, st.sampled_from(["atan", "ratio"]))
def test_double_quaternion_acts_as_the_4d_matrix(a, point, angle):
    """Independent reference: the 4 x 4 matrix of a plane rotation (translation's direction, fourth axis) times R."""
    d = np.linalg.norm(a.translation)
    psi = np.arctan(d / 0.1) if angle == "atan" else d / 0.1
    n = np.append(a.translation / d if d else np.zeros(3), 0.0)
    e = np.array([0.0, 0.0, 0.0, 1.0])
    plane = (
        np.eye(4)
        + (np.cos(psi) - 1) * (np.outer(n, n) + np.outer(e, e))
        + np.sin(psi) * (np.outer(n, e) - np.outer(e, n))
    )
    if not d:
        plane = np.eye(4)
    turned = np.eye(4)
    turned[:3, :3] = a.rotation
    x = np.append(point, 0.7)
    v = double_quaternion(a, 0.1, angle)
    g, h = pin.Quaternion(*v[:4]), pin.Quaternion(*v[4:])
    np.testing.assert_allclose((g * pin.Quaternion(x) * h.conjugate()).coeffs(), plane @ turned @ x, atol=1e-9)


@given(pose, pose)
def test_distance_is_symmetric_and_bounded(a, b):
    assert so4_distance(a, b) == pytest.approx(so4_distance(b, a), abs=1e-9)
    assert 0.0 <= so4_distance(a, b) <= 2.0 + 1e-12


@given(pose, pose)
def test_distance_has_the_closed_form(a, b):
    d = a.actInv(b)
    theta, psi = pin.AngleAxis(d.rotation).angle, np.arctan(np.linalg.norm(d.translation) / 0.25)
    expected = 2 * np.sqrt(1 - abs(np.cos(theta / 2) * np.cos(psi / 2)))
    assert so4_distance(a, b, radius=0.25) == pytest.approx(expected, abs=2e-8)


@given(pose, pose, pose)
def test_distance_does_not_know_the_worlds_origin(world, a, b):
    assert so4_distance(world * a, world * b) == pytest.approx(so4_distance(a, b), abs=1e-7)


@given(pose, pose)
def test_distance_is_zero_for_equal_poses_alone(a, b):
    assert so4_distance(a, a) < 1e-7
    apart = max(np.linalg.norm(a.translation - b.translation), np.linalg.norm(pin.log3(a.rotation.T @ b.rotation)))
    if apart > 1e-5:
        assert so4_distance(a, b) > 1e-6


@given(pose)
def test_both_signs_of_the_double_cover_are_one_pose(a):
    """A whole turn about any axis flips the quaternion's sign, never the pose."""
    nearly = pin.SE3(pin.exp3(np.array([0, 0, 2 * np.pi - 1e-4])) @ a.rotation, a.translation)
    assert so4_distance(a, nearly) < 1e-3


@given(pose, pose, pose)
def test_literal_metric_from_a_is_the_distance(a, b, reference):
    assert so4_distance_seen_from(a, a, b) == pytest.approx(so4_distance(a, b), abs=1e-9)
    literal = so4_distance_seen_from(reference, a, b)
    assert literal == pytest.approx(so4_distance_seen_from(reference, b, a), abs=1e-12)
    turned = reference * pin.SE3(pin.exp3(np.array([0.3, -1.0, 0.5])), np.zeros(3))
    assert so4_distance_seen_from(turned, a, b) == pytest.approx(literal, abs=1e-7)


def test_literal_metric_moves_with_the_reference():
    a, b = door_pose(0.0), door_pose(0.5)
    far = pin.SE3(np.eye(3), np.array([3.0, 0.0, 0.0]))
    near = so4_distance_seen_from(a, a, b)
    assert abs(so4_distance_seen_from(far, a, b) - near) > 0.2 * near


def test_ratio_aliases_on_an_opening_door_and_atan_does_not():
    """Grip 0.30 m from the hinge, R = 0.1 m: |d|/R peaks near 60 degrees and falls, atan grows all the way."""
    degrees = np.arange(0, 181)
    ratio = [so4_distance(door_pose(0.0), door_pose(x), angle="ratio") for x in np.radians(degrees)]
    atan = [so4_distance(door_pose(0.0), door_pose(x)) for x in np.radians(degrees)]
    first_fall = np.argmax(np.diff(ratio) < 0)
    assert 55 <= first_fall <= 70
    assert ratio[60] == pytest.approx(1.94, abs=0.01) and ratio[120] == pytest.approx(1.51, abs=0.01)
    assert (np.diff(atan) > 0).all()
    once_round = pin.SE3(np.eye(3), np.array([2 * np.pi * 0.1, 0, 0]))
    assert (
        so4_distance(pin.SE3.Identity(), once_round, angle="ratio")
        < 1e-7
        < so4_distance(pin.SE3.Identity(), once_round)
    )


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf])
def test_bad_radius(radius):
    with pytest.raises(InvalidValue, match="radius"):
        so4_distance(pin.SE3.Identity(), pin.SE3.Identity(), radius)


def test_misuse_is_named():
    identity = pin.SE3.Identity()
    with pytest.raises(InvalidType, match="(?s)b = .*pinocchio.SE3"):
        so4_distance(identity, np.eye(4))
    with pytest.raises(InvalidValue, match="angle"):
        so4_distance(identity, identity, angle="tan")
    with pytest.raises(InvalidValue, match="s = 1.5"):
        interpolate(identity, identity, 1.5)
    with pytest.raises(InvalidType, match="s = "):
        interpolate(identity, identity, "half")
    with pytest.raises(InvalidValue, match="a = "):
        interpolate(pin.SE3(np.eye(3), np.array([np.nan, 0, 0])), identity, 0.5)
    with pytest.raises(InvalidValue, match="quaternion"):
        from_quaternion(np.zeros(3), np.zeros(4))
    with pytest.raises(InvalidValue, match="order"):
        to_quaternion(identity, "xyz")
