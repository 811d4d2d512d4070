"""Exercises 1 to 3 of notebook 4: orders for a rate limit, an elbow with an offset, and a smoother time scale.

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tutorialbot.checks.counting import ByHand
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.seeding import make_rng

SEED = 4

# --- 1 ----------------------------------------------------------------------------------------------------------------
PERIODS, MOST = 10, 8  # of the controller, from epsilon to zero; the greatest order that is asked for
FAST = 1e-7  # a period [s] that limits nothing
RANGES = np.array([(0.1, 0.1, 1.0, 0.001), (0.7, 0.7, 20.0, 0.03)])  # of upper, lower, rate limit and period


def greatest_order(upper: float, lower: float, speed: float, rate_limit: float, period: float) -> int:
    """Return the greatest n <= MOST that keeps the limit and takes PERIODS periods for epsilon, 0 when none does."""
    n = 0
    while n < MOST:
        rate = 2.0 ** (n + 1) * (1.0 / upper + 1.0 / lower) * abs(speed)
        epsilon = np.pi / 2.0 ** (n + 2)
        if rate > rate_limit or PERIODS * period * rate > epsilon:
            break
        n += 1
    return n


def _on_the_edge(*inputs: float) -> bool:
    """Whether a hair more or less of the speed changes the answer."""
    upper, lower, speed, rate_limit, period = inputs
    few = {greatest_order(upper, lower, speed * factor, rate_limit, period) for factor in (0.98, 1.0, 1.02)}
    return len(few) > 1


def _judge_orders(student: Student) -> None:
    rng, ask = make_rng(SEED, 1), ByHand(student)

    def trial(check: str, reason: str, upper: float, lower: float, speeds, limit: float, period: float = FAST) -> None:
        inputs = (upper, lower, np.array(speeds, dtype=float), limit, period)
        answer = numbers(ask(*inputs), np.shape(speeds), inputs, reason)
        expected = [greatest_order(upper, lower, speed, limit, period) for speed in speeds]
        agree(check, answer, np.array(expected), inputs, reason)

    def speeds(k: int, upper: float, lower: float, limit: float, period: float = FAST, most: float = 0.15):
        found: list[float] = []
        while len(found) < k:
            speed = float(10.0 ** rng.uniform(-2.5, np.log10(most)))
            if not _on_the_edge(upper, lower, speed, limit, period):
                found.append(speed)
        return found

    reason = "At q4 = 0 the elbow turns fastest: 2^n times the sum of 1 / upper and 1 / lower times the speed."
    for limit in (3.0, 5.0):
        trial("equal links", reason, 0.35, 0.35, [0.1], limit)
        trial("equal links", reason, 0.35, 0.35, speeds(1, 0.35, 0.35, limit), limit)
    for upper, lower in ((0.42, 0.25), (0.2, 0.6), (0.55, 0.15)):
        told = f"Both links count, each by itself: neither stands for both, nor does their mean. {reason}"
        for speed in speeds(4, upper, lower, 3.0):
            trial("unequal links", told, upper, lower, [speed], 3.0)
    told = "Each phase has a speed of its own, and so an order of its own."
    trial("each phase", told, 0.35, 0.35, speeds(5, 0.35, 0.35, 3.0), 3.0)
    told = "Inward, the speed is below zero; the elbow turns as fast as outward."
    trial("inward", told, 0.35, 0.3, [-speed for speed in speeds(3, 0.35, 0.3, 3.0)], 3.0)
    trial("at rest", f"A phase at rest keeps any limit: the greatest order, {MOST}.", 0.35, 0.35, [0.0, 0.1], 3.0)
    trial("too fast", "Where not even n = 1 keeps the limits: 0.", 0.35, 0.35, [0.6, 2.0, -0.7], 3.0)
    told = "What just fits, fits."
    trial("just fits", told, 0.5, 0.5, [0.125, 0.25, 0.0625], 2.0)
    trial("just fits", told, 0.5, 0.25, [0.125, 0.0625], 3.0)
    told = (
        f"From epsilon = pi / 2^(n + 1) to zero, at the peak rate, {PERIODS} periods are asked for: with one order more"
        " epsilon is half as wide, and the elbow twice as fast."
    )
    for period in (0.01, 0.02, 0.004):
        trial("control period", told, 0.35, 0.35, speeds(3, 0.35, 0.35, 50.0, period), 50.0, period)
    for _ in range(20):
        upper, lower, limit, period = (float(x) for x in 10.0 ** rng.uniform(*np.log10(RANGES)))
        found = speeds(int(rng.integers(1, 6)), upper, lower, limit, period, 0.6)
        trial("any arm", "Any arm, any limit, any controller.", upper, lower, found, limit, period)


orders_for_phases = Exercise(
    "orders_for_phases",
    "the greatest order n of eq (2) for each phase, by the elbow's rate limit and the control period.",
    (
        "The note on the peak rate is for equal links: 2^(n + 1) v / L. Where does the 2 come from? Write r, the"
        " distance of wrist and shoulder, for unequal links, and look at q4 = 0.",
        "At q4 = 0, r is upper + lower, and so the rate is 2^n (upper + lower) / (upper lower) |v|. The control period"
        " asks for 10 period * rate <= pi / 2^(n + 1).",
        "Count n up from 0 as long as n + 1 keeps both limits, and stop at 8: that also does for a speed of zero, of"
        " which there is no logarithm.",
    ),
    _judge_orders,
)


# --- 2 ----------------------------------------------------------------------------------------------------------------
STEP = 1e-30  # of a derivative along the imaginary axis: exact


def wrist_seen_from_shoulder(q4: complex, upper: float, lower: float, offset: float) -> tuple[complex, complex]:
    """Return x and z [m] of the wrist in the upper arm's frame: out along one link's corner and in along the other's.

    A number with an imaginary part of STEP brings the derivatives along.
    """
    s, c = np.sin(q4), np.cos(q4)
    return offset + lower * s - offset * c, upper + lower * c + offset * s


def virtual_joint(q4: float, upper: float, lower: float, offset: float) -> np.ndarray:
    """Return r, dr/dq4 [m], alpha [rad], dalpha/dq4, and q4 [rad] where the arm is longest."""
    x, z = wrist_seen_from_shoulder(q4 + 1j * STEP, upper, lower, offset)
    r = np.sqrt(x * x + z * z)
    alpha = np.arctan2(x.real, z.real)
    turn = (x.imag * z.real - z.imag * x.real) / (r.real**2 * STEP)
    longest = np.angle((upper + 1j * offset) * (lower + 1j * offset))
    return np.array([r.real, r.imag / STEP, alpha, turn, longest])


NAMES = ("r", "slope of r", "alpha", "slope of alpha", "where it is longest")
TOLD = (
    "r is the distance from shoulder to wrist, over the corner at the elbow: not sqrt(L1^2 + L2^2 + 2 L1 L2 c4).",
    "The virtual prismatic joint moves by dr/dq4: it stands still where the arm is longest.",
    "alpha turns the upper arm's z about y into the line from shoulder to wrist: from z toward x.",
    "W turns against the upper arm by dalpha/dq4, a share of the elbow's own turn.",
    "The arm is longest where the elbow's axis lies on the line from shoulder to wrist: not at q4 = 0.",
)


def _judge_offset(student: Student) -> None:
    rng, ask = make_rng(SEED, 2), ByHand(student)

    def trial(prefix: str, *inputs: float) -> None:
        answer = numbers(ask(*inputs), (5,), inputs)
        for name, reason, found, wanted in zip(NAMES, TOLD, answer, virtual_joint(*inputs), strict=True):
            agree(prefix + name, found, wanted, inputs, reason, 1e-9)

    for q4 in (0.7, -0.7, 0.0, 2.2):
        trial("no offset: ", q4, 0.35, 0.35, 0.0)
    trial("no offset: ", 1.1, 0.4, 0.25, 0.0)
    for q4 in rng.uniform(-2.4, 2.4, 8):
        trial("", float(q4), 0.316, 0.384, 0.0825)  # a well-known arm with seven joints
    for q4 in rng.uniform(-2.4, 2.4, 8):
        trial("", float(q4), *rng.uniform(0.15, 0.5, 2).tolist(), float(rng.uniform(-0.12, -0.02)))
    for q4 in rng.uniform(-3.0, 3.0, 20):
        trial("", float(q4), *rng.uniform(0.15, 0.5, 2).tolist(), float(rng.uniform(-0.12, 0.12)))


offset_elbow = Exercise(
    "offset_elbow",
    "the virtual prismatic joint of an arm whose elbow is offset, and where that one is singular.",
    (
        "Put the wrist into the upper arm's frame (x, z): the elbow's axis is at (offset, upper), and from there to the"
        " wrist it is (-offset, lower), turned by q4 about y. Ry(q) turns (x, z) into (c x + s z, c z - s x).",
        "With the wrist at (x, z), r = hypot(x, z) and alpha = atan2(x, z). Derive x and z by q4; then"
        " dr/dq4 = (x x' + z z') / r and dalpha/dq4 = (x' z - x z') / r^2.",
        "From the shoulder to the elbow's axis it is hypot(offset, upper), at the angle atan2(offset, upper) to z; the"
        " same for the forearm. Straight in a line: q4 = atan2(offset, upper) + atan2(offset, lower).",
    ),
    _judge_offset,
)


# --- 3 ----------------------------------------------------------------------------------------------------------------
STEEPEST = 1.6  # times 2^n: how large b / sin q4 may become
GRIDS = (0.01, 0.0025)  # of q4 / epsilon
DERIVATIVES = ("no jump", "slope", "curvature", "third derivative")


@dataclass(frozen=True)
class Scale:
    """A student's answers for one n, asked one q4 at a time."""

    ask: Callable
    n: int

    @property
    def epsilon(self) -> float:
        """Where b is 1 from [rad]."""
        return np.pi / 2.0 ** (self.n + 1)

    def __call__(self, q4: float) -> np.ndarray:
        """Return b and b / sin q4."""
        inputs = (float(q4), self.n)
        reason = "b / sin q4 has a limit at q4 = 0: where both are small, do not divide one by the other."
        return numbers(self.ask(*inputs), (2,), inputs, reason)

    def on_grid(self, step: float) -> tuple[np.ndarray, np.ndarray]:
        """Return x = q4 / epsilon from -1.2 to 1.2, 0 and the ends of the sector among them, and b there."""
        half = round(1.2 / step)
        x = np.arange(-half, half + 1) * step
        return x, np.array([self(one * self.epsilon)[0] for one in x])


def leaps(x: np.ndarray, b: np.ndarray, order: int) -> tuple[float, float]:
    """Return the largest step between neighbours of the derivative of this order, and the x of it."""
    derivative = np.diff(b, order) / (x[1] - x[0]) ** order
    steps = np.abs(np.diff(derivative))
    worst = int(np.argmax(steps))
    return float(steps[worst]), float(x[worst + (order + 1) // 2])


def _judge_scale(student: Student) -> None:
    rng, ask = make_rng(SEED, 3), ByHand(student)
    for n in (2, 1, 3, 6):
        scale = Scale(ask, n)
        _beyond(scale, rng)
        _odd(scale, rng)
        _over_sine(scale, rng)
        if n < 3:
            _smooth(scale)


def _beyond(scale: Scale, rng: np.random.Generator) -> None:
    epsilon = scale.epsilon
    for q4 in (epsilon, 1.01 * epsilon, 2.5, *rng.uniform(epsilon, 2.6, 4)):
        for sign in (1.0, -1.0):
            inputs = (float(sign * q4), scale.n)
            reason = "From epsilon = pi / 2^(n + 1) on b is 1, and below -epsilon it is -1: the branch."
            agree("beyond epsilon", scale(inputs[0])[0], np.array(sign), inputs, reason, 1e-9)


def _odd(scale: Scale, rng: np.random.Generator) -> None:
    for q4 in (0.0, *rng.uniform(0.0, 1.3 * scale.epsilon, 10)):
        b, other = scale(q4)[0], scale(-q4)[0]
        inputs = (float(-q4), scale.n)
        agree("odd", other, -b, inputs, "b(-q4) = -b(q4): zero at zero, and on the other branch time runs back.", 1e-9)
    inside = np.linspace(0.0, 0.98, 50) * scale.epsilon
    b = np.array([scale(q4)[0] for q4 in inside])
    falls = (np.diff(b) <= 0.0) & (b[1:] < 1.0 - 1e-9)
    if falls.any() or b.max() > 1.0 + 1e-9:
        q4 = inside[int(np.argmax(falls)) if falls.any() else int(np.argmax(b))]
        raise Wrong("rising", f"from 0 to epsilon b rises throughout, up to 1{case((float(q4), scale.n))}")


def _over_sine(scale: Scale, rng: np.random.Generator) -> None:
    for q4 in (*rng.uniform(0.02, 2.6, 6), *rng.uniform(0.02, 1.0, 6) * scale.epsilon):
        for angle in (float(q4), float(-q4)):
            b, ratio = scale(angle)
            told = "The second number is b / sin q4, the same on both branches."
            agree("b over sine", ratio, b / np.sin(angle), (angle, scale.n), told, 1e-6 * 2.0**scale.n)
    near = scale(1e-4 * scale.epsilon)[1]
    for q4 in (0.0, 1e-5, -1e-7, 1e-9, -1e-12, 1e-160, 5e-324):
        told = "Toward q4 = 0 b / sin q4 goes to the slope of b there, which is not zero."
        agree("b over sine at zero", scale(q4)[1], near, (q4, scale.n), told, 1e-3 * 2.0**scale.n)
    if near < 0.1:
        told = f"b has a slope at zero, else the arm never gets there: {show(float(near))} is none"
        raise Wrong("slope at zero", told)
    ratios = [scale(x * scale.epsilon)[1] for x in np.linspace(0.0, 1.2, 61)]
    if max(ratios) > STEEPEST * 2.0**scale.n:
        inputs = (float(np.argmax(ratios) * 0.02 * scale.epsilon), scale.n)
        told = f"b / sin q4 is up to {show(float(max(ratios)))}, and joint rates grow with it: {STEEPEST} * 2^n at most"
        raise Wrong("peak rate", told + case(inputs))


def _smooth(scale: Scale) -> None:
    coarse, fine = (scale.on_grid(step) for step in GRIDS)
    for order, name in enumerate(DERIVATIVES):
        (wide, _), (leap, x) = leaps(*coarse, order), leaps(*fine, order)
        if leap > 0.6 * wide + 1e-4:
            told = f"near q4 = {show(x)} epsilon it changes by {show(leap)} within {GRIDS[1]} epsilon"
            what = "b itself jumps" if order == 0 else f"the {name} of b over q4 / epsilon jumps"
            raise Wrong(name, f"{what}: {told}. One side is not like the other.{case((x * scale.epsilon, scale.n))}")


smooth_scale = Exercise(
    "smooth_scale",
    "a time scale b of your own with three continuous derivatives, and b / sin q4 without a division by zero.",
    (
        "With x = q4 / epsilon: if the slope of b is a multiple of (1 - x^2)^m, then near x = 1 the rest 1 - b goes"
        " like (1 - x)^(m + 1). Which derivatives vanish then? The C2 variant has m = 2.",
        "m = 3: integrate (1 - x^2)^3, and divide by what it is at x = 1: b = (35 x - 35 x^3 + 21 x^5 - 5 x^7) / 16."
        " Other functions do as well, sin(pi / 4 (3 x - x^3)) for one.",
        "An odd polynomial has a factor x: b = x p(x). So b / sin q4 = p(x) / epsilon * (q4 / sin q4), and q4 / sin q4"
        " is 1 at zero: np.sinc(q4 / pi) is sin q4 / q4, and never divides by zero.",
    ),
    _judge_scale,
)
