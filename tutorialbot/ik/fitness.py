"""Eq. (5) of paper 2, and what a solution of the inverse kinematics is, whoever found it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from tutorialbot.errors import InvalidType, finite_array, finite_number, one_of
from tutorialbot.ik.arm7 import ARM, LIMITS, Arm, components_first, configurations, forward_kinematics_scalar, reach
from tutorialbot.ik.tilts import READINGS, Reading, turned_by

NEAR_POSITION, NEAR_TILT = 1e-3, 1e-2  # converged: every component below [m], [rad]
PENALTY = 100.0
AT_LIMIT = 1e-6  # marginal value from which a limit counts as binding
NEARBY = 0.05  # how far `binding_limits` looks around [rad]
NORMS = ("L1", "L2")

Objective = Callable[[np.ndarray], np.ndarray]


def fitness(
    q: np.ndarray, position: np.ndarray, tilt: np.ndarray, *, norm: str = "L1", reading: str = "pitch-first",
    weight: float = 1.0, penalty: float = PENALTY, arm: Arm = ARM,
) -> np.ndarray:
    """Return eq. (5) of paper 2 (...) for configurations q (..., 7) [rad]; the smaller, the better.

    position (3,) [m] and tilt (3,) [rad] = (roll, pitch, yaw) are the target's. Metres and radians are added up as they
    are: `weight` multiplies the tilt (1 in the paper). The bars are sums of absolutes ("L1") or lengths ("L2"); the
    `penalty` comes once, however many joints are outside their limits. Raises InvalidType or InvalidValue on misuse.
    """
    position, tilt = target(position, tilt)
    arm = as_arm(arm)
    return objective(position, tilt, norm=norm, reading=reading, weight=weight, penalty=penalty, arm=arm)(
        configurations("q", q)
    )


def objective(
    position: np.ndarray, tilt: np.ndarray, *, norm: str = "L1", reading: str = "pitch-first", weight: float = 1.0,
    penalty: float = PENALTY, arm: Arm = ARM,
) -> Objective:
    """Return eq. (5) as a function of q (..., 7) alone, for many calls: what it is given then is not checked.

    position and tilt (..., 3) broadcast against q: (targets, 1, 3) with q (targets, n, 7) is many problems at once.
    """
    one_of("norm", norm, NORMS)
    weight, penalty = finite_number("weight", weight, 0.0), finite_number("penalty", penalty, 0.0)
    read = READINGS[one_of("reading", reading, READINGS)]
    wanted_tip, wanted_tilt = np.moveaxis(position, -1, 0), read.wanted(tilt)
    size = _absolute if norm == "L1" else _length

    def value(q: np.ndarray) -> np.ndarray:
        joints = components_first(q)
        tip, turned = reach(joints, arm)
        tilted = read.error(read.tilt(turned), _beside(wanted_tilt, q))
        total = size(tip - _beside(wanted_tip, q)) + weight * size(tilted)
        return total + penalty * ~arm.holds(joints)

    return value


def _beside(wanted: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return (k, ...) with axes of length 1 put in, so that it broadcasts against (k, *q.shape[:-1])."""
    return wanted.reshape(len(wanted), *(1,) * (q.ndim - wanted.ndim), *wanted.shape[1:])


def _absolute(error: np.ndarray) -> np.ndarray:
    return np.abs(error).sum(axis=0)


def _length(error: np.ndarray) -> np.ndarray:
    return np.sqrt(np.square(error).sum(axis=0))


def fitness_scalar(
    q: Sequence[float], position: Sequence[float], tilt: Sequence[float], *, weight: float = 1.0,
    penalty: float = PENALTY, arm: Arm = ARM,
) -> float:
    """Return eq. (5) for one configuration q (7,), pitch-first and L1, in plain Python; it checks nothing."""
    tip, found = forward_kinematics_scalar(q, arm=arm)
    total = sum(abs(x - g) for x, g in zip(tip, position, strict=True))
    total += weight * sum(abs(math.remainder(a - g, 2.0 * math.pi)) for a, g in zip(found, tilt, strict=True))
    inside = all(low <= x <= high for low, x, high in zip(arm.lower, q, arm.upper, strict=True))
    return total if inside else total + penalty


def target(position: np.ndarray, tilt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a target's position and tilt as float arrays (3,), or raise InvalidType or InvalidValue."""
    return finite_array("position", position, (3,)), finite_array("tilt", tilt, (3,))


@dataclass(frozen=True)
class History:
    """The way to a solution, a row for each generation, the first included.

    evaluations (g,): of eq. (5) so far; fitness (g,): the best value so far; median (g,): of the population;
    q (g, 7): the best configuration so far.
    """

    evaluations: np.ndarray
    fitness: np.ndarray
    median: np.ndarray
    q: np.ndarray


@dataclass(frozen=True)
class GeneticSolution:
    """A configuration and how well it serves the target. A target out of reach is a result too, converged False.

    q (7,) [rad]; position_error (3,) [m] and tilt_error (3,) [rad] = (roll, pitch, yaw), pitch-first whatever was
    minimised: reached minus asked; within_limits; evaluations of eq. (5); history. residual: eq. (5) at weight 1
    without penalty; converged: within the limits, every component below 1 mm and 0.01 rad; binding: names of the limits
    that keep the residual up, none when converged; interrupted: Ctrl-C ended the search, this is the best so far.
    """

    q: np.ndarray
    position_error: np.ndarray
    tilt_error: np.ndarray
    within_limits: bool
    evaluations: int
    history: History
    residual: float
    converged: bool
    binding: tuple[str, ...] = ()
    interrupted: bool = False


def solution(
    q: np.ndarray, position: np.ndarray, tilt: np.ndarray, *, arm: Arm = ARM, reading: str = "pitch-first",
    evaluations: int = 0, history: History | None = None, interrupted: bool = False,
) -> GeneticSolution:
    """Measure the configuration q (7,) against the target and return it as a `GeneticSolution`."""
    read = READINGS[reading]
    error = task_error(q, position, _pitch_first_target(tilt, read), arm)
    residual, within = float(np.abs(error).sum()), bool(arm.within(q))
    converged = bool(within and np.abs(error[:3]).max() <= NEAR_POSITION and np.abs(error[3:]).max() <= NEAR_TILT)
    if history is None:
        history = History(np.array([evaluations]), np.array([residual]), np.array([residual]), q[None].copy())
    binding = () if converged else binding_limits(q, position, _pitch_first_target(tilt, read), arm)
    return GeneticSolution(
        q, error[:3], error[3:], within, int(evaluations), history, residual, converged, binding, interrupted
    )


def _pitch_first_target(tilt: np.ndarray, read: Reading) -> np.ndarray:
    return READINGS["pitch-first"].tilt(read.quaternion(tilt))


def task_error(q: np.ndarray, position: np.ndarray, tilt: np.ndarray, arm: Arm) -> np.ndarray:
    """Return reached minus asked (..., 6): position [m], then tilt [rad], pitch-first."""
    tip, turned = reach(components_first(q), arm)
    found = READINGS["pitch-first"].tilt(turned)
    return np.concatenate([np.moveaxis(tip, 0, -1) - position, turned_by(np.moveaxis(found, 0, -1) - tilt)], axis=-1)


def task_jacobian(q: np.ndarray, position: np.ndarray, tilt: np.ndarray, arm: Arm, step: float = 1e-6) -> np.ndarray:
    """Return how `task_error` changes with q (7,): (6, 7), by central differences in one batched call."""
    shifts = step * np.concatenate([np.eye(7), -np.eye(7)])
    errors = task_error(q + shifts, position, tilt, arm)
    return turned_by(errors[:7] - errors[7:]).T / (2.0 * step)


def binding_limits(q: np.ndarray, position: np.ndarray, tilt: np.ndarray, arm: Arm) -> tuple[str, ...]:
    """Return the names of the limits that keep eq. (5) up at q (7,): moved outward by a hair, they would lower it.

    These are the limits with a price (a dual variable) in the linear program min |e + J dq|_1 around q.
    """
    inside = np.clip(q, arm.lower, arm.upper)
    error = task_error(inside, position, tilt, arm)
    jacobian, eye = task_jacobian(inside, position, tilt, arm), np.eye(6)
    low, high = np.maximum(arm.lower - inside, -NEARBY), np.minimum(arm.upper - inside, NEARBY)
    found = linprog(
        np.repeat([0.0, 1.0], [7, 6]), A_ub=np.block([[jacobian, -eye], [-jacobian, -eye]]),
        b_ub=np.concatenate([-error, error]), bounds=[*zip(low, high, strict=True), *[(0.0, None)] * 6], method="highs",
    )  # fmt: skip
    if found.status != 0:
        return ()
    below = (found.lower.marginals[:7] > AT_LIMIT) & (low > -NEARBY)
    above = (found.upper.marginals[:7] < -AT_LIMIT) & (high < NEARBY)
    return tuple(
        LIMITS[i][side] for i in range(7) for side, binds in ((0, below[i]), (1, above[i])) if binds
    )  # fmt: skip


def as_arm(arm: Arm) -> Arm:
    """Return `arm`, or raise InvalidType."""
    if not isinstance(arm, Arm):
        raise InvalidType("arm", arm, "an Arm")
    return arm
