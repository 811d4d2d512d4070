"""Planners that need the whole C-space: a potential field, which gets stuck, and a navigation function, which does not.

Both are numbers on the cells of a map; a path goes from cell to the lowest neighbour until it is at the goal. The
potential field (Koren and Borenstein, reference [1] of paper 3) adds an attraction to the goal and a repulsion from
what is near: its hollows away from the goal are where it stalls. The wavefront counts steps from the goal around all
that is blocked: every cell but the goal has a lower neighbour, so there is no hollow, and the path is the shortest one
of the grid. Cells are neighbours along either angle, and the grid wraps around.
"""

import math

import numpy as np
from scipy.ndimage import distance_transform_edt, minimum_filter

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, one_of, positive
from tutorialbot.vox2c.kernels import compiled
from tutorialbot.vox2c.motions import cell, continuous, turn, wrap

PLANNERS = ("wavefront", "potential")
ATTRACTION = 1.0  # weight of half the squared distance to the goal [1 / rad^2]
REPULSION = 0.05  # weight of the repulsion [rad^2]
INFLUENCE = 0.5  # farther than this from an obstacle there is no repulsion [rad]
UNREACHED = -1
NEIGHBOURS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1)])
NOWHERE = np.empty((0, 2))


@compiled
def _spread(blocked, goal1, goal2, start1, start2):
    """Count steps from the goal over free cells (n, n), ring by ring; until the start is reached, or all when -1."""
    n = len(blocked)
    steps = np.full((n, n), UNREACHED, dtype=np.int32)
    if blocked[goal1, goal2]:
        return steps
    queue1, queue2 = np.empty(n * n, dtype=np.int32), np.empty(n * n, dtype=np.int32)
    queue1[0], queue2[0] = goal1, goal2
    steps[goal1, goal2] = 0
    first, last = 0, 1
    while first < last and (start1 < 0 or steps[start1, start2] == UNREACHED):
        i, j = queue1[first], queue2[first]
        first += 1
        for move in range(4):
            k, m = i + NEIGHBOURS[move, 0], j + NEIGHBOURS[move, 1]
            k = 0 if k == n else n - 1 if k < 0 else k
            m = 0 if m == n else n - 1 if m < 0 else m
            if steps[k, m] == UNREACHED and not blocked[k, m]:
                steps[k, m] = steps[i, j] + 1
                queue1[last], queue2[last] = k, m
                last += 1
    return steps


@compiled
def _lowest(field, i, j, moves):
    """Return the lowest of the neighbours of cell (i, j), the first one when some are equal."""
    n = len(field)
    best, k, m = np.inf, i, j
    for move in range(len(moves)):
        a, b = (i + moves[move, 0]) % n, (j + moves[move, 1]) % n
        if 0.0 <= field[a, b] < best:
            best, k, m = field[a, b], a, b
    return best, k, m


@compiled
def _descend(field, i, j, moves):
    """Go from cell to lowest neighbour while that is lower; the cells (k, 2)."""
    n = len(field)
    cells = np.empty((n * n, 2), dtype=np.int64)
    cells[0] = i, j
    k = 1
    while k < n * n:
        best, a, b = _lowest(field, i, j, moves)
        if best >= field[i, j]:
            break
        i, j = a, b
        cells[k] = i, j
        k += 1
    return cells[:k]


def check_cspace(cspace) -> np.ndarray:
    """Return a map as a bool array (n, n); raise InvalidType or InvalidValue for anything else."""
    array = np.asarray(cspace)
    if array.dtype != bool:
        raise InvalidType("cspace", f"array of {array.dtype}", "an array of bool, True = blocked")
    if array.ndim != 2 or array.shape[0] != array.shape[1] or not len(array):
        raise InvalidValue("cspace", f"array of shape {array.shape}", "shape (n, n)")
    return array


@compiled
def free_cell(blocked, theta1, theta2):
    """Return the cell nearest to (theta1, theta2) [rad] on a map (n, n); where it is blocked, the nearest free one of
    the eight around it. (None of them free: the cell itself.)
    """
    n = len(blocked)
    i, j = cell(theta1, n), cell(theta2, n)
    k, m, best = i, j, np.inf
    if blocked[i, j]:
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                away1 = turn(theta1, 2.0 * math.pi * (a / n - 0.5))
                away2 = turn(theta2, 2.0 * math.pi * (b / n - 0.5))
                away = away1 * away1 + away2 * away2
                if not blocked[a % n, b % n] and away < best:
                    k, m, best = a % n, b % n, away
    return k, m


@compiled
def widened(cspace):
    """Return a map with the eight cells around every blocked one blocked as well; the grid wraps around."""
    n = len(cspace)
    found = cspace.copy()
    for i in range(n):
        for j in range(n):
            if cspace[i, j]:
                for a in range(i - 1, i + 2):
                    for b in range(j - 1, j + 2):
                        found[a % n, b % n] = True
    return found


def angles_of(cells, n: int) -> np.ndarray:
    """Return the angles [rad] of cells (..., 2) on a map of n x n cells."""
    return 2 * np.pi * (np.asarray(cells) / n - 0.5)


def wavefront(cspace, goal) -> np.ndarray:
    """Return how many steps each cell is from the goal (2,) [rad], int32 (n, n); -1 where none lead there or blocked.

    A navigation function: its only minimum is the goal. Breadth first, each free cell once.
    """
    cspace, goal = check_cspace(cspace), finite_array("goal", goal, (2,))
    return _spread(cspace, *free_cell(cspace, *goal), -1, -1)


def distance_to_obstacles(cspace) -> np.ndarray:
    """Return how far each cell is from the nearest blocked one [rad], (n, n); infinity everywhere when none is."""
    cspace = check_cspace(cspace)
    n = len(cspace)
    if not cspace.any():
        return np.full((n, n), np.inf)
    around = distance_transform_edt(~np.pad(cspace, n // 2 + 1, mode="wrap"))
    return around[n // 2 + 1 : -(n // 2 + 1), n // 2 + 1 : -(n // 2 + 1)] * 2 * np.pi / n


def potential(cspace, goal, *, attraction: float = ATTRACTION, repulsion: float = REPULSION,
              influence: float = INFLUENCE) -> np.ndarray:  # fmt: skip
    """Return the potential field (n, n) of a map and a goal (2,) [rad]; infinity on what is blocked.

    attraction / 2 * (distance to the goal)^2 + repulsion / 2 * (1 / distance to obstacles - 1 / influence)^2, the
    second part within `influence` of an obstacle only.
    """
    cspace, goal = check_cspace(cspace), finite_array("goal", goal, (2,))
    positive("attraction", attraction), positive("repulsion", repulsion), positive("influence", influence)
    n = len(cspace)
    theta = 2 * np.pi * (np.arange(n) / n - 0.5)
    centre = angles_of(free_cell(cspace, *goal), n)
    away = [wrap(theta - angle) for angle in centre]
    pull = 0.5 * attraction * (away[0][:, None] ** 2 + away[1] ** 2)
    near = np.maximum(distance_to_obstacles(cspace), 1e-9)
    push = np.where(near < influence, 0.5 * repulsion * (1 / near - 1 / influence) ** 2, 0.0)
    return np.where(cspace, np.inf, pull + push)


def open_cells(field: np.ndarray) -> np.ndarray:
    """Return which cells (n, n) a field has a height for: not blocked, and reached."""
    return (field >= 0) & (field < np.inf)


def descend(field: np.ndarray, start) -> np.ndarray:
    """Return the cells (k, 2) from the start (2,) [rad] downhill, until no neighbour is lower."""
    return _descend(field, *free_cell(~open_cells(field), *finite_array("start", start, (2,))), NEIGHBOURS)


def hollows(field: np.ndarray) -> np.ndarray:
    """Return which cells (n, n) have no lower neighbour: where a descent ends. Unreached and blocked ones do not count.

    Of equal neighbours the descent leaves neither.
    """
    heights = np.where(open_cells(field), field, np.inf)
    cross = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=bool)
    return np.isfinite(heights) & (heights <= minimum_filter(heights, footprint=cross, mode="wrap"))


def stalled(field: np.ndarray, goal) -> np.ndarray:
    """Return the cells (n, n) from which a descent ends elsewhere than at the goal (2,) [rad]; blocked ones are not."""
    return _ends_elsewhere(field, *free_cell(~open_cells(field), *finite_array("goal", goal, (2,))), NEIGHBOURS)


@compiled
def _ends_elsewhere(field, goal1, goal2, moves):
    n = len(field)
    found = np.zeros((n, n), dtype=np.bool_)
    for i in range(n):
        for j in range(n):
            if 0.0 <= field[i, j] < np.inf:
                a, b = i, j
                while True:
                    best, k, m = _lowest(field, a, b, moves)
                    if best >= field[a, b]:
                        break
                    a, b = k, m
                found[i, j] = a != goal1 or b != goal2
    return found


def path(cspace: np.ndarray, start, goal, planner: str = "wavefront") -> np.ndarray:
    """Return a path (k, 2) [rad] from start to goal (2,) over free cells, continuous; (0, 2) when there is none.

    The planner "wavefront" finds one whenever there is one on the grid; "potential" may stall, and then has none.
    """
    cspace = check_cspace(cspace)
    if one_of("planner", planner, PLANNERS) == "potential":
        return along(potential(cspace, goal), start, goal)
    start, goal = finite_array("start", start, (2,)), finite_array("goal", goal, (2,))
    first, last = free_cell(cspace, *start), free_cell(cspace, *goal)
    return _down(_spread(cspace, *last, *first), first, last, start, goal)


def along(field: np.ndarray, start, goal) -> np.ndarray:
    """Return the path (k, 2) [rad] that goes down a field to the goal, its ends exactly start and goal (2,).

    Many starts share one field. (0, 2) where it stalls or never reached the start.
    """
    start, goal = finite_array("start", start, (2,)), finite_array("goal", goal, (2,))
    closed = ~open_cells(field)
    return _down(field, free_cell(closed, *start), free_cell(closed, *goal), start, goal)


def _down(field: np.ndarray, first: tuple, last: tuple, start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    cells = _descend(field, *first, NEIGHBOURS)
    if not 0 <= field[first] < np.inf or (cells[-1] != last).any():
        return NOWHERE
    return continuous(np.concatenate([[start], angles_of(cells[_corners(cells, len(field))], len(field)), [goal]]))


@compiled
def _corners(cells, n):
    """Say at which cells (k, 2) the way turns, begins or ends: straight runs need no points between.

    Long ones keep some, for the shorter way between two points to be the one meant.
    """
    keep = np.ones(len(cells), dtype=np.bool_)
    for i in range(1, len(cells) - 1):
        straight = True
        for axis in range(2):
            straight &= (cells[i + 1, axis] - cells[i, axis]) % n == (cells[i, axis] - cells[i - 1, axis]) % n
        keep[i] = not straight or i % max(1, n // 4) == 0
    return keep
