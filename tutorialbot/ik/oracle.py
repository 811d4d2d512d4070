"""The true optimum of eq. (5) of paper 2, to compare the genetic algorithm with: two independent ways, best of both.

- In closed form, tilt exact. Shoulder, elbow and wrist are a triangle with known sides; that fixes the elbow, and the
  triangle may turn about its longest side: the swivel, the seventh degree of freedom, is swept. Where no swivel is
  within the limits, the target is moved along z until one is.
- Numerically: minimise the sum of slacks s with -s <= error(q) <= s within the limits. This is eq. (5) with sums of
  absolutes, without its kinks; SLSQP from many starts.
"""

import warnings

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from tutorialbot.errors import InvalidValue, finite_array, whole_number
from tutorialbot.ik.arm7 import ARM, Arm
from tutorialbot.ik.fitness import GeneticSolution, as_arm, solution, target, task_error, task_jacobian
from tutorialbot.seeding import make_rng

SWIVELS = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
LIFTS = 0.005 * np.arange(61)  # how far the target may be moved along z [m]
HALVINGS, FINER = 16, 4  # of a step of LIFTS; how many SWIVELS about the last one are looked at more finely
STARTS = 24  # of SLSQP
EXACT = 1e-9  # a residual that nothing can better


def optimum(position: np.ndarray, tilt: np.ndarray, *, arm: Arm = ARM) -> GeneticSolution:
    """Return the best configuration for the target: eq. (5), L1, pitch-first, weight 1, inside the limits.

    position (3,) [m], tilt (3,) = (roll, pitch, yaw) [rad]. The same target gives the same answer. Nothing lower was
    ever found by other means, but it is no proof. Raises InvalidType or InvalidValue.
    """
    position, tilt = target(position, tilt)
    closed = lifted(position, tilt, arm) if is_usual(as_arm(arm)) else None
    if closed is not None and closed[1] == 0.0:
        return solution(closed[0], position, tilt, arm=arm)
    found = [] if closed is None else [closed[0]]
    for start in [*found, *make_rng(0).uniform(arm.lower, arm.upper, (STARTS, 7))]:
        found.append(least_slack(start, position, tilt, arm)[0])
        if residual(found[-1], position, tilt, arm) < EXACT:
            break
    return solution(min(found, key=lambda q: residual(q, position, tilt, arm)), position, tilt, arm=arm)


def residual(q: np.ndarray, position: np.ndarray, tilt: np.ndarray, arm: Arm) -> float:
    """Return eq. (5), L1 and pitch-first, without penalty."""
    return float(np.abs(task_error(q, position, tilt, arm)).sum())


def least_slack(
    q: np.ndarray, position: np.ndarray, tilt: np.ndarray, arm: Arm, iterations: int = 150
) -> tuple[np.ndarray, int]:
    """Return where SLSQP ends (7,) from q (7,), and how often it asked for the error (14 times for a derivative).

    It minimises the sum of slacks s (6,) with -s <= error(q) <= s, within the limits.
    """
    eye = np.eye(6)
    q = np.clip(q, arm.lower, arm.upper)
    slack = np.abs(task_error(q, position, tilt, arm))

    def room(x: np.ndarray) -> np.ndarray:
        error = task_error(x[:7], position, tilt, arm)
        return np.concatenate([x[7:] - error, x[7:] + error])

    def slope(x: np.ndarray) -> np.ndarray:
        jacobian = task_jacobian(x[:7], position, tilt, arm)
        return np.block([[-jacobian, eye], [jacobian, eye]])

    cost = np.repeat([0.0, 1.0], [7, 6])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a step that left the bounds by a rounding error is no news
        found = minimize(
            lambda x: x[7:].sum(), np.concatenate([q, slack]), jac=lambda x: cost, method="SLSQP",
            bounds=[*zip(arm.lower, arm.upper, strict=True), *[(0.0, None)] * 6],
            constraints={"type": "ineq", "fun": room, "jac": slope},
            options={"maxiter": whole_number("iterations", iterations, 1), "ftol": 1e-12},
        )  # fmt: skip
    end = found.x[:7] if np.isfinite(found.x).all() else q
    return np.clip(end, arm.lower, arm.upper), int(found.nfev + 14 * found.njev)


def swivel_family(
    positions: np.ndarray, tilts: np.ndarray, *, swivels: np.ndarray = SWIVELS, arm: Arm = ARM
) -> tuple[np.ndarray, np.ndarray]:
    """Return the configurations (n, swivels, 4, 7) [rad] that hold the targets exactly, limits left aside, and the room
    (n, swivels, 4) [rad] that each leaves to the nearest limit; negative room is a limit broken.

    positions (n, 3), tilts (n, 3); four: shoulder and wrist each in two ways. A target farther than the arm is long has
    no solution: NaN and -inf. Raises InvalidValue for an arm that is not built like the default one.
    """
    if not is_usual(as_arm(arm)):
        raise InvalidValue("arm", arm, "axes that meet in shoulder and wrist as in the default arm, for a closed form")
    positions = finite_array("positions", positions, (-1, 3))
    tilts, swivels = finite_array("tilts", tilts, positions.shape), finite_array("swivels", swivels, (-1,))
    hand = Rotation.from_euler("YXZ", tilts[:, [1, 0, 2]])
    wrist = positions - hand.apply(arm.offsets[7].copy()) - arm.offsets[0]  # from the shoulder
    distance = np.linalg.norm(wrist, axis=1)
    a, b = -arm.offsets[3, 2], -arm.offsets[4, 2]
    with np.errstate(invalid="ignore"):
        elbow = -np.arccos((distance**2 - a * a - b * b) / (2.0 * a * b))
    reached = np.isfinite(elbow) & (distance > 1e-9)
    elbow = np.where(reached, elbow, 0.0)
    at_rest = np.stack([-b * np.sin(elbow), 0.0 * elbow, -a - b * np.cos(elbow)], axis=1)  # wrist, shoulder unturned
    along = np.where(reached[:, None], wrist / np.maximum(distance, 1e-9)[:, None], [0.0, 0.0, -1.0])
    upright = _aligned(at_rest, along)

    n, m = len(positions), len(swivels)
    turn = Rotation.from_rotvec((swivels[None, :, None] * along[:, None]).reshape(-1, 3))
    shoulder = turn * upright[np.repeat(np.arange(n), m)]
    bent = Rotation.from_euler("Y", np.repeat(elbow, m)[:, None])
    rest = hand[np.repeat(np.arange(n), m)].inv() * shoulder * bent  # the wrist's turn, seen from the hand
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # two axes in line: any of their angles will do
        q_shoulder, q_wrist = shoulder.as_euler("YXZ"), -rest.as_euler("YXZ")[:, ::-1]
    found = np.empty((n * m, 4, 7))
    found[..., 3] = np.repeat(elbow, m)[:, None]
    for branch in range(4):
        found[:, branch, :3] = _other(q_shoulder) if branch & 1 else q_shoulder
        found[:, branch, 4:] = _other(q_wrist) if branch & 2 else q_wrist
    found = _within_a_turn(found, arm).reshape(n, m, 4, 7)
    room = np.minimum(found - arm.lower, arm.upper - found).min(axis=-1)
    found[~reached], room[~reached] = np.nan, -np.inf
    return found, room


def is_usual(arm: Arm) -> bool:
    """Whether `arm` has the default axes, one shoulder, one wrist, and straight links: it has a closed form then."""
    zero = [*arm.offsets[[1, 2, 5, 6]].ravel(), *arm.offsets[3:5, :2].ravel(), *(arm.axes - ARM.axes).ravel()]
    return not np.any(zero) and bool((arm.offsets[3:5, 2] < 0.0).all())


def _aligned(vectors: np.ndarray, directions: np.ndarray) -> Rotation:
    """Return the shortest turns that bring `vectors` (n, 3) into `directions` (n, 3), unit vectors."""
    unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    cross, dot = np.cross(unit, directions), (unit * directions).sum(axis=1)
    sine = np.linalg.norm(cross, axis=1, keepdims=True)
    across = np.where(sine > 1e-12, cross / np.maximum(sine, 1e-12), [0.0, 1.0, 0.0])  # y is across: both lie in x, z
    return Rotation.from_rotvec(across * np.arctan2(sine[:, 0], dot)[:, None])


def _other(angles: np.ndarray) -> np.ndarray:
    """Return the second triple of angles (n, 3) that gives the same turn."""
    return np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], axis=1)


def _within_a_turn(q: np.ndarray, arm: Arm) -> np.ndarray:
    """Return q (..., 7) shifted by whole turns to within half a turn of the middle of the limits."""
    middle = 0.5 * (arm.lower + arm.upper)
    return q - 2.0 * np.pi * np.rint((q - middle) / (2.0 * np.pi))


def lifted(position: np.ndarray, tilt: np.ndarray, arm: Arm) -> tuple[np.ndarray, float] | None:
    """Return the configuration (7,) with exact x, y and tilt and the smallest error in z, and that error [m].

    Found on the grid of LIFTS and SWIVELS, then by halving the last step of LIFTS, with ever finer swivels about the
    last one. Of several configurations the one with most room to its limits. None when there is none.
    """
    found = next(filter(None, (_most_room(position, tilt, (lift, -lift), SWIVELS, arm) for lift in LIFTS)), None)
    if found is None or found[1] == 0.0:
        return found and found[:2]
    q, lift, swivel = found
    refused, width = np.sign(lift) * (abs(lift) - LIFTS[1]), SWIVELS[FINER]
    for _ in range(HALVINGS):
        middle = 0.5 * (lift + refused)
        tried = _most_room(position, tilt, (middle,), swivel + width * np.linspace(-1.0, 1.0, len(SWIVELS)), arm)
        if tried is None:
            refused = middle
        else:
            q, lift, swivel = tried
    return q, lift


def _most_room(
    position: np.ndarray, tilt: np.ndarray, lifts: tuple[float, ...], swivels: np.ndarray, arm: Arm
) -> tuple[np.ndarray, float, float] | None:
    """Return the configuration within the limits that has most room, its lift and its swivel; None when none has."""
    shifts = np.array([[0.0, 0.0, lift] for lift in lifts])
    q, room = swivel_family(position + shifts, np.tile(tilt, (len(shifts), 1)), swivels=swivels, arm=arm)
    if room.max() < 0.0:
        return None
    side, swivel, branch = np.unravel_index(room.argmax(), room.shape)
    return q[side, swivel, branch], float(lifts[side]), float(swivels[swivel])
