"""Eqs (1)-(4) of paper 2 against pinocchio; the arm's limits; the readings of the tip's tilt."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.ik.arm7 import ARM, LIMITS, Arm, forward_kinematics, forward_kinematics_scalar
from tutorialbot.ik.quaternions import conjugate, product, quaternion, rotate
from tutorialbot.ik.tilts import READINGS

AXES = {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ}


def reference(q: np.ndarray) -> pin.SE3:
    """The tip's pose by pinocchio, from the dimensions of the method note, not from the arm under test."""
    model, joint = pin.Model(), 0
    places = [(0, 0.16, 0.38), (0, 0, 0), (0, 0, 0), (0, 0, -0.31), (0, 0, -0.23), (0, 0, 0), (0, 0, 0)]
    for i, (axis, place) in enumerate(zip("yxzyzxy", places, strict=True)):
        joint = model.addJoint(joint, AXES[axis](), pin.SE3(np.eye(3), np.array(place, dtype=float)), f"{i}")
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    return data.oMi[joint] * pin.SE3(np.eye(3), np.array([0.03, 0.0, -0.08]))


def configurations(n: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-2 * np.pi, 2 * np.pi, (n, 7))


def turn(tilt: np.ndarray) -> np.ndarray:
    """Ry(pitch) Rx(roll) Rz(yaw), by pinocchio."""
    roll, pitch, yaw = tilt
    return pin.utils.rotate("y", pitch) @ pin.utils.rotate("x", roll) @ pin.utils.rotate("z", yaw)


def test_forward_kinematics_is_pinocchios():
    q = configurations(300, 3001)
    positions, tilts = forward_kinematics(q)
    for one, position, tilt in zip(q, positions, tilts, strict=True):
        pose = reference(one)
        np.testing.assert_allclose(position, pose.translation, atol=1e-12)
        np.testing.assert_allclose(turn(tilt), pose.rotation, atol=1e-12)


def test_the_scalar_version_is_the_batched_one():
    q = configurations(300, 3002)
    positions, tilts = forward_kinematics(q)
    for one, position, tilt in zip(q, positions, tilts, strict=True):
        alone = forward_kinematics_scalar(one.tolist())
        np.testing.assert_allclose(alone[0], position, atol=1e-12)
        np.testing.assert_allclose(alone[1], tilt, atol=1e-9)  # angles near a roll of 90 degrees lose digits


def test_any_leading_shape_goes():
    q = configurations(12, 3003)
    position, tilt = forward_kinematics(q.reshape(3, 4, 7))
    assert position.shape == tilt.shape == (3, 4, 3)
    np.testing.assert_allclose(position.reshape(12, 3), forward_kinematics(q)[0], atol=1e-15)
    assert forward_kinematics(np.zeros(7))[0] == pytest.approx([0.03, 0.16, -0.24])
    assert forward_kinematics(np.zeros((0, 7)))[0].shape == (0, 3)
    assert forward_kinematics(np.full(7, 2 * np.pi))[0] == pytest.approx([0.03, 0.16, -0.24])


def test_the_reversed_order_of_quaternions_is_seen_away_from_zero():
    """Q_i = q_i ... q_0 agrees with eq. (2) at the zero pose and nowhere else."""

    def reversed_order(q):
        turned, tip = (1.0, 0.0, 0.0, 0.0), ARM.offsets[0]
        for angle, axis, link in zip(q, ARM.axes.tolist(), ARM.offsets[1:].tolist(), strict=True):
            turned = product(quaternion(angle, axis), turned)
            tip = tip + rotate(turned, link)
        return tip

    np.testing.assert_allclose(reversed_order(np.zeros(7)), forward_kinematics(np.zeros(7))[0], atol=1e-15)
    inside = np.random.default_rng(3004).uniform(ARM.lower, ARM.upper, (200, 7))
    apart = [np.linalg.norm(reversed_order(q) - forward_kinematics(q)[0]) for q in inside]
    assert np.median(apart) > 0.3 and np.quantile(apart, 0.05) > 0.05


angles = st.floats(-10.0, 10.0)
axes = st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])


@settings(max_examples=50, deadline=None)
@given(angles, axes, angles, axes)
def test_quaternions_are_a_group_of_turns(a, u, b, v):
    p, q = quaternion(a, u), quaternion(b, v)
    x = (0.3, -0.5, 0.7)
    np.testing.assert_allclose(rotate(product(p, q), x), rotate(p, rotate(q, x)), atol=1e-12)
    np.testing.assert_allclose(product(p, conjugate(p)), (1.0, 0.0, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(rotate(p, x), Rotation.from_rotvec(a * np.array(u)).apply(x), atol=1e-12)


def test_readings_of_the_tilt():
    """Each reading of a turn, against scipy and pinocchio."""
    q = configurations(100, 3005)
    turns = [reference(one).rotation for one in q]
    zyx = forward_kinematics(q, reading="zyx")[1]
    np.testing.assert_allclose(zyx[:, ::-1], Rotation.from_matrix(turns).as_euler("ZYX"), atol=1e-9)
    two, one = (forward_kinematics(q, reading=name)[1] for name in ("two vectors", "one vector"))
    np.testing.assert_allclose(two, [[*R[:, 0], *-R[:, 2]] for R in turns], atol=1e-12)
    np.testing.assert_allclose(one, two[:, 3:], atol=1e-12)
    chords = forward_kinematics(q, reading="geodesic")[1].T
    wanted = np.roll(chords, 1, axis=1)
    apart = [np.linalg.norm(pin.log3(turns[i - 1].T @ turns[i])) for i in range(100)]
    np.testing.assert_allclose(READINGS["geodesic"].error(chords, wanted)[0], apart, atol=1e-9)


@pytest.mark.parametrize("name", READINGS)
def test_a_target_means_what_its_reading_says(name):
    """The tilt of a configuration, stated as a target, leaves no error; a whole turn more of an angle changes none."""
    read, q = READINGS[name], configurations(50, 3006)
    tilt = forward_kinematics(q, reading="zyx" if name == "zyx" else "pitch-first")[1]
    found = np.moveaxis(forward_kinematics(q, reading=name)[1], -1, 0)
    for shift in (0.0, 2 * np.pi):
        error = read.error(found, read.wanted(tilt + [0.0, 0.0, shift]))
        np.testing.assert_allclose(error, 0.0, atol=2e-7)
    turned = Rotation.from_euler(read.order.upper(), tilt[:, ["xyz".index(axis) for axis in read.order]])
    same = np.abs((turned.as_quat(scalar_first=True) * read.quaternion(tilt).T).sum(axis=1))
    np.testing.assert_allclose(same, 1.0, atol=1e-12)


def test_pitch_first_is_regular_where_the_paper_is_and_zyx_is_not():
    """A turn of 1 mrad about any axis from the paper's pose changes the one by at most about as much, not the other."""
    hand = turn(np.array([0.0, -np.pi / 2, 0.0]))
    largest = {"YXZ": 0.0, "ZYX": 0.0}
    for axis in np.eye(3):
        near = Rotation.from_matrix(pin.exp3(1e-3 * axis + 1e-4 * np.ones(3)) @ hand)
        for order in largest:
            start = Rotation.from_matrix(pin.exp3(1e-4 * np.ones(3)) @ hand).as_euler(order)
            largest[order] = max(largest[order], np.abs(near.as_euler(order) - start).max())
    assert largest["YXZ"] < 2e-3 and largest["ZYX"] > 0.5


def test_the_limits():
    assert ARM.within(np.zeros(7)) and not ARM.within(np.deg2rad([0, 0, 0, 0, 0, 0, -16]))
    q = np.zeros((2, 3, 7))
    q[1, 2, 3] = 0.1
    assert ARM.within(q).tolist() == [[True] * 3, [True, True, False]]
    wider = ARM.with_limit("radial deviation", np.deg2rad(-20))
    assert wider.within(np.deg2rad([0, 0, 0, 0, 0, 0, -16]))
    assert np.flatnonzero(wider.lower != ARM.lower).tolist() == [6] and (wider.upper == ARM.upper).all()
    with pytest.raises(ValueError, match="read-only"):
        ARM.lower[0] = 1.0


def test_names_of_the_limits_say_where_the_hand_goes():
    """Signs: each joint of the hanging left arm, a little towards its named limit."""

    def tip(name, start=(0,) * 7):
        joint = next(i for i, pair in enumerate(LIMITS) if name in pair)
        q = np.array(start, dtype=float)
        q[joint] += 0.2 * (-1) ** (LIMITS[joint].index(name) == 0)
        return forward_kinematics(q)[0] - forward_kinematics(np.array(start, dtype=float))[0]

    for forward_limit in ("shoulder flexion", "elbow flexion", "radial deviation"):
        assert tip(forward_limit)[0] > 0.01
    for left in ("shoulder abduction", "wrist extension", "supination", "outward rotation"):
        assert tip(left)[1] > 0.005


@pytest.mark.parametrize(
    ("field", "value", "error"),
    [
        ("lower", np.full(7, np.nan), InvalidValue),
        ("lower", np.full(7, 1.0), InvalidValue),
        ("upper", np.zeros(6), InvalidValue),
        ("upper", "wide", InvalidType),
        ("axes", np.ones((7, 3)), InvalidValue),
        ("axes", 1.001 * ARM.axes, InvalidValue),
        ("offsets", np.zeros((7, 3)), InvalidValue),
    ],
)
def test_impossible_arms_are_refused(field, value, error):
    with pytest.raises(error, match=f"^{field} = "):
        Arm(**{field: value})


def test_an_arm_with_limits_the_wrong_way_round_names_the_joint():
    with pytest.raises(InvalidValue, match="joint 7, radial deviation / ulnar deviation"):
        ARM.with_limit("radial deviation", np.deg2rad(31))
    with pytest.raises(InvalidValue, match="angle = nan"):
        ARM.with_limit("radial deviation", float("nan"))
    with pytest.raises(InvalidValue, match="name = 'thumb'.*'radial deviation'"):
        ARM.with_limit("thumb", 0.0)


def test_misuse_of_forward_kinematics():
    with pytest.raises(InvalidValue, match="reading = 'xyz': expected one of 'geodesic'"):
        forward_kinematics(np.zeros(7), reading="xyz")
    for q in (np.zeros(6), np.full(7, np.nan), 0.0, np.zeros((7, 2))):
        with pytest.raises(InvalidValue, match="^q = "):
            forward_kinematics(q)
    for q in ("elbow up", [1, [2], 3], [True] * 7, ["1"] * 7, None):
        for call in (forward_kinematics, ARM.within):
            with pytest.raises((InvalidType, InvalidValue), match="^q = "):
                call(q)
    for arm in ("left", ARM.offsets, 0):
        with pytest.raises(InvalidType, match="^arm = "):
            forward_kinematics(np.zeros(7), arm=arm)
    for q in (0.0, np.zeros(6), np.full(7, np.nan)):
        with pytest.raises(InvalidValue, match="^q = "):
            ARM.within(q)
