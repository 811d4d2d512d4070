"""One right answer for each exercise of notebook 2, as a student would write it."""

import numpy as np
from scipy.spatial.transform import Rotation

from tutorialbot.ik.arm7 import LIMITS


def expected_children(n, crossing, mutating, variation):
    if variation == "or":
        return n * crossing, n * mutating, 0, n * (1 - crossing - mutating)
    both = crossing * mutating
    return n * (crossing - both), n * (mutating - both), n * both, n * (1 - crossing) * (1 - mutating)


def turn_all(quaternions, vectors):
    def times(a, b):
        aw, ax, ay, az = np.moveaxis(a, -1, 0)
        bw, bx, by, bz = np.moveaxis(b, -1, 0)
        return np.stack([
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ], axis=-1)  # fmt: skip

    turned = quaternions[:, 0]
    for i in range(1, quaternions.shape[1]):
        turned = times(turned, quaternions[:, i])
    pure = np.hstack([np.zeros((len(vectors), 1)), vectors])
    return times(times(turned, pure), turned * [1, -1, -1, -1])[:, 1:]


def tip_jacobian(q, axes, offsets):
    turned, tip, points, lines = Rotation.identity(), offsets[0], [], []
    for angle, axis, offset in zip(q, axes, offsets[1:], strict=True):
        points.append(tip)
        lines.append(turned.apply(axis))
        turned = turned * Rotation.from_rotvec(angle * axis)
        tip = tip + turned.apply(offset)
    return np.vstack([np.cross(lines, tip - np.array(points)).T, np.transpose(lines)])


def both_tilts(rotation):
    roll = -np.arcsin(np.clip(rotation[1, 2], -1, 1))
    if np.hypot(rotation[1, 0], rotation[1, 1]) > 1e-9:
        pitch, yaw = np.arctan2(rotation[0, 2], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[1, 1])
    else:
        pitch, yaw = np.arctan2(-rotation[2, 0], rotation[0, 0]), 0.0
    return (roll, pitch, yaw), (np.pi - roll, pitch + np.pi, yaw + np.pi)


def step_by_difference(population, factor, rng):
    n = len(population)
    i, first, second = np.arange(n), rng.integers(1, n, n), rng.integers(1, n - 1, n)
    second += second >= first
    return population + factor * (population[(i + first) % n] - population[(i + second) % n])


def costliest_limit(z_error, lower, upper, step):
    now, best = z_error(lower, upper), (None, 0.0)
    for i in range(7):
        for side, name in enumerate(LIMITS[i]):
            moved = [lower.copy(), upper.copy()]
            moved[side][i] += (-step, step)[side]
            price = (now - z_error(*moved)) / step
            if price > best[1] + 1e-9:
                best = name, price
    return best


def best_posture(fitness, lower, upper, budget, rng):
    n = 300
    population = rng.uniform(lower, upper, (n, 7))
    values = fitness(population)
    for _ in range(budget // n - 1):
        x, y, b, c = population[rng.integers(0, n, (4, n))]
        blended = x + (2 * rng.random((n, 7)) - 0.5) * (y - x)
        children = np.where(rng.random((n, 1)) < 0.6, blended, x + 0.5 * (b - c))
        population, values = np.vstack([population, children]), np.concatenate([values, fitness(children)])
        best = np.argsort(values)[:n]
        population, values = population[best], values[best]
    return population[0]
