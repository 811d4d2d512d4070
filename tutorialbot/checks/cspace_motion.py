"""Exercise 6 of notebook 3: steps so fine that no point of the arm jumps."""

import numpy as np

from tutorialbot.checks.cspace_grids import SEED
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.seeding import make_rng

FULL = 2.0 * np.pi


def shortest(start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Return by how much each joint turns the shorter way, in [-pi, pi]."""
    return np.angle(np.exp(1j * (np.asarray(goal) - start)))


def fewest(turn: np.ndarray, lengths: np.ndarray, most: float) -> int:
    """Return how many even steps keep the arcs of all links together below `most` [m]."""
    arcs = float(np.abs(np.cumsum(turn)) @ lengths)
    return max(1, int(np.ceil(arcs / most - 1e-9)))


def joint_places(q: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return where the ends of all links are, complex (k, n) [m]: on each link no point moves more than one of them."""
    return np.cumsum(lengths * np.exp(1j * np.cumsum(q, axis=1)), axis=1)


def _judge_steps(student: Student) -> None:
    rng = make_rng(SEED, 6)

    def trial(check: str, reason: str, start, goal, lengths, most: float) -> None:
        start, goal, lengths = (np.asarray(part, dtype=float) for part in (start, goal, lengths))
        inputs = (start, goal, lengths, most)
        answer = student(*inputs)
        try:
            rows = len(answer)
        except TypeError:
            rows = 1
        q = numbers(answer, (rows, len(start)), inputs, "One configuration a row.")
        ends = (shortest(start, q[0]), shortest(goal, q[-1])) if rows else (np.inf,)
        told = "The first row is the start, the last one the goal, up to whole turns."
        agree("from start to goal", np.abs(ends).max(), 0.0, inputs, told, 1e-9)
        wanted, turns = shortest(start, goal), shortest(q[:-1], q[1:])
        whole = turns.sum(axis=0)
        told = "Each joint goes the shorter way round: from 179 to -179 degrees it is 2. Angles may be beyond a turn."
        agree("shortest way round", np.abs(whole), np.abs(wanted), inputs, told, 1e-9)
        shares = turns @ whole / max(whole @ whole, 1e-12)
        if np.abs(turns - shares[:, None] * whole).max(initial=0.0) > 1e-9 or shares.min(initial=0.0) < -1e-9:
            told = "All joints start and arrive together, each at an even rate: a straight line on the torus."
            raise Wrong("straight", f"{told}{case(inputs)}")
        moved = np.abs(np.diff(joint_places(q, lengths), axis=0)).max(initial=0.0)
        if moved > most * (1.0 + 1e-9):
            told = f"between two neighbours a point moves by {show(moved)} m, more than {show(most)} m"
            raise Wrong(check, f"{reason}\n{told}{case(inputs)}")
        least = fewest(wanted, lengths, most)
        if rows - 1 > least + 1:
            told = (
                f"{rows - 1} steps, where {least} even ones do. What counts is by how much each link turns in the"
                " world: the second by the sum of both joints, which may be nothing."
            )
            raise Wrong("no more than needed", f"{told}{case(inputs)}")

    reason = "A single link: its end moves by its length times the angle, in radians."
    for turn in rng.uniform(-2.5, 2.5, 5):
        trial("one joint", reason, [0.3], [0.3 + turn], [0.475], float(rng.uniform(0.002, 0.1)))
    reason = "From 179 to -179 degrees it is 2 degrees, and from 725 to -5 it is 10."
    for start, goal in ((179, -179), (-170, 170), (725, -5), (-900, 175), (90, -90)):
        trial("one joint", reason, np.deg2rad([start]), np.deg2rad([goal]), [0.475], 0.01)
    reason = "The first joint swings the whole arm, stretched if theta2 is zero: both links count."
    trial("first joint", reason, [0.2, 0.0], [1.4, 0.0], [0.45, 0.475], 0.002)
    reason = "The last joint turns the last link."
    trial("last joint", reason, [0.2, 0.4], [0.2, 2.4], [0.45, 0.475], 0.002)
    reason = "Both joints turn: what the elbow is carried, and what the second link turns about it, add up."
    for _ in range(8):
        turn = rng.uniform(0.1, 2.0, 2) * rng.choice([-1.0, 1.0])
        trial("both joints", reason, [0.0, 0.0], turn, rng.uniform(0.1, 0.6, 2), float(rng.uniform(0.002, 0.02)))
    reason = "Against each other: the second link only turns by the difference, and may keep its direction."
    for ratio in (1.0, 1.0, 0.9, 1.8):
        turn = float(rng.uniform(0.5, 1.5))
        trial("against each other", reason, [1.0, -0.5], [1.0 + turn, -0.5 - ratio * turn], [0.45, 0.475], 0.002)
    reason = "Start and goal are one place, perhaps some turns apart: nothing moves."
    for turns in (0.0, FULL, -2 * FULL):
        trial("already there", reason, [0.5, -2.0], [0.5 + turns, -2.0 - turns], [0.45, 0.475], 0.002)
    reason = "Any number of joints, any arm, any fineness; a step longer than the whole way is none too many."
    for _ in range(25):
        n = int(rng.integers(1, 6))
        start, goal = rng.uniform(-7.0, 7.0, (2, n))
        trial("any arm", reason, start, goal, rng.uniform(0.05, 0.6, n), float(10 ** rng.uniform(-2.5, 0.5)))


steps_so_fine = Exercise(
    "steps_so_fine",
    "cut a motion on the torus so finely that no point of the arm moves more than a given distance.",
    (
        "First the shorter way of each joint: `(goal - start + pi) % (2 pi) - pi`. Then how far does the tip travel if"
        " every link turns by its share?",
        "Link i turns in the world by the sum of the first i joints' angles: np.cumsum. Its end moves, against its"
        " beginning, by at most length times |that sum|; all links together: the sum of these.",
        "n = max(1, ceil(sum / most)) steps have n + 1 ends: start + turn * k / n, k = 0 ... n.",
    ),
    _judge_steps,
)
