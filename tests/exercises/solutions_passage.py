"""One right answer for each exercise of notebook 4, as a student would write it."""

import itertools
import math

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation


def orders_for_phases(upper, lower, speeds, rate_limit, period):
    orders = []
    for speed in speeds:
        peak = [2**n * (upper + lower) / (upper * lower) * abs(speed) for n in range(1, 9)]
        fine = [p <= rate_limit and 10 * period * p <= math.pi / 2 ** (n + 1) for n, p in enumerate(peak, start=1)]
        orders.append(sum(fine))
    return orders


def offset_elbow(q4, upper, lower, offset):
    s, c = math.sin(q4), math.cos(q4)
    x, z = offset - c * offset + s * lower, upper + s * offset + c * lower
    dx, dz = s * offset + c * lower, c * offset - s * lower
    r = math.hypot(x, z)
    stretched = math.atan2(offset, upper) + math.atan2(offset, lower)
    return r, (x * dx + z * dz) / r, math.atan2(x, z), (dx * z - x * dz) / r**2, stretched


def smooth_scale(q4, n):
    epsilon = math.pi / 2 ** (n + 1)
    if abs(q4) >= epsilon:
        return math.copysign(1, q4), 1 / math.sin(abs(q4))
    x = q4 / epsilon
    over_x = (35 - 35 * x**2 + 21 * x**4 - 5 * x**6) / 16
    return x * over_x, over_x / epsilon / np.sinc(q4 / math.pi)


def fate_on_arc(hinge, radius, start, end, near, reach):
    def distance(theta):
        knob = hinge + radius * np.array([math.cos(theta), -math.sin(theta), 0])
        return np.linalg.norm(knob)

    x, y, z = hinge
    phi, a, b = math.atan2(-y, x), x * x + y * y + z * z + radius**2, 2 * radius * math.hypot(x, y)
    events = []
    if abs(distance(phi) - reach) <= 1e-6:
        events.append((phi, "stalls"))
    else:
        for edge, word in ((reach, "reflects"), (near, "folds")):
            if b > 0 and abs(edge**2 - a) < b:
                turn = math.acos((edge**2 - a) / b)
                events += [(phi + turn, word), (phi - turn, word)]
    if events and events[0][1] == "stalls" and abs(near**2 - a) < b:
        turn = math.acos((near**2 - a) / b)
        events += [(phi + turn, "folds"), (phi - turn, "folds")]
    on_way = [(abs(t + k * math.tau - start), t + k * math.tau, word) for t, word in events for k in (-2, -1, 0, 1, 2)]
    on_way = [event for event in on_way if min(start, end) <= event[1] <= max(start, end)]
    if not on_way:
        return "passes", end
    _, theta, word = min(on_way)
    return word, theta


def follow_twist(wanted, here, direction, b, onward, speed, gain, most):
    error = np.concatenate([wanted.translation - here.translation, pin.log3(wanted.rotation @ here.rotation.T)])
    pace = gain * np.linalg.norm(error[:3])
    twist = np.sign(b) * gain * error * (most / pace if pace > most else 1)
    twist[:3] += onward * speed * direction
    return twist, onward * b * speed


def least_share(start, radius, angle, drop, near, reach):
    theta = np.linspace(0, angle, 500)
    knob = radius * np.stack([np.cos(theta), -np.sin(theta)], axis=-1)
    shares = np.linspace(0, 1, 1001)
    base = start + shares[:, None, None] * (knob - knob[0])
    r = np.sqrt(((knob - base) ** 2).sum(axis=-1) + drop**2)
    fine = ((r >= near) & (r <= reach)).all(axis=1)
    return shares[fine][0] if fine.any() else None


def swap_signs(axes, offsets):
    f = np.diag([1, -1, -1])

    def tip(q):
        rotation, place = np.eye(3), offsets[0]
        for angle, axis, offset in zip(q, axes, offsets[1:], strict=True):
            rotation = rotation @ Rotation.from_rotvec(angle * axis).as_matrix()
            place = place + rotation @ offset
        return rotation, place

    q = np.random.default_rng(1).uniform(-1, 1, len(axes))
    rotation, place = tip(q)
    for signs in itertools.product((1, -1), repeat=len(axes)):
        other, there = tip(np.array(signs) * q[::-1])
        if np.allclose(f @ other @ f, rotation.T, atol=1e-7) and np.allclose(rotation @ f @ there, -place, atol=1e-7):
            return signs
    return None


def next_action(seen, memory):
    if seen.base == "before":
        if seen.hand == "face":
            return "release"
        if seen.hand == "free":
            return "grasp"
        return "open" if seen.angle < 61 else "lean"
    if seen.base == "leaning":
        if seen.hand == "knob":
            return "release"
        return "reach" if seen.hand == "free" else "forward"
    if seen.base != "behind":
        if seen.hand == "free":
            return "reach"
        return "forward" if seen.angle > 61 else "push"
    angles = memory.setdefault("angles", [])
    if seen.hand == "face":
        angles.clear()
        pulls = memory.setdefault("pulls", [])
        pulls.append(seen.pull)
        if len(pulls) > 1 and min(pulls[-2:]) > 2:
            return "release"
        return "wait" if len(pulls) % 2 else "ease"
    angles.append(seen.angle)
    return "reach" if len(angles) > 3 and seen.angle > 40 and abs(angles[-1] - angles[-2]) < 3 else "wait"
