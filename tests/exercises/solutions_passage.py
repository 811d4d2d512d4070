"""One right answer for each exercise of notebook 4, as a student would write it."""

import numpy as np
import pinocchio as pin


def orders_for_phases(upper, lower, speeds, rate_limit, period):
    orders = []
    for speed in speeds:
        peak = [2**n * (upper + lower) / (upper * lower) * abs(speed) for n in range(1, 9)]
        fine = [p <= rate_limit and 10 * period * p <= np.pi / 2 ** (n + 1) for n, p in enumerate(peak, start=1)]
        orders.append(sum(fine))
    return orders


def offset_elbow(q4, upper, lower, offset):
    s, c = np.sin(q4), np.cos(q4)
    x, z = offset - c * offset + s * lower, upper + s * offset + c * lower
    dx, dz = s * offset + c * lower, c * offset - s * lower
    r = np.hypot(x, z)
    stretched = np.arctan2(offset, upper) + np.arctan2(offset, lower)
    return r, (x * dx + z * dz) / r, np.arctan2(x, z), (dx * z - x * dz) / r**2, stretched


def smooth_scale(q4, n):
    epsilon = np.pi / 2 ** (n + 1)
    if abs(q4) >= epsilon:
        return np.copysign(1, q4), 1 / np.sin(abs(q4))
    x = q4 / epsilon
    over_x = (35 - 35 * x**2 + 21 * x**4 - 5 * x**6) / 16
    return x * over_x, over_x / epsilon / np.sinc(q4 / np.pi)


def fate_on_arc(hinge, radius, start, end, near, reach):
    x, y, z = hinge
    flat, phi = np.hypot(x, y), np.arctan2(-y, x)  # squared distance: a + b cos(theta - phi)
    a, b = flat**2 + radius**2 + z * z, 2 * radius * flat
    touches = abs(np.sqrt(a + b) - reach) <= 1e-6
    events = [(phi, "stalls")] if touches else []
    for edge, word in ((reach, "reflects"), (near, "folds")):
        if abs(edge**2 - a) < b and not (touches and edge == reach):
            turn = np.arccos((edge**2 - a) / b)
            events += [(phi + turn, word), (phi - turn, word)]
    events = [(t + 2 * np.pi * k, word) for t, word in events for k in (-2, -1, 0, 1, 2)]
    on_way = [(abs(t - start), t, word) for t, word in events if min(start, end) <= t <= max(start, end)]
    _, theta, word = min(on_way, default=(0, end, "passes"))
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
            rotation = rotation @ pin.exp3(angle * axis)
            place = place + rotation @ offset
        return rotation, place

    q = np.random.default_rng(1).uniform(-1, 1, len(axes))
    rotation, place = tip(q)
    for number in np.ndindex(*[2] * len(axes)):
        signs = 1 - 2 * np.array(number)
        other, there = tip(signs * q[::-1])
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
    if seen.hand == "face":
        return "release" if seen.pull > 2 else "ease"
    before, memory["angle"] = memory.get("angle", np.inf), seen.angle
    return "reach" if seen.angle > 41 and abs(seen.angle - before) < 3 else "wait"
