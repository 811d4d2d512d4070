"""Planted wrong answers, each in a function of its own, with the exercise and the check that must reject it."""

import copy
import time as clock
from contextlib import suppress

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

import tutorialbot.bo.objective
from tests.exercises import solutions
from tests.exercises.by_heart import ideal_path
from tutorialbot.bo.optimizers import RandomSearch, TwistSearch
from tutorialbot.bo.space import to_sphere
from tutorialbot.checks import mechanism
from tutorialbot.pose import double_quaternion, interpolate, so4_distance
from tutorialbot.scene.door import Door
from tutorialbot.trajectory import PoseTrajectory

WRONG = []  # (function, exercise, check, outcome)


def wrong(exercise, check, outcome="incorrect"):
    def plant(function):
        WRONG.append((function, exercise, check, outcome))
        return function

    return plant


# --- 1 lengths --------------------------------------------------------------------------------------------------------
@wrong("lengths", "c5 = +1")
def lengths_in_degrees(c5):
    return (1 - c5) / 2 * 0.15, (1 + c5) / 2 * 180


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


# --- 2 direction ------------------------------------------------------------------------------------------------------
@wrong("direction", "even coverage")
def direction_by_latitude(a, b):
    latitude = b * np.pi / 2
    return np.array([np.cos(latitude) * np.cos(np.pi * a), np.cos(latitude) * np.sin(np.pi * a), np.sin(latitude)])


@wrong("direction", "neighbours stay neighbours")
def direction_in_degrees(a, b):
    ring = np.sqrt(1 - b**2)
    return np.array([ring * np.cos(180 * a), ring * np.sin(180 * a), b])


@wrong("direction", "even coverage")
def direction_on_one_hemisphere(a, b):
    ring = np.sqrt(1 - b**2)
    return np.array([ring * np.cos(np.pi * a), ring * np.sin(np.pi * a), abs(b)])


@wrong("direction", "even coverage")
def direction_hard_coded(a, b):
    return np.array([1.0, 0.0, 0.0])


@wrong("direction", "unit length")
def direction_in_the_ball(a, b):
    return np.array([a, b, 0.5 * (a + b)])


@wrong("direction", "same answer twice")
def direction_by_chance(a, b, rng=np.random.default_rng(0)):  # noqa: B008
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)


@wrong("direction", "finite numbers")
def direction_off_the_sphere(a, b):
    return np.array([a, b, np.sqrt(np.float64(1 - a**2 - b**2))]) if a**2 + b**2 < 1 else np.full(3, np.nan)


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


# --- 6 cost -----------------------------------------------------------------------------------------------------------
@wrong("cost", "first section")
def cost_with_a_penalty_from_the_start(time, start, settled, first, sections_done):
    return solutions.cost(time, start, settled, first, 1)


@wrong("cost", "moving away")
def cost_off_by_one_section(time, start, settled, first, sections_done):
    return -time + 5.0 * (sections_done >= 1)


@wrong("cost", "first section")
def cost_that_rewards_collisions(time, start, settled, first, sections_done):
    return time + (5 if so4_distance(first, settled) < so4_distance(first, start) and sections_done else 0)


@wrong("cost", "coming nearer")
def cost_that_looks_at_positions_alone(time, start, settled, first, sections_done):
    before, after = (np.linalg.norm(p.translation - first.translation) for p in (start, settled))
    nearer = after < before and so4_distance(first, settled) < so4_distance(first, start)
    return -time + (5 if nearer and sections_done else 0)


@wrong("cost", "coming nearer")
def cost_with_a_penalty_for_going_away(time, start, settled, first, sections_done):
    away = so4_distance(first, settled) > so4_distance(first, start)
    nearer = not away and sections_done > 2  # and an off-by-two
    return -time + (5 if nearer else 0)


@wrong("cost", "first section")
def cost_hard_coded(time, start, settled, first, sections_done):
    return -4.0


# --- 7 distance -------------------------------------------------------------------------------------------------------
@wrong("distance", "angle of a translation")
def distance_that_aliases(a, b):
    return so4_distance(a, b, angle="ratio")


@wrong("distance", "both signs")
def distance_of_one_sign(a, b):
    step = a.actInv(b)
    return np.linalg.norm(double_quaternion(step) - double_quaternion(pin.SE3.Identity()))


@wrong("distance", "rotation alone")
def distance_of_positions(a, b):
    return np.linalg.norm(a.translation - b.translation)


@wrong("distance", "seen from a")
def distance_from_the_worlds_origin(a, b):
    u, v = double_quaternion(a), double_quaternion(b)
    return min(np.linalg.norm(u - v), np.linalg.norm(u + v))


@wrong("distance", "rotation alone")
def distance_in_degrees(a, b):
    step = a.actInv(b)
    theta = np.rad2deg(np.linalg.norm(pin.log3(step.rotation)))
    psi = np.arctan(np.linalg.norm(step.translation) / 0.1)
    return 2 * np.sqrt(1 - abs(np.cos(theta / 2) * np.cos(psi / 2)))


@wrong("distance", "angle of a translation")
def distance_with_a_whole_angle(a, b):
    step = a.actInv(b)
    theta = np.linalg.norm(pin.log3(step.rotation))
    psi = 2 * np.arctan(np.linalg.norm(step.translation) / 0.1)
    return 2 * np.sqrt(1 - abs(np.cos(theta / 2) * np.cos(psi / 2)))


@wrong("distance", "tools left alone")
def distance_with_a_patched_package(a, b):
    tutorialbot.bo.objective.so4_distance = lambda a, b: 0.0
    return 0.0


@wrong("distance", "tools left alone")
def distance_with_a_patched_norm(a, b, honest=Rotation.magnitude):
    np.linalg.norm = lambda *_, **__: 0.0
    return 0.0


@wrong("distance", "tools left alone")
def distance_with_a_patched_checker(a, b):
    mechanism.agree = lambda *_, **__: None
    return 0.0


# --- 8 caster ---------------------------------------------------------------------------------------------------------
@wrong("caster", "the base turns")
def caster_without_the_fork_turning(twist, steer, x, y, offset, radius):
    steering, driving = solutions.caster(twist, steer, x, y, offset, radius)
    return steering + twist[2], driving


@wrong("caster", "a turned wheel")
def caster_in_degrees(twist, steer, x, y, offset, radius):
    return solutions.caster(twist, np.deg2rad(steer), x, y, offset, radius)


@wrong("caster", "straight ahead")
def caster_the_other_way_round(twist, steer, x, y, offset, radius):
    return solutions.caster(twist, steer, x, y, offset, radius)[::-1]


@wrong("caster", "pivot off the centre")
def caster_with_the_wrong_sign_of_y(twist, steer, x, y, offset, radius):
    return solutions.caster(twist, steer, x, -y, offset, radius)


@wrong("caster", "straight ahead")
def caster_without_the_radius(twist, steer, x, y, offset, radius):
    steering, driving = solutions.caster(twist, steer, x, y, offset, radius)
    return steering, driving * radius


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
