"""Postures for the tests of paper 2's robot, by bounded least squares: independent of the package's solvers."""

import functools

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from tutorialbot import robots
from tutorialbot.scene.room import ABDOMEN_HEIGHT, ARM

HAND_FORWARD = pin.utils.rotate("y", -np.pi / 2)  # of the thumb's root: Table 1's tilt
HOME = np.array([0.0, 0.1, 0.0, -1.2, 0.0, 0.0, -0.1])


@functools.cache
def arm() -> pin.Model:
    return robots.load_pinocchio("life_support_robot", ARM)


@functools.cache
def posture(x: float, y: float, z: float, margin: float = 0.0) -> np.ndarray | None:
    """Arm angles (7,) [rad] at least `margin` [rad] inside the limits that bring the thumb's root to (x, y, z) from the
    abdomen, hand forward and thumb up; None when 20 starts find none."""
    model, data = arm(), arm().createData()
    tip, goal = model.getFrameId("tip"), pin.SE3(HAND_FORWARD, np.array([x, y, z + ABDOMEN_HEIGHT]))

    def miss(q):
        pin.framesForwardKinematics(model, data, q)
        return pin.log6(goal.actInv(data.oMf[tip])).vector

    def slope(q):
        inner = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL)
        return pin.Jlog6(goal.actInv(data.oMf[tip])) @ inner

    low, high, rng = model.lowerPositionLimit + margin, model.upperPositionLimit - margin, np.random.default_rng(0)
    for start in [HOME, *rng.uniform(low, high, (20, 7))]:
        start = np.clip(start, low + 1e-6, high - 1e-6)
        found = least_squares(miss, start, slope, (low, high), xtol=1e-14, ftol=1e-14, max_nfev=100)
        if np.abs(found.fun).max() < 1e-8:
            return found.x
    return None
