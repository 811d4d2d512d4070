"""Run the legs of the passage: eqs (4) and (5) of paper 4 in time, one scale b for base, door and arm.

    ds/dt = b,    qdot = joint rates for nu_a,    nu_a = R^T (nu_ref - nu_mb)              (5)

with nu_ref the tip's twist in the reference (zero while the door is held still), and nu_mb the twist that the base's
motion gives to the tip. Runge and Kutta's fourth order carries q and s on. What is left of the tip's error goes into
nu_ref, times |b|: with b it would grow where the elbow has changed its branch.
"""

import math
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidValue
from tutorialbot.ik.passage_legs import ArmLeg, HandLeg, hand_pose, instants, least_jerk, spline
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT

GAIN, SWIVEL_GAIN = 8.0, 6.0  # of the tip's error, of the swivel's [1/s]
STALL = 3.0  # a leg is given up after so many times its duration


@dataclass(frozen=True)
class Piece:
    """What a leg did at n instants: times (n,) [s] from 0, base (n, 3), q (n, 7), rates (n, 7), theta (n,), and more.

    tip_error (n,) [m]: of the hand from its reference, 0 where it has none; scale (n,): b; stop: "" when the leg came
    to its end, else the guard that stopped it; s: how far along the leg it came.
    """

    times: np.ndarray
    base: np.ndarray
    q: np.ndarray
    rates: np.ndarray
    theta: np.ndarray
    tip_error: np.ndarray
    scale: np.ndarray
    stop: str = ""
    s: float = 1.0


@dataclass(frozen=True)
class Reference:
    """A HandLeg at m even instants `every` seconds apart: plain lists, one row an instant.

    moving: x, y [m] and sin, cos of the base's yaw, then the tip's twist less what the base's motion gives to it, as
    seen from the world: nu_ref - nu_mb (vx, vy, vz, omega_z); pose: base (3), theta, tip (3), rotation (9).
    """

    every: float
    moving: list
    pose: np.ndarray


def reference(leg: HandLeg) -> Reference:
    """Return the reference of `leg` at twice as many instants as it has steps, for the middle of each step."""
    count = 2 * (len(instants(leg)) - 1) + 1
    s, rate = least_jerk(np.linspace(0.0, 1.0, count))
    curve = spline(leg.path)
    path, speed = curve(s), curve(s, 1) * (rate / leg.duration)[:, None]
    rotation, tip = hand_pose(path, leg.grip, leg.roll)
    theta, (turning, pivoting, along, across, up) = path[:, 3], speed[:, 3:].T
    c, s = np.cos(theta), np.sin(theta)
    v = np.stack([c * along + s * across + turning * tip[:, 1], c * across - s * along - turning * tip[:, 0], up], -1)
    x, y, yawing = path[:, 0], path[:, 1], speed[:, 2]
    by_base = np.stack([speed[:, 0] - yawing * (tip[:, 1] - y), speed[:, 1] + yawing * (tip[:, 0] - x)], axis=-1)
    v[:, :2] -= by_base  # eq (5), in the world's axes
    moving = np.column_stack([np.sin(path[:, 2]), np.cos(path[:, 2]), v, pivoting - turning - yawing])
    return Reference(leg.duration / (count - 1), moving.tolist(),
                     np.column_stack([path[:, :4], tip, rotation.reshape(-1, 9)]))  # fmt: skip


def follow(arm: SphericalArm, leg: HandLeg, q: np.ndarray, n: int = 2, nearest: float = 0.0) -> Piece:
    """Return how base and arm go along `leg` from the joints q (7,) [rad], by eqs (1)-(3) and (5).

    n: of eq (2). nearest: smallest angle [rad] of the elbow; below it, or where b < 0, the leg stops ("stretch",
    "branch"). With nearest = 0 it goes on: where b < 0 it runs back the way it came, the elbow flipped, until it is at
    its beginning ("branch"). "limits": a joint would leave its limits; "stall": b lets it take STALL times as long.
    """
    goal = reference(leg)
    rows, pose, last = goal.moving, goal.pose, len(goal.moving) - 1
    step, place, stop = 2.0 * goal.every, 0.0, ""
    kept, most = [], int(STALL * last / 2) + 1
    q = np.array(q, dtype=float)
    while True:
        here = _between(pose, place)
        fix, turn, off = _error(arm, here, q)
        spin = SWIVEL_GAIN * _wrapped(leg.swivel - _swivel(arm, q))
        try:
            k1, b1 = _rates(arm, rows, place, q, fix, turn, spin, n)
            kept.append((place, here, q, k1, b1, off))
            stop = _stopped(q, b1, nearest) or ("stall" if len(kept) > most else "")
            if place <= 0.0 and b1 < 0.0:
                stop = "branch"
            if stop or place >= last - 1e-9:
                break
            k2, b2 = _rates(arm, rows, place + b1, q + 0.5 * step * k1, fix, turn, spin, n)
            k3, b3 = _rates(arm, rows, place + b2, q + 0.5 * step * k2, fix, turn, spin, n)
            k4, b4 = _rates(arm, rows, place + 2.0 * b3, q + step * k3, fix, turn, spin, n)
        except InvalidValue as error:
            if not error.argument.startswith("q"):
                raise
            stop = "limits"  # a joint is beyond them
            kept = kept or [(place, here, q, np.zeros(7), 0.0, off)]
            break
        q = q + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        place = min(max(place + (b1 + 2.0 * b2 + 2.0 * b3 + b4) / 3.0, 0.0), last)
    return _piece(kept, step, stop, last)


def _piece(kept: list, step: float, stop: str, last: int) -> Piece:
    places, here, q, rates, scale, off = (np.array(column) for column in zip(*kept, strict=True))
    times = step * np.arange(len(kept))
    return Piece(times, here[:, :3], q, rates, here[:, 3], off, scale, stop, float(places[-1] / last))


def _between(rows, place: float):
    """Row at `place`, straight between two rows where it is no whole number."""
    low = min(max(int(place), 0), len(rows) - 1)
    share = place - low
    if share < 1e-9 or low == len(rows) - 1:
        return rows[low]
    if isinstance(rows, list):
        return [a + share * (b - a) for a, b in zip(rows[low], rows[low + 1], strict=True)]
    return rows[low] + share * (rows[low + 1] - rows[low])


def _rates(arm, rows, place, q, fix, turn, spin, n) -> tuple[np.ndarray, float]:
    """Joint rates and b at `place`; fix, turn: the twist that takes the tip's error away, in the world's axes."""
    sine, cosine, vx, vy, vz, omega = _between(rows, place)
    vx, vy = vx + fix[0], vy + fix[1]
    twist = (cosine * vx + sine * vy, cosine * vy - sine * vx, vz + fix[2],
             cosine * turn[0] + sine * turn[1], cosine * turn[1] - sine * turn[0], omega + turn[2])  # fmt: skip
    moved = arm.joint_velocity(q, np.array(twist), n, spin)
    return moved.qdot, moved.scale


def _error(arm: SphericalArm, here: np.ndarray, q: np.ndarray) -> tuple[list, list, float]:
    """Twist against the tip's error, linear and angular in the world's axes, and the error [m]."""
    x, y, yaw, _, px, py, pz, *wanted = here.tolist()
    pose = arm.forward(q)
    c, s = math.cos(yaw), math.sin(yaw)
    tx, ty, tz = pose.translation.tolist()
    e = (px - x - c * tx + s * ty, py - y - s * tx - c * ty, pz - ANCHOR_HEIGHT - tz)
    is_ = [(c * r0 - s * r1, s * r0 + c * r1, r2) for r0, r1, r2 in pose.rotation.T.tolist()]  # columns
    turn = [0.0, 0.0, 0.0]
    for i, (a, b, d) in enumerate(is_):  # half the sum of (column x wanted column)
        u, v, w = wanted[i], wanted[3 + i], wanted[6 + i]
        turn[0] += 0.5 * (b * w - d * v)
        turn[1] += 0.5 * (d * u - a * w)
        turn[2] += 0.5 * (a * v - b * u)
    gain = -GAIN if q[3] < 0.0 else GAIN  # b has the sign of sin q4: together |b|
    return [gain * k for k in e], [gain * k for k in turn], math.sqrt(e[0] ** 2 + e[1] ** 2 + e[2] ** 2)


def _swivel(arm: SphericalArm, q: np.ndarray) -> float:
    """`srs.swivel` in plain numbers, for the inner loop."""
    _, q2, q3, q4, *_ = q.tolist()
    s2, s4, r = math.sin(q2), arm.lower * math.sin(q4), arm.upper + arm.lower * math.cos(q4)
    x = (s4 * math.cos(q2) + r * s2 * math.cos(q3)) / math.hypot(s4, r)
    side = -1.0 if q4 < 0.0 else 1.0
    return math.atan2(side * s2 * math.sin(q3), side * x)


def _wrapped(angle: float) -> float:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def _stopped(q: np.ndarray, b: float, nearest: float) -> str:
    if nearest and q[3] < nearest:
        return "stretch"
    return "branch" if nearest and b < 0.0 else ""


def move_arm(leg: ArmLeg) -> Piece:
    """Return how an ArmLeg goes: joints, base and door along their samples."""
    times = instants(leg)
    s, rate = least_jerk(times / leg.duration)
    rate = rate[:, None] / leg.duration
    q, zero = spline(leg.q), np.zeros(len(times))
    return Piece(times, spline(leg.base)(s), q(s), q(s, 1) * rate, spline(leg.theta)(s), zero, zero + 1.0)
