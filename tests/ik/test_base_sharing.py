"""Eqs (4) and (5): one motion of the tip shared by base and arm, held still, and in time through the singularity."""

import math

import numpy as np
import pinocchio as pin
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.ik.arm_frames import arm_frames
from tutorialbot.ik.base_sharing import (
    LEVEL,
    Shares,
    base_centre_velocity,
    elbow_share,
    hold,
    share,
    share_in_time,
    tip_in_world,
    tip_velocity_by_base,
)
from tutorialbot.ik.moving_base import METHODS, line, place, whole_body
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.seeding import make_rng

ARM = SphericalArm()
BASE = np.array([0.4, -0.3, 0.7])


def drawn(count, seed, bend=None):
    """Random (base, q, twist) that no damping touches; the elbow within `bend` [rad]."""
    rng, limits, found = make_rng(seed), 0.9 * np.array(ARM.limits), 0
    while found < count:
        base, q, twist = rng.normal(size=3), rng.uniform(-limits, limits), 0.2 * rng.normal(size=6)
        q[3] = rng.uniform(-bend, bend) if bend else q[3]
        if not ARM.joint_velocity(q, twist).damped:
            found += 1
            yield base, q, twist


def moved(base, q, base_rates, qdot, h=1e-6):
    """The tip's twist by finite differences of poses in the world."""
    before = tip_in_world(ARM, base - h * base_rates, q - h * qdot)
    after = tip_in_world(ARM, base + h * base_rates, q + h * qdot)
    turn = pin.log3(after.rotation @ before.rotation.T)
    return np.concatenate([after.translation - before.translation, turn]) / (2 * h)


def test_base_and_arm_together_move_the_tip_by_b_times_the_twist():
    for base, q, twist in drawn(100, 11):
        found = share(ARM, base, q, twist, Shares(0.9, 0.4, 0.5))
        np.testing.assert_allclose(moved(base, q, found.base, found.qdot), found.scale * twist, atol=1e-7)
        np.testing.assert_allclose(found.nu_mb, np.array([0.9, 0.4, 0, 0, 0, 0.5]) * twist)
        np.testing.assert_allclose(found.nu_mb + found.nu_a, twist)


def test_base_and_arm_have_one_time_scale():
    q = np.array([0.3, 1.2, -0.4, 0.05, 0.5, 0.8, 0.1])
    found = share(ARM, BASE, q, np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.2]))
    assert found.scale == pytest.approx(math.sin(4 * 0.05))
    given = tip_velocity_by_base(found.base, tip_in_world(ARM, BASE, q).translation, BASE)
    np.testing.assert_allclose(given, found.scale * found.nu_mb, atol=1e-12)


def test_while_the_tip_is_held_the_base_moves_as_told():
    for base, q, twist in drawn(100, 12):
        found = hold(ARM, base, q, twist[:3])
        np.testing.assert_allclose(moved(base, q, found.base, found.qdot), 0.0, atol=1e-7)
        np.testing.assert_allclose(found.base, found.scale * twist[:3], atol=1e-12)


def test_velocity_at_the_tip_and_at_the_base_are_one_motion():
    tip, rates = np.array([1.0, 0.2, 1.1]), np.array([0.1, -0.2, 0.5])
    nu_mb = tip_velocity_by_base(rates, tip, BASE)
    np.testing.assert_allclose(base_centre_velocity(nu_mb, tip, BASE), rates, atol=1e-15)
    orbit = base_centre_velocity(np.array([0, 0, 0, 0, 0, 1.0]), tip, BASE)
    assert orbit[:2] @ (tip - np.array([*BASE[:2], 0]))[:2] == pytest.approx(0.0) and orbit[2] == 1.0


def test_the_base_inside_follows_in_time_also_at_the_singularity():
    """The stretched arm included, wherever it is level enough."""
    seen = stretched = 0
    for i, (base, q, twist) in enumerate(drawn(300, 13, 0.4)):
        q[3] = q[3] if i % 5 else 0.0
        level = np.hypot(*arm_frames(ARM, q).wrist_frame.rotation[:2, 2])
        if level < LEVEL or ARM.joint_velocity(q, twist).damped:
            continue
        found = share_in_time(ARM, base, q, twist)
        np.testing.assert_allclose(moved(base, q, found.base, found.qdot), twist, atol=1e-6)
        seen, stretched = seen + 1, stretched + (q[3] == 0.0)
    assert seen > 200 and stretched > 30


def test_the_elbow_s_share_never_crosses_outward_and_leaves_inward():
    for q4 in (0.0, 1e-9, 0.1, -0.1):
        out, over = elbow_share(q4, 0.1)
        assert 0.0 <= out <= 1.0 and over == pytest.approx(out / math.sin(q4) if q4 else 0.0, abs=1e-7)
        back, over = elbow_share(q4, -0.1)
        assert back == pytest.approx(abs(math.sin(4 * q4)))
        assert over * (q4 or 1.0) > 0.0
    assert elbow_share(0.0, -0.1)[1] == 4.0


def test_the_line_is_kept_to_a_millimetre_where_the_fixed_split_loses_80():
    found = {method: line(method) for method in METHODS}
    assert found["fixed split"].error.max() > 0.08
    ours = found["base inside"]
    assert ours.error.max() < 1e-3 and ours.nearest < 0.01
    assert np.abs(ours.joint_rates).max() < 2.5 and ours.base_acceleration < 1.5
    assert np.ptp(ours.base[:, 0]) > 0.3 and np.abs(ours.base[:, 1:]).max() < 1e-9
    assert found["whole body, good weights"].error.max() < 1e-3 < found["whole body, poor weights"].error.max()


def test_the_line_begins_and_ends_at_rest():
    h, ends = 1e-6, []
    for t in np.linspace(0.01, 6.4, 97).tolist():
        way, rate = place(t, 0.5, 0.2)
        assert -1e-12 <= way <= 0.5 + 1e-12 and abs(rate) <= 0.2 + 1e-12
        ends.append((place(t + h, 0.5, 0.2)[0] - place(t - h, 0.5, 0.2)[0]) / (2 * h) - rate)
    assert np.abs(ends).max() < 1e-6
    assert place(0.0, 0.5, 0.2) == (0.0, 0.0) and place(3.0, 0.5, 0.2)[0] == pytest.approx(0.5)


def test_the_whole_body_s_jacobian_is_that_of_the_poses():
    for base, q, twist in drawn(30, 14):
        base_rates, qdot = whole_body(ARM, base, q, twist, damping=1e-6)
        np.testing.assert_allclose(moved(base, q, base_rates, qdot), twist, atol=1e-5)


@pytest.mark.parametrize(("call", "kind", "says"), [
    (lambda: Shares(1.2), InvalidValue, "x = 1.2"), (lambda: Shares(yaw=-0.1), InvalidValue, "yaw = -0.1"),
    (lambda: share(None, BASE, np.zeros(7), np.zeros(6)), InvalidType, "arm = None"),
    (lambda: share(ARM, BASE, np.zeros(7), np.zeros(6), 0.9), InvalidType, "shares = 0.9"),
    (lambda: share(ARM, BASE[:2], np.zeros(7), np.zeros(6)), InvalidValue, "base = "),
    (lambda: share(ARM, BASE, np.zeros(7), np.full(6, np.nan)), InvalidValue, "twist = "),
    (lambda: share(ARM, BASE, np.zeros(7), np.zeros(6), n=0), InvalidValue, "n = 0"),
    (lambda: hold(ARM, BASE, np.zeros(7), [0.0, np.inf, 0.0]), InvalidValue, "base_rates = "),
    (lambda: share_in_time(ARM, BASE, np.full(7, 9.0), np.zeros(6)), InvalidValue, "q1 = 9.0"),
    (lambda: share_in_time(ARM, BASE, np.zeros(7), np.zeros(6), swivel_rate=np.nan), InvalidValue, "swivel_rate"),
    (lambda: line("luck"), InvalidValue, "method = 'luck'"), (lambda: line(arm=3), InvalidType, "arm = 3"),
    (lambda: line(dt=1e300), InvalidValue, "dt = 1e+300"), (lambda: line(dt=1e-300), InvalidValue, "dt = 1e-300"),
    (lambda: line(speed=1e300), InvalidValue, "speed = 1e+300"), (lambda: line(speed=1.1), InvalidValue, "speed = 1.1"),
    (lambda: line(speed=1e-300), InvalidValue, "speed = 1e-300"),
    (lambda: line("whole body, good weights", n=0), InvalidValue, "n = 0"),
    (lambda: line(length=1e300), InvalidValue, "length = 1e+300"),
])  # fmt: skip
def test_bad_input_is_named(call, kind, says):
    with pytest.raises(kind) as raised:
        call()
    assert says in str(raised.value)
