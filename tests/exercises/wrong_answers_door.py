"""Planted wrong answers to notebook 1's exercises, each with the exercise and the check that must reject it."""

import copy
import time as clock
from contextlib import suppress

import numpy as np
import pinocchio as pin

import tutorialbot.bo.objective
from tests.exercises import solutions_door as solutions
from tests.exercises.by_heart import ideal_path
from tests.exercises.planting import wrong_into
from tutorialbot.bo.optimizers import RandomSearch, TwistSearch
from tutorialbot.bo.space import to_sphere
from tutorialbot.checks import guard, mechanism
from tutorialbot.pose import interpolate, so4_distance
from tutorialbot.scene.door import Door
from tutorialbot.trajectory import PoseTrajectory

WRONG = []  # (function, exercise, check, outcome)
wrong = wrong_into(WRONG)


# --- 1 lengths --------------------------------------------------------------------------------------------------------
@wrong("lengths", "c5 = +1")
def lengths_in_degrees(c5):
    return (1 - c5) / 2 * 0.15, (1 + c5) / 2 * 180


@wrong("lengths", "c5 = +1")
def lengths_with_a_rounded_pi(c5):
    return (1 - c5) / 2 * 0.15, (1 + c5) / 2 * 3.14


@wrong("lengths", "c5 = -1")
def lengths_the_other_way_round(c5):
    return (1 + c5) / 2 * 0.15, (1 - c5) / 2 * np.pi


@wrong("lengths", "in between")
def lengths_with_a_square(c5):
    share = ((1 + c5) / 2) ** 2
    return (1 - share) * 0.15, share * np.pi


@wrong("lengths", "in between")
def lengths_hard_coded(c5):
    return (0.15, 0.0) if c5 < 0 else (0.0, np.pi)


@wrong("lengths", "shape of the answer")
def lengths_forgets_one(c5):
    return (1 - c5) / 2 * 0.15


@wrong("lengths", "shape of the answer")
def lengths_prints_and_returns_nothing(c5):
    print(c5)


# --- 2 two_numbers ----------------------------------------------------------------------------------------------------
@wrong("two_numbers", "height")
def numbers_by_latitude(v):
    a, b = solutions.two_numbers(v)
    return a, np.arcsin(b) * 2 / np.pi


@wrong("two_numbers", "azimuth")
def numbers_in_radians(v):
    return np.arctan2(v[1], v[0]), v[2] / np.linalg.norm(v)


@wrong("two_numbers", "azimuth")
def numbers_in_degrees(v):
    return np.rad2deg(np.arctan2(v[1], v[0])), v[2] / np.linalg.norm(v)


@wrong("two_numbers", "every quadrant")
def numbers_without_a_quadrant(v):
    x, y, z = v / np.linalg.norm(v)
    return np.arctan(y / x) / np.pi, z


@wrong("two_numbers", "every quadrant")
def numbers_by_the_arcsine(v):
    x, y, z = v / np.linalg.norm(v)
    return np.arcsin(np.clip(y / np.hypot(x, y), -1, 1)) / np.pi, z


@wrong("two_numbers", "any length")
def numbers_without_normalising(v):
    return np.arctan2(v[1], v[0]) / np.pi, v[2]


@wrong("two_numbers", "seam")
def numbers_that_turn_round_at_the_seam(v):
    x, y, z = v / np.linalg.norm(v)
    ring = np.hypot(x, y)
    return np.sign(y) * np.arccos(x / ring if ring > 0 else 1.0) / np.pi, z


@wrong("two_numbers", "finite numbers")
def numbers_without_a_pole(v):
    x, y, z = v / np.linalg.norm(v)
    with np.errstate(invalid="ignore"):
        share = np.arccos(np.clip(x / np.hypot(x, y), -1, 1)) / np.pi
    return np.copysign(share, y), z


@wrong("two_numbers", "poles")
def numbers_that_flee_from_the_poles(v):
    a, b = solutions.two_numbers(v)
    return a, np.clip(b, -0.99, 0.99)


@wrong("two_numbers", "inside the square")
def numbers_from_zero_to_two(v):
    a, b = solutions.two_numbers(v)
    return a % 2, b


@wrong("two_numbers", "azimuth")
def numbers_the_other_way_round(v):
    return solutions.two_numbers(v)[::-1]


@wrong("two_numbers", "azimuth")
def numbers_hard_coded(v):
    return 0.0, 0.0


@wrong("two_numbers", "shape of the answer")
def numbers_forth_instead_of_back(v):
    return to_sphere(v[0], v[1])


# --- 3 goal -----------------------------------------------------------------------------------------------------------
@wrong("goal", "world frame")
def goal_always_in_the_tool_frame(start, c, frame):
    return solutions.goal(start, c, "tool")


@wrong("goal", "tool frame")
def goal_always_in_the_world_frame(start, c, frame):
    return solutions.goal(start, c, "world")


@wrong("goal", "rotation alone")
def goal_in_degrees(start, c, frame):
    share = (1 + c[4]) / 2
    turn = pin.exp3(share * 180 * to_sphere(c[2], c[3]))
    return pin.SE3(turn @ start.rotation, start.translation + (1 - share) * 0.15 * to_sphere(c[0], c[1]))


@wrong("goal", "ratio of both")
def goal_without_a_ratio(start, c, frame):
    step = 0.15 * to_sphere(c[0], c[1]) * (c[4] < 1)
    return pin.SE3(pin.exp3(np.pi * to_sphere(c[2], c[3]) * (c[4] > -1)) @ start.rotation, start.translation + step)


@wrong("goal", "world frame")
def goal_that_swings_about_the_origin(start, c, frame):
    share = (1 + c[4]) / 2
    motion = pin.SE3(pin.exp3(share * np.pi * to_sphere(c[2], c[3])), (1 - share) * 0.15 * to_sphere(c[0], c[1]))
    here = pin.SE3(np.eye(3), np.array([0.1, 0.2, 1.0]))
    return here * motion if np.allclose(start.translation, here.translation) else motion * start


@wrong("goal", "inputs left alone")
def goal_that_moves_the_start(start, c, frame):
    start.translation += 0.15 * to_sphere(c[0], c[1])
    return start


class Chameleon(np.ndarray):
    """Numbers that differ from nothing."""

    def __sub__(self, other):
        return np.zeros(1)


class Liar(pin.SE3):
    @property
    def homogeneous(self):
        return np.eye(4).view(Chameleon)


@wrong("goal", "translation alone")
def goal_that_agrees_with_everything(start, c, frame):
    return Liar(pin.SE3.Identity())


# --- 4 way_between ----------------------------------------------------------------------------------------------------
@wrong("way_between", "quaternion order")
def way_with_w_last(a, b, s):
    position, q = solutions.way_between(a, b, s)
    return position, np.roll(q, -1)


@wrong("way_between", "straight line")
def way_along_a_screw(a, b, s):
    pose = pin.SE3.Interpolate(a, b, s)
    return pose.translation, np.roll(pin.Quaternion(pose.rotation).coeffs(), 1)


@wrong("way_between", "SLERP")
def way_the_long_way_round(a, b, s):
    qa, qb = (np.roll(pin.Quaternion(pose.rotation).coeffs(), 1) for pose in (a, b))
    o = np.arccos(qa @ qb)
    return (1 - s) * a.translation + s * b.translation, (np.sin((1 - s) * o) * qa + np.sin(s * o) * qb) / np.sin(o)


@wrong("way_between", "unit quaternion")
def way_without_normalising(a, b, s):
    qa, qb = (np.roll(pin.Quaternion(pose.rotation).coeffs(), 1) for pose in (a, b))
    return (1 - s) * a.translation + s * b.translation, (1 - s) * qa + s * qb * np.sign(qa @ qb)


@wrong("way_between", "SLERP")
def way_at_uneven_speed(a, b, s):
    position, q = way_without_normalising(a, b, s)
    return position, q / np.linalg.norm(q)


@wrong("way_between", "straight line")
def way_from_the_end(a, b, s):
    return solutions.way_between(b, a, s)


@wrong("way_between", "shape of the answer")
def way_as_a_pose(a, b, s):
    return interpolate(a, b, s)


# --- 5 time_to_collision ----------------------------------------------------------------------------------------------
@wrong("time_to_collision", "limits as given")
def collision_with_limits_of_its_own(times, wrench, up, weight, center, limits):
    return solutions.time_to_collision(times, wrench, up, weight, center, (40.0, 8.0))


@wrong("time_to_collision", "tare")
def collision_without_tare(times, wrench, up, weight, center, limits):
    return solutions.time_to_collision(times, wrench, up, 0.0, center, limits)


@wrong("time_to_collision", "the hand turns")
def collision_tared_once(times, wrench, up, weight, center, limits):
    return solutions.time_to_collision(times, wrench - wrench[0], up, 0.0, center, limits)


@wrong("time_to_collision", "torque of the weight")
def collision_with_the_weight_at_the_sensor(times, wrench, up, weight, center, limits):
    return solutions.time_to_collision(times, wrench, up, weight, np.zeros(3), limits)


@wrong("time_to_collision", "norm of the force")
def collision_by_the_largest_part(times, wrench, up, weight, center, limits):
    force = np.abs(wrench[:, :3] - weight * up).max(axis=1)
    beyond = force > limits[0]
    return times[np.argmax(beyond)] if beyond.any() else times[-1]


@wrong("time_to_collision", "torque counts")
def collision_without_torque(times, wrench, up, weight, center, limits):
    return solutions.time_to_collision(times, wrench, up, weight, center, (limits[0], np.inf))


@wrong("time_to_collision", "norm of the force")
def collision_one_reading_too_early(times, wrench, up, weight, center, limits):
    found = solutions.time_to_collision(times, wrench, up, weight, center, limits)
    return times[max(0, np.searchsorted(times, found) - 1)] if found < times[-1] else found


@wrong("time_to_collision", "first reading beyond")
def collision_at_the_last_reading(times, wrench, up, weight, center, limits):
    if solutions.time_to_collision(times, wrench, up, weight, center, limits) == times[-1]:
        return times[-1]
    force, torque = wrench[:, :3] - weight * up, wrench[:, 3:] - np.cross(center, weight * up)
    beyond = (np.linalg.norm(force, axis=1) > limits[0]) | (np.linalg.norm(torque, axis=1) > limits[1])
    return times[np.flatnonzero(beyond)[-1] + 1 - len(np.flatnonzero(beyond))] if beyond.sum() > 1 else times[0]


@wrong("time_to_collision", "no collision")
def collision_that_never_ends(times, wrench, up, weight, center, limits):
    found = solutions.time_to_collision(times, wrench, up, weight, center, limits)
    return 4.0 if found == times[-1] else found


@wrong("time_to_collision", "runs without an error", "error")
def collision_without_the_empty_case(times, wrench, up, weight, center, limits):
    return times[np.flatnonzero(np.linalg.norm(wrench[:, :3], axis=1) > limits[0])[0]]


# --- 6 mended_cost ----------------------------------------------------------------------------------------------------
def _came_back(settled, path):
    *before, after = (np.linalg.norm(pose.translation - path[0].translation) for pose in [*path, settled])
    return max(before) - after


def _cost(t_c, new, back):
    return -t_c + 5 if new < 0.1 or back > 0.06 else -t_c - 10 * new


@wrong("mended_cost", "something new")
def cost_that_punishes_what_is_new(t_c, settled, path):
    new = min(so4_distance(pose, settled) for pose in path)
    return -t_c + 5 if new < 0.1 or _came_back(settled, path) > 0.06 else -t_c + 10 * new


@wrong("mended_cost", "something new")
def cost_that_rewards_collisions(t_c, settled, path):
    return solutions.mended_cost(t_c, settled, path) + 2 * t_c


@wrong("mended_cost", "something new")
def cost_of_the_time_alone(t_c, settled, path):
    return -t_c


@wrong("mended_cost", "nothing new")
def cost_with_the_penalty_alone(t_c, settled, path):
    found = solutions.mended_cost(t_c, settled, path)
    return 5 if found == -t_c + 5 else found


@wrong("mended_cost", "nothing new")
def cost_without_a_threshold(t_c, settled, path):
    new = min(so4_distance(pose, settled) for pose in path)
    return -t_c + 5 if _came_back(settled, path) > 0.06 else -t_c - 10 * new


@wrong("mended_cost", "nothing new")
def cost_with_penalty_and_reward(t_c, settled, path):
    new = min(so4_distance(pose, settled) for pose in path)
    return -t_c - 10 * new + 5 * (new < 0.1 or _came_back(settled, path) > 0.06)


@wrong("mended_cost", "anywhere on the path")
def cost_by_the_last_pose(t_c, settled, path):
    return _cost(t_c, so4_distance(path[-1], settled), _came_back(settled, path))


@wrong("mended_cost", "anywhere on the path")
def cost_by_the_first_pose(t_c, settled, path):
    return _cost(t_c, so4_distance(path[0], settled), _came_back(settled, path))


@wrong("mended_cost", "anywhere on the path")
def cost_by_the_pose_furthest_away(t_c, settled, path):
    return _cost(t_c, max(so4_distance(pose, settled) for pose in path), _came_back(settled, path))


@wrong("mended_cost", "anywhere on the path")
def cost_by_the_mean(t_c, settled, path):
    return _cost(t_c, np.mean([so4_distance(pose, settled) for pose in path]), _came_back(settled, path))


@wrong("mended_cost", "coming back")
def cost_by_what_is_new_alone(t_c, settled, path):
    return _cost(t_c, min(so4_distance(pose, settled) for pose in path), 0.0)


@wrong("mended_cost", "coming back")
def cost_that_looks_back_from_the_start_of_the_move(t_c, settled, path):
    start, now = (np.linalg.norm(pose.translation - path[0].translation) for pose in (path[-1], settled))
    return _cost(t_c, min(so4_distance(pose, settled) for pose in path), start - now)


@wrong("mended_cost", "coming back")
def cost_that_comes_back_in_centimetres(t_c, settled, path):
    return _cost(t_c, min(so4_distance(pose, settled) for pose in path), _came_back(settled, path) / 100)


@wrong("mended_cost", "no coming back")
def cost_that_lets_nothing_come_back(t_c, settled, path):
    new = min(so4_distance(pose, settled) for pose in path)
    return -t_c + 5 if new < 0.1 or _came_back(settled, path) > 0 else -t_c - 10 * new


@wrong("mended_cost", "no coming back")
def cost_by_the_way_from_the_furthest(t_c, settled, path):
    furthest = max(path, key=lambda pose: np.linalg.norm(pose.translation - path[0].translation))
    away = np.linalg.norm(settled.translation - furthest.translation)
    back = away if len(path) > 1 and _came_back(settled, path) > -0.02 else 0
    return _cost(t_c, min(so4_distance(pose, settled) for pose in path), back)


@wrong("mended_cost", "tools left alone")
def cost_with_a_patched_package(t_c, settled, path):
    tutorialbot.bo.objective.so4_distance = lambda a, b: 0.0
    return -t_c


# --- 7 distance_seen_from ---------------------------------------------------------------------------------------------
def _apart(u, v):
    return min(np.linalg.norm(u - v), np.linalg.norm(u + v))


def _eight(pose, back=-1.0, turned_first=False, angle=lambda length: np.arctan(length / 0.1), least=1e-12):
    length = np.linalg.norm(pose.translation)
    half = angle(length) / 2
    axis = pose.translation / max(length, least)
    q = pin.Quaternion(pose.rotation)
    pair = [pin.Quaternion(np.cos(half), *(sign * np.sin(half) * axis)) for sign in (1.0, back)]
    return np.concatenate([(q * d if turned_first else d * q).coeffs() for d in pair])


@wrong("distance_seen_from", "two translations")
def distance_by_the_closed_formula(frame, a, b):
    step = a.actInv(b)
    theta = np.linalg.norm(pin.log3(step.rotation))
    psi = np.arctan(np.linalg.norm(step.translation) / 0.1)
    return 2 * np.sqrt(max(0.0, 1 - abs(np.cos(theta / 2) * np.cos(psi / 2))))


@wrong("distance_seen_from", "two translations")
def distance_of_the_displacement(frame, a, b):
    return so4_distance(a, b)


@wrong("distance_seen_from", "both signs")
def distance_of_one_sign(frame, a, b):
    return np.linalg.norm(_eight(frame.actInv(a)) - _eight(frame.actInv(b)))


@wrong("distance_seen_from", "G and H")
def distance_with_the_same_quaternion_twice(frame, a, b):
    return _apart(*(_eight(frame.actInv(pose), back=1.0) for pose in (a, b)))


@wrong("distance_seen_from", "G and H")
def distance_with_the_factors_reversed(frame, a, b):
    return _apart(*(_eight(frame.actInv(pose), turned_first=True) for pose in (a, b)))


@wrong("distance_seen_from", "seen from the frame")
def distance_from_the_worlds_origin(frame, a, b):
    return _apart(_eight(a), _eight(b))


@wrong("distance_seen_from", "seen from the frame")
def distance_seen_by_the_inverse(frame, a, b):
    return _apart(_eight(frame * a), _eight(frame * b))


@wrong("distance_seen_from", "angle of a translation")
def distance_that_aliases(frame, a, b):
    return _apart(*(_eight(frame.actInv(pose), angle=lambda length: length / 0.1) for pose in (a, b)))


@wrong("distance_seen_from", "angle of a translation")
def distance_with_a_whole_angle(frame, a, b):
    return _apart(*(_eight(frame.actInv(pose), angle=lambda length: 2 * np.arctan(length / 0.1)) for pose in (a, b)))


@wrong("distance_seen_from", "rotation alone")
def distance_of_positions(frame, a, b):
    return np.linalg.norm(a.translation - b.translation)


@wrong("distance_seen_from", "rotation alone")
def distance_of_four_numbers(frame, a, b):
    return _apart(*(_eight(frame.actInv(pose))[:4] for pose in (a, b)))


@wrong("distance_seen_from", "finite numbers")
def distance_that_divides_by_zero(frame, a, b):
    with np.errstate(invalid="ignore"):
        return _apart(*(_eight(frame.actInv(pose), least=0.0) for pose in (a, b)))


@wrong("distance_seen_from", "equal poses")
def distance_hard_coded(frame, a, b):
    return 0.7


@wrong("distance_seen_from", "tools left alone")
def distance_with_a_patched_norm(frame, a, b):
    np.linalg.norm = lambda *_, **__: 0.0
    return 0.0


@wrong("distance_seen_from", "tools left alone")
def distance_with_a_patched_checker(frame, a, b):
    mechanism.agree = lambda *_, **__: None
    return 0.0


@wrong("distance_seen_from", "tools left alone")
def distance_with_a_blinded_lookout(frame, a, b):
    mechanism._tools.clear()
    mechanism.agree = lambda *_, **__: None
    return 0.0


@wrong("distance_seen_from", "tools left alone")
def distance_with_a_lookout_that_looks_away(frame, a, b):
    guard.Tools.changed = lambda self: []
    mechanism.agree = lambda *_, **__: None
    return 0.0


# --- 8 base_twist -----------------------------------------------------------------------------------------------------
@wrong("base_twist", "turned wheels")
def twist_in_degrees(steer, turning, rolling, x, y, offset, radius):
    return solutions.base_twist(np.deg2rad(steer), turning, rolling, x, y, offset, radius)


@wrong("base_twist", "straight ahead")
def twist_without_the_radius(steer, turning, rolling, x, y, offset, radius):
    return solutions.base_twist(steer, turning, rolling, x, y, offset, np.ones_like(radius))


@wrong("base_twist", "turned wheels")
def twist_with_a_fork_that_swings_the_other_way(steer, turning, rolling, x, y, offset, radius):
    return solutions.base_twist(steer, -turning, rolling, x, y, offset, radius)


@wrong("base_twist", "the base turns")
def twist_with_the_wrong_sign_of_y(steer, turning, rolling, x, y, offset, radius):
    return solutions.base_twist(steer, turning, rolling, x, -y, offset, radius)


@wrong("base_twist", "the base turns")
def twist_without_the_turn_of_the_fork(steer, turning, rolling, x, y, offset, radius):
    ahead = offset * np.exp(1j * steer)  # the pivot where the wheel's centre should be
    return solutions.base_twist(steer, turning, rolling, x + ahead.real, y + ahead.imag, offset, radius)


@wrong("base_twist", "least squares")
def twist_of_two_casters_alone(*inputs):
    return solutions.base_twist(*(part[:2] for part in inputs))


@wrong("base_twist", "least squares")
def twist_in_radians_per_second(steer, turning, rolling, x, y, offset, radius):
    c, s = np.cos(steer), np.sin(steer)
    along = np.column_stack([c, s, x * s - y * c]) / radius[:, None]
    across = np.column_stack([-s, c, y * s + x * c - offset]) / offset[:, None]
    equations, measured = np.vstack([along, across]), np.concatenate([rolling, turning])
    twist = np.linalg.lstsq(equations, measured)[0]
    return *twist, np.linalg.norm(equations @ twist - measured)


@wrong("base_twist", "least squares")
def twist_of_three_equations(steer, turning, rolling, x, y, offset, radius):
    c, s = np.cos(steer), np.sin(steer)
    along = np.column_stack([c, s, x * s - y * c])
    across = np.column_stack([-s, c, y * s + x * c - offset])
    equations = np.vstack([along[:2], across[:1]])
    twist = np.linalg.solve(equations, np.concatenate([(radius * rolling)[:2], (offset * turning)[:1]]))
    return *twist, 0.0


@wrong("base_twist", "slip")
def twist_that_never_slips(*inputs):
    return *solutions.base_twist(*inputs)[:3], 0.0


@wrong("base_twist", "slip")
def twist_with_the_square_of_the_slip(*inputs):
    *twist, slip = solutions.base_twist(*inputs)
    return *twist, slip**2


@wrong("base_twist", "slip")
def twist_with_the_slip_of_one_equation(*inputs):
    *twist, slip = solutions.base_twist(*inputs)
    return *twist, slip / np.sqrt(2 * len(inputs[0]))


@wrong("base_twist", "shape of the answer")
def twist_without_the_slip(*inputs):
    return solutions.base_twist(*inputs)[:3]


@wrong("base_twist", "inputs left alone")
def twist_that_changes_the_rates(steer, turning, rolling, x, y, offset, radius):
    rolling *= radius
    return solutions.base_twist(steer, turning, rolling, x, y, offset, np.ones_like(radius))


# --- 9 find_direction -------------------------------------------------------------------------------------------------
@wrong("find_direction", "learns from the costs")
def search_at_random(evaluate, budget, rng):
    search = RandomSearch(rng)
    for _ in range(budget):
        c = search.ask()
        search.tell(c, evaluate(c), 1.0)
    return search.best()


@wrong("find_direction", "budget")
def search_once_too_often(evaluate, budget, rng):
    points = rng.uniform(-1, 1, (budget + 1, 5))
    return points[np.argmin([evaluate(c) for c in points])]


@wrong("find_direction", "budget")
def search_that_hides_its_excess(evaluate, budget, rng):
    best = None
    for _ in range(budget + 5):
        c = rng.uniform(-1, 1, 5)
        try:
            best = min(best or (np.inf,), (evaluate(c), *c))
        except Exception:
            continue
    return best[1:]


@wrong("find_direction", "runs without an error", "error")
def search_that_reaches_behind_the_counter(evaluate, budget, rng):
    points = [rng.uniform(-1, 1, 5) for _ in range(300)]
    return min(points, key=evaluate.function)


@wrong("find_direction", "the latch on the door")
def search_that_learns_but_gives_up_at_a_real_door(evaluate, budget, rng):
    if budget == 30:
        return solutions.find_direction(evaluate, budget, rng)
    points = rng.uniform(-1, 1, (budget // 3, 5))
    return points[np.argmax([evaluate(c) for c in points])]


@wrong("find_direction", "the best point")
def search_for_the_highest_cost(evaluate, budget, rng):
    points = rng.uniform(-1, 1, (budget, 5))
    return points[np.argmax([evaluate(c) for c in points])]


@wrong("find_direction", "the best point")
def search_that_returns_the_last(evaluate, budget, rng):
    search = TwistSearch(rng)
    for _ in range(budget):
        c = rng.uniform(-1, 1, 5)
        search.tell(c, evaluate(c), 1.0)
    return c


@wrong("find_direction", "budget")
def search_hard_coded(evaluate, budget, rng):
    return np.array([0.1, -0.2, 0.3, 0.4, 0.0])


@wrong("find_direction", "inside the cube")
def search_in_degrees(evaluate, budget, rng):
    points = rng.uniform(-180, 180, (budget, 5))
    return points[np.argmin([evaluate(c) for c in points])]


# --- 10 open_the_door -------------------------------------------------------------------------------------------------
def _hinge(robot):
    return robot._task.simulation._hinge


@wrong("open_the_door", "hands off the world")
def door_teleported(robot):
    robot._task.simulation.data.qpos[_hinge(robot)] = 1.6
    return robot.kept


@wrong("open_the_door", "hands off the world")
def door_teleported_and_carried_on(robot):
    robot._task.simulation.data.qpos[_hinge(robot)] = 1.6
    robot._task.here = robot._task.simulation.snapshot()
    robot.keep(np.zeros(5))
    return robot.kept


@wrong("open_the_door", "hands off the world")
def door_with_the_latch_switched_off(robot):
    simulation = robot._task.simulation
    simulation.data.eq_active[simulation._latch] = 0
    robot._task.here = simulation.snapshot()
    return solutions.open_the_door(robot)


@wrong("open_the_door", "hands off the world")
def door_pushed_by_a_ghost(robot):
    simulation = robot._task.simulation
    simulation.data.qfrc_applied[simulation.model.joint("door/hinge").dofadr[0]] = 20.0
    robot._task.here = simulation.snapshot()
    return solutions.open_the_door(robot)


@wrong("open_the_door", "hands off the world")
def door_pulled_by_a_rope(robot):
    simulation = robot._task.simulation
    simulation.data.xfrc_applied[simulation.model.body("door/panel").id, :3] = [-50.0, 0.0, 0.0]
    robot._task.here = simulation.snapshot()
    return solutions.open_the_door(robot)


@wrong("open_the_door", "hands off the world")
def door_with_an_edited_model(robot):
    robot._task.simulation.model.opt.gravity[:] = 0.0
    return solutions.open_the_door(robot)


@wrong("open_the_door", "hands off the world")
def door_with_a_patched_move(robot):
    task = robot._task
    honest = task.simulation.follow
    task.simulation.follow = lambda targets, **options: honest(list(targets)[:1], stop=False)
    return solutions.open_the_door(robot)


@wrong("open_the_door", "hands off the world")
def door_with_moves_without_end(robot):
    robot._left = 10**6
    return solutions.open_the_door(robot)


@wrong("open_the_door", "tools left alone")
def door_with_a_patched_replay(robot):
    tutorialbot.bo.objective.DoorTask.commit = lambda self, c: None
    return robot.kept


@wrong("open_the_door", "opens a fresh door")
def door_not_opened(robot):
    robot.keep(np.array([0.5, 0.0, 0.0, 0.0, -1.0]))
    return robot.kept


@wrong("open_the_door", "no brute force")
def door_of_the_notebook_learnt_by_heart(robot):
    return ideal_path(Door(), robot.pose)


@wrong("open_the_door", "starts at the handle")
def door_from_somewhere_else(robot):
    away = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.2]))
    return PoseTrajectory(np.array([0.0, 1.0]), [robot.pose * away, robot.pose])


@wrong("open_the_door", "starts at the handle")
def door_with_another_grip(robot):
    turned = robot.pose * pin.SE3(pin.exp3(np.array([0.0, 0.0, 0.5])), np.zeros(3))
    return PoseTrajectory(np.array([0.0, 1.0]), [turned, robot.pose])


@wrong("open_the_door", "in reasonable time")
def door_by_waiting(robot):
    return PoseTrajectory(np.array([0.0, 301.0]), [robot.pose, robot.pose])


@wrong("open_the_door", "shape of the answer")
def door_without_an_answer(robot):
    robot.keep(np.zeros(5))


@wrong("open_the_door", "budget")
def door_by_endless_trying(robot):
    while True:
        robot.attempt(np.array([0.0, 0.0, 0.0, 0.0, -1.0]))  # into the door: over soon


# --- rules of the mechanism itself ------------------------------------------------------------------------------------
@wrong("lengths", "time limit")
def lengths_for_ever(c5):
    while True:
        with suppress(Exception):
            clock.sleep(0.01)


@wrong("lengths", "little output")
def lengths_with_megabytes_of_print(c5):
    while True:
        print("c5 is", c5, "x" * 10_000)


@wrong("lengths", "runs without an error", "error")
def lengths_with_a_crash(c5):
    return copy.deepcopy({})["translation"]


@wrong("lengths", "runs without an error", "error")
def lengths_that_leaves(c5):
    raise SystemExit


@wrong("lengths", "shape of the answer")
def lengths_as_text(c5):
    return "0.15 m, 180 degrees"


@wrong("lengths", "runs without an error", "error")
def lengths_with_another_signature():
    return 0.15, np.pi
