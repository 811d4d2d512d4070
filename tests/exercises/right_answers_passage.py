"""Answers to notebook 4's exercises that differ from ours and are as right."""

import math

import numpy as np
import pinocchio as pin
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial.transform import Rotation

from tests.exercises.planting import right_into

RIGHT = []  # (function, exercise)
right = right_into(RIGHT)


# --- 1 orders_for_phases ----------------------------------------------------------------------------------------------
@right("orders_for_phases")
def orders_by_logarithms(upper, lower, speeds, rate_limit, period):
    rate = np.maximum(np.abs(speeds), 1e-12) * (upper + lower) / (upper * lower)
    by_rate = np.floor(np.log2(rate_limit / rate))
    by_period = np.floor(np.log2(np.pi / 2 / (10 * period * rate)) / 2)
    return np.clip(np.minimum(by_rate, by_period), 0, 8)


@right("orders_for_phases")
def orders_counted_down(upper, lower, speeds, rate_limit, period):
    def fits(n, speed):
        peak = 2.0**n * abs(speed) / upper + 2.0**n * abs(speed) / lower
        return peak <= rate_limit and peak * 10 * period * 2 ** (n + 1) <= math.pi

    return tuple(next((n for n in range(8, 0, -1) if fits(n, speed)), 0) for speed in speeds)


# --- 2 offset_elbow ---------------------------------------------------------------------------------------------------
@right("offset_elbow")
def elbow_of_a_larger_straight_arm(q4, upper, lower, offset):
    """Two links from corner to corner, and their angle counted from where they are in a line."""
    first, second = math.hypot(upper, offset), math.hypot(lower, offset)
    lean, other = math.atan2(offset, upper), math.atan2(offset, lower)
    angle = q4 - lean - other
    r = math.sqrt(first**2 + second**2 + 2 * first * second * math.cos(angle))
    alpha = lean + math.atan2(second * math.sin(angle), first + second * math.cos(angle))
    turn = second * (second + first * math.cos(angle)) / r**2
    alpha = math.atan2(math.sin(alpha), math.cos(alpha))
    return [r, -first * second * math.sin(angle) / r, alpha, turn, lean + other]


@right("offset_elbow")
def elbow_in_complex_numbers(q4, upper, lower, offset):
    """z + i x: a turn about y is a product."""
    wrist = upper + 1j * offset + (lower - 1j * offset) * np.exp(1j * q4)
    slope = 1j * (lower - 1j * offset) * np.exp(1j * q4)
    change = slope / wrist
    longest = np.angle((upper + 1j * offset) / (lower - 1j * offset))
    return np.array([abs(wrist), change.real * abs(wrist), np.angle(wrist), change.imag, longest])


@right("offset_elbow")
def elbow_by_matrices_of_pinocchio(q4, upper, lower, offset):
    def wrist(q):
        first = pin.SE3(np.eye(3), np.array([offset, 0, upper]))
        return (first * pin.SE3(pin.utils.rotate("y", q), np.zeros(3))).act(np.array([-offset, 0, lower]))

    x, _, z = wrist(q4)
    dx, _, dz = np.cross([0, 1, 0], wrist(q4) - [offset, 0, upper])
    def beside(q):
        along, _, up = wrist(q) - [offset, 0, upper]
        return offset * up - upper * along

    longest = brentq(beside, -1.5, 1.5, xtol=1e-14, rtol=1e-14)
    r = np.linalg.norm([x, z])
    return r, (x * dx + z * dz) / r, np.arctan2(x, z), (z * dx - x * dz) / r**2, longest


# --- 3 smooth_scale ---------------------------------------------------------------------------------------------------
@right("smooth_scale")
def scale_by_a_sine_of_a_cubic(q4, n):
    epsilon = np.pi / 2 ** (n + 1)
    if abs(q4) >= epsilon:
        return np.sign(q4), 1 / np.sin(abs(q4))
    x = q4 / epsilon
    b = np.sin(np.pi / 4 * (3 * x - x**3))
    return b, b / np.sin(q4) if abs(q4) > 1e-100 else 0.75 * np.pi / epsilon


@right("smooth_scale")
def scale_with_all_derivatives(q4, n):
    """Slope proportional to exp(-1 / (1 - x^2)), by quadrature."""
    epsilon = math.pi / 2 ** (n + 1)

    def bump(t):
        return math.exp(-1 / (1 - t * t)) if t * t < 1 else 0.0

    x = min(abs(q4) / epsilon, 1.0)
    whole = 0.22199690808403971
    part = quad(bump, 0, x, epsabs=1e-15, epsrel=1e-13)[0] if x < 1 else whole
    b = math.copysign(min(part / whole, 1.0), q4)
    near = abs(q4) < 1e-8
    return b, bump(0) / whole / epsilon if near else b / math.sin(q4)


@right("smooth_scale")
def scale_with_four_derivatives(q4, n):
    epsilon = math.pi / 2 ** (n + 1)
    x = max(-1, min(1, q4 / epsilon))
    over_x = (315 - 420 * x**2 + 378 * x**4 - 180 * x**6 + 35 * x**8) / 128
    sine_over_q = math.sin(q4) / q4 if q4 and abs(q4) > 1e-150 else 1
    ratio = over_x / epsilon if abs(q4) < epsilon else 1 / abs(q4)
    return x * over_x, ratio / sine_over_q


# --- 4 fate_on_arc ----------------------------------------------------------------------------------------------------
@right("fate_on_arc")
def arc_in_small_steps(hinge, radius, start, end, near, reach):
    def r(angle):
        return math.dist((radius * math.cos(angle), -radius * math.sin(angle), 0), -hinge)

    n = 3000
    step = (end - start) / n
    for k in range(1, n + 1):
        before, angle = start + (k - 1) * step, start + k * step
        far, low = r(angle) - reach, r(angle) - near
        if low < 0:
            return "folds", brentq(lambda t: r(t) - near, before, angle)
        if far > -1e-4 and (r(before) <= r(angle) or far > 0):
            between = sorted((before, angle + step))
            top = minimize_scalar(lambda t: -r(t), bounds=between, method="bounded", options={"xatol": 1e-10})
            if abs(-top.fun - reach) <= 1e-6 and 2 < k < n - 2:
                return "stalls", top.x
            if far > 0:
                return "reflects", brentq(lambda t: r(t) - reach, before, angle)
    return "passes", end


@right("fate_on_arc")
def arc_by_its_quadratic(hinge, radius, start, end, near, reach):
    """cos and sin by the half angle's tangent: the roots of a quadratic for each edge."""
    x, y, z = hinge
    phi = math.atan2(-y, x)
    flat, span = math.hypot(x, y), abs(end - start)
    way = 1 if end > start else -1
    found = []
    for edge, word in ((reach, "reflects"), (near, "folds")):
        a = flat**2 + radius**2 + z * z - edge**2  # a + b cos(u) = 0 with u = theta - phi
        b = 2 * flat * radius
        top = math.sqrt((flat + radius) ** 2 + z * z)
        if word == "reflects" and abs(top - reach) <= 1e-6:
            found.append((phi, "stalls"))
        elif b > abs(a):
            t = math.sqrt((a + b) / (b - a))
            found += [(phi + 2 * math.atan(t), word), (phi - 2 * math.atan(t), word)]
    ahead = [((way * (angle - start)) % math.tau, word) for angle, word in found]
    gone, word = min([one for one in ahead if one[0] <= span], default=(span, "passes"))
    return [word, start + way * gone]


# --- 5 follow_twist ---------------------------------------------------------------------------------------------------
@right("follow_twist")
def twist_by_scipy(wanted, here, direction, b, onward, speed, gain, most):
    turn = (Rotation.from_matrix(wanted.rotation) * Rotation.from_matrix(here.rotation).inv()).as_rotvec()
    away = wanted.translation - here.translation
    share = gain if gain * math.hypot(*away) <= most else most / math.hypot(*away)
    share = math.copysign(share, b)
    return np.hstack([onward * speed * direction + share * away, share * turn]), speed * onward * b


@right("follow_twist")
def twist_on_the_branch_of_the_elbow(wanted, here, direction, b, onward, speed, gain, most):
    """By the screw from here to there, with the place taken out of it again."""
    error = np.zeros(6)
    error[:3] = wanted.translation - here.translation
    error[3:] = here.rotation @ pin.log3(here.rotation.T @ wanted.rotation)
    correction = gain * error
    pace = np.sqrt(np.sum(correction[:3] ** 2))
    if pace > most:
        correction *= most / pace
    if b < 0:
        correction = -correction
    forward = np.concatenate([direction, np.zeros(3)]) * onward * speed
    return [forward + correction, b * onward * speed]


# --- 6 least_share ----------------------------------------------------------------------------------------------------
@right("least_share")
def share_by_intervals(start, radius, angle, drop, near, reach):
    """For each angle the distance is a parabola in 1 - K: what it forbids are two intervals at most."""
    theta = np.linspace(0, angle, 2000)[1:]
    away = radius * np.stack([np.cos(theta) - 1, -np.sin(theta)], axis=-1)
    rest = np.array([radius, 0]) - start
    square, mixed = (away**2).sum(axis=1), away @ rest
    constant = rest @ rest + drop**2
    if not near**2 <= constant <= reach**2:
        return None
    root = np.sqrt(mixed**2 - square * (constant - reach**2))
    most = min(1.0, ((-mixed + root) / square).min())  # of 1 - K, for the reach
    inside = mixed**2 - square * (constant - near**2)
    bad = inside > 0
    root = np.sqrt(inside[bad])
    low, high = ((-mixed[bad] + sign * root) / square[bad] for sign in (-1, 1))
    free = most
    for _ in range(10_000):
        hit = (low < free - 1e-12) & (free <= high)
        if not hit.any():
            return 1 - free
        free = low[hit].min()
    return None


@right("least_share")
def share_by_climbing_up(start, radius, angle, drop, near, reach):
    theta = np.linspace(0, angle, 400)
    knob = radius * np.exp(-1j * theta)
    base = complex(*start)
    for share in np.arange(0, 1.0005, 0.001):
        r = np.hypot(abs(knob - base - share * (knob - radius)), drop)
        if r.max() <= reach and r.min() >= near:
            return float(share)
    return None


# --- 7 swap_signs -----------------------------------------------------------------------------------------------------
@right("swap_signs")
def signs_by_lines(axes, offsets):
    """Each joint's line in the world at q = 0, from both ends: the same directions, and the same lines."""
    f, places = np.diag([1.0, -1.0, -1.0]), np.cumsum(offsets, axis=0)
    end = places[-1]
    other_axes, other_places = -axes[::-1] @ f, (places[:-1][::-1] - end) @ f
    signs = np.sign((axes * other_axes).sum(axis=1))
    same = np.abs(axes - signs[:, None] * other_axes).max() < 1e-7
    apart = np.cross(places[:-1] - other_places, axes)
    tips = np.abs(end + f @ end).max()
    return signs if same and np.abs(apart).max() < 1e-7 and tips < 1e-7 else None


@right("swap_signs")
def signs_by_one_joint_at_a_time(axes, offsets):
    n, f = len(axes), pin.SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))

    def tip(q):
        pose = pin.SE3(np.eye(3), offsets[0])
        for a, v, o in zip(q, axes, offsets[1:], strict=True):
            pose = pose * pin.SE3(pin.exp3(a * v), np.zeros(3)) * pin.SE3(np.eye(3), o)
        return pose

    signs = []
    for i in range(n):
        q = np.zeros(n)
        q[n - 1 - i] = 0.8
        for sign in (1, -1):
            if (tip(q) * f * tip(sign * q[::-1]) * f).isIdentity(1e-7):
                signs.append(sign)
                break
    if len(signs) < n:
        return None
    q = np.linspace(0.3, 1.7, n)
    whole = (tip(q) * f * tip(np.array(signs) * q[::-1]) * f).isIdentity(1e-7)
    return np.array(signs) if whole else None


# --- 8 next_action ----------------------------------------------------------------------------------------------------
@right("next_action")
def action_that_lets_go_where_the_door_stays(seen, memory):
    """Feels twice that nothing pulls, lets go of the knob and holds the push face; else it leans first."""
    if seen.hand != "free":
        memory["still"] = memory.get("still", 0) + 1 if seen.pull < 2 else 0
    stays = memory.get("still", 0) >= 2
    if seen.base == "before":
        if seen.hand == "knob":
            if seen.angle < 61 or (seen.angle < 70 and seen.last != "refused"):
                return "open"
            if memory["still"] == 1:
                return "wait"
            return "release" if stays else "lean"
        if seen.hand == "face":
            return "forward"
        return "reach" if stays and seen.angle > 62 else "grasp"
    if seen.base == "leaning":
        return {"knob": "release", "free": "reach", "face": "forward"}[seen.hand]
    if seen.base == "behind":
        if seen.hand == "face":
            return "release" if seen.pull > 2 else "ease"
        angles = memory.setdefault("angles", [])
        angles.append(seen.angle)
        return "reach" if len(angles) > 1 and angles[-1] > angles[-2] - 5 and angles[-1] > 45 else "wait"
    if seen.hand == "free":
        return "reach"
    return "push" if seen.angle < 61.5 else "forward"


@right("next_action")
def action_of_a_state_machine(seen, memory):
    """States with a guard, an action and what is done where the guard does not hold."""
    state = memory.get("state", "open")
    if state == "open" and seen.base == "leaning":
        state = "change hands"
    if state == "change hands" and seen.hand == "face":
        state = "through"
    if state == "through" and seen.base == "behind":
        state = "shut"
    memory["state"] = state
    memory.setdefault("seen", []).append(seen)
    if state == "open":
        if seen.hand == "free":
            return "grasp"
        return "lean" if seen.angle >= 64 or (seen.angle >= 61 and seen.last == "refused") else "open"
    if state == "change hands":
        return "release" if seen.hand == "knob" else "reach"
    if state == "through":
        if seen.hand != "face":
            return "reach"
        return "forward" if seen.angle >= 61 else "push"
    if seen.hand == "face":
        return "release" if seen.pull >= 2.5 else "ease"
    few = [one.angle for one in memory["seen"][-3:]]
    return "reach" if max(few) - min(few) < 4 and seen.angle > 42 else "wait"
