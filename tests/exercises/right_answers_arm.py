"""Answers to notebook 2's exercises that differ from ours and are as right."""

import random

import numpy as np
import pinocchio as pin
from deap import base, cma
from scipy.optimize import differential_evolution
from scipy.spatial.transform import Rotation

from tests.exercises.planting import right_into
from tutorialbot.ik.arm7 import LIMITS
from tutorialbot.seeding import numpy_global

RIGHT = []  # (function, exercise)
right = right_into(RIGHT)


# --- 1 expected_children ----------------------------------------------------------------------------------------------
@right("expected_children")
def children_by_a_table(n, crossing, mutating, variation):
    both = crossing * mutating if variation == "and" else 0.0
    return n * np.array([crossing - both, mutating - both, both, 1 - crossing - mutating + both])


# --- 2 turn_all -------------------------------------------------------------------------------------------------------
@right("turn_all")
def turns_by_scipy(quaternions, vectors):
    n = len(vectors) if len(quaternions) == 1 else len(quaternions)
    turned = np.broadcast_to(vectors, (n, 3)).copy()
    for i in reversed(range(quaternions.shape[1])):
        q = np.broadcast_to(quaternions[:, i], (n, 4)).copy()
        turned = Rotation.from_quat(q, scalar_first=True).apply(turned) if n else turned
    return turned


@right("turn_all")
def turns_of_the_vector_from_the_last_to_the_first(quaternions, vectors):
    """v + 2 w (u x v) + 2 u x (u x v), one turn after the other, without any product of quaternions."""
    for i in range(quaternions.shape[1] - 1, -1, -1):
        w, u = quaternions[:, i, :1], quaternions[:, i, 1:]
        across = 2 * np.cross(u, vectors)
        vectors = vectors + w * across + np.cross(u, across)
    return vectors


@right("turn_all")
def turns_by_a_table_of_products(quaternions, vectors):
    table = np.zeros((4, 4, 4))  # e_a e_b = table[a, b] e_c
    table[0, :, :] = np.eye(4)
    table[:, 0, :] = np.eye(4)
    for a, b, c in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        table[a, b, c], table[b, a, c], table[a, a] = 1, -1, [-1, 0, 0, 0]
    turned = quaternions[:, 0]
    for q in np.moveaxis(quaternions, 1, 0)[1:]:
        turned = np.einsum("na,nb,abc->nc", turned, q, table)
    pure = np.pad(vectors, ((0, 0), (1, 0)))
    there = np.einsum("na,nb,abc->nc", *np.broadcast_arrays(turned, pure), table)
    return np.einsum("na,nb,abc->nc", *np.broadcast_arrays(there, turned * [1, -1, -1, -1]), table)[:, 1:]


# --- 3 tip_jacobian ---------------------------------------------------------------------------------------------------
@right("tip_jacobian")
def jacobian_of_pinocchio(q, axes, offsets):
    model, joint = pin.Model(), 0
    for i, (axis, offset) in enumerate(zip(axes, offsets[:-1], strict=True)):
        place = pin.SE3(np.eye(3), offset)
        joint = model.addJoint(joint, pin.JointModelRevoluteUnaligned(axis), place, f"joint {i}")
    tip = model.addFrame(pin.Frame("tip", joint, pin.SE3(np.eye(3), offsets[-1]), pin.FrameType.OP_FRAME))
    found = pin.computeFrameJacobian(model, model.createData(), q, tip, pin.LOCAL_WORLD_ALIGNED)
    return found.reshape(6, len(q))  # pinocchio drops an axis of length 1


@right("tip_jacobian")
def jacobian_from_the_hand_back_to_the_shoulder(q, axes, offsets):
    """Each joint turns all columns after it, and the tip, as seen from the link before."""
    tip, columns = offsets[-1], []
    for angle, axis, offset in reversed(list(zip(q, axes, offsets[:-1], strict=True))):
        turn = pin.exp3(angle * axis)
        tip = turn @ tip
        columns = [(turn @ v, turn @ w) for v, w in columns]
        columns.insert(0, (np.cross(axis, tip), axis))
        tip = tip + offset
    return np.array(columns).reshape(-1, 6).T


# --- 4 both_tilts -----------------------------------------------------------------------------------------------------
@right("both_tilts")
def tilts_by_scipy(rotation):
    pitch, roll, yaw = Rotation.from_matrix(rotation).as_euler("YXZ", suppress_warnings=True)
    return np.array([[roll, pitch, yaw], [np.pi - roll, pitch - np.pi, yaw - np.pi]])


@right("both_tilts")
def tilts_by_turning_back(rotation):
    """First the pitch that brings the third column into the plane of y and z, then the roll, then what is left."""
    pitch = np.arctan2(rotation[0, 2], rotation[2, 2])
    rest = pin.rpy.rpyToMatrix(0.0, -pitch, 0.0) @ rotation
    roll = np.arctan2(-rest[1, 2], rest[2, 2])
    rest = pin.rpy.rpyToMatrix(-roll, 0.0, 0.0) @ rest
    yaw = np.arctan2(rest[1, 0], rest[0, 0])
    return [[roll, pitch, yaw], [np.pi - roll, pitch + np.pi, yaw + np.pi]]


# --- 5 step_by_difference ---------------------------------------------------------------------------------------------
@right("step_by_difference")
def step_in_a_loop(population, factor, rng):
    children = []
    for i in range(len(population)):
        b, c = rng.choice([j for j in range(len(population)) if j != i], 2, replace=False)
        children.append(population[i] + factor * (population[b] - population[c]))
    return np.array(children)


@right("step_by_difference")
def step_by_sorting_random_numbers(population, factor, rng):
    chance = rng.random((len(population), len(population)))
    np.fill_diagonal(chance, 2.0)
    b, c = np.argsort(chance, axis=1)[:, :2].T
    return population + factor * (population[b] - population[c])


@right("step_by_difference")
def step_with_drawing_again(population, factor, rng):
    stream = random.Random(int(rng.integers(2**60)))
    child = population.copy()
    for i in range(len(population)):
        b = c = i
        while len({i, b, c}) < 3:
            b, c = stream.randrange(len(population)), stream.randrange(len(population))
        child[i] += factor * (population[b] - population[c])
    return child


# --- 6 costliest_limit ------------------------------------------------------------------------------------------------
@right("costliest_limit")
def limit_by_a_dictionary(z_error, lower, upper, step):
    low = {LIMITS[i][0]: z_error(lower - step * np.eye(7)[i], upper) for i in range(7)}
    high = {LIMITS[i][1]: z_error(lower, upper + step * np.eye(7)[i]) for i in range(7)}
    after, now = low | high, z_error(lower, upper)
    name = min(after, key=after.get)
    return [name, (now - after[name]) / step] if after[name] < now else [None, 0]


# --- 7 best_posture ---------------------------------------------------------------------------------------------------
@right("best_posture")
def posture_by_differential_evolution_of_scipy(fitness, lower, upper, budget, rng):
    n = 70
    found = differential_evolution(
        lambda q: fitness(q.T), list(zip(lower, upper, strict=True)), popsize=n // 7, maxiter=budget // n - 1, tol=0,
        init="random", polish=False, vectorized=True, updating="deferred", rng=rng,
    )  # fmt: skip
    return found.x


class _Smallest(base.Fitness):
    weights = (-1.0,)


class _Individual(list):
    def __init__(self, genes):
        super().__init__(genes)
        self.fitness = _Smallest()


@right("best_posture")
def posture_by_cma_es_of_deap(fitness, lower, upper, budget, rng):
    best, left = (np.inf, None), budget
    with numpy_global(rng):
        while left >= 20:  # a new start, whenever the last one has come to its end
            strategy = cma.Strategy(((lower + upper) / 2).tolist(), 0.5, lambda_=20)
            spread = np.inf
            while left >= 20 and spread > 1e-9:
                population = strategy.generate(_Individual)
                values = fitness(np.array(population))
                left, spread = left - 20, np.ptp(values)
                for individual, value in zip(population, values.tolist(), strict=True):
                    individual.fitness.values = (value,)
                best = min(best, (values.min(), tuple(population[values.argmin()])))
                strategy.update(population)
    return best[1]


@right("best_posture")
def posture_by_one_to_one_differential_evolution(fitness, lower, upper, budget, rng):
    n = 60
    population = rng.uniform(lower, upper, (n, 7))
    values = np.array([fitness(q) for q in population])
    for _ in range(budget // n - 1):
        order = np.argsort(rng.random((n, n)), axis=1)[:, :3].T
        a, b, c = population[order]
        child = np.where(rng.random((n, 7)) < 0.9, a + 0.5 * (b - c), population)
        its = fitness(child)
        population, values = np.where((its < values)[:, None], child, population), np.minimum(its, values)
    return population[values.argmin()].tolist()
