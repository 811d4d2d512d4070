"""The optimum that everything of paper 2 is measured by, against searches that share nothing with it."""

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from tutorialbot.errors import InvalidValue
from tutorialbot.ik.arm7 import ARM, LIMITS, Arm, forward_kinematics
from tutorialbot.ik.fitness import fitness, solution, task_error, task_jacobian
from tutorialbot.ik.oracle import is_usual, least_slack, lifted, optimum, swivel_family

TILT = np.array([0.0, -1.57, 0.0])
TABLE_1 = [(0.2, 0.1, 0), (0.3, 0.1, 0), (0.4, 0.1, 0), (0.3, 0, 0), (0.3, 0.2, 0), (0.3, 0.2, 0.1), (0.3, 0.1, 0.1)]


@pytest.mark.parametrize("position", TABLE_1[::2])
def test_differential_evolution_finds_nothing_lower(position):
    """scipy's own evolution of eq. (5) comes to the same value, from above."""
    best = optimum(position, TILT)
    found = differential_evolution(
        lambda q: fitness(q.T, position, TILT), list(zip(ARM.lower, ARM.upper, strict=True)), strategy="rand1bin",
        mutation=0.5, recombination=0.9, popsize=15, maxiter=500, tol=0.0, polish=False, vectorized=True,
        updating="deferred", rng=np.random.default_rng(3301),
    )  # fmt: skip
    assert best.residual - 1e-8 <= found.fun <= best.residual + 5e-4


def test_the_table_of_the_method_note():
    """z errors [mm], found there by other code; x, y and tilt exact, and radial deviation binds."""
    for position, z in zip(TABLE_1, (57.0, 41.8, 58.7, 52.5, 40.9, 0.0, 0.0), strict=True):
        best = optimum(position, TILT)
        assert 1e3 * best.position_error[2] == pytest.approx(z, abs=0.06)
        assert np.abs(best.position_error[:2]).max() < 1e-6 and np.abs(best.tilt_error).max() < 1e-6
        assert best.within_limits and best.converged == (z == 0.0)
        assert best.binding == (() if z == 0.0 else ("radial deviation",))


def test_closed_form_and_slsqp_agree():
    """Two ways that share forward kinematics alone."""
    for position in TABLE_1[:5]:
        _, lift = lifted(np.array(position), TILT, ARM)
        starts = np.random.default_rng(3302).uniform(ARM.lower, ARM.upper, (6, 7))
        numeric = min(np.abs(task_error(least_slack(q, position, TILT, ARM)[0], position, TILT, ARM)).sum()
                      for q in starts)  # fmt: skip
        assert lift == pytest.approx(numeric, abs=2e-5)


def test_every_member_of_the_swivel_family_holds_the_target():
    rng = np.random.default_rng(3303)
    positions, tilts = forward_kinematics(rng.uniform(ARM.lower, ARM.upper, (30, 7)))
    q, room = swivel_family(positions, tilts, swivels=np.linspace(0.0, 6.0, 40))
    tips, found = forward_kinematics(q)
    np.testing.assert_allclose(tips, np.broadcast_to(positions[:, None, None], tips.shape), atol=1e-9)
    np.testing.assert_allclose(np.sin(0.5 * (found - tilts[:, None, None])), 0.0, atol=1e-7)
    np.testing.assert_array_equal(room >= 0.0, ARM.within(q))


def test_the_swivel_family_contains_the_configuration_that_made_the_target():
    """Swept finely, it passes within a hair of the configuration that the target came from: no branch is missing."""
    made = np.random.default_rng(3304).uniform(ARM.lower, ARM.upper, (40, 7))
    q, _ = swivel_family(*forward_kinematics(made), swivels=np.linspace(0.0, 2.0 * np.pi, 1440))
    apart = np.abs(np.angle(np.exp(1j * (q - made[:, None, None])))).max(axis=-1).min(axis=(1, 2))
    assert np.quantile(apart, 0.9) < 0.01 and apart.max() < 0.2  # near a singularity joints move much with the swivel


def test_random_reachable_targets_have_no_error():
    made = np.random.default_rng(3305).uniform(ARM.lower, ARM.upper, (40, 7))
    for position, tilt in zip(*forward_kinematics(made), strict=True):
        best = optimum(position, tilt)
        assert best.converged and best.residual < 1e-6 and best.binding == ()


def test_the_same_target_has_one_answer():
    np.testing.assert_array_equal(optimum(TABLE_1[0], TILT).q, optimum(TABLE_1[0], TILT).q)


def test_binding_limits_are_those_whose_move_helps():
    """Each limit of the arm moved outward by a degree: the residual falls where `binding` says so, and only there."""
    names = [name for pair in LIMITS for name in pair]
    for position in (TABLE_1[0], (0.1, 0.4, 0.0), (0.45, 0.3, 0.2)):
        best = optimum(position, TILT)
        helped = set()
        for i, name in enumerate(names):
            side = (ARM.lower, ARM.upper)[i % 2][i // 2]
            arm = ARM.with_limit(name, side + np.deg2rad(1.0) * (1 if i % 2 else -1))
            if local(best.q, position, arm) < best.residual - 1e-6:
                helped.add(name)
        assert set(best.binding) == helped


def local(q, position, arm):
    return np.abs(task_error(least_slack(q, np.array(position), TILT, arm)[0], position, TILT, arm)).sum()


def test_a_target_far_away():
    best = optimum([3.0, 0.0, 0.0], TILT)
    assert not best.converged and best.residual > 2.0 and best.within_limits


def test_another_build_has_no_closed_form_but_an_optimum():
    offsets = ARM.offsets.copy()
    offsets[5] = [0.02, 0.0, 0.0]
    arm = Arm(offsets=offsets)
    q = np.random.default_rng(3306).uniform(arm.lower, arm.upper)
    position, tilt = forward_kinematics(q, arm=arm)
    assert optimum(position, tilt, arm=arm).residual < 1e-6
    with pytest.raises(InvalidValue, match="closed form"):
        swivel_family(position[None], tilt[None], arm=arm)


@pytest.mark.parametrize(("row", "column"), [(row, x) for row in (1, 2, 5, 6) for x in range(3)]
                         + [(3, 0), (3, 1), (4, 0), (4, 1)])  # fmt: skip
def test_any_link_where_none_may_be_makes_another_build(row, column):
    offsets = ARM.offsets.copy()
    offsets[row, column] = 0.02
    assert is_usual(ARM) and not is_usual(Arm(offsets=offsets))
    assert not is_usual(Arm(axes=np.roll(ARM.axes, 1, axis=0)))


def test_the_derivative_is_one():
    """Against a one-sided difference of another width."""
    for q in np.random.default_rng(3307).uniform(ARM.lower, ARM.upper, (10, 7)):
        position, tilt = forward_kinematics(q)
        jacobian = task_jacobian(q, position, tilt, ARM)
        slope = (task_error(q + 1e-7 * np.eye(7), position, tilt, ARM) - task_error(q, position, tilt, ARM)) / 1e-7
        np.testing.assert_allclose(jacobian, slope.T, rtol=1e-3, atol=1e-3 * np.abs(jacobian).max())


def test_a_solution_measures_what_it_is_given():
    q = np.array([0.0, 0.1, 0.0, -1.2, 0.0, 0.0, -0.1])
    position, tilt = forward_kinematics(q)
    found = solution(q, position - [0.0, 0.0, 0.05], tilt)
    assert found.position_error == pytest.approx([0.0, 0.0, 0.05]) and not found.converged
    assert solution(q, position - [0.0, 0.0, 9e-4], tilt - [0.0, 0.009, 0.0]).converged
    assert not solution(q, position, tilt - [0.0, 0.011, 0.0]).converged
    outside = q.copy()
    outside[6] = -1.0
    found = solution(outside, *forward_kinematics(outside))
    assert not found.within_limits and not found.converged and found.residual < 1e-12
