"""Motions of the home robot at a door, made by hand for the tests: no paper's method, just damped least squares."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot import robots
from tutorialbot.scene import home_robot
from tutorialbot.scene.closing_door import ClosingDoor

START = np.array([0.80, -0.70, np.pi / 2, 0.0, 0.9, 0.0, 1.6, 0.0, -0.9, 0.0])  # base and arm before the knob
PERIOD = 0.02


@dataclass(frozen=True)
class Motion:
    """times (n,), base (n, 3), q (n, 7), grasped (n,) and the door's angle (n,) as the kinematics has it."""

    times: np.ndarray
    base: np.ndarray
    q: np.ndarray
    grasped: np.ndarray
    angle: np.ndarray

    @property
    def arguments(self) -> tuple:
        return self.times, self.base, self.q, self.grasped


def chain() -> pin.Model:
    return robots.load_pinocchio(home_robot.NAME, home_robot.MOVING)


def to_configuration(model: pin.Model, moving: np.ndarray) -> np.ndarray:
    """pinocchio's q of (x, y, yaw, arm): it keeps the base's yaw as an angle or as cosine and sine."""
    return (
        moving if model.nq == 10 else np.concatenate([moving[:2], [np.cos(moving[2]), np.sin(moving[2])], moving[3:]])
    )


def reach(model: pin.Model, data: pin.Data, moving: np.ndarray, goal: pin.SE3, weights: np.ndarray) -> np.ndarray:
    """Bring the tip to `goal` from the values `moving` (10,), moving little what has a small weight."""
    frame = model.getFrameId("tip")
    for _ in range(60):
        q = to_configuration(model, moving)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        error = pin.log6(data.oMf[frame].actInv(goal)).vector
        if np.linalg.norm(error) < 1e-10:
            break
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL) * weights
        step = weights * (jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-8 * np.eye(6), error))
        moving = moving + step * min(1.0, 0.3 / np.abs(step).max())
    else:
        raise RuntimeError(f"the hand misses by {np.linalg.norm(error):.2g}")
    return moving


def ease(count: int) -> np.ndarray:
    """A share from 0 to 1 without a jump in speed."""
    s = np.linspace(0.0, 1.0, count)
    return s * s * (3.0 - 2.0 * s)


def pull(door: ClosingDoor, opening: float, seconds: float = 4.0, wait: float = 0.5) -> Motion:
    """Hold the knob from the start, wait, pull the door to `opening` [rad] with arm and base, wait with it."""
    model = chain()
    data, still = model.createData(), round(wait / PERIOD)
    angle = np.concatenate([np.zeros(still), opening * ease(round(seconds / PERIOD)), np.full(still, opening)])
    weights = np.concatenate([[0.7, 0.7, 0.5], np.ones(7)])
    shift = np.concatenate([door.knob(0.0)[:2] - ClosingDoor().knob(0.0)[:2], np.zeros(8)])
    moving, rows = START + shift, []
    for theta in angle:
        moving = reach(model, data, moving, door.knob_frame(theta, 0.5 * theta), weights)
        rows.append(moving)
    rows = np.array(rows)
    times = PERIOD * np.arange(len(angle))
    return Motion(times, rows[:, :3], rows[:, 3:], np.ones(len(angle), dtype=bool), angle)


def then_stay(motion: Motion, seconds: float, grasped: bool = False) -> Motion:
    """Stay where `motion` ended, with or without the knob in the hand; the kinematic angle stays too."""
    count = round(seconds / PERIOD)
    more = [np.repeat(column[-1:], count, axis=0) for column in (motion.base, motion.q, motion.angle)]
    times = np.concatenate([motion.times, motion.times[-1] + PERIOD * np.arange(1, count + 1)])
    base, q, angle = (np.concatenate(both) for both in zip((motion.base, motion.q, motion.angle), more, strict=True))
    return Motion(times, base, q, np.concatenate([motion.grasped, np.full(count, grasped)]), angle)
