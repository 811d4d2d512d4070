"""The abstract's "full workspace": what a margin to the stretched arm costs, in space and in degrees of the door.

A solver that has to keep off the singularity stops at |q4| = margin; eqs (1)-(3) go on to q4 = 0. How far the door
opens is found by eqs (4): the base takes its share K of the knob's motion, and the arm the rest, until the wrist would
be farther from the shoulder than the margin allows.
"""

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidValue, finite_array, finite_number, one_of
from tutorialbot.ik.base_sharing import Shares, base_centre_velocity
from tutorialbot.ik.singularity_consistent import SphericalArm, check_arm
from tutorialbot.pose import twist_between
from tutorialbot.scene.closing_door import ClosingDoor, check_closing_door
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT

START = (0.98, -0.62)  # the base before the closed door [m]
GRASPS = ("rigid", "pivoting")  # the hand turns with the door, or the knob turns in the hand
LARGEST_DEG, FINEST_DEG = 90.0, 1e-3  # how far the door is opened at most; the least step


@dataclass(frozen=True)
class FullWorkspace:
    """margins (m,) [rad] of |q4|, 0 first: eqs (1)-(3); volume (m,): share of the wrist's space that is left; shares
    (k,): the base's K; opening (grasps, k, m) [rad]: how far the door opens, 90 degrees at most; grasps: GRASPS.
    """

    margins: np.ndarray
    volume: np.ndarray
    shares: np.ndarray
    opening: np.ndarray
    grasps: tuple[str, ...] = GRASPS


def volume_share(arm: SphericalArm, margin: float) -> float:
    """Return the share of the wrist's space, a shell about the shoulder, where |q4| >= margin [rad]."""
    margin = finite_number("margin", margin, 0.0, check_arm(arm).limits[3])
    inner = arm.distance_at(arm.limits[3]) ** 3
    return (arm.distance_at(margin) ** 3 - inner) / (arm.reach**3 - inner)


def needed_reach(
    arm: SphericalArm, door: ClosingDoor, share: float, grasp: str = "rigid", step_deg: float = 0.25
) -> tuple[np.ndarray, np.ndarray]:
    """Return the door's angles (n,) [rad], 0 to 90 degrees, and how far the wrist is from the shoulder there (n,) [m].

    The base takes `share` of the knob's motion along x and y, and half as much of its turn: eq (4).
    """
    one_of("grasp", grasp, GRASPS), check_arm(arm), check_closing_door(door)
    finite_number("share", share, 0.0, 1.0), finite_number("step_deg", step_deg, FINEST_DEG, LARGEST_DEG)
    shares = Shares(share, share, 0.5 * share).matrix
    angles = np.deg2rad(np.arange(0.0, LARGEST_DEG + 0.5 * step_deg, step_deg))
    base, far, before = np.array([*START, 0.0]), [], _hand(door, 0.0, grasp)
    for angle in angles:
        tip = _hand(door, float(angle), grasp)
        nu_mb = shares @ twist_between(before, tip)  # (4)
        base = base + base_centre_velocity(nu_mb, 0.5 * (tip.translation + before.translation), base)
        wrist, before = tip.translation - arm.tip_offset * tip.rotation[:, 2], tip
        far.append(math.dist(wrist, (base[0], base[1], ANCHOR_HEIGHT + arm.base_offset)))
    return angles, np.array(far)


def _hand(door: ClosingDoor, angle: float, grasp: str) -> pin.SE3:
    return door.knob_frame(angle, angle if grasp == "pivoting" else 0.0)


def largest_opening(
    arm: SphericalArm, door: ClosingDoor, share: float, grasp: str = "rigid", margins: tuple[float, ...] = (0.0,)
) -> np.ndarray:
    """Return how far the door opens before |q4| is below each of the margins (m,) [rad]: (m,) [rad], pi/2 at most.

    Raises InvalidValue for a margin with which the hand does not even reach the knob of the closed door.
    """
    angles, far = needed_reach(arm, door, finite_number("share", share, 0.0, 1.0), grasp)
    found = []
    for margin in finite_array("margins", margins, (-1,)).tolist():
        beyond = far > arm.distance_at(finite_number("margin", margin, 0.0, arm.limits[3]))
        if beyond[0]:
            raise InvalidValue("margin", margin, f"one with which the hand reaches the knob from {START}")
        found.append(angles[int(np.argmax(beyond)) - 1] if beyond.any() else angles[-1])
    return np.array(found)


def full_workspace(
    arm: SphericalArm | None = None, door: ClosingDoor | None = None, *,
    margins_deg: tuple = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0), shares: tuple = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0),
) -> FullWorkspace:  # fmt: skip
    """Return the figure's data: space and door angle over the margin, and over the base's share.

    margins_deg (m,): from 0 to the elbow's limit; shares (k,): from 0 to 1. Raises InvalidType or InvalidValue for
    others, and for a margin with which the hand does not even reach the knob.
    """
    arm, door = SphericalArm() if arm is None else arm, ClosingDoor() if door is None else door
    check_arm(arm), check_closing_door(door)
    shares = _row("shares", shares, 1.0).tolist()
    margins = np.deg2rad(_row("margins_deg", margins_deg, math.degrees(arm.limits[3])))
    opening = [[largest_opening(arm, door, k, grasp, margins.tolist()) for k in shares] for grasp in GRASPS]
    volume = np.array([volume_share(arm, m) for m in margins.tolist()])
    return FullWorkspace(margins, volume, np.array(shares), np.array(opening))


def _row(name: str, value: tuple, high: float) -> np.ndarray:
    """Return numbers (m,) from 0 to `high`, one at least, or raise."""
    row = finite_array(name, value, (-1,))
    if not len(row) or row.min() < 0.0 or row.max() > high:
        raise InvalidValue(name, value, f"one or more numbers from 0 to {high:g}")
    return row
