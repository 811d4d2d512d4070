"""Caster kinematics against a wheel rolled in small steps, and the speed profile against its limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.scene.control import Caster, limit, to_casters, to_twist, trapezoid_step

ACTIVE = (Caster(0.0, 0.18, 0.06, 0.08), Caster(0.0, -0.18, 0.06, 0.08))
PASSIVE = tuple(Caster(x, y, 0.03, 0.04) for x in (-0.22, 0.22) for y in (-0.22, 0.22))
ALL = ACTIVE + PASSIVE

number = st.floats(-1.0, 1.0)
twists = st.tuples(number, number, st.floats(-3.0, 3.0)).map(np.array)
angles = st.lists(st.floats(-7.0, 7.0), min_size=6, max_size=6).map(np.array)


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def contact_points(base: np.ndarray, steer: np.ndarray) -> np.ndarray:
    """(n, 2) [m] contact points in the world, for the base's pose (x, y, yaw)."""
    pivots = np.array([(c.x, c.y) for c in ALL])
    trail = np.array([-c.offset * np.array([np.cos(a), np.sin(a)]) for c, a in zip(ALL, steer, strict=True)])
    return base[:2] + (pivots + trail) @ rotation(base[2]).T


@settings(max_examples=30)
@given(twists, angles)
def test_contact_points_roll_along_their_heading(twist, steer):
    """Finite differences of the contact points in the world: r theta' along the wheel, nothing across."""
    steer_rates, drive_rates = to_casters(ALL, twist, steer)
    base, h = np.array([0.3, -0.2, 0.7]), 1e-6

    def contacts(t):
        moved = base + t * np.append(rotation(base[2]) @ twist[:2], twist[2])
        return contact_points(moved, steer + t * steer_rates)

    velocity = (contacts(h) - contacts(-h)) / (2 * h)
    heading = np.stack([np.cos(base[2] + steer), np.sin(base[2] + steer)], axis=1)
    rolled = np.array([c.radius for c in ALL]) * drive_rates
    np.testing.assert_allclose(velocity, rolled[:, None] * heading, atol=1e-8)


def test_a_drive_of_two_seconds_leaves_a_track_as_long_as_the_wheels_rolled():
    """Integrated: the arc lengths of the tracks equal r |theta| (the wheels never roll back here)."""
    twist, steer, base, dt = np.array([0.3, 0.2, 0.5]), np.zeros(6), np.zeros(3), 5e-4
    rolled, track, last = np.zeros(6), np.zeros(6), contact_points(base, steer)
    for _ in range(4_000):
        steer_rates, drive_rates = to_casters(ALL, twist, steer)
        middle = steer + 0.5 * dt * steer_rates
        steer_rates, drive_rates = to_casters(ALL, twist, middle)
        steer = steer + dt * steer_rates
        base = base + dt * np.append(rotation(base[2] + 0.5 * dt * twist[2]) @ twist[:2], twist[2])
        now = contact_points(base, steer)
        track += np.linalg.norm(now - last, axis=1)
        rolled += dt * np.abs(drive_rates) * [c.radius for c in ALL]
        last = now
    np.testing.assert_allclose(track, rolled, atol=1e-5)
    assert (rolled > 0.4).all()


@given(twists, angles)
def test_round_trip(twist, steer):
    for casters, phi in ((ACTIVE, steer[:2]), (ALL, steer)):
        again, slip = to_twist(casters, phi, *to_casters(casters, twist, phi))
        np.testing.assert_allclose(again, twist, atol=1e-12)
        assert slip < 1e-12


@given(twists, angles, st.integers(0, 1), st.floats(0.1, 2.0))
def test_one_wheel_out_of_step_slips(twist, steer, which, error):
    """Two drive rates that pull apart along the line between the wheels cannot be a rigid base's."""
    steer_rates, drive_rates = to_casters(ACTIVE, twist, np.array([np.pi / 2, np.pi / 2]) + 0.1 * np.tanh(steer[:2]))
    drive_rates[which] += error
    slip = to_twist(ACTIVE, np.array([np.pi / 2, np.pi / 2]) + 0.1 * np.tanh(steer[:2]), steer_rates, drive_rates)[1]
    assert slip > 0.5 * error * ACTIVE[0].radius / np.sqrt(2)


@given(twists, angles, st.floats(0.1, 5.0), st.floats(0.1, 5.0))
def test_limits_hold_and_keep_the_direction(twist, steer, max_steer, max_drive):
    slower = limit(ACTIVE, twist, steer[:2], max_steer, max_drive)
    steer_rates, drive_rates = to_casters(ACTIVE, slower, steer[:2])
    used = max(np.abs(steer_rates).max() / max_steer, np.abs(drive_rates).max() / max_drive)
    assert used <= 1 + 1e-12
    np.testing.assert_allclose(np.cross(slower, twist), 0, atol=1e-12)
    assert slower @ twist >= 0
    if used < 1 - 1e-9:  # no more than needed: what stays below the limits is untouched
        np.testing.assert_array_equal(slower, twist)


def test_sideways_from_aligned_wheels_needs_fast_steering():
    """The case of the method note: 0.2 m/s sideways and 0.3 rad/s, aligned, b = 0.06 m."""
    steer_rates, _ = to_casters(ACTIVE, np.array([0.0, 0.2, 0.3]), np.zeros(2))
    assert np.abs(steer_rates).max() == pytest.approx(0.2 / 0.06 - 0.3)
    assert np.linalg.norm(limit(ACTIVE, np.array([0.0, 0.2, 0.3]), np.zeros(2), 1.0, 10.0)) < 0.2


def run(goal, vmax, amax, dt, steps, start=0.0, velocity=0.0):
    n = len(goal)
    x, v = np.full(n, start), np.full(n, velocity)
    xs, vs = [x], [v]
    for _ in range(steps):
        x, v = trapezoid_step(x, v, goal, vmax, amax, dt)
        xs.append(x), vs.append(v)
    return np.array(xs), np.array(vs)


positive_list = st.lists(st.floats(0.05, 5.0), min_size=3, max_size=3).map(np.array)


@settings(max_examples=60)
@given(
    st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array),
    positive_list,
    positive_list,
    st.sampled_from([0.001, 0.01, 0.04]),
)
def test_profile_reaches_its_goal_without_passing_it_and_within_its_limits(goal, vmax, amax, dt):
    ideal = np.abs(goal) / vmax + vmax / amax  # a trapezoid; more than a triangle needs
    steps = min(int(np.ceil(ideal.max() / dt)) + 3, 4_000)
    xs, vs = run(goal, vmax, amax, dt, steps)
    assert (np.abs(vs) <= vmax * (1 + 1e-12)).all()
    assert (np.abs(np.diff(vs, axis=0)) <= amax * dt * (1 + 1e-9)).all()
    assert ((xs - goal) * np.sign(goal) <= 1e-12).all()
    if steps < 4_000:
        np.testing.assert_allclose(xs[-1], goal, atol=1e-12)
        np.testing.assert_allclose(vs[-1], 0, atol=1e-9)


def test_profile_is_as_fast_as_the_ideal_trapezoid():
    """Distance d from rest to rest takes d / v + v / a; the sampled profile loses less than three periods."""
    goal, vmax, amax, dt = np.array([1.0, -0.02]), np.array([0.5, 0.5]), np.array([2.0, 2.0]), 0.01
    ideal = np.array([1.0 / 0.5 + 0.5 / 2.0, 2 * np.sqrt(0.02 / 2.0)])
    xs, vs = run(goal, vmax, amax, dt, 400)
    arrival = dt * np.argmax(np.abs(xs - goal) < 1e-12, axis=0)
    assert (arrival <= ideal + 3 * dt).all() and (arrival >= ideal - dt).all()
    assert np.abs(vs[:, 0]).max() == 0.5 and np.abs(vs[:, 1]).max() < 0.21


def test_profile_turns_round_for_a_new_goal():
    xs, vs = run(np.array([-1.0]), np.array([1.0]), np.array([2.0]), 0.01, 400, start=0.0, velocity=0.8)
    assert xs.max() == pytest.approx(0.8**2 / 4, abs=0.01)
    assert np.abs(np.diff(vs, axis=0)).max() <= 0.02 + 1e-12
    assert xs[-1] == pytest.approx(-1.0, abs=1e-12)


@pytest.mark.parametrize("field", ["offset", "radius"])
def test_impossible_casters(field):
    with pytest.raises(InvalidValue, match=field):
        Caster(**{"x": 0.0, "y": 0.0, "offset": 0.1, "radius": 0.1, field: 0.0})


def test_bad_arguments():
    with pytest.raises(InvalidValue, match="at least two"):
        to_twist(ACTIVE[:1], np.zeros(1), np.zeros(1), np.zeros(1))
    for casters in ([], None, [3]):
        with pytest.raises(InvalidType, match="casters"):
            to_casters(casters, np.zeros(3), np.zeros(0))
        with pytest.raises(InvalidType, match="casters"):
            to_twist(casters, np.zeros(0), np.zeros(0), np.zeros(0))
    with pytest.raises(InvalidValue, match="twist"):
        to_casters(ACTIVE, np.array([0, np.nan, 0]), np.zeros(2))
    with pytest.raises(InvalidValue, match="steer"):
        to_casters(ACTIVE, np.zeros(3), np.zeros(3))
    with pytest.raises(InvalidValue, match="max_steer_rate"):
        limit(ACTIVE, np.zeros(3), np.zeros(2), 0.0, 1.0)
