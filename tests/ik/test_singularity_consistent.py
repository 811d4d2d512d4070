"""Paper 4, eqs (1)-(3): exact direction, bounded rates on the stretched arm, peak rates, and what counts as misuse."""

import math

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.ik.singularity_consistent import (
    SphericalArm,
    elbow_peak_rate,
    joint_velocity_in_matrices,
    order_for_rate,
    time_scale,
)
from tutorialbot.seeding import make_rng

ARM = SphericalArm()
UNEQUAL = SphericalArm(0.4, 0.3, 0.1, 0.2)
STRETCHED = np.array([0.3, 0.9, -0.4, 0.0, 0.5, 0.8, 0.1])
TWIST = np.array([0.1, 0.2, 0.1, 0.3, 0.2, 0.1])


def poses(arm, count, seed):
    """Random poses and twists that no damping touches."""
    rng, limits, found = make_rng(seed), np.array(arm.limits), 0
    while found < count:
        q, twist = rng.uniform(-limits, limits), rng.normal(size=6)
        if not arm.joint_velocity(q, twist).damped:
            found += 1
            yield q, twist


def along(q):
    """The direction from shoulder to wrist of an arm stretched out."""
    return ARM.forward(np.array([*q[:3], 0.0, 0.0, 0.0, 0.0])).rotation[:, 2]


def outward(q, speed):
    return np.concatenate([speed * along(q), np.zeros(3)])


def test_the_arm_stands_upright_and_turns_about_z_y_z_y_z_y_z():
    assert ARM.forward(np.zeros(7)).translation == pytest.approx([0.0, 0.0, 1.0])
    bent = ARM.forward(np.array([0.0, 0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0]))
    assert bent.translation == pytest.approx([0.5, 0.0, 0.5])
    q = np.array([math.pi / 2, math.pi / 2, 0.0, 0.0, 0.0, math.pi / 2, 0.0])
    assert ARM.forward(q).translation == pytest.approx([0.0, 0.7, 0.0])


@pytest.mark.parametrize("arm", [ARM, UNEQUAL], ids=["equal links", "unequal links"])
@pytest.mark.parametrize("options", [{}, {"n": 4}, {"scaling": "quintic"}, {"wrist": "A"}, {"swivel_rate": 0.4},
                                     {"wrist": "A", "swivel_rate": 0.4}])  # fmt: skip
def test_the_tip_moves_along_the_twist_to_1e_9(arm, options):
    for q, twist in poses(arm, 300, 1):
        found = arm.joint_velocity(q, twist, **options)
        moved = arm.jacobian(q) @ found.qdot
        tolerance = 1e-9 * max(1.0, np.abs(found.qdot).max() if options.get("wrist") == "A" else 1.0)
        np.testing.assert_allclose(moved, found.scale * twist, atol=tolerance)


@pytest.mark.parametrize("arm", [ARM, UNEQUAL], ids=["equal links", "unequal links"])
def test_the_equations_as_printed_give_the_same(arm):
    for q, twist in poses(arm, 200, 2):
        np.testing.assert_allclose(arm.joint_velocity(q, twist).qdot, joint_velocity_in_matrices(arm, q, twist),
                                   rtol=1e-8, atol=1e-10)  # fmt: skip


def test_reading_b_is_the_pseudo_inverse_slowed_down_by_b():
    for q, twist in poses(ARM, 300, 3):
        found = ARM.joint_velocity(q, twist)
        least = found.scale * np.linalg.pinv(ARM.jacobian(q)) @ twist
        np.testing.assert_allclose(found.qdot, least, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("q4", [0.0, 1e-300, 1e-9, -1e-9, 1e-4])
def test_rates_stay_bounded_on_the_stretched_arm(q4):
    q, twist = STRETCHED.copy(), outward(STRETCHED, 0.1)
    q[3] = q4
    found = ARM.joint_velocity(q, twist, n=3)
    assert np.abs(found.qdot).max() == pytest.approx(elbow_peak_rate(ARM, 0.1, 3), rel=1e-3)
    np.testing.assert_allclose(ARM.jacobian(q) @ found.qdot, found.scale * twist, atol=1e-9)
    assert found.branch == np.sign(q4)
    if 0.0 < abs(q4) < 1e-5:
        least = np.linalg.pinv(ARM.jacobian(q), rcond=1e-300) @ twist
        assert np.abs(least).max() > 1e4


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5])
@pytest.mark.parametrize(("scaling", "tolerance"), [("sine", 1e-9), ("quintic", 1e-9)])
def test_the_peak_rate_is_the_closed_form_s(n, scaling, tolerance):
    q, rates = STRETCHED.copy(), []
    for q4 in np.linspace(-1.0, 1.0, 2001):
        q[3] = q4
        z = ARM.forward(q) * np.array([0.0, 0.0, -0.15]) - np.array([0.0, 0.0, 0.15])
        twist = np.concatenate([0.1 * z / np.linalg.norm(z), np.zeros(3)])
        rates.append(abs(ARM.joint_velocity(q, twist, n=n, scaling=scaling).qdot[3]))
    assert max(rates) == pytest.approx(elbow_peak_rate(ARM, 0.1, n, scaling), rel=tolerance)
    if scaling == "sine":
        assert elbow_peak_rate(ARM, 0.1, n) == pytest.approx(2 ** (n + 1) * 0.1 / 0.35)


def test_the_rule_for_n_is_the_greatest_that_keeps_the_limit():
    assert order_for_rate(ARM, 0.1, 3.0) == 2 == math.floor(math.log2(3.0 * 0.35 / 0.2))
    for arm, speed, limit in ((ARM, 0.02, 2.5), (ARM, 0.1, 9.0), (UNEQUAL, 0.05, 3.0)):
        n = order_for_rate(arm, speed, limit)
        assert elbow_peak_rate(arm, speed, n) <= limit < elbow_peak_rate(arm, speed, n + 1)
    with pytest.raises(InvalidValue, match="speed = 1.0: expected at most 0.175 m/s for 2 rad/s"):
        order_for_rate(ARM, 1.0, 2.0)


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("scaling", ["sine", "quintic"])
def test_the_time_scale_is_odd_smooth_at_its_edge_and_one_beyond(n, scaling):
    epsilon, h = math.pi / 2 ** (n + 1), 1e-3 / 2**n
    b = [time_scale(epsilon + k * h, n, scaling)[0] for k in range(-3, 3)]
    assert b[3:] == [1.0] * 3 and time_scale(-0.3 * epsilon, n, scaling)[0] == -time_scale(0.3 * epsilon, n, scaling)[0]
    assert (b[3] - b[2]) / h == pytest.approx(0.0, abs=1e-3 * 2**n)
    bend = (b[3] - 2 * b[2] + b[1]) / h**2 / 4**n
    assert bend == (pytest.approx(-1.0, abs=0.01) if scaling == "sine" else pytest.approx(0.0, abs=0.01))
    for q4 in (1e-9, 0.5 * epsilon, epsilon, 2.0):
        scale, over = time_scale(q4, n, scaling)
        assert over == pytest.approx(scale / math.sin(q4))
    assert time_scale(0.0, n, scaling) == (0.0, pytest.approx(time_scale(1e-8, n, scaling)[1]))


def test_reading_a_fails_where_only_the_method_is_singular_and_b_does_not():
    """Near q6 = 0 with the elbow bent; the Jacobian has full rank there."""
    rng = make_rng(4)
    worst = {"A": 0.0, "B": 0.0}
    for _ in range(200):
        q = rng.uniform(-1.0, 1.0, 7)
        q[1], q[3], q[5] = rng.uniform(0.5, 2.0), rng.uniform(0.5, 2.0), 1e-5
        assert np.linalg.svd(ARM.jacobian(q), compute_uv=False)[-1] > 1e-3
        for wrist in worst:
            worst[wrist] = max(worst[wrist], np.abs(ARM.joint_velocity(q, TWIST, wrist=wrist).qdot).max())
    assert worst["A"] > 1e3 > 20.0 > worst["B"]
    q[5] = 0.0
    assert np.isfinite(ARM.joint_velocity(q, TWIST).qdot).all()
    assert not np.isfinite(ARM.joint_velocity(q, TWIST, wrist="A").qdot).all()


def test_the_swivel_turns_the_elbow_and_leaves_the_tip():
    q = np.array([0.3, 1.2, -0.4, 1.1, 0.5, 0.9, 0.1])
    qdot = ARM.joint_velocity(q, np.zeros(6), swivel_rate=0.2).qdot
    np.testing.assert_allclose(ARM.jacobian(q) @ qdot, 0.0, atol=1e-12)
    line = ARM.forward(q) * np.array([0.0, 0.0, -0.15]) - np.array([0.0, 0.0, 0.15])

    def elbow_axis(q):
        return ARM.forward(np.array([*q[:3], 0.0, 0.0, 0.0, 0.0])).rotation[:, 1]

    h = 1e-6
    turned = np.cross(elbow_axis(q), (elbow_axis(q + h * qdot) - elbow_axis(q)) / h)
    rate = turned @ line / np.linalg.norm(line)
    assert 0.15 < rate <= 0.2


def test_rates_stay_finite_at_the_shoulder_s_and_the_wrist_s_own_singularities():
    for q2, q3, q4, q5, q6 in ((0, 0.5, 0, 0.5, 0), (0, math.pi / 2, 1, 0.3, 1), (1, 0.3, 1, math.pi / 2, 0),
                               (0, 0.3, 1, 0.3, 0), (0, 0, 0, 0, 0)):  # fmt: skip
        found = ARM.joint_velocity(np.array([0.1, q2, q3, q4, q5, q6, 0.2]), TWIST)
        assert np.abs(found.qdot).max() < 200.0 and found.damped


GOOD = {"q": STRETCHED, "twist": TWIST}
BAD = (
    ({"n": 0}, InvalidValue, "n = 0"), ({"n": -2}, InvalidValue, "n = -2"), ({"n": 2.0}, InvalidType, "n = 2.0"),
    ({"n": True}, InvalidType, "n = True"), ({"n": "2"}, InvalidType, "n = '2'"), ({"n": 99}, InvalidValue, "n = 99"),
    ({"q": np.full(7, np.nan)}, InvalidValue, "q1 = nan"), ({"q": np.zeros(6)}, InvalidValue, "q = "),
    ({"q": [0, 0, 0, 2.7, 0, 0, 0]}, InvalidValue, "q4 = 2.7: expected an angle from -2.6180 to 2.6180"),
    ({"q": "zero"}, InvalidType, "q = 'zero'"),
    ({"twist": [0, 0, np.inf, 0, 0, 0]}, InvalidValue, "twist = "),
    ({"twist": np.array([0, 0, np.inf, 0, 0, -np.inf])}, InvalidValue, "twist = "),
    ({"twist": np.zeros(3)}, InvalidValue, "twist = "), ({"swivel_rate": np.nan}, InvalidValue, "swivel_rate = nan"),
    ({"swivel_rate": "fast"}, InvalidType, "swivel_rate"), ({"scaling": "cosine"}, InvalidValue, "scaling = 'cosine'"),
    ({"wrist": "C"}, InvalidValue, "wrist = 'C': expected one of 'A', 'B'"),
)  # fmt: skip


@pytest.mark.parametrize(("change", "kind", "says"), BAD)
def test_bad_input_is_named(change, kind, says):
    with pytest.raises(kind) as raised:
        ARM.joint_velocity(**{**GOOD, **change})
    assert says in str(raised.value)


@pytest.mark.parametrize(("change", "says"), [
    ({"upper": 0.0}, "upper = 0.0"), ({"lower": np.nan}, "lower = nan"), ({"tip_offset": -0.1}, "tip_offset = -0.1"),
    ({"limits": (1,) * 6}, "limits = "), ({"limits": (1, 1, 1, 3.2, 1, 1, 1)}, "the fourth < pi"),
])  # fmt: skip
def test_a_bad_arm_is_named(change, says):
    with pytest.raises(InvalidValue) as raised:
        SphericalArm(**change)
    assert says in str(raised.value)
