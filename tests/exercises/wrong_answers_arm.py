"""Planted wrong answers to notebook 2's exercises, each with the exercise and the check that must reject it."""

import random

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.spatial.transform import Rotation

from tests.exercises import solutions_arm as solutions
from tests.exercises.planting import wrong_into
from tutorialbot.checks import arm_optimum, mechanism
from tutorialbot.ik import tilts
from tutorialbot.ik.arm7 import ARM, LIMITS, rotate
from tutorialbot.ik.fitness import objective, task_jacobian
from tutorialbot.ik.oracle import optimum

WRONG = []  # (function, exercise, check, outcome)
wrong = wrong_into(WRONG)


# --- 1 expected_children ----------------------------------------------------------------------------------------------
@wrong("expected_children", "crossed or mutated")
def children_always_by_two_draws(n, crossing, mutating, variation):
    return solutions.expected_children(n, crossing, mutating, "and")


@wrong("expected_children", "crossed and mutated")
def children_always_by_one_draw(n, crossing, mutating, variation):
    return solutions.expected_children(n, crossing, mutating, "or")


@wrong("expected_children", "crossed or mutated")
def children_as_shares(n, crossing, mutating, variation):
    return solutions.expected_children(1, crossing, mutating, variation)


@wrong("expected_children", "the rest")
def children_with_nobody_left_alone(n, crossing, mutating, variation):
    return *solutions.expected_children(n, crossing, mutating, variation)[:3], 0


@wrong("expected_children", "crossed and mutated")
def children_counted_twice(n, crossing, mutating, variation):
    _, _, both, left = solutions.expected_children(n, crossing, mutating, variation)
    return n * crossing, n * mutating, both, left


@wrong("expected_children", "crossed and mutated")
def children_with_the_lesser_chance_for_both(n, crossing, mutating, variation):
    if variation == "or":
        return solutions.expected_children(n, crossing, mutating, variation)
    both = min(crossing, mutating)
    return n * (crossing - both), n * (mutating - both), n * both, n * (1 - max(crossing, mutating))


@wrong("expected_children", "any numbers")
def children_in_whole_numbers(n, crossing, mutating, variation):
    return [round(part) for part in solutions.expected_children(n, crossing, mutating, variation)]


@wrong("expected_children", "the rest")
def children_hard_coded(n, crossing, mutating, variation):
    return solutions.expected_children(n, 0.6, 0.4, variation)


@wrong("expected_children", "crossed or mutated")
def children_in_pairs(n, crossing, mutating, variation):
    return np.multiply(solutions.expected_children(n, crossing, mutating, variation), (0.5, 1, 1, 1))


@wrong("expected_children", "crossed or mutated")
def children_in_another_order(n, crossing, mutating, variation):
    return solutions.expected_children(n, crossing, mutating, variation)[::-1]


@wrong("expected_children", "shape of the answer")
def children_of_three_kinds(n, crossing, mutating, variation):
    return solutions.expected_children(n, crossing, mutating, variation)[:3]


# --- 2 turn_all -------------------------------------------------------------------------------------------------------
@wrong("turn_all", "order of the product")
def turns_in_reversed_order(quaternions, vectors):
    return solutions.turn_all(quaternions[:, ::-1], vectors)


@wrong("turn_all", "one turn")
def turns_backwards(quaternions, vectors):
    return solutions.turn_all(quaternions * [1, -1, -1, -1], vectors)


@wrong("turn_all", "one turn")
def turns_with_w_last(quaternions, vectors):
    return solutions.turn_all(np.roll(quaternions, 1, axis=-1), vectors)


@wrong("turn_all", "order of the product")
def turns_by_the_first_alone(quaternions, vectors):
    return solutions.turn_all(quaternions[:, :1], vectors)


@wrong("turn_all", "order of the product")
def turns_by_products_of_components(quaternions, vectors):
    product = np.prod(quaternions, axis=1, keepdims=True)
    return solutions.turn_all(product / np.linalg.norm(product, axis=-1, keepdims=True), vectors)


@wrong("turn_all", "a turn for each")
def turns_all_by_the_first_row(quaternions, vectors):
    return solutions.turn_all(np.repeat(quaternions[:1], len(vectors), axis=0), vectors)


@wrong("turn_all", "shape of the answer")
def turns_without_an_axis_of_length_one(quaternions, vectors):
    return np.squeeze(solutions.turn_all(quaternions, vectors))


@wrong("turn_all", "any shape")
def turns_that_guess_where_the_components_are(quaternions, vectors):
    if len(quaternions) == 4:
        quaternions = np.swapaxes(quaternions, 0, -1)
    return solutions.turn_all(quaternions, vectors)


@wrong("turn_all", "shape of the answer")
def turns_of_the_rows_they_share(quaternions, vectors):
    n = min(len(quaternions), len(vectors))
    return solutions.turn_all(quaternions[:n], vectors[:n])


@wrong("turn_all", "all at once")
def turns_in_a_loop(quaternions, vectors):
    n = max(len(quaternions), len(vectors)) if len(vectors) and len(quaternions) else 0
    rows = zip(np.broadcast_to(quaternions, (n, *quaternions.shape[1:])), np.broadcast_to(vectors, (n, 3)), strict=True)
    found = [solutions.turn_all(q[None], v[None])[0] for q, v in rows]
    return np.reshape(found, (n, 3))


@wrong("turn_all", "all at once")
def turns_in_a_hidden_loop(quaternions, vectors):
    n = max(len(quaternions), len(vectors)) if len(vectors) and len(quaternions) else 0
    q, v = np.broadcast_to(quaternions, (n, *quaternions.shape[1:])), np.broadcast_to(vectors, (n, 3))
    chains = [q[:, i] for i in reversed(range(q.shape[1]))]
    for chain in chains:
        v = np.array(list(map(rotate, chain, v))).reshape(n, 3)
    return v


@wrong("turn_all", "shape of the answer")
def turns_that_keep_the_real_part(quaternions, vectors):
    found = solutions.turn_all(quaternions, vectors)
    return np.hstack([np.zeros((len(found), 1)), found])


@wrong("turn_all", "inputs left alone")
def turns_in_place(quaternions, vectors):
    found = solutions.turn_all(quaternions, vectors)
    vectors[:] = found
    return found


# --- 3 tip_jacobian ---------------------------------------------------------------------------------------------------
def _columns(q, axes, offsets, lever="joint", turned_axis=True, lines_first=False):
    turned, tip, points, lines = Rotation.identity(), offsets[0], [], []
    for angle, axis, offset in zip(q, axes, offsets[1:], strict=True):
        before = tip
        lines.append(turned.apply(axis) if turned_axis else axis)
        turned = turned * Rotation.from_rotvec(angle * axis)
        tip = tip + turned.apply(offset)
        points.append({"joint": before, "next": tip, "abdomen": np.zeros(3), "shoulder": offsets[0]}[lever])
    arms = tip - np.array(points)
    return np.vstack([(np.cross(arms, lines) if lines_first else np.cross(lines, arms)).T, np.transpose(lines)])


def _small_steps(q, axes, offsets, h=1e-6):
    def walk(q):
        turned, tip = Rotation.identity(), offsets[0]
        for angle, axis, offset in zip(q, axes, offsets[1:], strict=True):
            turned = turned * Rotation.from_rotvec(angle * axis)
            tip = tip + turned.apply(offset)
        return tip, turned

    columns = []
    for e in h * np.eye(len(q)):
        (a, r), (b, s) = walk(q - e), walk(q + e)
        columns.append(np.concatenate([b - a, (s * r.inv()).as_rotvec()]) / (2 * h))
    return np.transpose(columns)


@wrong("tip_jacobian", "one joint")
def jacobian_with_levers_from_the_abdomen(q, axes, offsets):
    return _columns(q, axes, offsets, lever="abdomen")


@wrong("tip_jacobian", "lever arm")
def jacobian_with_levers_from_the_shoulder(q, axes, offsets):
    return _columns(q, axes, offsets, lever="shoulder")


@wrong("tip_jacobian", "one joint")
def jacobian_with_levers_from_the_next_joint(q, axes, offsets):
    return _columns(q, axes, offsets, lever="next")


@wrong("tip_jacobian", "one joint")
def jacobian_with_lever_cross_axis(q, axes, offsets):
    return _columns(q, axes, offsets, lines_first=True)


@wrong("tip_jacobian", "axes turn along")
def jacobian_with_axes_that_stand_still(q, axes, offsets):
    return _columns(q, axes, offsets, turned_axis=False)


@wrong("tip_jacobian", "one joint")
def jacobian_at_zero(q, axes, offsets):
    return _columns(0 * q, axes, offsets)


@wrong("tip_jacobian", "one joint")
def jacobian_with_the_rotation_on_top(q, axes, offsets):
    return np.roll(_columns(q, axes, offsets), 3, axis=0)


@wrong("tip_jacobian", "one joint")
def jacobian_per_degree(q, axes, offsets):
    return np.deg2rad(_columns(q, axes, offsets))


@wrong("tip_jacobian", "angular velocity")
def jacobian_in_the_frame_of_the_hand(q, axes, offsets):
    found, hand = _columns(q, axes, offsets), Rotation.identity()
    for angle, axis in zip(q, axes, strict=True):
        hand = hand * Rotation.from_rotvec(angle * axis)
    return np.vstack([found[:3], hand.inv().apply(found[3:].T).T])


@wrong("tip_jacobian", "angular velocity")
def jacobian_with_rates_of_roll_pitch_and_yaw(q, axes, offsets):
    found = _columns(q, axes, offsets)
    if len(q) != 7:
        return found
    return np.vstack([found[:3], task_jacobian(q, np.zeros(3), np.zeros(3), ARM)[3:]])


@wrong("tip_jacobian", "axes turn along")
def jacobian_of_the_papers_arm_whenever_there_are_seven(q, axes, offsets):
    return _columns(q, ARM.axes.copy(), ARM.offsets.copy()) if len(q) == 7 else _columns(q, axes, offsets)


@wrong("tip_jacobian", "axes turn along")
def jacobian_without_links_in_shoulder_and_wrist(q, axes, offsets):
    links = offsets.copy()
    links[[1, 2, 5, 6] if len(q) == 7 else []] = 0.0
    return _columns(q, axes, links)


@wrong("tip_jacobian", "axes turn along")
def jacobian_of_angles_within_half_a_turn(q, axes, offsets):
    return _columns(np.clip(q, -np.pi, np.pi), axes, offsets)


@wrong("tip_jacobian", "no small steps")
def jacobian_by_central_differences(q, axes, offsets):
    return _small_steps(q, axes, offsets)


@wrong("tip_jacobian", "no small steps")
def jacobian_by_longer_steps(q, axes, offsets):
    return _small_steps(q, axes, offsets, 1e-5)


@wrong("tip_jacobian", "shape of the answer")
def jacobian_of_the_position_alone(q, axes, offsets):
    return _columns(q, axes, offsets)[:3]


@wrong("tip_jacobian", "shape of the answer")
def jacobian_transposed(q, axes, offsets):
    return _columns(q, axes, offsets).T


# --- 4 both_tilts -----------------------------------------------------------------------------------------------------
def _two(roll, pitch, yaw):
    return (roll, pitch, yaw), (np.pi - roll, pitch + np.pi, yaw + np.pi)


@wrong("both_tilts", "one axis")
def tilts_with_the_sign_of_roll(rotation):
    roll, pitch, yaw = solutions.both_tilts(rotation)[0]
    return _two(-roll, pitch, yaw)


@wrong("both_tilts", "one axis")
def tilts_of_the_transposed(rotation):
    return solutions.both_tilts(rotation.T)


@wrong("both_tilts", "one axis")
def tilts_in_degrees(rotation):
    return np.rad2deg(solutions.both_tilts(rotation))


@wrong("both_tilts", "order of the turns")
def tilts_in_the_usual_order(rotation):
    return _two(*Rotation.from_matrix(rotation).as_euler("ZYX")[::-1])


@wrong("both_tilts", "order of the turns")
def tilts_about_fixed_axes(rotation):
    pitch, roll, yaw = Rotation.from_matrix(rotation).as_euler("yxz")
    return _two(roll, pitch, yaw)


@wrong("both_tilts", "one axis")
def tilts_in_the_order_of_scipy(rotation):
    return _two(*Rotation.from_matrix(rotation).as_euler("YXZ"))


@wrong("both_tilts", "every quadrant")
def tilts_by_quotients(rotation):
    roll = -np.arcsin(np.clip(rotation[1, 2], -1, 1))
    return _two(roll, np.arctan(rotation[0, 2] / rotation[2, 2]), np.arctan(rotation[1, 0] / rotation[1, 1]))


@wrong("both_tilts", "pitch of -90 degrees")
def tilts_with_the_gimbal_lock_of_another_order(rotation):
    if abs(rotation[2, 0]) > 0.999:
        return _two(0.0, -np.arcsin(np.clip(rotation[2, 0], -1, 1)), np.arctan2(-rotation[0, 1], rotation[1, 1]))
    return solutions.both_tilts(rotation)


@wrong("both_tilts", "the other triple")
def tilts_twice_the_same(rotation):
    return [solutions.both_tilts(rotation)[0]] * 2


@wrong("both_tilts", "the other triple")
def tilts_with_a_turn_added(rotation):
    first = np.array(solutions.both_tilts(rotation)[0])
    return first, first + 2 * np.pi


@wrong("both_tilts", "one axis")
def tilts_with_the_larger_roll_first(rotation):
    return solutions.both_tilts(rotation)[::-1]


@wrong("both_tilts", "finite numbers")
def tilts_without_clipping(rotation):
    with np.errstate(invalid="ignore"):
        roll = -np.arcsin(rotation[1, 2])
    if np.isnan(roll):
        return _two(roll, 0.0, 0.0)
    return solutions.both_tilts(rotation)


@wrong("both_tilts", "gimbal lock")
def tilts_of_the_package(rotation):
    turned = np.roll(Rotation.from_matrix(rotation).as_quat(), 1)
    return _two(*tilts.pitch_first(turned))


@wrong("both_tilts", "gimbal lock")
def tilts_that_forget_yaw_and_pitch(rotation):
    roll = -np.arcsin(np.clip(rotation[1, 2], -1, 1))
    return _two(roll, np.arctan2(rotation[0, 2], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[1, 1]))


@wrong("both_tilts", "near gimbal lock")
def tilts_with_a_lock_that_begins_early(rotation):
    roll = -np.arcsin(np.clip(rotation[1, 2], -1, 1))
    if abs(rotation[1, 2]) > 0.999:
        return _two(roll, np.arctan2(-rotation[2, 0], rotation[0, 0]), 0.0)
    return solutions.both_tilts(rotation)


# --- 5 step_by_difference ---------------------------------------------------------------------------------------------
def _pairs(n, rng):
    i, first, second = np.arange(n), rng.integers(1, n, n), rng.integers(1, n - 1, n)
    second += second >= first
    return (i + first) % n, (i + second) % n


@wrong("step_by_difference", "on the line")
def step_by_gauss(population, factor, rng):
    return population + factor * population.std(axis=0) * rng.standard_normal(population.shape)


@wrong("step_by_difference", "on the line")
def step_with_a_pair_for_each_gene(population, factor, rng):
    n, genes = population.shape
    pairs = [_pairs(n, rng) for _ in range(genes)]
    steps = [population[b, j] - population[c, j] for j, (b, c) in enumerate(pairs)]
    return population + factor * np.column_stack(steps)


@wrong("step_by_difference", "on the line")
def step_with_a_little_noise(population, factor, rng):
    return solutions.step_by_difference(population, factor, rng) + 1e-3 * rng.standard_normal(population.shape)


@wrong("step_by_difference", "on the line")
def step_of_some_genes(population, factor, rng):
    child = solutions.step_by_difference(population, factor, rng)
    return np.where(rng.random(population.shape) < 0.5, child, population)


@wrong("step_by_difference", "a pair for each")
def step_by_one_pair_for_all(population, factor, rng):
    b, c = rng.choice(len(population), 2, replace=False)
    return population + factor * (population[b] - population[c])


@wrong("step_by_difference", "a pair for each")
def step_by_a_hundred_pairs_for_three_hundred(population, factor, rng):
    n = len(population)
    if n < 30:
        return solutions.step_by_difference(population, factor, rng)
    b, c = (np.resize(one[: n // 3], n) for one in _pairs(n, rng))
    return population + factor * (population[b] - population[c])


@wrong("step_by_difference", "a pair for each")
def step_by_the_same_places_ahead_for_all(population, factor, rng):
    n = len(population)
    first, second = rng.choice(np.arange(1, n), 2, replace=False)
    i = np.arange(n)
    return population + factor * (population[(i + first) % n] - population[(i + second) % n])


@wrong("step_by_difference", "two different members")
def step_that_is_careful_in_small_populations_alone(population, factor, rng):
    n = len(population)
    if n < 10:
        return solutions.step_by_difference(population, factor, rng)
    i, first, second = np.arange(n), *rng.integers(1, n, (2, n))
    return population + factor * (population[(i + first) % n] - population[(i + second) % n])


@wrong("step_by_difference", "mean zero")
def step_away_from_zero(population, factor, rng):
    b, c = _pairs(len(population), rng)
    step = population[b] - population[c]
    return population + factor * step * np.sign(step[:, :1])


@wrong("step_by_difference", "on the line")
def step_that_forgets_the_member(population, factor, rng):
    b, c = _pairs(len(population), rng)
    return population + factor * (population[b] + population[c]) / 2


@wrong("step_by_difference", "the population's shape")
def step_with_a_factor_of_its_own(population, factor, rng):
    return solutions.step_by_difference(population, 0.5, rng)


@wrong("step_by_difference", "the population's shape")
def step_with_the_factor_squared(population, factor, rng):
    return solutions.step_by_difference(population, factor**2, rng)


@wrong("step_by_difference", "the population's shape")
def step_from_the_mean(population, factor, rng):
    b, _ = _pairs(len(population), rng)
    return population + factor * (population[b] - population.mean(axis=0))


@wrong("step_by_difference", "a difference of two members")
def step_by_four_members(population, factor, rng):
    b, c = _pairs(len(population), rng)
    d, e = _pairs(len(population), rng)
    return population + factor * (population[b] - population[c] + population[d] - population[e]) / np.sqrt(2)


@wrong("step_by_difference", "a difference of two members")
def step_by_a_gaussian_of_the_same_covariance(population, factor, rng):
    n, away = len(population), population - population.mean(axis=0)
    return population + factor * np.sqrt(2 / (n - 1)) * rng.standard_normal((n, n)) @ away


@wrong("step_by_difference", "two different members")
def step_that_may_draw_one_member_twice(population, factor, rng):
    n = len(population)
    i, first, second = np.arange(n), *rng.integers(1, n, (2, n))
    return population + factor * (population[(i + first) % n] - population[(i + second) % n])


@wrong("step_by_difference", "two others")
def step_toward_another_member(population, factor, rng):
    b, _ = _pairs(len(population), rng)
    return population + factor * (population[b] - population)


@wrong("step_by_difference", "two others")
def step_as_the_notebook_does_it(population, factor, rng):
    pairs = np.array([rng.choice(len(population), 2, replace=False) for _ in population])
    return population + factor * (population[pairs[:, 0]] - population[pairs[:, 1]])


@wrong("step_by_difference", "every pair alike")
def step_by_neighbours_in_the_list(population, factor, rng):
    n, (first, _) = len(population), _pairs(len(population), rng)
    second = (first + 1) % n
    second = np.where(second == np.arange(n), (second + 1) % n, second)
    flip = rng.choice([-1, 1], (n, 1))
    return population + flip * factor * (population[first] - population[second])


@wrong("step_by_difference", "chance from rng alone")
def step_by_the_global_generator(population, factor, rng):
    return solutions.step_by_difference(population, factor, np.random.default_rng())


@wrong("step_by_difference", "new chance each time")
def step_by_the_same_numbers_each_time(population, factor, rng):
    rng = np.random.default_rng(np.frombuffer(population.tobytes(), np.uint32))
    return solutions.step_by_difference(population, factor, rng)


@wrong("step_by_difference", "inputs left alone")
def step_in_place(population, factor, rng):
    population += solutions.step_by_difference(population, factor, rng) - population
    return population


@wrong("step_by_difference", "shape of the answer")
def step_of_one_member(population, factor, rng):
    return solutions.step_by_difference(population, factor, rng)[0]


# --- 6 costliest_limit ------------------------------------------------------------------------------------------------
def _gains(z_error, lower, upper, step, tried=None):
    tried, now = tried or step, z_error(lower, upper)
    found = []
    for i in range(7):
        shift = tried * np.eye(7)[i]
        found += [now - z_error(lower - shift, upper), now - z_error(lower, upper + shift)]
    return np.array(found), [name for pair in LIMITS for name in pair]


def _largest(gain, names, step):
    return (names[gain.argmax()], gain.max() / step) if gain.max() > 1e-9 else (None, 0.0)


@wrong("costliest_limit", "in reach")
def limit_always_named(z_error, lower, upper, step):
    gain, names = _gains(z_error, lower, upper, step)
    return names[gain.argmax()], gain.max() / step


@wrong("costliest_limit", "outward")
def limit_that_the_notebook_names(z_error, lower, upper, step):
    gain, _ = _gains(z_error, lower, upper, step)
    return ("radial deviation", gain.max() / step) if z_error(lower, upper) > 0 else (None, 0.0)


@wrong("costliest_limit", "outward")
def limit_of_the_oracle(z_error, lower, upper, step):
    if z_error(lower, upper) == 0:
        return None, 0.0
    found = optimum(np.array([0.3, 0.1, 0.0]), np.array([0.0, -np.pi / 2, 0.0]))
    return found.binding[0], found.residual / step


@wrong("costliest_limit", "outward")
def limit_with_lower_limits_moved_up(z_error, lower, upper, step):
    now, gain = z_error(lower, upper), []
    for i in range(7):
        shift = step * np.eye(7)[i]
        gain += [now - z_error(lower + shift, upper), now - z_error(lower, upper + shift)]
    return _largest(np.array(gain), _gains(z_error, lower, upper, step)[1], step)


@wrong("costliest_limit", "outward")
def limit_of_the_upper_side_alone(z_error, lower, upper, step):
    gain, names = _gains(z_error, lower, upper, step)
    return _largest(gain[1::2], names[1::2], step)


@wrong("costliest_limit", "outward")
def limit_by_the_other_name(z_error, lower, upper, step):
    gain, names = _gains(z_error, lower, upper, step)
    name, price = _largest(gain, names, step)
    return name and names[names.index(name) ^ 1], price


@wrong("costliest_limit", "outward")
def limit_with_both_sides_moved_together(z_error, lower, upper, step):
    now = z_error(lower, upper)
    gain = np.array([now - z_error(lower - step * e, upper + step * e) for e in np.eye(7)])
    return _largest(gain, [pair[0] for pair in LIMITS], step)


@wrong("costliest_limit", "small error")
def limit_of_errors_worth_naming(z_error, lower, upper, step):
    return solutions.costliest_limit(z_error, lower, upper, step) if z_error(lower, upper) > 0.01 else (None, 0.0)


@wrong("costliest_limit", "which limit")
def limit_that_is_the_first_to_help(z_error, lower, upper, step):
    gain, names = _gains(z_error, lower, upper, step)
    helps = np.flatnonzero(gain > 1e-9)
    return (names[helps[0]], gain[helps[0]] / step) if len(helps) else (None, 0.0)


@wrong("costliest_limit", "which limit")
def limit_without_putting_back_the_others(z_error, lower, upper, step):
    now, gain = z_error(lower, upper), []
    moved = lower.copy(), upper.copy()
    for i in range(7):
        for limits, outward in zip(moved, (-step, step), strict=True):
            limits[i] += outward
            gain.append(now - z_error(*moved))
    return _largest(np.array(gain), [name for pair in LIMITS for name in pair], step)


@wrong("costliest_limit", "over the whole step")
def limit_by_a_derivative(z_error, lower, upper, step):
    gain, names = _gains(z_error, lower, upper, step, 1e-6)
    return _largest(gain, names, 1e-6) if gain.max() > 0 else (None, 0.0)


@wrong("costliest_limit", "price")
def limit_with_metres_for_a_price(z_error, lower, upper, step):
    name, price = solutions.costliest_limit(z_error, lower, upper, step)
    return name, price * step


@wrong("costliest_limit", "price")
def limit_with_a_price_per_degree(z_error, lower, upper, step):
    name, price = solutions.costliest_limit(z_error, lower, upper, step)
    return name, np.deg2rad(price)


@wrong("costliest_limit", "price")
def limit_with_a_negative_price(z_error, lower, upper, step):
    name, price = solutions.costliest_limit(z_error, lower, upper, step)
    return name, -price


@wrong("costliest_limit", "a name of LIMITS")
def limit_by_number(z_error, lower, upper, step):
    gain, _ = _gains(z_error, lower, upper, step)
    return (int(gain.argmax()), gain.max() / step) if gain.max() > 0 else (None, 0.0)


@wrong("costliest_limit", "at the arm")
def limit_of_the_notebooks_arm(z_error, lower, upper, step):
    return solutions.costliest_limit(z_error, ARM.lower, ARM.upper, step)


@wrong("costliest_limit", "inputs left alone")
def limit_that_moves_the_arms_own(z_error, lower, upper, step):
    lower[6] -= step
    return None, 0.0


@wrong("costliest_limit", "shape of the answer")
def limit_without_a_price(z_error, lower, upper, step):
    return solutions.costliest_limit(z_error, lower, upper, step)[0]


# --- 7 best_posture ---------------------------------------------------------------------------------------------------
def _evolution(fitness, lower, upper, budget, rng, mutate, n=300, crossing=0.6):
    """The solution with another mutation: `mutate(x, share of the generations done)`."""
    population = rng.uniform(lower, upper, (n, 7))
    values, generations = fitness(population), budget // n - 1
    for generation in range(generations):
        x, y = population[rng.integers(0, n, (2, n))]
        blended = x + (2 * rng.random((n, 7)) - 0.5) * (y - x)
        children = np.where(rng.random((n, 1)) < crossing, blended, mutate(x, generation / generations))
        population, values = np.vstack([population, children]), np.concatenate([values, fitness(children)])
        best = np.argsort(values)[:n]
        population, values = population[best], values[best]
    return population[0]


@wrong("best_posture", "out of reach")
def posture_by_annealed_gaussian_steps(fitness, lower, upper, budget, rng):
    def mutate(x, done):
        return x + (rng.random(x.shape) < 0.3) * 0.3 * (1 / 300) ** done * rng.standard_normal(x.shape)

    return _evolution(fitness, lower, upper, budget, rng, mutate)


@wrong("best_posture", "within reach")
def posture_by_gaussian_steps(fitness, lower, upper, budget, rng):
    def mutate(x, done):
        return x + (rng.random(x.shape) < 0.2) * 0.1 * rng.standard_normal(x.shape)

    return _evolution(fitness, lower, upper, budget, rng, mutate, n=100)


@wrong("best_posture", "within reach")
def posture_at_random(fitness, lower, upper, budget, rng):
    points = rng.uniform(lower, upper, (budget, 7))
    return points[np.argmin(fitness(points))]


@wrong("best_posture", "within reach")
def posture_by_crossover_alone(fitness, lower, upper, budget, rng):
    return _evolution(fitness, lower, upper, budget, rng, lambda x, done: x, n=100, crossing=0.5)


@wrong("best_posture", "within reach")
def posture_by_one_that_climbs(fitness, lower, upper, budget, rng):
    q = rng.uniform(lower, upper)
    value, sigma = fitness(q), 0.3
    for _ in range(min(budget, 8000) - 1):
        child = q + sigma * rng.standard_normal(7)
        its = fitness(child)
        q, value, sigma = (child, its, 1.5 * sigma) if its < value else (q, value, sigma * 0.9)
        sigma = max(sigma, 1e-6)
    return q


@wrong("best_posture", "within reach")
def posture_by_one_simplex(fitness, lower, upper, budget, rng):
    start = rng.uniform(lower, upper)
    bounds = list(zip(lower, upper, strict=True))
    return minimize(fitness, start, method="Nelder-Mead", bounds=bounds, options={"maxfev": min(1500, budget - 1)}).x


@wrong("best_posture", "within reach")
def posture_hard_coded(fitness, lower, upper, budget, rng):
    return np.array([0.0, 0.1, 0.0, -1.2, 0.0, 0.0, -0.1])


@wrong("best_posture", "within reach")
def posture_of_a_target_that_is_known(fitness, lower, upper, budget, rng):
    return optimum(np.array([0.3, 0.1, 0.1]), np.array([0.0, -np.pi / 2, 0.0])).q


@wrong("best_posture", "another arm")
def posture_by_finding_out_the_target(fitness, lower, upper, budget, rng):
    """Fits the target to what a few postures cost, and asks the package for the rest: on the usual arm alone."""
    q, tilt = rng.uniform(lower, upper, (100, 7)), np.array([0.0, -np.pi / 2, 0.0])
    values = fitness(q)

    def misfit(position):
        return np.abs(objective(position, tilt)(q) - values).sum()

    found = differential_evolution(misfit, [(0.1, 0.5), (-0.1, 0.4), (-0.1, 0.2)], rng=0, maxiter=60, tol=0, atol=1e-6)
    return optimum(found.x, tilt).q


@wrong("best_posture", "joint limits")
def posture_beyond_the_limits(fitness, lower, upper, budget, rng):
    return solutions.best_posture(fitness, lower, upper, budget, rng) + np.array([0, 0, 0, 0, 0, 0, 2.0])


@wrong("best_posture", "budget")
def posture_by_sixty_thousand_and_three_hundred(fitness, lower, upper, budget, rng):
    return solutions.best_posture(fitness, lower, upper, budget + 300, rng)


@wrong("best_posture", "budget")
def posture_with_generations_of_its_own(fitness, lower, upper, budget, rng):
    return solutions.best_posture(fitness, lower, upper, 60_000, rng)


@wrong("best_posture", "budget")
def posture_that_hides_its_excess(fitness, lower, upper, budget, rng):
    best = np.inf, None
    for _ in range(budget + 10):
        q = rng.uniform(lower, upper)
        try:
            best = min(best, (fitness(q), tuple(q)))
        except Exception:
            continue
    return best[1]


@wrong("best_posture", "runs without an error", "error")
def posture_that_reaches_behind_the_counter(fitness, lower, upper, budget, rng):
    return solutions.best_posture(fitness.function, lower, upper, 10 * budget, rng)


@wrong("best_posture", "chance from rng alone")
def posture_by_a_generator_of_its_own(fitness, lower, upper, budget, rng):
    own = np.random.default_rng(random.SystemRandom().getrandbits(32))
    return solutions.best_posture(fitness, lower, upper, budget, own)


@wrong("best_posture", "shape of the answer")
def posture_with_its_fitness(fitness, lower, upper, budget, rng):
    q = solutions.best_posture(fitness, lower, upper, budget, rng)
    return q, fitness(q)


@wrong("best_posture", "shape of the answer")
def posture_of_a_whole_population(fitness, lower, upper, budget, rng):
    return rng.uniform(lower, upper, (300, 7))


@wrong("best_posture", "tools left alone")
def posture_with_a_patched_oracle(fitness, lower, upper, budget, rng):
    arm_optimum.NEAR_POSITION = 1.0
    return 0.5 * (lower + upper)


@wrong("best_posture", "tools left alone")
def posture_with_a_patched_checker(fitness, lower, upper, budget, rng):
    mechanism.agree = lambda *_, **__: None
    return 0.5 * (lower + upper)
