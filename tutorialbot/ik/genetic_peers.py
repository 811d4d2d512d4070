"""Other ways to do what the genetic algorithm of paper 2 does, on the same targets, with the same kind of answer.

`clik` and `pink_ik` need derivatives and a start, and minimise squares; `slsqp` needs derivatives and minimises eq. (5)
itself; `cma_es` needs neither, like the genetic algorithm; `closed_form` needs an arm whose axes meet in shoulder and
wrist.
"""

import numpy as np
import pink
import pinocchio as pin
from deap import base, cma

from tutorialbot.errors import finite_array, positive, whole_number
from tutorialbot.ik.arm7 import ARM, Arm
from tutorialbot.ik.fitness import GeneticSolution, History, as_arm, objective, solution, target
from tutorialbot.ik.oracle import least_slack, lifted, residual
from tutorialbot.seeding import make_rng, numpy_global

HOME = (0.0, 0.1, 0.0, -1.2, 0.0, 0.0, -0.1)  # elbow bent, hand forward: a guess that most targets are near to
TIP = "thumb root"


def pinocchio_model(arm: Arm = ARM) -> pin.Model:
    """Return `arm` as pinocchio's model; the frame "thumb root" is its tip, the world the abdomen's frame."""
    model, joint = pin.Model(), 0
    for i, (axis, offset) in enumerate(zip(as_arm(arm).axes, arm.offsets[:7], strict=True)):
        place = pin.SE3(np.eye(3), offset)
        joint = model.addJoint(joint, pin.JointModelRevoluteUnaligned(axis), place, f"joint {i + 1}")
    model.lowerPositionLimit, model.upperPositionLimit = arm.lower.copy(), arm.upper.copy()
    model.addFrame(pin.Frame(TIP, joint, pin.SE3(np.eye(3), arm.offsets[7]), pin.FrameType.OP_FRAME))
    return model


def clik(
    position: np.ndarray, tilt: np.ndarray, *, initial: np.ndarray = HOME, arm: Arm = ARM,
    model: pin.Model | None = None, iterations: int = 300, damping: float = 1e-3, near: float = 1e-6,
) -> GeneticSolution:
    """Closed-loop inverse kinematics in pinocchio: dq = J^T (J J^T + damping 1)^-1 log(T^-1 T_target), then clamped.

    Each step is cut back to the limits. It minimises the square of the error, and ends when that is below `near`
    (metres and radians together) or the iterations are used up. model: `pinocchio_model(arm)`, kept between calls.
    """
    position, tilt = target(position, tilt)
    q = np.clip(finite_array("initial", initial, (7,)), as_arm(arm).lower, arm.upper)
    positive("damping", damping), positive("near", near)
    model = model or pinocchio_model(arm)
    data, frame = model.createData(), model.getFrameId(TIP)
    goal, regular = _goal(position, tilt), damping * np.eye(6)
    for done in range(1, whole_number("iterations", iterations, 1) + 1):  # noqa: B007 - counts the evaluations
        pin.framesForwardKinematics(model, data, q)
        error = pin.log6(data.oMf[frame].actInv(goal)).vector
        if error @ error < near**2:
            break
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL)
        q = q + jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + regular, error)
        q = np.minimum(np.maximum(q, arm.lower), arm.upper)
    return solution(q, position, tilt, arm=arm, evaluations=done)


def _goal(position: np.ndarray, tilt: np.ndarray) -> pin.SE3:
    roll, pitch, yaw = tilt
    turn = pin.utils.rotate("y", pitch) @ pin.utils.rotate("x", roll) @ pin.utils.rotate("z", yaw)
    return pin.SE3(turn, position)


def pink_ik(
    position: np.ndarray, tilt: np.ndarray, *, initial: np.ndarray = HOME, arm: Arm = ARM,
    model: pin.Model | None = None, iterations: int = 300, damping: float = 1.0, near: float = 1e-6,
    stall: float = 1e-6,
) -> GeneticSolution:
    """Pink: each step is a quadratic program, the square of the error left by J dq within the joints' limits.

    Unlike in `clik`, a step knows the limits before it is taken. `damping` is Levenberg and Marquardt's, times the
    square of the error; with little of it the steps chatter where the target is out of reach. It ends when the error
    is below `near` (metres and radians together), no joint moves by more than `stall` [rad], or the iterations are
    used up. model: `pinocchio_model(arm)`, kept between calls.
    """
    position, tilt = target(position, tilt)
    q = np.clip(finite_array("initial", initial, (7,)), as_arm(arm).lower, arm.upper)
    positive("damping", damping), positive("near", near), positive("stall", stall)
    model = model or pinocchio_model(arm)
    configuration = pink.Configuration(model, model.createData(), q)
    task = pink.FrameTask(TIP, position_cost=1.0, orientation_cost=1.0, lm_damping=damping)
    task.set_target(_goal(position, tilt))
    limits = [pink.limits.ConfigurationLimit(model, config_limit_gain=1.0)]  # up to the limit in one step
    for done in range(1, whole_number("iterations", iterations, 1) + 1):  # noqa: B007 - counts the evaluations
        if np.linalg.norm(task.compute_error(configuration)) < near:
            break
        step = pink.solve_ik(configuration, [task], 1.0, solver="daqp", limits=limits, safety_break=False)
        moved = np.clip(q + step, arm.lower, arm.upper)
        largest, q = np.abs(moved - q).max(), moved
        if largest < stall:
            break
        configuration.update(q)
    return solution(q, position, tilt, arm=arm, evaluations=done)


def slsqp(
    position: np.ndarray, tilt: np.ndarray, *, initial: np.ndarray | None = HOME, seed: int = 0, starts: int = 1,
    arm: Arm = ARM,
) -> GeneticSolution:
    """Sequential quadratic programming on eq. (5) without kinks, see `oracle.least_slack`; the best of `starts`.

    The first start is `initial`; the others, or all when it is None, are drawn within the limits from `seed`.
    """
    position, tilt = target(position, tilt)
    begin = [] if initial is None else [finite_array("initial", initial, (7,))]
    drawn = make_rng(seed).uniform(as_arm(arm).lower, arm.upper, (whole_number("starts", starts, 1), 7))
    found, counts = zip(*(least_slack(q, position, tilt, arm) for q in [*begin, *drawn][:starts]), strict=True)
    best = min(found, key=lambda q: residual(q, position, tilt, arm))
    return solution(best, position, tilt, arm=arm, evaluations=sum(counts))


class _Smallest(base.Fitness):
    weights = (-1.0,)


class _Individual(list):
    def __init__(self, values):
        super().__init__(values)
        self.fitness = _Smallest()


def cma_es(
    position: np.ndarray, tilt: np.ndarray, *, seed: int, initial: np.ndarray | None = None, sigma: float = 0.5,
    children: int = 20, evaluations: int = 20_000, level: float = 1e-9, arm: Arm = ARM,
) -> GeneticSolution:
    """DEAP's CMA-ES on eq. (5) as it stands, penalty included: a normal distribution that learns the ridge's direction.

    It begins in the middle of the limits, or at `initial` (7,), `sigma` [rad] wide, with so many `children` a
    generation, and ends when a generation's values agree to `level`, or the evaluations are used up.
    """
    position, tilt = target(position, tilt)
    value = objective(position, tilt, arm=as_arm(arm))
    middle = 0.5 * (arm.lower + arm.upper) if initial is None else finite_array("initial", initial, (7,))
    whole_number("children", children, 4), whole_number("evaluations", evaluations, children)
    best, lowest, seen = middle, np.inf, []
    with numpy_global(make_rng(seed)):
        strategy = cma.Strategy(middle.tolist(), positive("sigma", sigma), lambda_=children)
        for done in range(children, evaluations + 1, children):
            population = strategy.generate(_Individual)
            values = value(np.array(population))
            for individual, one in zip(population, values.tolist(), strict=True):
                individual.fitness.values = (one,)
            if values.min() < lowest:
                best, lowest = np.array(population[int(values.argmin())]), float(values.min())
            seen.append((done, lowest, float(np.median(values)), best))
            if np.ptp(values) < level:
                break
            strategy.update(population)
    history = History(*map(np.array, zip(*seen, strict=True)))
    return solution(best, position, tilt, arm=arm, evaluations=done, history=history)


def closed_form(position: np.ndarray, tilt: np.ndarray, *, arm: Arm = ARM) -> GeneticSolution:
    """The swivel swept, tilt exact: of all that the limits allow, the configuration farthest from them.

    A target out of reach is moved along z until it is in reach; one that no such shift brings into reach leaves the
    middle of the limits. Raises InvalidValue for an arm of another build.
    """
    position, tilt = target(position, tilt)
    found = lifted(position, tilt, as_arm(arm))
    q = 0.5 * (arm.lower + arm.upper) if found is None else found[0]
    return solution(q, position, tilt, arm=arm)
