"""Exercises 6 and 7 of notebook 2: which joint limit costs most, and an evolution of one's own."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from tutorialbot.checks.arm_kinematics import SEED
from tutorialbot.checks.counting import Counted
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.ik.arm7 import ARM, LIMITS, Arm
from tutorialbot.ik.fitness import NEAR_POSITION, NEAR_TILT, objective, task_error
from tutorialbot.ik.oracle import lifted, optimum
from tutorialbot.seeding import make_rng

TILT = np.array([0.0, -np.pi / 2, 0.0])  # Table 1
NAMES = [name for pair in LIMITS for name in pair]
STIFF_ELBOW = ARM.with_limit("radial deviation", np.deg2rad(-40.0)).with_limit("elbow extension", np.deg2rad(-95.0))

# --- 6 ----------------------------------------------------------------------------------------------------------------
ZError = Callable[[np.ndarray, np.ndarray], float]


def priced(error: float, prices: np.ndarray, most: np.ndarray | float = np.inf) -> ZError:
    """Return a z error that is `error` [m] at the arm's own limits and falls by what each of 14 limits pays.

    prices (14,) [m/rad], in the order of NAMES; most (14,) [m]: what each can pay at all.
    """

    def z_error(lower: np.ndarray, upper: np.ndarray) -> float:
        room = np.stack([ARM.lower - lower, upper - ARM.upper], axis=1).ravel()
        return max(0.0, error - float(np.minimum(prices * room, most).sum()))

    return z_error


def measured(arm: Arm, position: np.ndarray) -> ZError:
    """Return the smallest z error [m] that `arm` can have at `position` with the tilt of Table 1, for any limits."""
    known: dict[bytes, float] = {}

    def z_error(lower: np.ndarray, upper: np.ndarray) -> float:
        other = replace(arm, lower=lower, upper=upper)
        key = other.lower.tobytes() + other.upper.tobytes()
        if key not in known:
            found = lifted(position, TILT, other)
            known[key] = np.inf if found is None else abs(found[1])
        return known[key]

    return z_error


def gains(z_error: ZError, arm: Arm, step: float) -> np.ndarray:
    """Return by how much [m] the z error falls when each limit alone, in the order of NAMES, moves out by `step`."""
    found = []
    for i in range(7):
        shift = step * np.eye(7)[i]
        found += [z_error(arm.lower - shift, arm.upper), z_error(arm.lower, arm.upper + shift)]
    return z_error(arm.lower, arm.upper) - np.array(found)


def _judge_limit(student: Student) -> None:
    rng = make_rng(SEED, 6)

    def trial(check: str, reason: str, z_error: ZError, degrees: float, expected: tuple, arm: Arm = ARM) -> None:
        step = float(np.deg2rad(degrees))
        inputs = (z_error, arm.lower.copy(), arm.upper.copy(), step)
        answer = student(*inputs)
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            raise Wrong("shape of the answer", f"expected two things, a name (or None) and a number{case(inputs)}")
        name, price = answer
        if name is not None and (not isinstance(name, str) or name not in NAMES):
            raise Wrong("a name of LIMITS", f"{show(name)} is neither a name in LIMITS nor None{case(inputs)}")
        wanted, gain = expected
        if name != wanted:
            raise Wrong(check, f"{reason}\nyours {name}, expected {wanted}{case(inputs)}")
        told = "The price is the fall of the z error divided by the step, in metres per radian."
        agree("price", numbers(price, (), inputs, told), gain / step, inputs, told)

    reason = "The z error is zero as it is: no limit costs anything, the answer is (None, 0)."
    trial("in reach", reason, priced(0.0, np.ones(14)), 5.0, (None, 0.0))
    reason = "A limit gives way outward: the lower one down, the upper one up. Moved inward, it can but cost more."
    for i in rng.permutation(14):
        degrees = float(rng.uniform(2.0, 10.0))
        expected = NAMES[i], 0.3 * np.deg2rad(degrees)
        trial("outward", reason, priced(0.2, 0.3 * np.eye(14)[i]), degrees, expected)
    reason = "A small error is one too: two millimetres, which one limit costs."
    trial("small error", reason, priced(0.002, 0.02 * np.eye(14)[12]), 5.0, (NAMES[12], 0.02 * np.deg2rad(5.0)))
    reason = "Of several limits that give something the one that gives most counts, each moved alone."
    for _ in range(10):
        prices, degrees = rng.permutation(np.linspace(0.0, 0.4, 14)), float(rng.uniform(2.0, 10.0))
        best = int(prices.argmax())
        trial("which limit", reason, priced(0.3, prices), degrees, (NAMES[best], prices[best] * np.deg2rad(degrees)))
    reason = "The steepest limit stops paying soon; over the whole step another one gives more."
    for _ in range(10):
        prices, degrees = rng.permutation(np.linspace(0.05, 0.4, 14)), float(rng.uniform(4.0, 10.0))
        most = np.where(prices > 0.2, 0.003, np.inf)
        best = int(np.where(prices > 0.2, 0.0, prices).argmax())
        expected = NAMES[best], prices[best] * np.deg2rad(degrees)
        trial("over the whole step", reason, priced(0.3, prices, most), degrees, expected)
    for arm, whose in ((ARM, "this arm"), (STIFF_ELBOW, "an arm with a softer wrist and a stiffer elbow")):
        z_error = measured(arm, np.array([*rng.uniform([0.24, 0.08], [0.34, 0.18]), 0.0]))
        fall = gains(z_error, arm, np.deg2rad(5.0))
        reason = f"The true z error of {whose} at a target with z = 0: what holds it is not always the same joint."
        trial("at the arm", reason, z_error, 5.0, (NAMES[fall.argmax()], fall.max()), arm)


costliest_limit = Exercise(
    "costliest_limit",
    "which of fourteen joint limits costs most height, and how much per radian?",
    (
        "What is the z error with the limits as they are? And with one of them moved by the step?",
        "Work on copies: `moved = lower.copy(); moved[i] -= step`, and the upper limits the other way. LIMITS[i] names"
        " the lower and the upper limit of joint i.",
        "Fourteen differences z_error(lower, upper) - z_error(moved ...): the largest one, its name, and divided by"
        " step. When the largest is not above zero, (None, 0.0).",
    ),
    _judge_limit,
    limit=60.0,
)

# --- 7 ----------------------------------------------------------------------------------------------------------------
BUDGET, BOWL_BUDGET = 60_000, 2_000  # evaluations
OTHER_ARM = Arm(offsets=[*ARM.offsets[:3], [0.0, 0.0, -0.29], [0.0, 0.0, -0.26], *ARM.offsets[5:]])


def _postures(q: object) -> np.ndarray:
    """Return q as an array (..., 7), or raise Wrong."""
    return numbers(q, (*np.shape(q)[:-1], 7), ())


def _ask(student: Student, function, arm: Arm, budget: int, rng: np.random.Generator) -> np.ndarray:
    counted = Counted(function, budget, _postures, "count one for each posture that you ask about.")
    inputs = (counted.evaluate, arm.lower.copy(), arm.upper.copy(), budget, rng)
    try:
        q = student(*inputs)
    finally:
        if counted.broken is not None:
            raise counted.broken
    q = numbers(q, (7,), (), "The answer is the best posture that you found.")
    beyond = np.maximum(arm.lower - q, q - arm.upper)
    if beyond.max() > 1e-9:
        raise Wrong(
            "joint limits",
            f"joint {beyond.argmax() + 1} of your posture is {np.rad2deg(beyond.max()):.2f} degrees beyond its limit:"
            " a real arm would stand at its stop.",
        )
    return q


def targets() -> Iterator[tuple[str, Arm, np.ndarray, str]]:
    """Yield the rule, the arm, the target's position (3,) [m], and what is special about it."""
    rng, within = make_rng(SEED, 7), 0
    while within < 2:
        position = np.array([*rng.uniform([0.2, 0.0], [0.32, 0.25]), 0.1])
        if optimum(position, TILT).converged:
            within += 1
            yield "within reach", ARM, position, "a target within reach"
    for _ in range(3):
        yield "out of reach", ARM, np.array([*rng.uniform([0.2, 0.0], [0.4, 0.2]), 0.0]), "one that is out of reach"
    yield "another arm", OTHER_ARM, np.array([*rng.uniform([0.2, 0.0], [0.4, 0.2]), 0.0]), "an arm of other lengths"


def _judge_posture(student: Student) -> None:
    lowest = make_rng(SEED, 7, 1).uniform(ARM.lower, ARM.upper)

    def bowl(q: np.ndarray) -> np.ndarray:
        return np.abs(q - lowest).sum(axis=-1) + 100.0 * ~ARM.within(q)

    once, again = (_ask(student, bowl, ARM, BOWL_BUDGET, make_rng(SEED, 7, 2)) for _ in range(2))
    reason = "The same generator gives the same posture: `rng` is the only source of chance."
    agree("chance from rng alone", again, once, (), reason, 1e-12)
    for number, (check, arm, position, what) in enumerate(targets()):
        oracle = optimum(position, TILT, arm=arm)
        best = task_error(oracle.q, position, TILT, arm)
        value, told = objective(position, TILT, arm=arm), []
        for chance in (0, 1):  # chance may fail a good search once, hardly twice
            q = _ask(student, value, arm, BUDGET, make_rng(SEED, 7, 3, number, chance))
            off = np.abs(task_error(q, position, TILT, arm) - best)
            if off[:3].max() <= NEAR_POSITION and off[3:].max() <= NEAR_TILT:
                break
            told.append(f"{1000.0 * off[:3].max():.1f} mm and {off[3:].max():.3f} rad")
        else:
            raise Wrong(
                check,
                f"at {what}, {show(position)} m, your two tries ended {' and '.join(told)} from the optimum, which has"
                f" a z error of {1000.0 * best[2]:.1f} mm; 1 mm and 0.01 rad are allowed. Steps that do not know the"
                " direction of the ridge fall off it.",
            )


best_posture = Exercise(
    "best_posture",
    "open design: your own evolution finds the best posture for any target, within a budget.",
    (
        "A population of some hundred postures within the limits, all evaluated in one call; children; the best of both"
        " stay. Generations: what the budget leaves. The best of all is the answer.",
        "Children by Gaussian steps fall off the ridge. Which steps know its direction? Exercise 5 has them;"
        " differential evolution and CMA-ES have them too.",
        "300 members, `budget // 300 - 1` generations: children = members + 0.5 (b - c), or a blend of two members;"
        " np.argsort of the values of parents and children together, keep the first 300. The penalty keeps the limits.",
    ),
    _judge_posture,
    limit=180.0,
)
