"""Studies for the notebooks: one function a question, thin, each returning rows of plain numbers.

Inverse kinematics (paper 1, section 3): `ik_targets` draws targets, `compare` sets the methods side by side.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot import robots
from tutorialbot.errors import one_of, whole_number
from tutorialbot.ik import peers, prioritized
from tutorialbot.seeding import make_rng

POSTURE = np.array([0.0, 0.0, 0.0, 0.0, 0.6, -1.6, 0.0, 1.0, 0.0])  # base, arm: hand level before the shoulder
SHOULDER, ARM_LENGTH = np.array([0.0, -0.24, 1.04]), 0.72  # of the mobile manipulator, its base at the origin [m]
TARGETS = ("reachable", "base locked", "too high")


@dataclass(frozen=True)
class IkCase:
    """A start q0 (nv,) and a target of the hand for `model`; posture (nv,) is the robot's rest."""

    model: pin.Model
    q0: np.ndarray
    target: pin.SE3
    posture: np.ndarray


@dataclass(frozen=True)
class IkRow:
    """One method on one kind of target. Medians over the targets; motion_after: the largest of any joint of any target.

    converged, settled: shares; position_error [m], rotation_error [rad]; motion_after [rad or m] in five further
    iterations; microseconds: a whole solution's.
    """

    method: str
    targets: str
    converged: float
    settled: float
    position_error: float
    rotation_error: float
    iterations: float
    motion_after: float
    microseconds: float


def ik_targets(kind: str, count: int, seed: int) -> list[IkCase]:
    """Draw `count` targets of one kind of TARGETS, each with its own start near the posture.

    "reachable": base and arm, poses within 0.3 m and 60 degrees of the start that some configuration within the limits
    has; "base locked": arm alone, 0.8-1.2 m off the start and beyond the arm's length; "too high": base and arm, a
    metre and more above the start.
    """
    one_of("kind", kind, TARGETS)
    rng = make_rng(seed, TARGETS.index(kind))
    joints = robots.ARM if kind == "base locked" else robots.BASE + robots.ARM
    model = robots.load_pinocchio("mobile_manipulator", joints)
    posture = POSTURE[-model.nv :]
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    data, tool = model.createData(), model.getFrameId("tool")
    cases = []
    while len(cases) < whole_number("count", count):
        q0 = np.clip(posture + rng.normal(0.0, 0.15, model.nv), low, high)
        start = _tool(model, data, tool, q0)
        target = pin.SE3(pin.exp3(_in_ball(rng, np.pi / 3)) @ start.rotation, start.translation.copy())
        if kind == "reachable":
            target = _tool(model, data, tool, np.clip(q0 + rng.normal(0.0, 0.5, model.nv), low, high))
            apart = start.actInv(target)
            fits = np.linalg.norm(apart.translation) <= 0.3 and np.linalg.norm(pin.log3(apart.rotation)) <= np.pi / 3
        elif kind == "base locked":
            direction = rng.normal(size=3)
            target.translation += rng.uniform(0.8, 1.2) * direction / np.linalg.norm(direction)
            fits = np.linalg.norm(target.translation - SHOULDER) > ARM_LENGTH
        else:
            target.translation += np.append(rng.uniform(-0.5, 0.5, 2), rng.uniform(1.0, 1.5))
            fits = target.translation[2] > SHOULDER[2] + ARM_LENGTH
        if fits:
            cases.append(IkCase(model, q0, target, posture))
    return cases


def compare(seed: int, targets: int = 100, kinds: Sequence[str] = TARGETS) -> list[IkRow]:
    """Set virtual springs beside damped least squares and strict null-space priority, on the same targets."""
    whole_number("targets", targets, 1)
    rows = []
    for kind in kinds:
        cases = ik_targets(kind, targets, seed)
        for name, method in _METHODS.items():
            results, moved, seconds = [], [], []
            for case in cases:
                task = prioritized.Task("tool", case.target)
                began = time.process_time()
                results.append(method(case, case.q0, task, 100))
                seconds.append(time.process_time() - began)
                moved.append(np.abs(method(case, results[-1].q, task, 5).q - results[-1].q).max())
            rows.append(IkRow(
                method=name, targets=kind,
                converged=float(np.mean([r.converged for r in results])),
                settled=float(np.mean(np.array(moved) < prioritized.AT_REST)),
                position_error=float(np.median([r.position_error for r in results])),
                rotation_error=float(np.median([r.rotation_error for r in results])),
                iterations=float(np.median([r.iterations for r in results])),
                motion_after=float(max(moved)),
                microseconds=1e6 * float(np.median(seconds)),
            ))
    return rows


def _springs(case: IkCase, q0: np.ndarray, task: prioritized.Task, iterations: int) -> prioritized.IkResult:
    return prioritized.solve(case.model, q0, task, posture=case.posture, iterations=iterations)


def _damped(case: IkCase, q0: np.ndarray, task: prioritized.Task, iterations: int) -> prioritized.IkResult:
    return peers.damped_least_squares(case.model, q0, task, iterations=iterations)


def _strict(case: IkCase, q0: np.ndarray, task: prioritized.Task, iterations: int) -> prioritized.IkResult:
    return peers.strict_null_space(case.model, q0, task, posture=case.posture, iterations=iterations)


_METHODS = {"virtual springs": _springs, "damped least squares": _damped, "strict null space": _strict}


def _tool(model: pin.Model, data: pin.Data, tool: int, q: np.ndarray) -> pin.SE3:
    pin.forwardKinematics(model, data, q)
    return pin.updateFramePlacement(model, data, tool).copy()


def _in_ball(rng: np.random.Generator, radius: float) -> np.ndarray:
    """A point (3,), even in direction and in distance from the centre."""
    direction = rng.normal(size=3)
    return radius * rng.uniform() * direction / np.linalg.norm(direction)
