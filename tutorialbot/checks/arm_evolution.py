"""Exercises 1 and 5 of notebook 2: who is crossed and who mutates, and the difference mutation."""

import numpy as np

from tutorialbot.checks.arm_kinematics import SEED
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, expect, numbers
from tutorialbot.seeding import make_rng


# --- 1 ----------------------------------------------------------------------------------------------------------------
def _judge_children(student: Student) -> None:
    rng = make_rng(SEED, 1)

    def trial(check: str, reason: str, n: int, crossing: float, mutating: float, variation: str) -> None:
        table = np.outer([1.0 - crossing, crossing], [1.0 - mutating, mutating])  # chances of two draws
        if variation == "or":
            table = np.array([[1.0 - crossing - mutating, mutating], [crossing, 0.0]])  # of one draw
        expected = n * np.array([table[1, 0], table[0, 1], table[1, 1], table[0, 0]])
        expect(student, check, (n, crossing, mutating, variation), expected, reason, 1e-9 * n)

    reason = "The paper's 0.6 and 0.4 in the preset `good`: each child draws once, and is crossed or mutated."
    trial("crossed or mutated", reason, 300, 0.6, 0.4, "or")
    reason = "One draw for each child: what is left of 1 after both probabilities is a child left as its parent was."
    trial("the rest", reason, 300, 0.5, 0.3, "or")
    reason = "Two draws for each child, which know nothing of each other: their chances multiply, and some have both."
    trial("crossed and mutated", reason, 100, 0.6, 0.4, "and")
    reason = "Numbers of children, not shares, for any size and any probabilities; an expectation need not be whole."
    for _ in range(20):
        crossing = float(rng.uniform())
        mutating = float(rng.uniform(0.0, 1.0 - crossing))
        for variation in ("or", "and"):
            trial("any numbers", reason, int(rng.integers(5, 500)), crossing, mutating, variation)
    reason = "Where each child draws twice, both probabilities may be large: their sum means nothing."
    trial("any numbers", reason, 40, 0.9, 0.8, "and")


expected_children = Exercise(
    "expected_children",
    "how many children are expected to be crossed, mutated, both, or neither?",
    (
        "A share of n is p n. Which four things can happen to a child, and do their chances add up to 1?",
        '"or": one draw, which falls on crossing, on mutating, or on neither. Both at once cannot be.',
        '"and": two independent draws. Crossed alone has the chance c (1 - m), both have c m, and so on.',
    ),
    _judge_children,
)


# --- 5 ----------------------------------------------------------------------------------------------------------------
CALLS, LARGE, MIDDLE, SMALL = 40, 300, 40, 7
SIGMAS = 6.0  # by which a sample may be off


def _ridge(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return a population (n, 7) that is long in one direction and thin across it, and lopsided."""
    mixed = np.linalg.qr(rng.standard_normal((7, 7)))[0]
    return rng.exponential(1.0, (n, 7)) * np.geomspace(1.0, 1e-3, 7) @ mixed + rng.uniform(-1.0, 1.0, 7)


def _children(student: Student, population: np.ndarray, factor: float, rng: np.random.Generator) -> np.ndarray:
    inputs = (population, factor, rng)
    return numbers(student(*inputs), population.shape, inputs, "Each member of the population gets one child.")


def _judge_shape(student: Student) -> None:
    """The rules on the cloud of children."""
    rng = make_rng(SEED, 5)
    along = rng.standard_normal(7)
    line = rng.uniform(-1.0, 1.0, 7) + rng.uniform(-1.0, 1.0, (50, 1)) * along
    off = _children(student, line, 0.5, make_rng(SEED, 5, 1)) - line
    off -= np.outer(off @ along, along) / (along @ along)
    if np.abs(off).max() > 1e-9:
        raise Wrong(
            "on the line",
            "all members lie on one line in the space of the joints, and a difference of members lies along it; yet a"
            f" child left it by {np.abs(off).max():.2g} rad. Off the ridge there is only worse fitness.",
        )
    population, factor, chance = _ridge(rng, LARGE), 0.6, make_rng(SEED, 5, 2)
    steps = np.concatenate([_children(student, population, factor, chance) - population for _ in range(CALLS)])
    different = len(np.unique(steps[:LARGE].round(12), axis=0))
    if different < 0.5 * LARGE:
        raise Wrong(
            "a pair for each",
            f"{LARGE} children made only {different} different steps: each child draws a pair of its own.",
        )
    pooled = 2.0 * factor**2 * np.cov(population.T)
    whitened = steps @ np.linalg.inv(np.linalg.cholesky(pooled)).T  # mean 0 and covariance 1, if all is well
    mean = np.abs(whitened.mean(axis=0)).max()
    if mean > SIGMAS / np.sqrt(len(steps)):
        raise Wrong(
            "mean zero",
            f"on average the children are {mean:.2f} standard deviations to one side of their parents: b - c and c - b"
            " are as likely, so the step has no preferred direction.",
        )
    wrong = np.abs(np.cov(whitened.T) - np.eye(7)).max()
    if wrong > 0.15:  # some nine standard deviations
        raise Wrong(
            "the population's shape",
            f"the covariance of the steps differs from 2 factor^2 times that of the population by {100 * wrong:.0f} %:"
            " the steps are `factor` times a difference of two members, long where the population is long.",
        )


def _pairs(population: np.ndarray, children: np.ndarray, factor: float, inputs: tuple) -> np.ndarray:
    """Return which members b, c made each step (n, 2); raises Wrong when no two did."""
    n = len(population)
    differences = (population[:, None] - population[None]).reshape(n * n, -1)
    away = np.abs((children - population)[:, None] / factor - differences).max(axis=-1)
    found = away.argmin(axis=1)
    for i in np.flatnonzero(away.min(axis=1) > 1e-9):
        raise Wrong(
            "a difference of two members",
            f"child {i} moved by {show(children[i] - population[i])}: that is not {factor} times the difference of any"
            f" two members{case(inputs)}",
        )
    return np.stack(np.divmod(found, n), axis=1)


def _judge_members(student: Student) -> None:
    """The rules on who made each step."""
    rng, chance = make_rng(SEED, 5, 3), make_rng(SEED, 5, 4)
    counts, members, alike = np.zeros((SMALL, SMALL, SMALL)), np.arange(SMALL)[:, None], 0
    for n in [3, *[MIDDLE] * 8, *[SMALL] * 600]:
        population, factor = rng.uniform(-1.0, 1.0, (n, 7)), float(rng.uniform(0.3, 0.9))
        inputs = (population, factor, chance)
        pairs = _pairs(population, _children(student, *inputs), factor, inputs)
        for i, (b, c) in enumerate(pairs):
            if b == c:
                told = "is where its parent was: a member minus itself is no step"
                raise Wrong("two different members", f"child {i} {told}{case(inputs)}")
            if i in (b, c):
                told = f"moved by the difference of members {b} and {c}: two others than {i} itself are asked for"
                raise Wrong("two others", f"child {i} {told}{case(inputs)}")
            if n == SMALL:
                counts[i, b, c] += 1
        if n == SMALL:
            ahead = (pairs - members) % n
            alike += (ahead == np.roll(ahead, 1, axis=0)).all(axis=1).sum()
    others = [(i, b, c) for i in range(SMALL) for b in range(SMALL) for c in range(SMALL) if len({i, b, c}) == 3]
    for what, seen, expected in (
        ("pair (first, second)", counts.sum(axis=0)[~np.eye(SMALL, dtype=bool)], 600 * SMALL / (SMALL * (SMALL - 1))),
        ("pair for one member", np.array([counts[where] for where in others]), 600 / ((SMALL - 1) * (SMALL - 2))),
    ):
        if np.abs(seen - expected).max() > SIGMAS * np.sqrt(expected):
            raise Wrong(
                "every pair alike",
                f"in 600 generations of {SMALL} members each {what} should come about {expected:.0f} times; one came"
                f" {seen.min():.0f} times, one {seen.max():.0f} times. Whoever is never drawn teaches nobody.",
            )
    expected = 600 * SMALL / ((SMALL - 1) * (SMALL - 2))
    if alike > expected + SIGMAS * np.sqrt(expected):
        raise Wrong(
            "a pair for each",
            f"in 600 generations of {SMALL} members a child took the same two places ahead of its own as its neighbour"
            f" in the list {alike} times, expected about {expected:.0f}: each child draws a pair of its own.",
        )


def _judge_chance(student: Student) -> None:
    """The rules on where chance comes from."""
    population = make_rng(SEED, 5, 5).uniform(-1.0, 1.0, (30, 7))
    once, again = (_children(student, population, 0.5, make_rng(SEED, 5, 6)) for _ in range(2))
    reason = "The same generator gives the same children: `rng` is the only source of chance."
    agree("chance from rng alone", again, once, (), reason)
    chance = make_rng(SEED, 5, 7)
    once, again = (_children(student, population, 0.5, chance) for _ in range(2))
    if np.array_equal(once, again) and not np.array_equal(once, population):
        told = "two generations in a row drew the same pairs: take the numbers from `rng`, which moves on by itself."
        raise Wrong("new chance each time", told)


def _judge_difference(student: Student) -> None:
    _judge_chance(student)
    _judge_shape(student)
    _judge_members(student)


step_by_difference = Exercise(
    "step_by_difference",
    "the difference mutation of a whole population, with two others for each member.",
    (
        "For each member i draw b and c, and let the child be x_i + factor (x_b - x_c), all genes by the same pair.",
        "i, b, c are three different numbers. Drawing again until they differ is one way; a loop over the members too.",
        "Without a loop: b = (i + r) % n with r from 1 to n - 1 is anybody but i. For c draw another r from 1 to n - 2,"
        " and add 1 where it is not below the first one.",
    ),
    _judge_difference,
    limit=30.0,
)
