"""Inverse kinematics with prioritised targets, by virtual springs.

Paper 1 uses the method of its reference 6 (Sekiguchi and Takesue 2020, "Fast and robust numerical method for inverse
kinematics with prioritized multiple targets for redundant robots"). We know of it what paper 1 says: virtual springs
apply forces and torques iteratively, priorities make the redundant solution unique, and a target out of reach still
gives a near solution. Everything below is our reconstruction, not the authors' algorithm.

Each target pulls at its frame with a spring (k_p [N/m] at the position, k_r [Nm/rad] at the orientation), and a far
softer spring on each joint pulls towards a posture. With e_p = R^T (p_target - p) and e_r = log(R^T R_target) in the
frame's axes, J the frame's Jacobian and eps the ratio of the posture's stiffness to the hand's,

    V(q)   = 1/2 sum (k_p |e_p|^2 + k_r |e_r|^2) + 1/2 eps sum w_j (q_j - posture_j)^2         energy
    tau(q) = sum J^T (k_p e_p, k_r e_r)          - eps w (q - posture)  = -dV/dq               force on the joints

The robot comes to rest where V is least. Dampers D on the joints make that a motion, D q' = tau, and one iteration is
one implicit step of it:

    (H + D) dq = tau,      H = d2V/dq2,      D = |tau|^2 / (2 k)     with k = 1

D is the energy that a spring of unit stiffness under the force tau could still give off. (The energy V itself would do
where a target can be reached; where it cannot, V never vanishes and would slow the motion for ever.) H holds, besides
the usual J^T K J, what a stretched spring adds when the frame swings round: without that part, an arm stretched towards
a target out of reach overshoots and chatters. In directions where H is negative (a saddle), its size counts.

- Priority is the ratio of stiffnesses: position 1, orientation 0.1, posture eps. `solve` starts with 0.03 at most, so
  that the posture shapes the way, and softens it a hundredfold whenever the motion comes to rest, until the hand
  is exact or eps = 1e-8. The posture thus decides among all solutions and costs the hand nothing.
- A joint at its limit that is pushed outward is held (active set); a step never leaves the limits.
- A step that would raise V is taken back and tried again with eight times the damping, so nothing can chatter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg.lapack import dposv, dsyev

from tutorialbot.errors import finite_array, whole_number
from tutorialbot.ik.springs import (
    Problem,
    Task,
    check_model,
    energy_at,
    errors_at,
    force_and_stiffness,
    problem,
    worst,
)

NEAR_POSITION, NEAR_ROTATION = 1e-4, np.deg2rad(0.1)  # converged: below both [m], [rad]
EXACT = 0.1  # `solve` goes on until the error is this share of what counts as converged
AT_REST = 1e-3  # settled: less motion than this in FURTHER iterations [rad or m]
FURTHER = 5
STIFFEST, SOFTEST, SOFTEN = 0.03, 1e-8, 0.01  # the posture's stiffness eps in `solve`
SOFTEN_BELOW, STOP_BELOW = 2e-3, 2e-5  # motion of one iteration at which eps is lowered, at which `solve` stops [rad]
LARGEST = 0.5  # motion of any joint in one iteration [rad or m]
REJECTIONS = 12


@dataclass(frozen=True)
class IkResult:
    """Where the robot came to rest. A target out of reach is a result too: converged False, with what is left.

    q (nv,) [rad or m]; converged: position_error [m] < 0.1 mm and rotation_error [rad] < 0.1 degrees, each the largest
    over the tasks that ask for it; settled: the last five iterations moved no joint by 1e-3 or more.
    """

    q: np.ndarray
    converged: bool
    position_error: float
    rotation_error: float
    iterations: int
    settled: bool


def solve(
    model: pin.Model, q0: np.ndarray, tasks: Task | Sequence[Task], *, posture: np.ndarray | None = None,
    posture_weights: np.ndarray | None = None, iterations: int = 100, data: pin.Data | None = None,
) -> IkResult:
    """Return the configuration in which the springs of `tasks` come to rest, from `q0` (nv,), clipped to the limits.

    posture (nv,): what decides among the solutions, `q0` when None; posture_weights (nv,): stiffness of its springs
    against each other, 1 each when None (raise the base's to keep it where it is). The same arguments give the same
    answer; with the same posture so do different starts, unless they lie in different valleys of V (an elbow up or
    down, a wrist flipped). Raises InvalidType or InvalidValue on misuse.
    """
    q = finite_array("q0", q0, (check_model(model).nv,)).clip(model.lowerPositionLimit, model.upperPositionLimit)
    this = problem(model, tasks, q if posture is None else posture, posture_weights, data)
    errors = errors_at(this, q)
    eps = _first_stiffness(this, q, errors)
    moves = []
    for _ in range(whole_number("iterations", iterations, 1)):
        new, errors = _iterate(this, q, errors, eps)
        moves.append(np.abs(new - q).max())
        q = new
        if moves[-1] < SOFTEN_BELOW:
            if eps > SOFTEST and not is_converged(this, errors, EXACT):
                eps = max(eps * SOFTEN, SOFTEST)
            elif moves[-1] < STOP_BELOW:
                break
    return result(this, q, errors, moves)


def result(this: Problem, q: np.ndarray, errors: np.ndarray, moves: list[float]) -> IkResult:
    """Gather the answer from the last `q`, its `errors`, and the largest motion of each iteration."""
    settled = sum(moves[-FURTHER:]) < AT_REST or moves[-1] < STOP_BELOW
    return IkResult(q, is_converged(this, errors), *worst(this, errors), len(moves), bool(settled))


def step(this: Problem, q: np.ndarray, eps: float = 1e-5) -> np.ndarray:
    """Return `q` (nv,) after one iteration with the posture's stiffness `eps`.

    For a tight loop (make `this` once with `problem`): it checks nothing.
    """
    return _iterate(this, q, errors_at(this, q), eps)[0]


def follow(this: Problem, target: pin.SE3, q: np.ndarray, eps: float = 1e-5) -> np.ndarray:
    """`step` towards a new `target` of the first task: one iteration is enough behind a target that creeps."""
    frame, _, *stiffness = this.springs[0]
    this.springs[0] = (frame, target, *stiffness)
    return step(this, q, eps)


def is_converged(this: Problem, errors: np.ndarray, share: float = 1.0) -> bool:
    """Whether all errors are below `share` of what counts as converged."""
    position, rotation = worst(this, errors)
    return position < share * NEAR_POSITION and rotation < share * NEAR_ROTATION


def _held(this: Problem, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Joints (nv,) that stand at a limit and are pushed outward."""
    return ((q <= this.low) & (force < 0)) | ((q >= this.high) & (force > 0))


def _first_stiffness(this: Problem, q: np.ndarray, errors: np.ndarray) -> float:
    """eps that the targets' force can balance: STIFFEST far from rest, small where `q` is a solution already."""
    force = force_and_stiffness(this, q, errors)[0]
    pull = np.linalg.norm(force[~_held(this, q, force)])
    away = np.linalg.norm(this.weights * (q - this.posture))
    return float(np.clip(pull / away, SOFTEST, STIFFEST)) if away else STIFFEST


def _iterate(this: Problem, q: np.ndarray, errors: np.ndarray, eps: float) -> tuple[np.ndarray, np.ndarray]:
    """One iteration: the new q (nv,) and its errors; `q` itself when no step lowers the energy."""
    force, stiffness = force_and_stiffness(this, q, errors)
    away = q - this.posture
    before = energy_at(this, errors, away, eps)
    springs = eps * this.weights
    force -= springs * away
    diagonal = stiffness.reshape(-1)[:: len(q) + 1]  # a view
    diagonal += springs
    if ((q <= this.low) | (q >= this.high)).any():
        held = _held(this, q, force)
        force[held] = 0.0
        stiffness[held], stiffness[:, held] = 0.0, 0.0
        diagonal[held] = 1.0
    damper = 0.5 * (force @ force)
    for _ in range(REJECTIONS):
        move = _implicit(stiffness, diagonal, force, damper, eps)
        if move @ move > LARGEST**2:
            move *= LARGEST / max(move.max(), -move.min(), LARGEST)
        new = np.minimum(np.maximum(q + move, this.low), this.high)
        new_errors = errors_at(this, new)
        if energy_at(this, new_errors, new - this.posture, eps) <= before + 1e-15:
            return new, new_errors
        damper = max(8.0 * damper, eps)
    return q, errors


def _implicit(stiffness: np.ndarray, diagonal: np.ndarray, force: np.ndarray, damper: float, eps: float) -> np.ndarray:
    """Solve (H + D) dq = tau; where H + D has a negative direction, by the size of H's curvatures (at least eps)."""
    diagonal += damper
    _, move, failed = dposv(stiffness, force)
    diagonal -= damper
    if not failed:
        return move
    curvature, axes, _ = dsyev(stiffness)
    return axes @ ((force @ axes) / (np.maximum(np.abs(curvature), eps) + damper))
