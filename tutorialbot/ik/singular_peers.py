"""What others do near the stretched arm: joint rates for a twist that follow it in time, as far as they can.

Each takes an arm, q (7,) [rad] and the tip's twist (6,) (linear first, in the anchor's axes) and returns qdot (7,)
[rad/s]. None of them slows the path down, so near a singularity each gives up something else: `pseudo_inverse` the
bound of the rates, damped least squares and the quadratic program a part of the twist.
"""

from functools import cache

import daqp
import numpy as np
import pink
import pinocchio as pin

from tutorialbot.errors import positive
from tutorialbot.ik.singularity_consistent import SphericalArm


def pseudo_inverse(arm: SphericalArm, q: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Least rates that follow the twist exactly: qdot = J^+ twist, by singular values."""
    return np.linalg.pinv(_jacobian(arm, q), rcond=1e-15) @ twist


def damped_least_squares(arm: SphericalArm, q: np.ndarray, twist: np.ndarray, damping: float = 0.02) -> np.ndarray:
    """Least |J qdot - twist|^2 + damping^2 |qdot|^2: qdot = J^T (J J^T + damping^2 1)^-1 twist."""
    jacobian = _jacobian(arm, q)
    return jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping * damping * _SIX, twist)


def adaptive_least_squares(
    arm: SphericalArm, q: np.ndarray, twist: np.ndarray, damping: float = 0.06, threshold: float = 0.012
) -> np.ndarray:
    """The same with a damping that fades in below a manipulability w = sqrt(det J J^T) (Nakamura and Hanafusa, 1986):

    damping^2 (1 - w / threshold)^2 in the place of damping^2, nothing from the threshold on.
    """
    jacobian = _jacobian(arm, q)
    gram = jacobian @ jacobian.T
    w = np.sqrt(max(0.0, np.linalg.det(gram)))
    if w < threshold:
        gram += max(1e-12, (damping * (1.0 - w / threshold)) ** 2) * _SIX
    return jacobian.T @ np.linalg.solve(gram, twist)


def rate_limited_program(
    arm: SphericalArm, q: np.ndarray, twist: np.ndarray, rate_limit: float = 3.0, damping: float = 1e-3
) -> np.ndarray:
    """Least |J qdot - twist|^2 + damping^2 |qdot|^2 with every |qdot_i| <= rate_limit: a quadratic program, by DAQP."""
    jacobian = _jacobian(arm, q)
    hessian = jacobian.T @ jacobian + damping * damping * _SEVEN
    bound = np.full(7, rate_limit)
    found, _, _, _ = daqp.solve(hessian, -jacobian.T @ twist, _NO_ROWS, bound, -bound, _FREE)
    return found


def _jacobian(arm: SphericalArm, q: np.ndarray) -> np.ndarray:
    """`arm.jacobian` without its checks."""
    return pin.computeFrameJacobian(arm.model, arm.data, q, arm.model.nframes - 1, pin.LOCAL_WORLD_ALIGNED)


_SIX, _SEVEN, _NO_ROWS, _FREE = np.eye(6), np.eye(7), np.zeros((0, 7)), np.zeros(7, dtype=np.int32)


def pink_program(
    arm: SphericalArm, q: np.ndarray, twist: np.ndarray, rate_limit: float = 3.0, damping: float = 1e-3
) -> np.ndarray:
    """The same program as pink sets it up: a frame task whose target is one step along the twist, and its limits.

    pink keeps the joints' limits as well. A step is 2 ms.
    """
    step, model = 2e-3, _limited(arm, positive("rate_limit", rate_limit))
    q = np.clip(q, model.lowerPositionLimit, model.upperPositionLimit)
    configuration = pink.Configuration(model, model.createData(), q)
    task = pink.FrameTask("tip", position_cost=1.0, orientation_cost=1.0)
    here = configuration.get_transform_frame_to_world("tip")
    turn = pin.exp3(step * twist[3:]) @ here.rotation
    task.set_target(pin.SE3(turn, here.translation + step * twist[:3]))
    limits = [pink.limits.ConfigurationLimit(model, config_limit_gain=1.0), pink.limits.VelocityLimit(model)]
    return pink.solve_ik(
        configuration, [task], step, solver="daqp", damping=damping**2, limits=limits, safety_break=False
    )


@cache
def _limited(arm: SphericalArm, rate_limit: float) -> pin.Model:
    model = arm.model.copy()
    model.velocityLimit = np.full(7, rate_limit)
    return model
