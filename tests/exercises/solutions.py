"""One right answer for each exercise, as a student would write it; in the tests it takes the stub's place."""

import numpy as np
import pinocchio as pin

from tutorialbot.bo.optimizers import TwistSearch
from tutorialbot.bo.space import SearchSpace, to_sphere
from tutorialbot.pose import so4_distance


def lengths(c5):
    share = (1 + c5) / 2
    return (1 - share) * 0.15, share * np.pi


def direction(a, b):
    # Lambert's azimuthal projection turned round: not the package's own cylinder, and as good.
    radius, angle = np.sqrt((b + 1) / 2), np.pi * a
    z = 1 - 2 * radius**2
    ring = 2 * radius * np.sqrt(1 - radius**2)
    return np.array([ring * np.cos(angle), ring * np.sin(angle), z])


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


def cost(time, start, settled, first, sections_done):
    nearer = so4_distance(first, settled) < so4_distance(first, start)
    return -time + (5 if nearer and sections_done > 0 else 0)


def distance(a, b):
    step = a.actInv(b)
    d = step.translation
    length = np.linalg.norm(d)
    half = np.arctan(length / 0.1) / 2
    axis = d / length if length > 0 else d
    q = pin.Quaternion(step.rotation)
    forth = pin.Quaternion(np.cos(half), *(np.sin(half) * axis))
    both = np.concatenate([(forth * q).coeffs(), (forth.conjugate() * q).coeffs()])
    rest = np.array([0, 0, 0, 1, 0, 0, 0, 1])
    return min(np.linalg.norm(both - rest), np.linalg.norm(both + rest))


def caster(twist, steer, x, y, offset, radius):
    vx, vy, w = twist
    u = np.array([vx - w * y, vy + w * x])
    h, n = np.array([np.cos(steer), np.sin(steer)]), np.array([-np.sin(steer), np.cos(steer)])
    return n @ u / offset - w, h @ u / radius


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
