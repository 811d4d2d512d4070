"""Exercise 2 of notebook 3: rectangles that are both turned."""

import numpy as np

from tutorialbot.checks.counting import lines_run
from tutorialbot.checks.cspace_grids import SEED, all_at_once, truths
from tutorialbot.checks.guard import Student, Wrong, show
from tutorialbot.checks.mechanism import Exercise
from tutorialbot.seeding import make_rng

TOUCH = 1e-9  # rectangles that overlap by less do but touch [m]
NEAR = 1e-5  # drawn pairs that are nearer to touching than this are drawn again [m]


def overlap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how far [m] a must be shifted to touch b only, in the best of four directions, (n,); negative: apart."""

    def corners(rectangle: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Corners (4, n) as complex numbers z + i x, as seen by somebody who is turned by `angle`."""
        x, z, long, wide, own = rectangle.T
        spread = [s * long + 1j * t * wide for s in (-1, 1) for t in (-1, 1)]
        return (z + 1j * x + np.array(spread) * np.exp(1j * own)) * np.exp(-1j * angle)

    found = []
    for angle in (a[:, 4], b[:, 4]):
        p, q = corners(a, angle), corners(b, angle)
        for part in (np.real, np.imag):
            found += [part(p).max(axis=0) - part(q).min(axis=0), part(q).max(axis=0) - part(p).min(axis=0)]
    return np.min(found, axis=0)


def _draw(rng: np.random.Generator, n: int, turns: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return n pairs (n, 5) of which none nearly touches, each turned by up to so much [rad]."""
    found, missing = np.empty((2, n, 5)), np.ones(n, dtype=bool)
    while missing.any():
        low, high = np.array([[-0.3, -0.3, 0.02, 0.02, 0.0], [0.3, 0.3, 0.3, 0.1, 0.0]])
        for rectangle, turn in zip(found, turns, strict=True):
            rectangle[missing] = rng.uniform(low, high, (missing.sum(), 5))
            rectangle[missing, 4] = rng.uniform(-turn, turn, missing.sum())
        missing = np.abs(overlap(*found)) < NEAR
    return found[0], found[1]


def _touching(rng: np.random.Generator, n: int, deep: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return n pairs, turned as one, that overlap by `deep` [m] and rounding: half of them lengthwise, half abreast."""
    a, _ = _draw(rng, n, (3.0, 0.0))
    b = a.copy()
    b[:, 2:4] = rng.uniform(0.02, 0.1, (n, 2))
    beside = rng.uniform(-0.03, 0.03, n)
    lengthwise = a[:, 2] + b[:, 2] - deep + 1j * beside
    abreast = beside + 1j * (a[:, 3] + b[:, 3] - deep)
    shift = np.where(np.arange(n) % 2, abreast, lengthwise) * np.exp(1j * a[:, 4])
    b[:, 0] += shift.imag
    b[:, 1] += shift.real
    return a, b


def _judge_rectangles(student: Student) -> None:
    rng, full = make_rng(SEED, 2), np.pi

    def trial(check: str, reason: str, a: np.ndarray, b: np.ndarray) -> int:
        inputs = (a, b)
        n = max(len(a), len(b)) if len(a) and len(b) else 0
        expected = overlap(*(np.broadcast_to(r, (n, 5)) for r in inputs)) > TOUCH
        answer, steps = lines_run(lambda: student(*inputs))
        answer = truths(answer, (n,), inputs)
        for i in np.flatnonzero(answer != expected):
            own = [r[min(int(i), len(r) - 1)] for r in inputs]
            told = f"yours {answer[i]}, expected {expected[i]} for the pair {show(own[0])}, {show(own[1])}"
            raise Wrong(check, f"{reason}\n{told}")
        return steps

    reason = "Not turned, they meet where their intervals in x and in z both overlap; the sizes are HALF the sides."
    trial("not turned", reason, *_draw(rng, 200, (0.0, 0.0)))
    reason = "At angle 0 the first half side points along +z, and a positive angle turns it toward +x, as with the arm."
    trial("one turned", reason, *_draw(rng, 200, (full, 0.0)))
    trial("one turned", reason, *_draw(rng, 200, (0.0, full)))
    cross = np.array([[0.1, 0.2, 0.25, 0.025, 0.3]]), np.array([[0.1, 0.2, 0.025, 0.25, 0.3]])
    trial("a cross", "Two bars that cross have no corner inside each other, and meet.", *cross)
    reason = "Both are turned: the gap may show on the directions of either."
    trial("both turned", reason, *_draw(rng, 2000, (full, full)))
    reason = f"They do but touch when they overlap by less than {TOUCH:g} m: rounding decides nothing."
    for n, deep in ((1, 0.0), (200, 0.0), (200, 0.3 * TOUCH), (200, 3.0 * TOUCH)):
        trial("touching", reason, *_touching(rng, n, deep))
    a, b = _draw(rng, 400, (full, full))
    a[:200, 3] = b[100:300, 3] = b[300:, 2] = b[350:, 3] = 0.0
    near = np.abs(overlap(a, b)) < NEAR
    reason = "Without width it is a line, without both half sides a point: these meet what they pass through inside."
    trial("lines and points", reason, a[~near], b[~near])
    a, b = _draw(rng, 30, (full, full))
    for one, other in ((a[:1], b), (a, b[:1]), (a[:0], b[:0])):
        trial("one for all", "A single rectangle serves all of the other side; none have none.", one, other)
    counts = [(n, trial("both turned", reason, *_draw(rng, n, (full, full)))) for n in (40, 2000)]
    all_at_once(counts, "pairs", "A map at 1 degree has 129,600 postures.")


turned_rectangles_meet = Exercise(
    "turned_rectangles_meet",
    "do two rectangles meet that are both turned? Many pairs at once.",
    (
        "Separating axes: they are apart exactly if their shadows on one of four directions are. Which four are there"
        " when both are turned?",
        "Along = (sin angle, cos angle), across = (cos angle, -sin angle), as arrays (n,). Half the shadow of a"
        " rectangle on an axis: half side times |along . axis| plus half side times |across . axis|.",
        "Only the difference of the two angles matters for these products: |cos| and |sin| of it. Apart if"
        " |centres apart . axis| > both half shadows - 1e-9, on any of the four.",
    ),
    _judge_rectangles,
    limit=30.0,
)
