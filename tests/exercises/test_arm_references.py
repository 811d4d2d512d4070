"""The references of notebook 2's exercises agree with ways to compute the same that share no line with them."""

import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.exercises.sets import SOLUTIONS
from tutorialbot.checks import arm_optimum
from tutorialbot.checks.arm_kinematics import composed, jacobian
from tutorialbot.checks.counting import Counted, lines_run
from tutorialbot.checks.guard import Wrong
from tutorialbot.checks.mechanism import numbers
from tutorialbot.ik.arm7 import ARM, reach
from tutorialbot.ik.oracle import optimum
from tutorialbot.seeding import make_rng


def test_the_jacobian_is_what_small_steps_approach():
    rng, h = make_rng(31), 1e-6
    for q in rng.uniform(ARM.lower, ARM.upper, (20, 7)):
        tip, turned = reach((q + h * np.vstack([np.eye(7), -np.eye(7)])).T, ARM)
        turns = Rotation.from_quat(turned.T, scalar_first=True)
        spin = (turns[:7] * turns[7:].inv()).as_rotvec().T
        expected = np.vstack([tip[:, :7] - tip[:, 7:], spin]) / (2 * h)
        assert jacobian(q, ARM.axes, ARM.offsets) == pytest.approx(expected, abs=1e-8)


def test_the_tilt_composes_as_scipy_has_it():
    for tilt in make_rng(32).uniform(-3.0, 3.0, (50, 3)):
        assert composed(tilt) == pytest.approx(Rotation.from_euler("YXZ", tilt[[1, 0, 2]]).as_matrix(), abs=1e-12)


@pytest.mark.parametrize("arm", [ARM, arm_optimum.STIFF_ELBOW], ids=["usual", "stiff elbow"])
def test_the_limit_that_pays_most_is_the_one_with_a_price_in_the_linear_program(arm):
    position = np.array([0.29, 0.11, 0.0])
    fall = arm_optimum.gains(arm_optimum.measured(arm, position), arm, np.deg2rad(5.0))
    assert optimum(position, arm_optimum.TILT, arm=arm).binding == (arm_optimum.NAMES[fall.argmax()],)


def test_both_arms_are_held_by_different_limits_and_the_targets_are_what_they_are_said_to_be():
    names = [
        optimum(np.array([0.29, 0.11, 0.0]), arm_optimum.TILT, arm=a).binding for a in (ARM, arm_optimum.STIFF_ELBOW)
    ]
    assert names[0] != names[1]
    for check, arm, position, _ in arm_optimum.targets():
        best = optimum(position, arm_optimum.TILT, arm=arm)
        assert np.abs(best.tilt_error).max() < 1e-6
        assert (abs(best.position_error[2]) < 1e-6) == (check == "within reach")


def test_steps_of_python_grow_with_a_loop_and_not_with_an_array():
    def looped(n):
        return [i * i for i in range(n)]

    def mapped(n):
        return list(map(lambda i: i * i, range(n)))  # noqa: C417 - the hidden loop is the point

    def at_once(n):
        return np.arange(n) ** 2

    before = sys.gettrace(), sys.getprofile()
    grown = [lines_run(lambda f=f: f(1000))[1] - lines_run(lambda f=f: f(10))[1] for f in (looped, mapped, at_once)]
    assert grown[0] > 900 and grown[1] > 900 and grown[2] == 0
    assert (sys.gettrace(), sys.getprofile()) == before


def test_each_posture_counts_alone_and_in_company():
    counted = Counted(lambda q: q.sum(axis=-1), 10, lambda q: numbers(q, (*np.shape(q)[:-1], 7), ()), "no more.")
    assert counted.evaluate(np.ones(7)) == 7.0 and isinstance(counted.evaluate([0] * 7), float)
    assert counted.evaluate(np.ones((2, 4, 7))).shape == (2, 4)
    assert len(counted.costs) == 10
    with pytest.raises(Wrong):
        counted.evaluate(np.ones((1, 7)))
    assert counted.broken.check == "budget" and len(counted.costs) == 10


@pytest.mark.parametrize("seed", range(5))
def test_the_difference_mutation_passes_with_any_chance(seed, monkeypatch):
    """The statistical rules leave room: other generators of the same solution pass them too."""
    from tutorialbot.checks import arm_evolution, mechanism

    monkeypatch.setattr(arm_evolution, "SEED", 100 + seed)
    monkeypatch.setattr(mechanism, "_tools", [])
    mechanism.remember_tools()  # with this seed: an empty memory would count as tampering
    assert arm_evolution.step_by_difference.verdict(SOLUTIONS["step_by_difference"]).outcome == "correct"
