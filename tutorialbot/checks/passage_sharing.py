"""Exercise 6 of notebook 4: the smallest share of the base with which the arm keeps to the knob."""

import numpy as np

from tutorialbot.checks.counting import ByHand
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, numbers
from tutorialbot.checks.passage_elbow import SEED
from tutorialbot.seeding import make_rng

CLOSE = 2e-3  # how near to the smallest share an answer has to be
ON_THE_WAY = (  # start, radius, angle, drop, near, reach
    ((0.78, -0.34), 0.78, 1.55, -0.08, 0.22, 0.68),
    ((0.66, -0.52), 0.77, 1.37, -0.01, 0.28, 0.68),
    ((0.54, -0.61), 0.86, 1.52, -0.22, 0.25, 0.73),
)
ISLANDS = (
    ((0.53, -0.32), 0.79, 1.63, -0.21, 0.22, 0.69),
    ((0.75, -0.31), 0.92, 1.75, -0.07, 0.09, 0.64),
    ((0.61, -0.37), 0.90, 2.01, 0.05, 0.06, 0.78),
)
SHARES, ANGLES = np.linspace(0.0, 1.0, 401), 361


def worst(share: np.ndarray, start, radius: float, angle: float, drop: float, near: float, reach: float) -> np.ndarray:
    """Return by how much [m] the knob is too far or too near at worst, below 0 when it never is: an entry a share."""
    theta = np.linspace(0.0, angle, ANGLES)
    knob = radius * np.exp(-1j * theta)  # x + i y
    base = complex(*start) + np.asarray(share)[..., None] * (knob - knob[0])
    r = np.sqrt(np.abs(knob - base) ** 2 + drop**2)
    return np.maximum(r - reach, near - r).max(axis=-1)


def smallest(start, radius: float, angle: float, drop: float, near: float, reach: float) -> float | None:
    """Return the smallest share that will do, or None."""
    inputs = start, radius, angle, drop, near, reach
    fine = np.flatnonzero(worst(SHARES, *inputs) <= 0.0)
    if not fine.size:
        return None
    if fine[0] == 0:
        return 0.0
    low, high = SHARES[fine[0] - 1], SHARES[fine[0]]
    for _ in range(30):
        middle = (low + high) / 2.0
        low, high = (low, middle) if worst(middle, *inputs) <= 0.0 else (middle, high)
    return float(high)


def clear_cut(start, radius: float, angle: float, drop: float, near: float, reach: float) -> bool:
    """Whether the answer stays what it is when both limits are half a millimetre wider or narrower."""
    few = [smallest(start, radius, angle, drop, near - by, reach + by) for by in (-5e-4, 0.0, 5e-4)]
    if None in few:
        return few == [None] * 3
    return max(few) - min(few) < 0.01


def _judge_share(student: Student) -> None:
    rng, ask = make_rng(SEED, 6), ByHand(student)

    def trial(check: str, reason: str, start, *rest: float) -> None:
        inputs = (np.array(start, dtype=float), *map(float, rest))
        expected, answer = smallest(*inputs), ask(*inputs)
        if answer is None or expected is None:
            if answer is not expected:
                told = f"yours {show(answer)}, expected {show(expected)}"
                raise Wrong(check, f"{reason}\n{told}{case(inputs)}")
            return
        found = float(numbers(answer, (), inputs, reason))
        if abs(found - expected) > CLOSE:
            theirs = float(worst(np.array(min(max(found, 0.0), 1.0)), *inputs))
            told = f"With yours the knob is {show(theirs)} m too far or too near." if theirs > 0.0 else ""
            raise Wrong(check, f"{reason}\nyours {found:.4f}, expected {expected:.4f}. {told}{case(inputs)}")

    limits = (0.18, 0.7)
    reason = "Opened by a small angle, the knob stays within the arm's reach although the base stands: 0."
    trial("base stands", reason, (0.78, -0.45), 0.78, 0.1, 0.0, *limits)
    trial("base stands", reason, (0.6, -0.5), 0.78, 0.2, 0.15, *limits)
    reason = "The base moves by the share of what the knob moves; what is left the arm has to reach."
    for angle in (1.1, 1.3, np.pi / 2):
        trial("too far", reason, (1.15, -0.25), 0.78, angle, 0.0, 0.1, 0.7)
    reason = "The knob comes toward the robot first, and its arm bends only so far: also too near is out of reach."
    for y in (-0.5, -0.55, -0.6):
        trial("too near", reason, (0.7, y), 0.78, 0.5, 0.0, 0.22, 0.75)
    reason = "Shoulder and knob are not at one height: that takes a part of the reach."
    for drop in (0.3, -0.3):
        trial("height", reason, (1.1, -0.2), 0.78, 1.2, drop, *limits)
    reason = "On the way too: what is fine at the last angle may be too far, or too near, half-way."
    for inputs in ON_THE_WAY:
        trial("on the way", reason, *inputs)
    reason = "A larger share need not be a better one: it may do between two that do not. Asked for is the smallest."
    for inputs in ISLANDS:
        trial("not halved", reason, *inputs)
    reason = "Out of reach before anything moves: no share helps. None."
    trial("none", reason, (0.78, -0.8), 0.78, 1.0, 0.0, *limits)
    trial("none", reason, (0.78, -0.1), 0.78, 1.0, 0.0, *limits)
    done = 0
    while done < 25:
        start = rng.uniform((0.4, -0.75), (1.3, -0.2))
        inputs = start, *rng.uniform((0.6, 0.3, -0.3, 0.12, 0.6), (0.95, 1.7, 0.3, 0.3, 0.8)).tolist()
        answer = smallest(*inputs)
        if clear_cut(*inputs) and (answer is not None or done % 5 == 0) and (answer != 0.0 or done % 4 == 0):
            trial("any door", "Any door, any start.", *inputs)
            done += 1


least_share = Exercise(
    "least_share",
    "the smallest share K of the base with which the knob stays within the arm's reach on the door's whole way.",
    (
        "The knob is at radius (cos theta, -sin theta), the base at start + K (knob - knob at theta = 0). The distance"
        " is sqrt(|knob - base|^2 + drop^2), and has to stay from near to reach.",
        "Look at all angles from 0 to `angle` for each K: numpy does a table of 2,000 K by 500 angles at once,"
        " knob (500,) and K[:, None].",
        "ok = ((r >= near) & (r <= reach)).all(axis=1); the smallest K with ok, or None. Halving the interval is no"
        " way: too far and too near may take turns.",
    ),
    _judge_share,
    limit=20.0,
)
