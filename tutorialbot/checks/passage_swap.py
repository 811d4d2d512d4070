"""Exercise 7 of notebook 4: whether an arm is the same arm when it is held by its other end."""

import numpy as np
from scipy.spatial.transform import Rotation

from tutorialbot.checks.counting import ByHand
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, numbers
from tutorialbot.checks.passage_elbow import SEED
from tutorialbot.seeding import make_rng

F = np.diag([1.0, -1.0, -1.0])  # half a turn about x, from the tip's frame to the anchor's
NEAR = 1e-6  # m, and as a share of a rotation
X, Y, Z = np.eye(3)


def tip(q: np.ndarray, axes: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation (3, 3) and place (3,) [m] of the tip of a chain: offsets (n + 1, 3), axes (n, 3) between them."""
    rotation, place = np.eye(3), offsets[0].copy()
    for angle, axis, offset in zip(q, axes, offsets[1:], strict=True):
        rotation = rotation @ Rotation.from_rotvec(angle * axis).as_matrix()
        place = place + rotation @ offset
    return rotation, place


def off(signs: np.ndarray, axes: np.ndarray, offsets: np.ndarray, q: np.ndarray) -> float:
    """Return how far F T(signs * rev q) F is from the inverse of T(q): the largest number of their product less 1."""
    rotation, place = tip(q, axes, offsets)
    other, there = tip(signs * q[::-1], axes, offsets)
    other, there = F @ other @ F, F @ there
    return float(max(np.abs(rotation @ other - np.eye(3)).max(), np.abs(rotation @ there + place).max()))


def mirrored(axes, offsets, signs, middle=None) -> tuple[np.ndarray, np.ndarray]:
    """Return a symmetric chain: `axes` and `offsets` from one end to the `middle` axis, if there is one, and back.

    signs: of the axes on the way back. With a middle axis there are as many offsets as axes, and one more without.
    """
    axes, offsets = np.array(axes, dtype=float).reshape(-1, 3), np.array(offsets, dtype=float).reshape(-1, 3)
    back, middles = -axes[::-1] @ F * np.reshape(signs, (-1, 1)), np.zeros((0, 3))
    if middle is not None:
        middles = np.array([middle])
        return np.concatenate([axes, middles, back]), np.concatenate([offsets, -offsets[::-1] @ F])
    half = offsets[-1] / 2.0
    joined = half - F @ half
    return np.concatenate([axes, back]), np.concatenate([offsets[:-1], [joined], -offsets[-2::-1] @ F])


def shifted(axes: np.ndarray, offsets: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the same chain with joint i moved along its own axis by along[i] [m], as an axis is a whole line."""
    offsets = offsets.copy()
    offsets[:-1] += along[:, None] * axes
    offsets[1:] -= along[:, None] * axes
    return axes, offsets


def _arm(upper=0.35, lower=0.35, base=0.15, hand=0.15, elbow=0.0) -> tuple[np.ndarray, np.ndarray]:
    none = np.zeros(3)
    offsets = (base * Z, none, none, upper * Z + elbow * X, lower * Z - elbow * X, none, none, hand * Z)
    return np.array([Z, Y, Z, Y, Z, Y, Z]), np.array(offsets)


def _judge_swap(student: Student) -> None:
    rng, ask = make_rng(SEED, 7), ByHand(student)

    def unit() -> np.ndarray:
        v = rng.standard_normal(3)
        return v / np.sqrt(v @ v)

    def trial(check: str, reason: str, axes: np.ndarray, offsets: np.ndarray, symmetric: bool) -> None:
        inputs = (np.array(axes), np.array(offsets))
        answer = ask(*inputs)
        if answer is None:
            if symmetric:
                raise Wrong(check, f"{reason}\nyours None, but it is the same arm from both ends{case(inputs)}")
            return
        signs = numbers(answer, (len(axes),), inputs, reason)
        if not np.isin(signs, (-1.0, 1.0)).all():
            raise Wrong("plus or minus one", f"the signs are {show(signs)}{case(inputs)}")
        if not symmetric:
            raise Wrong(check, f"{reason}\nyours {show(signs)}, but from its other end it is another arm{case(inputs)}")
        worst = max(off(signs, *inputs, rng.uniform(-2.0, 2.0, len(axes))) for _ in range(3))
        if worst > NEAR:
            told = f"with the signs {show(signs)} T(q)^-1 and F T(signs * q[::-1]) F differ by {worst:.2g}"
            raise Wrong(check, f"{reason}\n{told}{case(inputs)}")

    trial("this arm", "The arm of the notebook: no sign changes.", *_arm(), True)
    trial("this arm", "The arm of the notebook: no sign changes.", *_arm(0.2, 0.2, 0.0, 0.0), True)
    reason = "Unequal links: from the tip it is another arm. None."
    trial("unequal", reason, *_arm(lower=0.3), False)
    trial("unequal", reason, *_arm(hand=0.1), False)
    trial("unequal", f"A millimetre, too. {reason}", *_arm(lower=0.351), False)
    reason = "An axis may point either way: its joint then counts the other way, and the sign of one end's joint is -1."
    for _ in range(6):
        axes, offsets = _arm()
        trial("axes that point down", reason, axes * rng.choice((-1.0, 1.0), (7, 1)), offsets, True)
    reason = "Half a turn about x leaves x as it is, and the inverse turns backward: a joint about x changes its sign."
    trial("about x", reason, np.array([X, X, X]), np.array([0.1 * Z, 0.3 * Z, 0.3 * Z, 0.1 * Z]), True)
    trial("about x", reason, np.array([Z, X, X, Z]), np.array([0.1, 0.2, 0.3, 0.2, 0.1])[:, None] * Z, True)
    trial("about x", reason, np.array([X]), np.array([0.1 * Z, 0.1 * Z]), True)
    reason = "An elbow that is offset to one side is so from both ends: x changes its sign on the way back, z does not."
    trial("offset elbow", reason, *_arm(elbow=0.08), True)
    axes, offsets = _arm(elbow=0.08)
    offsets[4] = offsets[4] * [-1, 1, 1]
    trial("offset elbow", reason, axes, offsets, False)
    reason = "Any axes: what is before the middle comes back after it, seen after half a turn about x."
    for k in range(1, 4):
        for middle in (None, X, Y, (0.0, 0.6, -0.8)):
            few = rng.uniform(-0.3, 0.3, (k + 1, 3))
            signs = rng.choice((-1.0, 1.0), k)
            chain = mirrored([unit() for _ in range(k)], few, signs, middle)
            trial("any axes", reason, *chain, True)
            axes, offsets = chain[0].copy(), chain[1].copy()
            axes[0] = unit()
            trial("any axes, unequal", "One axis leans another way at one end. None.", axes, offsets, False)
    reason = "A joint's axis is a line: whoever measures its offset further up along it describes the same arm."
    for elbow in (0.0, 0.08):
        trial("along the axis", reason, *shifted(*_arm(elbow=elbow), rng.uniform(-0.1, 0.1, 7)), True)
    for k in (1, 2, 3):
        chain = mirrored([unit() for _ in range(k)], rng.uniform(-0.3, 0.3, (k + 1, 3)), rng.choice((-1.0, 1.0), k), Y)
        trial("along the axis", reason, *shifted(*chain, rng.uniform(-0.1, 0.1, 2 * k + 1)), True)
    for _ in range(6):
        n = int(rng.integers(2, 7))
        chain = np.array([unit() for _ in range(n)]), rng.uniform(-0.3, 0.3, (n + 1, 3))
        trial("any arm", "An arm of any axes and offsets is not symmetric. None.", *chain, False)


swap_signs = Exercise(
    "swap_signs",
    "whether any arm is the same arm from its other end, and which joints count backward then.",
    (
        "T(q)^-1 goes the chain backward: offsets turned round, angles below zero. Between two F each vector v becomes"
        " F v: so F T(q)^-1 F has the axis -F a_n first, and the offset -F o_n before it.",
        "Axis i from the other end, -F a_(n + 1 - i), has to be a_i or -a_i, and that is the sign. If the offsets agree"
        " as well, it is the same arm; if they do not, it may still be: an axis is a line.",
        "There are but few signs. Try T(q)^-1 = F T(signs * q[::-1]) F with some q drawn by chance: when it holds for"
        " these, it holds for all. Compare to 1e-6, for a millimetre matters.",
    ),
    _judge_swap,
    limit=20.0,
)
