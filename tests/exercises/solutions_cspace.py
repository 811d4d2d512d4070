"""One right answer for each exercise of notebook 3, as a student would write it."""

import heapq

import numpy as np


def affordable_joints(resolution_deg, memory, check_us, patience):
    cells, found = round(360 / resolution_deg), []
    for most in (8 * memory, patience * 1_000_000 // check_us):
        joints = 0
        while cells ** (joints + 1) <= most:
            joints += 1
        found.append(joints)
    return found


def turned_rectangles_meet(a, b):
    x, z, long_a, wide_a, angle_a = a.T
    x2, z2, long_b, wide_b, angle_b = b.T
    apart = np.zeros(np.broadcast(x, x2).shape, dtype=bool)
    c, s = np.abs(np.cos(angle_a - angle_b)), np.abs(np.sin(angle_a - angle_b))
    for angle, own, other in (
        (angle_a, (long_a, wide_a), (long_b * c + wide_b * s, long_b * s + wide_b * c)),
        (angle_b, (long_b, wide_b), (long_a * c + wide_a * s, long_a * s + wide_a * c)),
    ):
        along = np.abs((x - x2) * np.sin(angle) + (z - z2) * np.cos(angle))
        across = np.abs((x - x2) * np.cos(angle) - (z - z2) * np.sin(angle))
        apart |= (along > own[0] + other[0] - 1e-9) | (across > own[1] + other[1] - 1e-9)
    return ~apart


def from_own_angles(second, third):
    n, m = third.shape
    i, k = np.indices((n, n))
    return second[:, None] | third[i, ((i + k) * (m // n) - m // 2) % m]


def points_to_voxels(points, low, side, shape, least):
    points = points[np.isfinite(points).all(axis=1)]
    cells = np.floor((points - low) / side)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)].astype(int)
    counts = np.zeros(shape, dtype=int)
    np.add.at(counts, tuple(cells.T), 1)
    return counts >= least


def loss_from_logits(logits, gt, weight):
    tail = np.log1p(np.exp(-np.abs(logits)))
    blocked, free = np.maximum(-logits, 0) + tail, np.maximum(logits, 0) + tail  # -log p, -log (1 - p)
    loss = np.mean(weight * gt * blocked + (1 - gt) * free)
    return loss, ((1 - gt) * np.exp(-blocked) - weight * gt * np.exp(-free)) / np.size(logits)


def steps_so_fine(start, goal, lengths, most):
    turn = (goal - start + np.pi) % (2 * np.pi) - np.pi
    n = max(1, int(np.ceil(np.sum(lengths * np.abs(np.cumsum(turn))) / most)))
    return start + np.arange(n + 1)[:, None] / n * turn


def pays_from(map_seconds, with_map, without):
    saving = without - with_map
    mean, error = saving.mean(), saving.std(ddof=1) / np.sqrt(len(saving))
    return [int(map_seconds / rate) + 1 if rate > 0 else None for rate in (mean, mean - 2 * error)]


def downhill_values(blocked, price, goal):
    n = len(blocked)
    values = np.full((n, n), np.inf)
    if blocked[goal]:
        return values
    values[goal] = 0.0
    heap = [(0.0, goal)]
    while heap:
        value, (i, j) = heapq.heappop(heap)
        if value > values[i, j]:
            continue
        for a in (-1, 0, 1):
            for b in (-1, 0, 1):
                k, m = (i + a) % n, (j + b) % n
                if blocked[k, m] or blocked[i, m] or blocked[k, j]:
                    continue
                cost = value + np.hypot(a, b) * (price[i, j] + price[k, m]) / 2
                if cost < values[k, m]:
                    values[k, m] = cost
                    heapq.heappush(heap, (cost, (k, m)))
    return values
