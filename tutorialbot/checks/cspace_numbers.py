"""Exercises 1, 5 and 7 of notebook 3: what more joints cost, a loss that bears any logit, and when a map pays.

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

import statistics
from numbers import Integral
from typing import Any

import numpy as np

from tutorialbot.checks.counting import packages_called
from tutorialbot.checks.cspace_grids import SEED
from tutorialbot.checks.guard import Crashed, Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.seeding import make_rng

# --- 1 ----------------------------------------------------------------------------------------------------------------
BY_MEMORY, BY_TIME = "by memory", "by time"


def most_joints(cells: int, most: int) -> int:
    """Return the largest k for which cells^k is at most `most`, in whole numbers."""
    k = 0
    while cells ** (k + 1) <= most:
        k += 1
    return k


def _judge_joints(student: Student) -> None:
    rng = make_rng(SEED, 1)

    def trial(check: str, reason: str, cells: int, memory: int, check_us: int, patience: int) -> None:
        inputs = (360 / cells, memory, check_us, patience)
        answer = numbers(student(*inputs), (2,), inputs, reason)
        limits = (BY_MEMORY, 8 * memory), (BY_TIME, patience * 1_000_000 // check_us)
        for found, (rule, most) in zip(answer, limits, strict=True):
            agree(check or rule, found, most_joints(cells, most), inputs, f"{reason} {rule.capitalize()}:")

    reason = "A map of k joints has cells^k cells: one bit each, eight to a byte; one check each, in microseconds."
    trial("", reason, 360, 16 * 10**9, 10, 3600)
    trial("", reason, 72, 10**6, 12, 86_400)
    trial("", reason, 36, 200, 1, 10)
    reason = "What just fits, fits; a byte or a second less, and it does not. A logarithm's last digit decides nothing."
    for k in range(1, 7):
        for less in (0, 1):
            trial("just fits", reason, 72, 72**k // 8 - less, 10**6, 72**k - less)
            trial("just fits", reason, 1000, 1000**k // 8 - less, 10**6, 1000**k - less)
    reason = "No number of joints is too large for a whole number of Python's; numpy's end at 9.2e18."
    for k in (9, 10, 14):
        trial("many joints", reason, 180, 180**k // 8 + 1, 1, 180**k // 10**6 + 1)
    reason = "The steps of a joint are a whole number, also where 360 / resolution comes out a hair below it."
    for cells in (169, 237, 255, 471):
        for k in (3, 10):  # a bit less than k joints need, and more than they would with a hair less of a step
            trial("whole number of steps", reason, cells, (cells**k - 1) // 8, 1, (cells**k - 1) // 10**6)
    for _ in range(20):
        cells, check_us = int(rng.choice([36, 72, 90, 180, 360, 720])), int(rng.integers(1, 5000))
        memory, patience = (int(10 ** rng.uniform(*limits)) for limits in ((3, 16), (2, 8)))
        trial("any robot", reason, cells, memory, check_us, patience)


affordable_joints = Exercise(
    "affordable_joints",
    "for how many joints is there memory, and time, for a whole C-space?",
    (
        "How many cells has one joint at this resolution? And two joints, three, k?",
        "cells^k bits are cells^k / 8 bytes; cells^k checks take cells^k check_us / 1,000,000 seconds. Which is the"
        " largest k that still fits?",
        "Count up in whole numbers instead of taking logarithms: cells ** (k + 1) <= 8 * memory. `round(360 /"
        " resolution_deg)`, for 360 / (360 / 169) is 168.99999999999997.",
    ),
    _judge_joints,
)


# --- 5 ----------------------------------------------------------------------------------------------------------------
DIGITS = 1e-9  # relative
MACHINES = {"torch", "jax", "autograd", "tensorflow"}  # they derive by themselves


def softplus(x: np.ndarray) -> np.ndarray:
    """Return log(1 + exp(x)) to the last digits for any x."""
    return np.logaddexp(0.0, x)


def loss_parts(logits: np.ndarray, gt: np.ndarray, weight: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the loss, and what blocked and free cells add to its gradient: one pulls down, the other up."""
    cost = weight * gt * softplus(-logits) + (1.0 - gt) * softplus(logits)
    down = weight * gt * np.exp(-softplus(logits)) / logits.size
    up = (1.0 - gt) * np.exp(-softplus(-logits)) / logits.size
    return float(cost.mean()), down, up


def _judge_loss(student: Student) -> None:
    rng = make_rng(SEED, 5)

    def answered(inputs: tuple) -> Any:
        try:
            with np.errstate(over="raise", divide="raise", invalid="raise"):
                return student(*inputs)
        except Crashed as crash:
            if "FloatingPointError" not in str(crash):
                raise
            told = "No exponential of a large number and no logarithm of zero, not even one that is thrown away."
            raise Wrong("no overflow", f"{crash}\n{told}") from None

    def trial(check: str, reason: str, logits, gt, weight: float) -> None:
        inputs = (np.asarray(logits, dtype=float), np.asarray(gt, dtype=float), weight)
        loss, down, up = loss_parts(*inputs)
        answer = answered(inputs)
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            raise Wrong("shape of the answer", f"expected two things, the loss and its gradient{case(inputs)}")
        found = numbers(answer[0], (), inputs, reason)
        agree(f"{check}: loss", found, loss, inputs, reason, DIGITS * abs(loss))
        slope = numbers(answer[1], inputs[0].shape, inputs, reason)
        off = np.abs(slope - (up - down)) > DIGITS * (up + down)
        if off.any():
            told = f"yours {slope[off][0]:.12g}, expected {(up - down)[off][0]:.12g} at the first of {off.sum()} cells"
            raise Wrong(f"{check}: gradient", f"{reason}\nGradient: {told}; nine digits are asked for{case(inputs)}")

    reason = "A blocked cell costs -log p, a free one -log(1 - p), with p = 1 / (1 + exp(-logit))."
    for x in rng.uniform(-3.0, 3.0, 4):
        for truth in (0.0, 1.0):
            trial("one cell", reason, x, truth, 1.0)
    reason = "The mean over all cells: each has an N-th of the loss, and of the slope."
    for shape in ((5,), (6, 6), (2, 4, 4)):
        trial("mean", reason, rng.normal(0.0, 2.0, shape), rng.random(shape) < 0.3, 1.0)
    reason = "`weight` multiplies what blocked cells cost, and so what they add to the gradient."
    for weight in (0.25, 6.0):
        trial("weight", reason, rng.normal(0.0, 2.0, (5, 5)), rng.random((5, 5)) < 0.3, weight)
    reason = "The truth of a coarse cell may be a share, 0.3 say: both terms count then."
    trial("shares", reason, rng.normal(0.0, 2.0, (6, 6)), rng.random((6, 6)), 3.0)
    reason = "A confident network has logits of 40: 1 - p is 4e-18 then, which 1 minus something cannot hold."
    for x in (20.0, 40.0, -40.0, 600.0, -600.0):
        trial("tiny", reason, [x, x], [float(x > 0)] * 2, 2.0)
    reason = "An untrained one may say 1000: the loss is 1000 where that is wrong, and not infinite."
    trial("no overflow", reason, [1000.0, -1000.0, 800.0, 0.0], [0.0, 1.0, 1.0, 1.0], 2.0)
    inputs = (rng.normal(0.0, 2.0, (4, 4)), (rng.random((4, 4)) < 0.3).astype(float), 2.0)
    used = packages_called(lambda: student(*inputs)) & MACHINES
    if used:
        told = f"{', '.join(sorted(used))} did the work: write the loss and its derivative with numpy."
        raise Wrong("by hand", told)


loss_from_logits = Exercise(
    "loss_from_logits",
    "the loss from logits of any size, and its gradient by hand.",
    (
        "Put p = 1 / (1 + exp(-x)) into -log p: log(1 + exp(-x)). This is fine for large x; what for x = -1000?",
        "log(1 + exp(x)) = max(x, 0) + log1p(exp(-|x|)): its exponent is never above zero. `np.logaddexp(0, x)` does"
        " the same.",
        "The derivative of log(1 + exp(x)) is p(x), that of log(1 + exp(-x)) is -p(-x), and p(x) = exp(-log(1 +"
        " exp(-x))). Keep both terms apart: p - 1 is 0 where -p(-x) is -4e-18.",
    ),
    _judge_loss,
)


# --- 7 ----------------------------------------------------------------------------------------------------------------
PAIRED = "Both times of a problem belong together: hard ones take long either way. Look at the differences."


def pays(map_seconds: float, saving: float) -> int | None:
    """Return the first number of queries whose savings are above what the map costs, or None."""
    return None if saving <= 0.0 else int(map_seconds // saving) + 1


def _savings(with_map: np.ndarray, without: np.ndarray) -> tuple[float, float]:
    """Return the mean saving of a query, and the same less two standard errors."""
    each = (without - with_map).tolist()
    mean = statistics.fmean(each)
    return mean, mean - 2.0 * statistics.stdev(each) / len(each) ** 0.5


def _unpaired(map_seconds: float, with_map: np.ndarray, without: np.ndarray) -> int | None:
    """Return what comes out when both samples are taken for independent ones."""
    error = ((np.var(with_map, ddof=1) + np.var(without, ddof=1)) / len(without)) ** 0.5
    return pays(map_seconds, float(np.mean(without) - np.mean(with_map) - 2.0 * error))


def _judge_pays(student: Student) -> None:
    rng = make_rng(SEED, 7)

    def trial(check: str, reason: str, map_seconds: float, with_map, without) -> None:
        inputs = (map_seconds, np.asarray(with_map, dtype=float), np.asarray(without, dtype=float))
        answer = student(*inputs)
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            raise Wrong("shape of the answer", f"expected two things, each a whole number or None{case(inputs)}")
        expected = [pays(map_seconds, saving) for saving in _savings(*inputs[1:])]
        for which, found, wanted in zip(("expected", "sure"), answer, expected, strict=True):
            whole = isinstance(found, Integral) or (isinstance(found, float) and found.is_integer())
            if found is not None and (not whole or isinstance(found, bool)):
                raise Wrong("a whole number", f"{show(found)} is neither a whole number nor None{case(inputs)}")
            if found != wanted and check == "standard error" and which == "sure" and found == _unpaired(*inputs):
                check, reason = "paired", PAIRED
            if found != wanted:
                raise Wrong(check, f"{reason}\n{which}: yours {show(found)}, expected {wanted}{case(inputs)}")

    def drawn(k: int, saving: float, spread: float, common: float) -> tuple[float, np.ndarray, np.ndarray]:
        """Times of k problems, some hard for both, and a map whose cost no rounding brings to another number."""
        while True:
            hard, own = common * rng.exponential(1.0, k), rng.normal(0.0, spread, (2, k))
            with_map, without = 0.002 + hard + own[0], 0.002 + saving + hard + own[1]
            map_seconds = saving * float(rng.uniform(20.0, 60.0))
            rates = [rate for rate in _savings(with_map, without) if rate > 0.0]
            if all(0.01 < map_seconds / rate % 1.0 < 0.99 for rate in rates):
                return map_seconds, with_map, without

    reason = (
        "The map costs 1 s, each query saves 0.25 s: after four it has earned what it cost, with the fifth it pays."
    )
    trial("pays", reason, 1.0, [0.25, 0.25, 0.25], [0.5, 0.5, 0.5])
    trial("pays", "A quarter of what a query saves: one query is enough.", 0.0625, [0.25, 0.25], [0.5, 0.5])
    trial("pays", "A map for nothing pays with the first query.", 0.0, [0.25, 0.25], [0.5, 0.5])
    reason = "A map that makes queries no faster never pays: None."
    for slower in (0.0, 0.125):
        trial("never", reason, 0.5, np.array([0.25, 0.25]) + slower, [0.25, 0.25])
    reason = "Sure is what is left of the mean saving when two of its standard errors are taken off."
    for k in (20, 100, 300):
        trial("standard error", reason, *drawn(k, 0.005, 0.0005, 0.05))
    for k in (4, 12, 50, 400):
        trial("standard error", reason, *drawn(k, 0.02, 0.003, 0.0))
    reason = "With few queries it matters that the mean was taken from the same numbers: divide by k - 1."
    for k in (2, 2, 3, 3):
        trial("few queries", reason, *drawn(k, 0.05, 0.004, 0.0))
    reason = "A mean saving above zero may be chance: expected a number, sure None."
    seen = 0
    while seen < 4:
        case_ = drawn(6, 0.002, 0.004, 0.01)
        mean, sure = _savings(*case_[1:])
        if mean > 0.0 >= sure:
            seen += 1
            trial("by chance", reason, *case_)
    for _ in range(10):
        trial("any times", "Any times.", *drawn(int(rng.integers(2, 200)), *rng.uniform(0.001, 0.02, 3).tolist()))


pays_from = Exercise(
    "pays_from",
    "after how many queries has a map paid, as expected and for sure?",
    (
        "With q queries the map costs map_seconds + q times the mean time with it; without it, q times the other mean.",
        "Strictly cheaper: q > map_seconds / saving, so the floor of the quotient, and one more. A saving of zero or"
        " less: None.",
        "The savings `without - with_map` of the k problems have the standard deviation s = std(ddof=1); their mean has"
        " the standard error s / sqrt(k). For sure: the mean less two of these.",
    ),
    _judge_pays,
)
