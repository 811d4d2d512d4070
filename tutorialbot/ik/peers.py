"""Two textbook methods of inverse kinematics, with the interface of `prioritized.solve`, to compare it with.

Both linearise the task, J dq = e, and take whole steps: nothing checks that a step makes the error smaller. Where a
target is out of reach they have no point of rest, and chatter.
"""

from collections.abc import Callable, Sequence

import numpy as np
import pinocchio as pin

from tutorialbot.errors import finite_array, positive, whole_number
from tutorialbot.ik import prioritized
from tutorialbot.ik.prioritized import IkResult
from tutorialbot.ik.springs import Problem, Task, check_model, errors_at, problem

SINGULAR = 1e-3  # singular values below this share of the largest are left out of a pseudo-inverse
POSTURE_GAIN = 0.2  # share of the way back to the posture in one iteration


def damped_least_squares(
    model: pin.Model, q0: np.ndarray, tasks: Task | Sequence[Task], *, iterations: int = 100, damping: float = 0.05
) -> IkResult:
    """Return where the Levenberg steps dq = (J^T K J + damping^2 1)^-1 J^T K e lead from `q0` (nv,).

    K holds the weights of the tasks. No posture: each start has its own answer. Ends when the hand is exact.
    """
    square = positive("damping", damping) ** 2

    def move(this: Problem, q: np.ndarray, errors: np.ndarray) -> np.ndarray:
        jacobian, weights = _stacked(this, q)
        weighted = jacobian.T * weights
        return np.linalg.solve(weighted @ jacobian + square * np.eye(len(q)), weighted @ errors.ravel())

    return _repeat(model, q0, tasks, q0, iterations, move)


def strict_null_space(
    model: pin.Model, q0: np.ndarray, tasks: Task | Sequence[Task], *, posture: np.ndarray | None = None,
    iterations: int = 100,
) -> IkResult:
    """Return where steps of strict priority lead from `q0` (nv,): positions, then orientations, then the posture.

    Each level moves only in what the levels above leave free, with N the projector onto their common null space:

        dq <- dq + (J_i N)^+ (e_i - J_i dq),    N <- N - (J_i N)^+ (J_i N)

    The weights of a task count as present or absent. The posture is `q0` when None. Ends when the hand is exact.
    """

    def move(this: Problem, q: np.ndarray, errors: np.ndarray) -> np.ndarray:
        jacobian, weights = _stacked(this, q)
        rows = np.arange(len(weights)) % 6
        motion, free = np.zeros(len(q)), np.eye(len(q))
        for level in ((rows < 3) & (weights > 0), (rows >= 3) & (weights > 0)):
            here = jacobian[level] @ free
            inverse = np.linalg.pinv(here, rcond=SINGULAR)
            motion = motion + inverse @ (errors.ravel()[level] - jacobian[level] @ motion)
            free = free - inverse @ here
        return motion + free @ (POSTURE_GAIN * (this.posture - q))

    return _repeat(model, q0, tasks, q0 if posture is None else posture, iterations, move)


def _stacked(this: Problem, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Jacobian (6 tasks, nv) in the frames' axes, and the weight of each row."""
    pin.computeJointJacobians(this.model, this.data, q)
    rows = [pin.getFrameJacobian(this.model, this.data, s[0], pin.LOCAL) for s in this.springs]
    return np.vstack(rows), np.concatenate([np.repeat(s[2:], 3) for s in this.springs])


def _repeat(model, q0, tasks, posture, iterations, move: Callable) -> IkResult:
    """Iterate `move`, no joint by more than prioritized.LARGEST, within the limits."""
    q0 = finite_array("q0", q0, (check_model(model).nv,))
    this = problem(model, tasks, posture)
    q = q0.clip(this.low, this.high)
    errors, moves = errors_at(this, q), []
    for _ in range(whole_number("iterations", iterations, 1)):
        motion = move(this, q, errors)
        new = q + motion * min(1.0, prioritized.LARGEST / max(np.abs(motion).max(), 1e-12))
        new = np.clip(new, this.low, this.high)
        moves.append(np.abs(new - q).max())
        q, errors = new, errors_at(this, new)
        if prioritized.is_converged(this, errors, prioritized.EXACT) or moves[-1] < prioritized.STOP_BELOW:
            break
    return prioritized.result(this, q, errors, moves)
