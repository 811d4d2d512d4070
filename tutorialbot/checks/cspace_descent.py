"""Exercise 8 of notebook 3: values on a map that lead down to the goal from everywhere."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from tutorialbot.checks.counting import lines_run
from tutorialbot.checks.cspace_grids import SEED
from tutorialbot.checks.guard import Student, Wrong
from tutorialbot.checks.mechanism import Exercise
from tutorialbot.seeding import make_rng
from tutorialbot.vox2c import labels
from tutorialbot.vox2c.scenes import random_scene

MOVES = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
LENGTHS = np.hypot(*np.transpose(MOVES))
DEARER = 1.5  # times as dear as the cheapest way, a descent may be
WORK = 1000  # steps of Python for each cell


def allowed(blocked: np.ndarray) -> np.ndarray:
    """Return which of the MOVES each cell allows, (8, n, n): both cells free, and beside a diagonal one both others."""

    def free(i: int, j: int) -> np.ndarray:
        return ~np.roll(blocked, (-i, -j), axis=(0, 1))

    return np.array([free(0, 0) & free(i, j) & free(i, 0) & free(0, j) for i, j in MOVES])


def cheapest(blocked: np.ndarray, price: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    """Return what the cheapest way of each cell to the goal costs, (n, n); infinity where there is none or blocked."""
    cells = np.arange(blocked.size).reshape(blocked.shape)
    at, to, cost = [], [], []
    for (i, j), length, fine in zip(MOVES, LENGTHS, allowed(blocked), strict=True):
        there = np.roll(cells, (-i, -j), axis=(0, 1))[fine]
        at.append(cells[fine]), to.append(there)
        cost.append(length * (price[fine] + price.ravel()[there]) / 2.0)
    edges = np.concatenate(cost), (np.concatenate(at), np.concatenate(to))
    graph = csr_array(edges, shape=(blocked.size, blocked.size))
    found = dijkstra(graph, indices=int(cells[goal])).reshape(blocked.shape)
    return np.where(blocked, np.inf, found)


def steepest(values: np.ndarray, blocked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the steepest fall over length (n, n) among the moves of each cell, at most 0 in a hollow, and its move."""
    falls = []
    for (i, j), length, fine in zip(MOVES, LENGTHS, allowed(blocked), strict=True):
        there = np.roll(values, (-i, -j), axis=(0, 1))
        usable = fine & np.isfinite(there) & np.isfinite(values)
        falls.append(np.where(usable, (np.where(usable, values, 0.0) - np.where(usable, there, 0.0)) / length, 0.0))
    return np.max(falls, axis=0), np.argmax(falls, axis=0)


def descents(values: np.ndarray, blocked: np.ndarray, price: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    """Return what the descent of each cell costs that has a value, (n, n); all of them end at the goal."""
    _, move = steepest(values, blocked)
    cost = np.full(values.shape, np.inf)
    cost[goal] = 0.0
    for place in zip(*np.unravel_index(np.argsort(values, axis=None, kind="stable"), values.shape), strict=True):
        if np.isfinite(values[place]) and place != goal:
            to = tuple(np.add(place, MOVES[move[place]]) % len(values))
            cost[place] = cost[to] + LENGTHS[move[place]] * (price[place] + price[to]) / 2.0
    return cost


@dataclass(frozen=True)
class Trial:
    """One map with prices and a goal, by the rule that it is for."""

    check: str
    reason: str
    blocked: np.ndarray
    price: np.ndarray
    goal: tuple[int, int]

    def __str__(self) -> str:
        walls, n = np.argwhere(self.blocked).tolist(), len(self.blocked)
        some = f", the first ones {walls[:4]}" if walls else ""
        prices = f"prices from {self.price.min():.4g} to {self.price.max():.4g}"
        return f"\non a map of {n} x {n} cells, {len(walls)} blocked{some}; {prices}, goal {list(self.goal)}"


def serpentine(n: int) -> np.ndarray:
    """Return a map (n, n) of one long corridor: a wall every other row, open at one end and then at the other."""
    blocked = np.zeros((n, n), dtype=bool)
    blocked[::2] = True
    blocked[:, 0] = True
    blocked[2::4, 1] = blocked[4::4, -1] = False
    return blocked


def diagonals(n: int, gaps: tuple[int, ...]) -> np.ndarray:
    """Return a map (n, n) with two walls askew whose cells touch at their corners; open in the columns `gaps`."""
    i, j = np.indices((n, n))
    return ((i + j) % (n // 2) == 0) & ~np.isin(j, gaps)


def near_obstacles(blocked: np.ndarray, most: float, width: float) -> np.ndarray:
    """Return prices (n, n) from 1 far from all that is blocked to 1 + most beside it, falling over `width` cells."""
    cells = np.indices(blocked.shape).reshape(2, -1)
    away = np.abs(cells[:, :, None] - np.argwhere(blocked).T[:, None])
    away = np.minimum(away, len(blocked) - away).astype(float)
    square = np.square(away).sum(axis=0).min(axis=1)
    return 1.0 + most * np.exp(-square / width**2).reshape(blocked.shape)


def simple_trials() -> Iterator[Trial]:
    """Yield maps drawn by hand, each with what is special about it."""
    ones, empty = np.ones((12, 12)), np.zeros((12, 12), dtype=bool)
    reason = "On an empty map each cell but the goal has a neighbour that is lower; the goal itself has none."
    for goal in ((6, 5), (5, 6), (6, 6)):
        yield Trial("only the goal", reason, empty, ones, goal)
    wall = empty.copy()
    wall[4] = True
    for blocked, goal in ((wall, (6, 2)), (wall.T, (2, 6)), (wall | wall.T, (3, 3))):
        yield Trial("round the seam", "Behind the wall is the way over the border of the map.", blocked, ones, goal)
    trap = np.zeros((20, 20), dtype=bool)
    trap[4:13, 4] = trap[4, 4:13] = trap[12, 4:13] = True
    reason = "A dead end that opens away from the goal: who comes nearer to the goal each step stays in there."
    for turn in range(4):
        goal = [(8, 0), (0, 11), (11, 19), (19, 8)][turn]
        yield Trial("trap", reason, np.rot90(trap, -turn), np.ones((20, 20)), goal)
    reason = "Between two blocked cells that share a corner nothing passes: on its way the arm sweeps over both."
    for gaps, goal in (((), (2, 3)), ((7,), (2, 3)), ((2, 9), (12, 1))):
        yield Trial("corners", reason, diagonals(16, gaps), np.ones((16, 16)), goal)
    pocket = np.zeros((14, 14), dtype=bool)
    pocket[3:8, 3:8] = True
    pocket[4:7, 4:7] = False
    reason = "Infinity where no way leads to the goal, and where it is blocked; from a blocked goal, everywhere."
    for goal in ((10, 2), (5, 5), (3, 3)):
        yield Trial("no way", reason, pocket, np.ones((14, 14)), goal)
    reason = "A corridor of several hundred cells."
    yield Trial("long way", reason, serpentine(26), np.ones((26, 26)), (25, 24))


def arm_trials() -> Iterator[Trial]:
    """Yield C-spaces of true scenes, first with one price and then dear beside obstacles."""
    rng, price = make_rng(SEED, 8), np.ones((12, 12))
    price[3:7] = 30.0
    price[3:7, 6] = 1.0
    reason = "A dear strip with one cheap crossing: the shortest way is not the cheapest."
    yield Trial("worth its price", reason, np.zeros((12, 12), dtype=bool), price, (9, 1))
    for seed in (61, 65, 69, 71):
        blocked = labels.exact_cspace(random_scene(seed, 25), 10)
        free = np.argwhere(~blocked)
        goal = tuple(free[rng.integers(len(free))].tolist())
        yield Trial("map of an arm", "The C-space of a scene.", blocked, np.ones(blocked.shape), goal)
        reason = "Where it is narrow it is dear: a way around may be worth it, also a long one."
        yield Trial("worth its price", reason, blocked, near_obstacles(blocked, 15.0, 2.5), goal)


def _heights(answer: object, trial: Trial) -> np.ndarray:
    """Return the answer as a float array (n, n) without NaN, or raise Wrong."""
    try:
        values = np.array(answer, dtype=float)
    except Exception:  # whatever the answer is made of
        values = np.empty(0)
    if values.shape != trial.blocked.shape:
        raise Wrong("shape of the answer", f"expected a number for each cell{trial}")
    if np.isnan(values).any():
        raise Wrong("finite numbers", f"there is a NaN among the values: infinity says that no way leads{trial}")
    return values


def _judge_map(trial: Trial, answer: object) -> None:
    blocked, goal = trial.blocked, trial.goal
    values, best = _heights(answer, trial), cheapest(blocked, trial.price, goal)
    reached = np.isfinite(best)

    def reject(check: str, where: np.ndarray, told: str) -> None:
        if where.any():
            place = np.argwhere(where)[0].tolist()
            raise Wrong(check, f"{trial.reason}\nAt the cell {place} {told}; so at {where.sum()} cells{trial}")

    reject(trial.check, ~reached & (values < np.inf), "the value is not infinity, though no way leads to the goal")
    reject(trial.check, reached & ~np.isfinite(values), "the value is infinite, though a way leads to the goal")
    hollow = reached & (steepest(values, blocked)[0] <= 0.0)
    if reached[goal]:
        if not hollow[goal]:
            raise Wrong(trial.check, f"{trial.reason}\nThe goal has a lower neighbour{trial}")
        hollow[goal] = False
    reject(trial.check, hollow, "no neighbour that may be reached is lower: the descent ends there")
    too_dear = reached & (descents(values, blocked, trial.price, goal) > DEARER * best + 1e-9)
    reject("worth its price", too_dear, f"the descent costs more than {DEARER} times what the cheapest way does")


def _judge_descent(student: Student) -> None:
    for trial in simple_trials():
        _judge_map(trial, student(trial.blocked, trial.price, trial.goal))
    answer, steps = lines_run(lambda: student(trial.blocked, trial.price, trial.goal))
    if steps > WORK * trial.blocked.size:
        raise Wrong(
            "work",
            f"{trial.blocked.size} cells in one long corridor took {steps} steps of Python, more than {WORK} a cell:"
            " sweep over the whole map again and again, and the work grows as the square of the map. Who has been"
            " reached need not be looked at each time.",
        )
    for trial in arm_trials():
        _judge_map(trial, student(trial.blocked, trial.price, trial.goal))


downhill_values = Exercise(
    "downhill_values",
    "open design: values that lead down to the goal from everywhere, and around what is dear.",
    (
        "How dear is the cheapest way from each cell to the goal? These costs have no hollow but the goal. Begin there"
        " and let them spread.",
        "Dijkstra: a heap (`heapq`) of (cost, cell), the cheapest comes out first, and offers its neighbours its own"
        " cost and that of the step. Indices modulo n.",
        "A diagonal step from (i, j) to (i + a, j + b) needs (i + a, j) and (i, j + b) free too. A cell that comes out"
        " of the heap dearer than it is known to be is passed over.",
    ),
    _judge_descent,
    limit=60.0,
)
