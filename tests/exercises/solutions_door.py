"""One right answer for each exercise of notebook 1, as a student would write it."""

import numpy as np
import pinocchio as pin

from tutorialbot.bo.optimizers import TwistSearch
from tutorialbot.bo.space import SearchSpace, to_sphere
from tutorialbot.pose import so4_distance


def lengths(c5):
    share = (1 + c5) / 2
    return (1 - share) * 0.15, share * np.pi


def two_numbers(v):
    x, y, z = v / np.linalg.norm(v)
    return np.arctan2(y, x) / np.pi, z


def goal(start, c, frame):
    share = (1 + c[4]) / 2
    step = (1 - share) * 0.15 * to_sphere(c[0], c[1])
    turn = pin.exp3(share * np.pi * to_sphere(c[2], c[3]))
    if frame == "tool":
        return start * pin.SE3(turn, step)
    return pin.SE3(turn @ start.rotation, start.translation + step)


def way_between(a, b, s):
    qa, qb = (np.roll(pin.Quaternion(pose.rotation).coeffs(), 1) for pose in (a, b))
    if qa @ qb < 0:
        qb = -qb
    o = np.arccos(min(1.0, qa @ qb))
    q = (np.sin((1 - s) * o) * qa + np.sin(s * o) * qb) / np.sin(o) if o > 1e-9 else qa
    return (1 - s) * a.translation + s * b.translation, q


def time_to_collision(times, wrench, up, weight, center, limits):
    force = wrench[:, :3] - weight * up
    torque = wrench[:, 3:] - np.cross(center, weight * up)
    beyond = (np.linalg.norm(force, axis=1) > limits[0]) | (np.linalg.norm(torque, axis=1) > limits[1])
    return times[np.argmax(beyond)] if beyond.any() else times[-1]


def mended_cost(t_c, settled, path):
    new = min(so4_distance(pose, settled) for pose in path)
    *before, after = (np.linalg.norm(pose.translation - path[0].translation) for pose in [*path, settled])
    return -t_c + 5 if new < 0.1 or max(before) - after > 0.06 else -t_c - 10 * new


def distance_seen_from(frame, a, b):
    def eight(pose):
        seen = frame.actInv(pose)
        length = np.linalg.norm(seen.translation)
        half = np.arctan(length / 0.1) / 2
        axis = seen.translation / length if length > 0 else np.zeros(3)
        forth, q = pin.Quaternion(np.cos(half), *(np.sin(half) * axis)), pin.Quaternion(seen.rotation)
        return np.concatenate([(forth * q).coeffs(), (forth.conjugate() * q).coeffs()])

    u, v = eight(a), eight(b)
    return min(np.linalg.norm(u - v), np.linalg.norm(u + v))


def base_twist(steer, turning, rolling, x, y, offset, radius):
    c, s = np.cos(steer), np.sin(steer)
    along = np.column_stack([c, s, x * s - y * c])
    across = np.column_stack([-s, c, y * s + x * c - offset])
    equations = np.vstack([along, across])
    measured = np.concatenate([radius * rolling, offset * turning])
    twist = np.linalg.lstsq(equations, measured)[0]
    return *twist, np.linalg.norm(equations @ twist - measured)


def find_direction(evaluate, budget, rng):
    search = TwistSearch(rng)
    for _ in range(budget):
        c = search.ask()
        search.tell(c, evaluate(c), 1.0)
    return search.best()


def open_the_door(robot):
    space = SearchSpace(rotation_max=np.pi / 2, frame="tool")
    rng = np.random.default_rng(0)
    again = None  # what worked in the last section
    while robot.moves_left > 20:
        trials = []
        for i in range(15):
            moving = [trial for trial in trials if trial.cost < 0]
            if i == 0 and again is not None:
                c = again
            elif i % 3 == 2 and moving:
                best = min(moving, key=lambda trial: trial.cost)
                c = space.point(*space.moved(best.start, best.settled))
            else:
                c = rng.uniform(-1, 1, 5)
            trials.append(robot.attempt(c))
            if trials[-1].outcome == "opened" or (i == 0 and trials[-1].cost < -8):
                break
        best = trials[-1] if trials[-1].outcome == "opened" else min(trials, key=lambda trial: trial.cost)
        if best.cost > -0.5:
            again = None
            robot.undo()
            continue
        kept = robot.keep(best.c)
        if kept.outcome == "opened":
            break
        again = space.point(*space.moved(kept.start, robot.pose))
    return robot.kept
