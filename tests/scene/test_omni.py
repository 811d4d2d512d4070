"""Omni-wheel kinematics against wheels rolled in small steps, and against the wheels of the robot's file."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tutorialbot import robots
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.scene.omni import OmniWheel, jacobian, limit, to_twist, to_wheels
from tutorialbot.scene.room import WHEELS

SCATTERED = (OmniWheel(0.3, 0.1, 0.4, 0.05), OmniWheel(-0.2, 0.25, 2.0, 0.08), OmniWheel(-0.1, -0.3, 4.4, 0.06))
number = st.floats(-1.0, 1.0)
twists = st.tuples(number, number, st.floats(-3.0, 3.0)).map(np.array)


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@settings(max_examples=30)
@given(twists, st.sampled_from([WHEELS, SCATTERED]))
def test_centres_move_along_their_rolling_direction_as_far_as_the_wheels_roll(twist, wheels):
    """Finite differences of the centres in the world; what is left points along the axles, where the rollers turn."""
    base, h = np.array([0.3, -0.2, 0.7]), 1e-6

    def centres(t):
        moved = base + t * np.append(rotation(base[2]) @ twist[:2], twist[2])
        return moved[:2] + np.array([(w.x, w.y) for w in wheels]) @ rotation(moved[2]).T

    velocity = (centres(h) - centres(-h)) / (2 * h)
    angles = base[2] + np.array([w.angle for w in wheels])
    along = (velocity * np.stack([np.cos(angles), np.sin(angles)], axis=1)).sum(axis=1)
    np.testing.assert_allclose(along, [w.radius for w in wheels] * to_wheels(wheels, twist), atol=1e-8)


@given(twists, st.sampled_from([WHEELS, SCATTERED]))
def test_round_trip(twist, wheels):
    again, slip = to_twist(wheels, to_wheels(wheels, twist))
    np.testing.assert_allclose(again, twist, atol=1e-12)
    assert slip < 1e-12


@given(twists, st.integers(0, 3), st.floats(0.1, 2.0))
def test_one_wheel_out_of_step_drags_all_four(twist, which, error):
    """Four wheels, three unknowns: a quarter of the square of an error in one rate cannot be rolled away."""
    rates = to_wheels(WHEELS, twist)
    rates[which] += error
    assert to_twist(WHEELS, rates)[1] == pytest.approx(0.5 * error * WHEELS[which].radius, abs=1e-12)


@given(st.tuples(*[st.floats(-5.0, 5.0)] * 4).map(np.array), twists)
def test_no_other_twist_fits_the_rates_better(rates, other):
    twist, slip = to_twist(WHEELS, rates)
    radius = np.array([w.radius for w in WHEELS])
    assert np.linalg.norm(radius * (to_wheels(WHEELS, twist + other) - rates)) >= slip - 1e-12


def test_many_twists_at_once():
    many = np.random.default_rng(3).normal(size=(7, 3))
    np.testing.assert_allclose(to_wheels(WHEELS, many), [to_wheels(WHEELS, one) for one in many], atol=1e-12)


@given(twists, st.floats(0.1, 20.0))
def test_limit_holds_and_keeps_the_direction(twist, fastest):
    slower = limit(WHEELS, twist, fastest)
    used = np.abs(to_wheels(WHEELS, slower)).max() / fastest
    assert used <= 1 + 1e-12 and slower @ twist >= 0
    np.testing.assert_allclose(np.cross(slower, twist), 0, atol=1e-12)
    if used < 1 - 1e-9:
        np.testing.assert_array_equal(slower, twist)


def test_the_wheels_of_the_robots_file_roll_as_the_equations_say():
    """On the floor below each wheel: speed of its centre and of its spin, along the rolling direction, cancel."""
    model = robots.load("life_support_robot")
    data = mujoco.MjData(model)
    data.joint("base_yaw").qpos[:], data.joint("base_x").qpos[:] = 0.6, 0.4
    twist = np.array([0.3, -0.2, 0.9])
    data.joint("base_x").qvel[:], data.joint("base_y").qvel[:] = rotation(0.6) @ twist[:2]
    data.joint("base_yaw").qvel[:] = twist[2]
    for i, rate in enumerate(to_wheels(WHEELS, twist), 1):
        data.joint(f"wheel_{i}").qvel[:] = rate
    mujoco.mj_forward(model, data)
    for i, wheel in enumerate(WHEELS, 1):
        body, jacobian_p = model.body(f"wheel_{i}").id, np.zeros((3, model.nv))
        assert data.xpos[body, 2] == wheel.radius
        contact = data.xpos[body] - [0, 0, wheel.radius]
        mujoco.mj_jac(model, data, jacobian_p, None, contact, body)
        angle = 0.6 + wheel.angle
        assert (jacobian_p @ data.qvel) @ [np.cos(angle), np.sin(angle), 0] == pytest.approx(0, abs=1e-9)


def test_bad_arguments():
    for field in ("x", "y", "angle", "radius"):
        with pytest.raises(InvalidValue, match=field):
            OmniWheel(**{"x": 0.0, "y": 0.0, "angle": 0.0, "radius": 0.1, field: np.inf})
    with pytest.raises(InvalidValue, match="radius"):
        OmniWheel(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(InvalidValue, match="twist"):
        to_wheels(WHEELS, np.array([0, np.nan, 0]))
    with pytest.raises(InvalidValue, match="rates"):
        to_twist(WHEELS, np.zeros(3))
    with pytest.raises(InvalidValue, match="wheels"):
        to_twist(WHEELS[:2], np.zeros(2))
    with pytest.raises(InvalidValue, match="wheels"):
        to_twist([OmniWheel(0.0, y, 0.0, 0.1) for y in (-1.0, 0.0, 1.0)], np.zeros(3))
    for wheels in (None, (), [1, 2, 3], "wheels", WHEELS[0]):
        for call in (jacobian, lambda w: to_wheels(w, np.zeros(3)), lambda w: to_twist(w, np.zeros(3))):
            with pytest.raises(InvalidType, match="^wheels = "):
                call(wheels)
    with pytest.raises(InvalidValue, match="max_rate"):
        limit(WHEELS, np.zeros(3), 0.0)
    assert jacobian(WHEELS).shape == (4, 3)
