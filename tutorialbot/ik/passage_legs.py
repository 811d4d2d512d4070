"""The pieces of motion that the passage of paper 4 is made of, and how long each takes.

A *leg* is one smooth motion from rest to rest along s = 0..1, in time by the polynomial of least jerk. In a `HandLeg`
base and hand are given and the joints follow from eqs (4) and (5); the hand is given in the panel's frame, so that a
hand at the knob stays there whatever the door does. In an `ArmLeg` the joints are given and the hand is free.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tutorialbot.scene.closing_door import turn

GRIPS = {  # columns: the tip's x, y, z in the panel's frame
    "knob": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),  # up, along, into the panel
    "panel": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),  # up, back along, from behind
}
HAND = ("base_x", "base_y", "base_yaw", "theta", "pivot", "along", "across", "up")  # columns of a HandLeg's path
RATE, BASE_SPEED, BASE_TURN, DOOR_RATE = 1.8, 0.4, 0.6, np.deg2rad(22.0)  # aimed at [rad/s, m/s, rad/s, rad/s]
SHORTEST = 0.8  # a leg [s]
STEP = 0.025  # between two samples [s]


@dataclass(frozen=True)
class HandLeg:
    """Base and hand along s = 0..1; `path` (m, 8) holds samples of HAND at even s, in m and rad.

    grip: one of GRIPS; roll: of the hand about its own z axis; swivel: of the elbow, all along; touching: the hand
    holds something, or is on its way to or from it; leaning: the base may lean on the door; grasped: the hand holds the
    knob; nearing: the base comes closer to a hand that is far away, so a stretched arm does not stop it.
    """

    path: np.ndarray
    grip: str
    roll: float
    swivel: float
    duration: float = 1.0
    touching: bool = True
    leaning: bool = False
    grasped: bool = False
    nearing: bool = False


@dataclass(frozen=True)
class ArmLeg:
    """Joints q (m, 7), base (m, 3) and door angle theta (m,) at even s; the hand is not bound to anything.

    touching, leaning, grasped are as in `HandLeg`; closing: the door is let go, and its angle follows from the closer.
    """

    q: np.ndarray
    base: np.ndarray
    theta: np.ndarray
    duration: float = 1.0
    touching: bool = False
    leaning: bool = False
    grasped: bool = False
    closing: bool = False


def least_jerk(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return s and ds/du of the motion of least jerk from rest to rest at u in [0, 1]."""
    return u**3 * (10.0 + u * (6.0 * u - 15.0)), 30.0 * u * u * (1.0 - u) ** 2


def spline(samples: np.ndarray) -> CubicSpline:
    """Return the cubic spline of `samples` (m, ...) at even s in [0, 1]."""
    return CubicSpline(np.linspace(0.0, 1.0, len(samples)), samples)


def hand_pose(path: np.ndarray, grip: str, roll: float) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation (m, 3, 3) and position (m, 3) [m] of the tip in the world for samples (m, 8) of HAND."""
    theta, pivot, along, across, up = path[:, 3:].T
    c, s = np.cos(theta), np.sin(theta)
    position = np.stack([c * along + s * across, c * across - s * along, up], axis=-1)
    rolled = np.array([[math.cos(roll), -math.sin(roll), 0.0], [math.sin(roll), math.cos(roll), 0.0], [0.0, 0.0, 1.0]])
    return turn(theta - pivot) @ (GRIPS[grip] @ rolled), position


def duration(speeds: np.ndarray, limits: np.ndarray) -> float:
    """Return the time [s] after which no |d/ds| (m, k), at even s, goes faster than `limits` (k,) a second."""
    u = np.linspace(0.0, 1.0, 201)
    s, rate = least_jerk(u)
    at = np.linspace(0.0, 1.0, len(speeds))
    over = np.max(speeds / limits, axis=1)
    return max(SHORTEST, float(np.max(np.interp(s, at, over) * rate)))


def hand_duration(path: np.ndarray, q: np.ndarray) -> float:
    """Return the time [s] of a HandLeg with samples (m, 8) of HAND and the joints q (m, 7) that go with them."""
    rate, speed = (np.abs(np.gradient(values, 1.0 / (len(path) - 1), axis=0)) for values in (q, path))
    flat = np.hypot(speed[:, 0], speed[:, 1])
    speeds = np.column_stack([rate, flat, speed[:, 2], speed[:, 3]])
    return duration(speeds, np.array([*[RATE] * 7, BASE_SPEED, BASE_TURN, DOOR_RATE]))


def arm_duration(q: np.ndarray) -> float:
    """Return the time [s] of an ArmLeg along q (m, 7)."""
    return duration(np.abs(np.gradient(q, 1.0 / (len(q) - 1), axis=0)), np.full(7, RATE))


def instants(leg: HandLeg | ArmLeg, step: float = STEP) -> np.ndarray:
    """Return the times (k,) [s] at which a leg is sampled: even steps of at most `step`."""
    return np.linspace(0.0, leg.duration, math.ceil(leg.duration / step) + 1)
