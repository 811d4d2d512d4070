"""Follow a path that stretches the arm out, with eqs (1)-(3) or a peer, and say what became of it.

A method that paces itself (eqs (1)-(3)) moves along the path by ds = |b| v dt, outward or, once the elbow has flipped,
back; it is asked for

    twist = sigma v path'(s) + sign(b) k (path(s) - tip),    sigma: the branch at the start

so that, times b, its feedback is |b| k. With b k instead, what corrects on one branch drives away on the other. Other
methods are asked for v path'(v t) + k (path(v t) - tip) at every instant t.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidType, finite_number, one_of, positive, step_count
from tutorialbot.ik import singular_peers as peers
from tutorialbot.ik.singularity_consistent import SphericalArm, check_arm
from tutorialbot.ik.stretch_paths import StretchPath, check_path, classify, five_paths, references, start
from tutorialbot.pose import twist_between

FEEDBACKS = ("|b|", "b")
MOST_PATIENCE = 1000.0  # of a path's own duration


@dataclass(frozen=True)
class Solver:
    """rates: arm, q (7,), twist (6,) -> qdot (7,) and the share b of the twist that it means; paced: b is not 1."""

    rates: Callable[[SphericalArm, np.ndarray, np.ndarray], tuple[np.ndarray, float]]
    paced: bool = False


def singularity_consistent(n: int = 2, scaling: str = "sine", wrist: str = "B") -> Solver:
    """Return eqs (1)-(3) as a `Solver`."""

    def rates(arm: SphericalArm, q: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, float]:
        found = arm.joint_velocity(q, twist, n, scaling=scaling, wrist=wrist)
        return found.qdot, found.scale

    return Solver(rates, paced=True)


def in_time(function: Callable, **options: float) -> Solver:
    """Return one of `singular_peers` as a `Solver`."""
    solve = partial(function, **options)
    return Solver(lambda arm, q, twist: (solve(arm, q, twist), 1.0))


def solvers() -> Mapping[str, Solver]:
    """Return all methods that are compared, by name."""
    return {
        "pseudo-inverse": in_time(peers.pseudo_inverse),
        "damped 0.02": in_time(peers.damped_least_squares, damping=0.02),
        "damped 0.1": in_time(peers.damped_least_squares, damping=0.1),
        "adaptive": in_time(peers.adaptive_least_squares),
        "rate-limited QP": in_time(peers.rate_limited_program),
        "singularity-consistent n=2": singularity_consistent(2),
        "singularity-consistent n=3": singularity_consistent(3),
    }


@dataclass(frozen=True)
class Followed:
    """A path followed, an entry a step.

    times (n,) [s]; s (n,): the reference's place on the path [m]; q (n, 7) [rad]; qdot (n, 7) [rad/s]; scale (n,): b;
    tip (n, 3) [m]; deviation (n,) [m]: from the tip to the nearest place on the path; behind (n,) [m]: from the tip to
    where it ought to be at that time; direction_error (n,) [rad]: between the tip's velocity and b times the one asked
    for, where both are at least a tenth of the path's speed. outcome: of a method that paces itself "to the end",
    "turned back" (at the beginning again), "stalled" (when time was up) or "joint limit"; of the others "in time".
    arrived: whether the tip ended within 1 mm of where the reference ends.
    """

    times: np.ndarray
    s: np.ndarray
    q: np.ndarray
    qdot: np.ndarray
    scale: np.ndarray
    tip: np.ndarray
    deviation: np.ndarray
    behind: np.ndarray
    direction_error: np.ndarray
    outcome: str
    arrived: bool

    @property
    def peak_rate(self) -> float:
        """Greatest |qdot_i| [rad/s]."""
        return float(np.abs(self.qdot).max())

    @property
    def flipped(self) -> bool:
        """Whether the elbow ended on the other side."""
        return bool(self.q[-1, 3] * self.q[0, 3] < 0.0)


def follow(
    arm: SphericalArm, path: StretchPath, solver: Solver, *, speed: float = 0.1, gain: float = 10.0, dt: float = 2e-3,
    patience: float = 2.5, feedback: str = "|b|", q0: np.ndarray | None = None,
) -> Followed:  # fmt: skip
    """Move the tip along `path` at `speed` [m/s] from q0 (7,), by default `start`, and record every step of `dt` [s].

    gain [1/s] of the feedback; patience: how many times the path's own duration a solver that paces itself may take;
    feedback="b" is the mistake that drives the tip away once the elbow has flipped. Joint rates are held for a step.
    Raises InvalidType or InvalidValue that names the argument, also for more than a million steps.
    """
    one_of("feedback", feedback, FEEDBACKS), finite_number("gain", gain, 0.0), check_arm(arm), check_path(path)
    if not isinstance(solver, Solver):
        raise InvalidType("solver", solver, "a Solver")
    positive("speed", speed), finite_number("patience", patience, 0.0, MOST_PATIENCE, above=True)
    step_count((patience if solver.paced else 1.0) * duration(path, speed), speed, positive("dt", dt))
    q = np.array(arm.checked(start(arm, path) if q0 is None else q0))
    tip, rotation = references(arm, path, q)
    if solver.paced:
        rows, outcome = _paced(arm, path, solver, q, (tip, rotation), (speed, gain, dt), patience, feedback)
    else:
        rows, outcome = _in_time(arm, path, solver, q, (tip, rotation), (speed, gain, dt)), "in time"
    return _record(arm, path, tip, rows, speed, outcome)


def _paced(arm, path, solver, q, reference, pace, patience, feedback) -> tuple[list, str]:
    (tip, rotation), (speed, gain, dt), s, rows = reference, pace, 0.0, []
    onward = math.copysign(1.0, q[3])  # sigma; the other way once a path that turns within reach has turned
    turns = path.returns and classify(arm, path) == "passes"
    for step in range(round(patience * duration(path, speed) / dt)):
        if np.abs(q).max() > min(arm.limits) and (np.abs(q) > arm.limits).any():
            return rows, "joint limit"
        place, direction = tip(s)
        back = _error(arm, q, place, rotation) * (gain * (np.sign(q[3]) if feedback == "|b|" else 1.0))
        back[:3] += onward * speed * direction
        qdot, b = solver.rates(arm, q, back)
        rows.append((step * dt, s, q, qdot, b, back))
        q, s = q + dt * qdot, s + onward * b * speed * dt
        if s >= path.length and turns:
            onward, turns = -onward, False
        if s >= path.length and not path.returns:
            return rows, "to the end"
        if s < 0.0:
            return rows, "turned back"
    return rows, "stalled"


def _in_time(arm, path, solver, q, reference, pace) -> list:
    (tip, rotation), (speed, gain, dt), rows = reference, pace, []
    for step in range(round(duration(path, speed) / dt) + 1):
        s, heading = place_in_time(path, speed * step * dt)
        place, direction = tip(s)
        twist = gain * _error(arm, q, place, rotation)
        twist[:3] += heading * speed * direction
        qdot, b = solver.rates(arm, q, twist)
        rows.append((step * dt, s, q, qdot, b, twist))
        q = q + dt * qdot
    return rows


def duration(path: StretchPath, speed: float) -> float:
    """Return how long [s] the path takes at `speed` [m/s], there and back if it returns."""
    return path.length / speed * (2.0 if path.returns else 1.0)


def place_in_time(path: StretchPath, gone: float) -> tuple[float, float]:
    """Return s [m] after so many metres, and the heading there, 1 or, on the way back, -1; 0 after the end."""
    if gone < path.length:
        return gone, 1.0
    if not path.returns or gone >= 2.0 * path.length:
        return (0.0 if path.returns else path.length), 0.0
    return 2.0 * path.length - gone, -1.0


def _error(arm: SphericalArm, q: np.ndarray, place: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    return twist_between(arm.forward(q), pin.SE3(rotation, place))


def _record(arm: SphericalArm, path: StretchPath, tip, rows: list, speed: float, outcome: str) -> Followed:
    times, s, q, qdot, scale, twists = (np.array(column) for column in zip(*rows, strict=True))
    places = np.array([arm.forward(one).translation for one in q])
    ought = np.array([tip(place_in_time(path, speed * t)[0])[0] for t in times])
    deviation = np.array([_nearest(tip, path.length, at, place) for at, place in zip(s, places, strict=True)])
    moved = np.array([(arm.jacobian(one) @ rate)[:3] for one, rate in zip(q, qdot, strict=True)])
    apart = np.linalg.norm(places[-1] - tip(0.0 if path.returns else path.length)[0])
    return Followed(
        times, s, q, qdot, scale, places, deviation, np.linalg.norm(places - ought, axis=1),
        _angles(moved, scale[:, None] * twists[:, :3], 0.1 * speed), outcome, bool(apart < 1e-3),
    )  # fmt: skip


def _nearest(tip, length: float, s: float, place: np.ndarray) -> float:
    """Return the distance [m] of a place from the path, looked for near s."""
    for _ in range(4):
        on_path, direction = tip(s)
        s = min(max(s + float(direction @ (place - on_path)), 0.0), length)
    return float(np.linalg.norm(place - tip(s)[0]))


def _angles(a: np.ndarray, b: np.ndarray, least: float) -> np.ndarray:
    """Return the angles (n,) [rad] between velocities (n, 3), zero where one of them is slower than `least` [m/s]."""
    sine, cosine = np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1)
    slow = np.minimum(np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)) < least
    return np.where(slow, 0.0, np.arctan2(sine, cosine))


def table(arm: SphericalArm | None = None, *, speed: float = 0.1, dt: float = 2e-3) -> Iterator[dict]:
    """Yield a row for each of the five paths and each method: what it costs near the stretched arm.

    peak_rate [rad/s], direction_error [deg], deviation [mm] from the path, behind [mm] its time, seconds [s] taken and
    asked for, outcome, arrived, flipped.
    """
    arm = SphericalArm() if arm is None else arm
    for path in five_paths(arm):
        for name, solver in solvers().items():
            found = follow(arm, path, solver, speed=speed, dt=dt)
            yield {
                "path": path.name, "predicted": classify(arm, path), "method": name,
                "peak_rate": found.peak_rate, "direction_error": math.degrees(found.direction_error.max()),
                "deviation": 1e3 * found.deviation.max(), "behind": 1e3 * found.behind.max(),
                "seconds": float(found.times[-1]), "nominal_seconds": duration(path, speed),
                "outcome": found.outcome, "arrived": found.arrived, "flipped": found.flipped,
            }  # fmt: skip
