"""Answers to notebook 3's exercises that differ from ours and are as right."""

import heapq
import math
import statistics
from collections import deque
from fractions import Fraction

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.special import expit, log_expit

from tests.exercises.planting import right_into

RIGHT = []  # (function, exercise)
right = right_into(RIGHT)


# --- 1 affordable_joints ----------------------------------------------------------------------------------------------
@right("affordable_joints")
def joints_by_dividing(resolution_deg, memory, check_us, patience):
    cells = int(360 / resolution_deg + 0.5)
    bits, checks, found = memory * 8, patience * 10**6 // check_us, []
    for left in (bits, checks):
        found.append(0)
        while left >= cells:
            left //= cells
            found[-1] += 1
    return tuple(found)


@right("affordable_joints")
def joints_by_a_list_of_maps(resolution_deg, memory, check_us, patience):
    sizes = [round(360 / resolution_deg) ** k for k in range(1, 40)]
    by_memory = sum(math.ceil(Fraction(size, 8)) <= memory for size in sizes)
    return np.array([by_memory, sum(size * check_us <= patience * 10**6 for size in sizes)])


# --- 2 turned_rectangles_meet -----------------------------------------------------------------------------------------
@right("turned_rectangles_meet")
def meet_by_corners(a, b):
    """Shadows of the corners on all four directions, the lot of them at once."""

    def corners(r):
        along = np.stack([np.sin(r[:, 4]), np.cos(r[:, 4])], axis=-1)
        across = np.stack([np.cos(r[:, 4]), -np.sin(r[:, 4])], axis=-1)
        s, t = np.array([[1, 1, -1, -1], [1, -1, 1, -1]])
        points = s[:, None] * (r[:, 2:3] * along)[:, None] + t[:, None] * (r[:, 3:4] * across)[:, None]
        return r[:, None, :2] + points, np.stack([along, across], axis=1)

    a, b = np.broadcast_arrays(a, b)
    (p, own), (q, other) = corners(a), corners(b)
    axes = np.concatenate([own, other], axis=1)
    p, q = (np.einsum("nak,nck->nac", axes, points) for points in (p, q))
    gap = np.maximum(p.min(axis=2) - q.max(axis=2), q.min(axis=2) - p.max(axis=2))
    return gap.max(axis=1, initial=-np.inf) < -1e-9


@right("turned_rectangles_meet")
def meet_seen_from_each_in_turn(a, b):
    """Complex numbers: turn the world until one of both is upright."""

    def apart(r, s):
        away = (s[:, 1] + 1j * s[:, 0] - r[:, 1] - 1j * r[:, 0]) * np.exp(-1j * r[:, 4])
        u = np.exp(1j * (s[:, 4] - r[:, 4]))
        long = s[:, 2] * abs(u.real) + s[:, 3] * abs(u.imag)
        wide = s[:, 2] * abs(u.imag) + s[:, 3] * abs(u.real)
        return (abs(away.real) >= r[:, 2] + long - 1e-9) | (abs(away.imag) >= r[:, 3] + wide - 1e-9)

    return ~(apart(a, b) | apart(b, a))


# --- 3 from_own_angles ------------------------------------------------------------------------------------------------
@right("from_own_angles")
def angles_by_degrees(second, third):
    """Whole degrees of a turn of n m: theta1 + theta2 as such, then back to a cell."""
    n, m = third.shape
    theta = -n * m + 2 * m * np.arange(n)  # in units of 180 / (n m) degrees
    cell = ((theta[:, None] + theta + n * m) % (2 * n * m)) // (2 * n)
    return np.logical_or(np.take_along_axis(third, cell, axis=1), second.reshape(-1, 1))


@right("from_own_angles")
def angles_by_a_doubled_table(second, third):
    """Two and a half turns of phi side by side: no modulo, a window that slides."""
    n, m = third.shape
    doubled = np.concatenate([third[:, m // 2 :], third, third, third[:, : m // 2]], axis=1)
    start = np.arange(n) * (m // n)
    flat = doubled.ravel()[np.arange(n)[:, None] * 3 * m + start[:, None] + start]
    return np.maximum(flat, second[:, None])


@right("from_own_angles")
def angles_by_skewing(second, third):
    """Rows that are one longer than they are wide shift themselves, once they are read as a single row."""
    n, m = third.shape
    phi = np.roll(third, m // 2, axis=1)[:, :: m // n]
    skewed = np.hstack([phi, phi]).ravel()
    i, k = np.divmod(np.arange(n * n), n)
    return skewed[(i * 2 * n) + i + k].reshape(n, n) | second[:, None]


# --- 4 points_to_voxels -----------------------------------------------------------------------------------------------
@right("points_to_voxels")
def voxels_by_bincount(points, low, side, shape, least):
    with np.errstate(invalid="ignore"):
        i, j, k = np.floor((points - low) / side).T
        inside = (i >= 0) & (i < shape[0]) & (j >= 0) & (j < shape[1]) & (k >= 0) & (k < shape[2])
    flat = (i[inside] * shape[1] + j[inside]) * shape[2] + k[inside]
    return (np.bincount(flat.astype(int), minlength=int(np.prod(shape))) >= least).reshape(shape)


@right("points_to_voxels")
def voxels_by_unique_rows(points, low, side, shape, least):
    inside = ((points >= low) & (points < low + side * np.array(shape))).all(axis=1)
    cells, counts = np.unique(np.floor_divide(points[inside] - low, side), axis=0, return_counts=True)
    grid = np.zeros(shape)
    grid[tuple(cells[counts >= least].astype(int).T)] = 1
    return grid


@right("points_to_voxels")
def voxels_by_histogram_of_what_is_inside(points, low, side, shape, least):
    faces = [low[a] + side * np.arange(shape[a] + 1) for a in range(3)]
    inside = np.all([(points[:, a] >= faces[a][0]) & (points[:, a] < faces[a][-1]) for a in range(3)], axis=0)
    return np.histogramdd(points[inside], faces)[0] >= least


# --- 5 loss_from_logits -----------------------------------------------------------------------------------------------
@right("loss_from_logits")
def loss_by_scipy(logits, gt, weight):
    loss = -(weight * gt * log_expit(logits) + (1 - gt) * log_expit(-logits)).mean()
    return loss, ((1 - gt) * expit(logits) - weight * gt * expit(-logits)) / np.size(logits)


@right("loss_from_logits")
def loss_by_logaddexp(logits, gt, weight):
    free, blocked = np.logaddexp(0, logits), np.logaddexp(0, -logits)
    n = np.size(logits)
    loss = np.sum(weight * gt * blocked + (1 - gt) * free) / n
    return [float(loss), (1 - gt) / n * np.exp(-blocked) - weight * gt / n * np.exp(-free)]


@right("loss_from_logits")
def loss_with_one_exponential(logits, gt, weight):
    small = np.exp(-np.abs(logits))  # of what is certain, the other way
    rare, often = small / (1 + small), 1 / (1 + small)
    p, q = np.where(logits < 0, rare, often), np.where(logits < 0, often, rare)
    slope = ((1 - gt) * p - weight * gt * q) / logits.size
    softplus = np.log1p(small) + logits * (logits > 0)
    return np.mean((1 - gt) * softplus + weight * gt * (np.log1p(small) - logits * (logits < 0))), slope


# --- 6 steps_so_fine --------------------------------------------------------------------------------------------------
@right("steps_so_fine")
def steps_by_trying(start, goal, lengths, most):
    """Cuts finer until the ends of all links move little enough."""
    turn = np.angle(np.exp(1j * (goal - start)))
    n = 1
    while True:
        q = start + np.linspace(0, 1, n + 1)[:, None] * turn
        ends = np.cumsum(lengths * np.exp(1j * np.cumsum(q, axis=1)), axis=1)
        moved = np.abs(np.diff(ends, axis=0)).max()
        if moved <= most:
            return q
        n = max(n + 1, int(n * moved / most))


@right("steps_so_fine")
def steps_in_a_plain_loop(start, goal, lengths, most):
    turn = [math.remainder(g - s, math.tau) for s, g in zip(start, goal, strict=True)]
    world = arcs = 0.0
    for angle, length in zip(turn, lengths, strict=True):
        world += angle
        arcs += length * abs(world)
    n = math.ceil(arcs / most) + 1  # one more than needed, to be safe
    return [[(s + t * k / n) % math.tau for s, t in zip(start, turn, strict=True)] for k in range(n + 1)]


@right("steps_so_fine")
def steps_that_stay_where_they_are(start, goal, lengths, most):
    turn = goal - start - 2 * np.pi * np.rint((goal - start) / (2 * np.pi))
    if np.allclose(turn, 0, atol=1e-12):
        return start[None]
    arcs = np.abs(np.tril(np.ones((len(turn), len(turn)))) @ turn) @ lengths
    q = start + np.linspace(0, 1, 1 + max(1, math.ceil(arcs / most)))[:, None] * turn
    return (q + np.pi) % (2 * np.pi) - np.pi


# --- 7 pays_from ------------------------------------------------------------------------------------------------------
@right("pays_from")
def pays_by_statistics(map_seconds, with_map, without):
    saved = [b - a for a, b in zip(with_map, without, strict=True)]
    mean, error = statistics.fmean(saved), math.sqrt(statistics.variance(saved) / len(saved))
    return tuple(None if rate <= 0 else math.floor(map_seconds / rate) + 1 for rate in (mean, mean - 2 * error))


@right("pays_from")
def pays_by_counting(map_seconds, with_map, without):
    saved = without - with_map
    k, found = len(saved), []
    error = np.sqrt(((saved**2).sum() - k * saved.mean() ** 2) / (k - 1) / k) if np.ptp(saved) else 0.0
    for rate in (saved.mean(), saved.mean() - 2 * error):
        q = 1
        while rate > 0 and q * rate <= map_seconds:
            q += 1
        found.append(np.int64(q) if rate > 0 else None)
    return found


@right("pays_from")
def pays_by_a_covariance(map_seconds, with_map, without):
    (a, c), (_, b) = np.cov(with_map, without)
    rate = without.mean() - with_map.mean()
    sure = rate - 2 * math.sqrt(max(a + b - 2 * c, 0.0) / len(without))
    return [1.0 + map_seconds // r if r > 0 else None for r in (rate, sure)]


# --- 8 downhill_values ------------------------------------------------------------------------------------------------
def _step(blocked, a, b):
    """Where a step by (a, b) may begin."""
    beside = [np.roll(blocked, shift, axis=(0, 1)) for shift in ((0, 0), (-a, -b), (-a, 0), (0, -b))]
    return ~np.any(beside, axis=0)


AROUND = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]


@right("downhill_values")
def values_by_scipy(blocked, price, goal):
    n = len(blocked)
    cell, rows, columns, costs = np.arange(n * n).reshape(n, n), [], [], []
    for a, b in AROUND:
        fine = _step(blocked, a, b)
        rows.append(cell[fine])
        columns.append(np.roll(cell, (-a, -b), axis=(0, 1))[fine])
        costs.append((np.hypot(a, b) * (price + np.roll(price, (-a, -b), axis=(0, 1))) / 2)[fine])
    graph = csr_array((np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), shape=(n * n, n * n))
    values = dijkstra(graph, indices=goal[0] * n + goal[1]).reshape(n, n)
    return np.where(blocked, np.inf, values)


@right("downhill_values")
def values_by_sweeps_of_whole_maps(blocked, price, goal):
    steps = [(a, b, _step(blocked, a, b)) for a, b in AROUND]
    values = np.full(blocked.shape, np.inf)
    values[goal] = np.inf if blocked[goal] else 5.0  # only differences count
    while True:
        before = values.copy()
        for a, b, fine in steps:
            there, dear = np.roll(values, (-a, -b), axis=(0, 1)), np.roll(price, (-a, -b), axis=(0, 1))
            offer = there + np.hypot(a, b) * (price + dear) / 2
            values = np.where(fine & (offer < values), offer, values)
        if np.array_equal(values, before):
            return values


@right("downhill_values")
def values_of_four_neighbours(blocked, price, goal):
    """Straight steps alone: somewhat dearer, and without a hollow all the same."""
    n = len(blocked)
    values, heap = {}, [] if blocked[goal] else [(0.0, *goal)]
    while heap:
        value, i, j = heapq.heappop(heap)
        if (i, j) not in values:
            values[i, j] = value
            for k, m in (((i + 1) % n, j), ((i - 1) % n, j), (i, (j + 1) % n), (i, (j - 1) % n)):
                if not blocked[k, m] and (k, m) not in values:
                    heapq.heappush(heap, (value + (price[i, j] + price[k, m]) / 2, k, m))
    found = np.full(blocked.shape, np.inf)
    for place, value in values.items():
        found[place] = value
    return found.tolist()


@right("downhill_values")
def values_by_a_queue_that_corrects_itself(blocked, price, goal):
    n = len(blocked)
    values, queue = np.full((n, n), np.inf), deque() if blocked[goal] else deque([goal])
    waiting = set(queue)
    if queue:
        values[goal] = 0
    while queue:
        i, j = queue.popleft()
        waiting.discard((i, j))
        for a, b in AROUND:
            k, m = (i + a) % n, (j + b) % n
            offer = values[i, j] + math.hypot(a, b) * (price[i, j] + price[k, m]) / 2
            if not (blocked[k, m] or blocked[i, m] or blocked[k, j]) and offer < values[k, m]:
                values[k, m] = offer
                if (k, m) not in waiting:
                    waiting.add((k, m))
                    queue.append((k, m))
    return values
