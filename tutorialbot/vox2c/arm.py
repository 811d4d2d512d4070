"""Paper 3's arm: RRBot at half its size, two bars that turn side by side in planes y = constant.

A configuration q is (theta1, theta2) [rad]: theta1 turns about +y at JOINT_1, zero points straight up and positive
leans toward +x; theta2 is relative to the first bar, and phi = theta1 + theta2 is the second bar's own angle. Both
joints turn without end. The bars are called link 2 and link 3, as in the robot's file; link 1 is the column.
"""

import numpy as np
import pinocchio as pin

from tutorialbot.errors import finite_array

JOINT_1 = (0.0, 0.05, 0.975)  # on the axis of theta1 [m]
ELBOW = 0.45  # from joint 1 to joint 2 along link 2 [m]
HALF_WIDTH = 0.025  # of every bar and of the column [m]
HALF_LENGTH = 0.25  # of both bars [m]
MIDDLE = 0.225  # from a bar's joint to the bar's middle [m]
OFFSET = 0.05  # of link 3 beside link 2, along y [m]
SLABS = ((0.025, 0.075), (0.075, 0.125))  # where link 2 and link 3 lie along y [m]
COLUMN = ((-0.025, -0.025, 0.0), (0.025, 0.025, 1.0))  # lowest and highest corner [m]
DOMAIN = ((-1.15, -1.15, 0.0), (1.15, 1.15, 2.3))  # the paper's 2.3 m cube, the robot in its middle [m]
BAR = (ELBOW, MIDDLE, HALF_LENGTH, HALF_WIDTH)  # as the compiled kernels take it


def configurations(q, argument: str = "q") -> np.ndarray:
    """Return q as a float array (k, 2) [rad]; one configuration (2,) becomes (1, 2).

    Raises InvalidType or InvalidValue when it is not numbers, holds NaN or infinity, or has another shape.
    """
    shape = (2,) if np.ndim(q) == 1 else (-1, 2)
    return finite_array(argument, q, shape).reshape(-1, 2)


def link_poses(q) -> tuple[pin.SE3, pin.SE3]:
    """Return the poses of link 2 and link 3 in the world for one configuration q (2,): origin on the joint, z along."""
    theta1, theta2 = finite_array("q", q, (2,))
    first = pin.SE3(pin.exp3(np.array([0.0, theta1, 0.0])), np.array(JOINT_1))
    relative = pin.SE3(pin.exp3(np.array([0.0, theta2, 0.0])), np.array([0.0, OFFSET, ELBOW]))
    return first, first * relative


def forward_kinematics(q) -> np.ndarray:
    """Return joint 1, joint 2 and the tip of link 3 in the world, (k, 3, 3) [m], for q (k, 2) or (2,)."""
    q = configurations(q)
    points = np.tile(np.array(JOINT_1), (len(q), 3, 1))
    points[:, 1:, 1] += OFFSET
    for joint, angle, length in ((1, q[:, 0], ELBOW), (2, q.sum(axis=1), MIDDLE + HALF_LENGTH)):
        points[:, joint:, 0] += (length * np.sin(angle))[:, None]
        points[:, joint:, 2] += (length * np.cos(angle))[:, None]
    return points
