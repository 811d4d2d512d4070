"""Virtual springs: exact physics, solutions, rest out of reach, uniqueness, and what counts as misuse."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

from tutorialbot import robots
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.ik import prioritized
from tutorialbot.ik.peers import damped_least_squares, strict_null_space
from tutorialbot.ik.springs import Task, energy_at, errors_at, force_and_stiffness, problem
from tutorialbot.pose import interpolate
from tutorialbot.studies import IkCase, ik_targets

UNREACHABLE = ("base locked", "too high")


def solve(case: IkCase, q0=None, **options):
    task = Task("tool", case.target)
    return prioritized.solve(case.model, case.q0 if q0 is None else q0, task, posture=case.posture, **options)


def hand_error(case: IkCase, q: np.ndarray) -> tuple[float, float]:
    """Position [m] and rotation error [rad], by another path than the solver's."""
    data = case.model.createData()
    pin.framesForwardKinematics(case.model, data, q)
    apart = data.oMf[case.model.getFrameId("tool")].actInv(case.target)
    return float(np.linalg.norm(apart.translation)), float(pin.AngleAxis(apart.rotation).angle)


def energy(this, q):
    return energy_at(this, errors_at(this, q), np.zeros(len(q)), 0.0)


@pytest.mark.parametrize("kind", ["reachable", "base locked"])
def test_force_and_stiffness_are_derivatives_of_the_energy(kind):
    """Finite differences, far from the target, with two tasks on different frames."""
    for case in ik_targets(kind, 5, 201):
        elbow = Task("arm_elbow", case.target * pin.SE3(pin.exp3(np.array([0.5, -1.0, 0.4])), np.ones(3)), 0.7, 0.3)
        this = problem(case.model, [Task("tool", case.target), elbow], case.posture)
        force, stiffness = force_and_stiffness(this, case.q0, errors_at(this, case.q0))
        h, units = 1e-4, np.eye(case.model.nv)
        slope = [(energy(this, case.q0 + h * u) - energy(this, case.q0 - h * u)) / (2 * h) for u in units]
        np.testing.assert_allclose(-force, slope, atol=1e-7)
        bend = [
            (force_and_stiffness(this, q_minus, errors_at(this, q_minus))[0]
             - force_and_stiffness(this, q_plus, errors_at(this, q_plus))[0]) / (2 * h)
            for q_plus, q_minus in ((case.q0 + h * u, case.q0 - h * u) for u in units)
        ]
        np.testing.assert_allclose(stiffness, bend, atol=1e-6)


def check_reachable(cases):
    for case in cases:
        result = solve(case)
        position, rotation = hand_error(case, result.q)
        assert result.converged and result.settled
        assert position < 1e-4 and rotation < np.deg2rad(0.1)
        assert result.position_error == pytest.approx(position, abs=1e-9)
        assert (result.q >= case.model.lowerPositionLimit).all() and (result.q <= case.model.upperPositionLimit).all()


def check_unreachable(cases):
    for case in cases:
        result = solve(case)
        assert result.settled and not result.converged and result.position_error > 0.01
        assert hand_error(case, result.q)[0] == pytest.approx(result.position_error, abs=1e-9)
        assert np.abs(solve(case, result.q, iterations=5).q - result.q).max() < 1e-3
        this, q = problem(case.model, Task("tool", case.target), case.posture), result.q
        for _ in range(5):
            q = prioritized.step(this, q, prioritized.SOFTEST)
        assert np.abs(q - result.q).max() < 1e-3


def test_reachable_targets():
    check_reachable(ik_targets("reachable", 60, 202))


@pytest.mark.parametrize("kind", UNREACHABLE)
def test_unreachable_targets_come_to_rest(kind):
    check_unreachable(ik_targets(kind, 40, 203))


@pytest.mark.full
def test_a_thousand_reachable_targets():
    check_reachable(ik_targets("reachable", 1000, 204))


@pytest.mark.full
@pytest.mark.parametrize("kind", UNREACHABLE)
def test_a_thousand_unreachable_targets_come_to_rest(kind):
    check_unreachable(ik_targets(kind, 1000, 205))


def test_any_pose_near_the_start_is_reached():
    """Poses drawn evenly in the ball of 0.3 m and 60 degrees, whether or not a configuration was known for them."""
    rng = np.random.default_rng(206)
    for case in ik_targets("reachable", 60, 206):
        data = case.model.createData()
        pin.framesForwardKinematics(case.model, data, case.q0)
        start = data.oMf[case.model.getFrameId("tool")]
        shift, turn = rng.normal(size=3), rng.normal(size=3)
        shift *= 0.3 * rng.uniform() ** (1 / 3) / np.linalg.norm(shift)
        turn *= np.pi / 3 * rng.uniform() / np.linalg.norm(turn)
        target = pin.SE3(pin.exp3(turn) @ start.rotation, start.translation + shift)
        assert solve(IkCase(case.model, case.q0, target, case.posture)).converged


@pytest.mark.parametrize("kind", ["reachable", *UNREACHABLE])
def test_no_step_raises_the_energy(kind):
    """From far away, where a whole step would often overshoot."""
    rng = np.random.default_rng(218)
    for case in ik_targets(kind, 10, 218):
        this = problem(case.model, Task("tool", case.target), case.posture)
        q = np.clip(case.q0 + rng.normal(0.0, 1.5, case.model.nv), this.low, this.high)
        energies = []
        for _ in range(25):
            energies.append(energy_at(this, errors_at(this, q), q - this.posture, 1e-3))
            q = prioritized.step(this, q, 1e-3)
        assert (np.diff(energies) <= 1e-14).all() and energies[-1] < energies[0]


def test_peers_reach_and_chatter():
    """The other two reach what can be reached; out of reach they do not rest: so the test above can fail."""
    for case in ik_targets("reachable", 30, 207):
        task = Task("tool", case.target)
        assert damped_least_squares(case.model, case.q0, task).converged
        assert strict_null_space(case.model, case.q0, task, posture=case.posture).converged
    for method in (damped_least_squares, strict_null_space):
        moved = []
        for case in ik_targets("base locked", 20, 208):
            task = Task("tool", case.target)
            q = method(case.model, case.q0, task).q
            moved.append(np.abs(method(case.model, q, task, iterations=5).q - q).max())
        assert np.median(moved) > 0.05


def test_the_same_question_has_one_answer():
    case = ik_targets("reachable", 1, 209)[0]
    np.testing.assert_array_equal(solve(case).q, solve(case).q)


@pytest.mark.parametrize("kind", ["reachable", "base locked", "too high"])
def test_other_starts_lead_to_the_same_configuration(kind):
    """The posture resolves what the hand leaves free, so where the motion began does not matter."""
    rng = np.random.default_rng(210)
    for case in ik_targets(kind, 25, 210):
        other = solve(case, case.q0 + rng.normal(0.0, 0.3, case.model.nv))
        np.testing.assert_allclose(other.q, solve(case).q, atol=1e-3)


def test_the_redundancy_ends_at_the_nearest_posture():
    """Independent reference: SciPy's SLSQP for min |q - posture| subject to the hand at its target."""
    for case in ik_targets("reachable", 6, 211):
        this = problem(case.model, Task("tool", case.target), case.posture)
        ours = solve(case)
        best = minimize(
            lambda q, case=case: 0.5 * np.sum((q - case.posture) ** 2), ours.q + 0.05, method="SLSQP",
            bounds=list(zip(this.low, this.high, strict=True)), options={"ftol": 1e-12, "maxiter": 300},
            constraints={"type": "eq", "fun": lambda q, this=this: errors_at(this, q).ravel()},
        )
        assert best.success
        np.testing.assert_allclose(ours.q, best.x, atol=2e-3)


@pytest.mark.parametrize("kind", UNREACHABLE)
def test_out_of_reach_nothing_near_is_better(kind):
    """Independent reference: SciPy's L-BFGS-B on the hand's energy finds nothing below the answer, from there.

    (From elsewhere it sometimes does: limits make several valleys, and the springs roll into the nearest.)
    """
    for case in ik_targets(kind, 10, 212):
        this = problem(case.model, Task("tool", case.target), case.posture)
        ours = solve(case).q
        bounds = list(zip(this.low, this.high, strict=True))
        best = minimize(lambda q, this=this: energy(this, q), ours, method="L-BFGS-B", bounds=bounds)
        assert energy(this, ours) <= best.fun * (1 + 1e-6)


def test_stiffer_means_first():
    """Out of reach, raising the stiffness of the orientation buys orientation at the price of position."""
    case = ik_targets("base locked", 1, 213)[0]
    errors = []
    for k_r in (0.01, 0.1, 1.0, 10.0):
        result = prioritized.solve(case.model, case.q0, Task("tool", case.target, 1.0, k_r), posture=case.posture)
        errors.append((result.position_error, result.rotation_error))
    assert (np.diff(errors, axis=0)[:, 0] > 0).all() and (np.diff(errors, axis=0)[:, 1] < 0).all()


def test_the_bases_springs_keep_it_in_place():
    stiff_base = np.array([100.0, 100.0, 100.0, 1, 1, 1, 1, 1, 1])
    away = np.zeros(2)
    for case in ik_targets("reachable", 10, 214):
        both = solve(case), solve(case, posture_weights=stiff_base)
        assert both[0].converged and both[1].converged
        away += [np.linalg.norm((result.q - case.posture)[:3]) for result in both]
    assert away[1] < 0.5 * away[0]


def test_a_task_may_leave_position_or_orientation_free():
    case = ik_targets("reachable", 1, 215)[0]
    for weights, which in (((1.0, 0.0), 0), ((0.0, 0.1), 1)):
        result = prioritized.solve(case.model, case.q0, Task("tool", case.target, *weights), posture=case.posture)
        assert result.converged and (result.position_error, result.rotation_error)[1 - which] == 0.0
        errors = hand_error(case, result.q)
        assert errors[which] < 1e-4 and errors[1 - which] > 1e-3


def test_following_a_path_one_step_at_a_time():
    """0.15 m and 90 degrees in 4 s, one iteration every 40 ms: never more than a millimetre and 0.2 degrees behind."""
    case = ik_targets("reachable", 1, 216)[0]
    data = case.model.createData()
    pin.framesForwardKinematics(case.model, data, case.posture)
    start = data.oMf[case.model.getFrameId("tool")].copy()
    goal = start * pin.SE3(pin.exp3(np.array([np.pi / 2, 0, 0])), np.array([-0.1, 0.1, 0.05]))
    this, q = problem(case.model, Task("tool", start), case.posture), case.posture.copy()
    for s in np.linspace(0, 1, 101)[1:]:
        before, q = q, prioritized.follow(this, interpolate(start, goal, s), q)
        position, rotation = prioritized.worst(this, errors_at(this, q))
        assert position < 1e-3 and rotation < np.deg2rad(0.2)
        assert np.abs(q - before).max() < 0.05


def test_another_robot():
    model = pin.buildSampleModelManipulator()
    q = np.full(model.nv, 0.4)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    frame = model.nframes - 1
    result = prioritized.solve(model, q + 0.3, Task(frame, data.oMf[frame].copy()))
    assert result.converged


def test_misuse_is_named():
    case = ik_targets("reachable", 1, 217)[0]
    task = Task("tool", case.target)
    with pytest.raises(InvalidValue, match="'tool'"):
        prioritized.solve(case.model, case.q0, Task("toool", case.target))
    with pytest.raises(InvalidValue, match="frame = 999"):
        prioritized.solve(case.model, case.q0, Task(999, case.target))
    with pytest.raises(InvalidValue, match="q0"):
        prioritized.solve(case.model, case.q0[:-1], task)
    with pytest.raises(InvalidValue, match="q0"):
        damped_least_squares(case.model, np.full(9, np.nan), task)
    with pytest.raises(InvalidValue, match="posture_weights"):
        solve(case, posture_weights=np.zeros(9))
    with pytest.raises(InvalidValue, match="posture = "):
        prioritized.solve(case.model, case.q0, task, posture=np.zeros(3))
    with pytest.raises(InvalidValue, match="iterations"):
        solve(case, iterations=0)
    with pytest.raises(InvalidValue, match="damping"):
        damped_least_squares(case.model, case.q0, task, damping=0.0)
    with pytest.raises(InvalidType, match="model"):
        prioritized.solve(robots.load("mobile_manipulator"), case.q0, task)
    with pytest.raises(InvalidType, match="tasks = None"):
        prioritized.solve(case.model, case.q0, None)
    with pytest.raises(InvalidType, match="data = 3"):
        prioritized.solve(case.model, case.q0, task, data=3)
    with pytest.raises(InvalidType, match="tasks"):
        prioritized.solve(case.model, case.q0, [case.target])
    with pytest.raises(InvalidValue, match="at least one"):
        prioritized.solve(case.model, case.q0, [])
    with pytest.raises(InvalidType, match="target"):
        Task("tool", np.eye(4))
    with pytest.raises(InvalidValue, match="position_weight"):
        Task("tool", case.target, 0.0, 0.0)
    with pytest.raises(InvalidValue, match="position_weight"):
        Task("tool", case.target, -1.0)
    with pytest.raises(InvalidValue, match="one number each"):
        prioritized.solve(pin.buildSampleModelHumanoid(), np.zeros(9), task)
