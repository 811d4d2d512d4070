"""The arm of paper 2 goes where it is told, by its own controllers, and says where it was."""

import mujoco
import numpy as np
import pytest

from tutorialbot.errors import InvalidValue
from tutorialbot.ik import genetic
from tutorialbot.scene import arm_motion, room

EMPTY = room.Room("empty", [[0, 0], [3, 0], [3, 3], [0, 3]], start=(1.5, 1.5, 0.0))
BENT = np.array([0.0, 0.1, 0.0, -1.2, 0.0, 0.0, -0.1])


@pytest.fixture
def world():
    model, lead = room.assemble(EMPTY, seen=False, tool=False)
    data = mujoco.MjData(model)
    room.place(model, data, EMPTY.start, np.zeros(7))
    return model, data, lead


def test_the_arm_arrives_and_the_trace_is_true(world):
    trace = arm_motion.follow_angles(*world, [BENT, np.zeros(7), BENT], hold=4.0)
    assert np.abs(trace.measured[trace.arrivals] - [BENT, np.zeros(7), BENT]).max() < 0.002
    np.testing.assert_allclose(trace.commanded[trace.arrivals], [BENT, np.zeros(7), BENT], atol=1e-9)
    expected, _ = genetic.forward_kinematics(trace.measured)  # an independent way to the tip
    np.testing.assert_allclose(trace.tip, expected, atol=5e-3)  # positions of sites lag a step behind the joints
    np.testing.assert_allclose(trace.tip[trace.arrivals], expected[trace.arrivals], atol=1e-5)
    speed = np.abs(np.diff(trace.commanded, axis=0)).max(axis=0) / arm_motion.PERIOD
    assert (speed <= room.SPEED[3:] + 1e-9).all() and speed.max() > 1.0
    assert np.allclose(np.diff(trace.times), arm_motion.PERIOD)


def test_a_world_that_steps_too_far_and_no_way_points_are_refused(world):
    with pytest.raises(InvalidValue, match="^way_points = 'none'"):
        arm_motion.follow_angles(*world, np.zeros((0, 7)))
    with pytest.raises(InvalidValue, match="^hold = inf"):
        arm_motion.follow_angles(*world, [BENT], hold=np.inf)
    assert arm_motion.follow_angles(*world, np.zeros((1, 7)), hold=0.0).arrivals.tolist() == [0]  # it is there already
    model, lead = room.assemble(EMPTY, seen=False, tool=False, timestep=0.1)
    with pytest.raises(InvalidValue, match="^world.opt.timestep = 0.1"):
        arm_motion.follow_angles(model, mujoco.MjData(model), lead, [BENT])


def test_a_heavier_hand_droops_more():
    """In a posture that holds the nozzle above the floor."""
    raised, drops = genetic.optimum([0.3, 0.1, 0.25], [0.0, -1.57, 0.0]).q, []
    for tool in (False, True):
        model, lead = room.assemble(EMPTY, seen=False, tool=tool)
        data = mujoco.MjData(model)
        room.place(model, data, EMPTY.start, raised)
        trace = arm_motion.follow_angles(model, data, lead, [raised], hold=0.3)
        drops.append(trace.tip[0, 2] - trace.tip[-1, 2])
    assert drops[1] > drops[0] + 0.005


@pytest.mark.parametrize("bad", [np.zeros(7), np.full((1, 7), np.nan), [[0, 0, 0, 0.5, 0, 0, 0]], "up"])
def test_bad_way_points_are_refused(world, bad):
    with pytest.raises((ValueError, TypeError), match=r"^way_points"):
        arm_motion.follow_angles(*world, bad)
