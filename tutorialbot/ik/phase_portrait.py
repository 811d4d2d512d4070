"""When eqs (1)-(3) pass the stretched arm, when they reflect and when they stall: the plane (q4, s).

s [m] is the place on the path, counted from where the path is nearest to the edge of the workspace. With r'(s) the
slope of the distance from the shoulder that the path asks for, and sigma = 1,

    ds/dt = b(q4) v,        dq4/dt = -(r / (L1 L2)) (b / sin q4) r'(s) v

On a straight line through the edge r' > 0 there: q4 crosses zero at a finite rate, b changes its sign and s runs back.
On an arc of radius rho inside it r' = 0 there, and (0, 0) is a saddle with the eigenvalues

    +-2^n v sqrt(c (1 / L1 + 1 / L2)),      c = 1 / rho - 1 / (L1 + L2)

whose stable direction is the path that touches the edge: it takes forever. Paths inside pass, paths outside reflect.
"""

import math
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import finite_array, finite_number, positive, step_count, whole_number
from tutorialbot.ik.singularity_consistent import SphericalArm, check_arm, time_scale
from tutorialbot.ik.stretch_paths import StretchPath, arc, classify, first_elbow, radial

MARGINS = (0.005, 0.0, -0.005)  # [m] inside the edge: passes, stalls, reflects
MOST_POINTS = 1000  # to a side of the plane
MOST_PATIENCE = 1000.0  # of a path's own duration


@dataclass(frozen=True)
class PhasePath:
    """A path's own line in the plane: times (k,) [s], q4 (k,) [rad], s (k,) [m]; what it does, as `classify` says."""

    name: str
    outcome: str
    times: np.ndarray
    q4: np.ndarray
    s: np.ndarray


@dataclass(frozen=True)
class PhasePortrait:
    """q4 (k,) [rad], s (m,) [m]; rates (m, k): q4_rate [rad/s], s_rate [m/s]; saddle: eigenvalue > 0 [1/s], nan on a
    straight line; direction: dq4/ds [rad/m] of the saddle's unstable line, the stable one has the opposite sign.
    """

    q4: np.ndarray
    s: np.ndarray
    q4_rate: np.ndarray
    s_rate: np.ndarray
    saddle: float
    direction: float
    paths: tuple[PhasePath, ...]


def rates(arm: SphericalArm, path: StretchPath, q4: float, s: float, speed: float, n: int) -> tuple[float, float]:
    """Return dq4/dt [rad/s] and ds/dt [m/s] at q4 and at s, counted from the path's beginning."""
    along, across, u, v = path.plane(s)
    slope = (along * u + across * v) / math.hypot(along, across)
    b, b_over_sine = time_scale(q4, n)
    return -arm.distance_at(q4) / (arm.upper * arm.lower) * b_over_sine * slope * speed, b * speed


def eigenvalue(arm: SphericalArm, radius: float, speed: float = 0.1, n: int = 2) -> float:
    """Return the saddle's eigenvalue [1/s] for an arc of `radius` [m] that touches the edge from inside."""
    check_arm(arm)
    c = 1.0 / positive("radius", radius) - 1.0 / arm.reach
    bend = max(0.0, c) * (1.0 / arm.upper + 1.0 / arm.lower)
    return time_scale(0.0, n)[1] * positive("speed", speed) * math.sqrt(bend)


def portrait(
    arm: SphericalArm, *, n: int = 2, speed: float = 0.1, radius: float = 0.45, margins: tuple = MARGINS,
    q4_range: float = 0.7, s_range: float = 0.15, points: int = 25,
) -> PhasePortrait:  # fmt: skip
    """Return the plane for arcs of `radius` [m] with these margins [m] inside the edge, around the touching one.

    speed [m/s]; q4_range [rad], s_range [m]: to both sides of zero; points: to a side. Raises InvalidType or
    InvalidValue that names the argument.
    """
    check_arm(arm), _check_plane(speed, q4_range, points)
    finite_number("s_range", s_range, 0.0, math.pi * positive("radius", radius), above=True)
    margins = finite_array("margins", margins, (-1,)).tolist()
    arcs = [arc(arm, margin, radius, s_range) for margin in margins]
    return _portrait(arm, arc(arm, 0.0, radius, s_range), arcs, n, speed, (q4_range, s_range, points), radius)


def line_portrait(
    arm: SphericalArm, *, n: int = 2, speed: float = 0.1, q4_range: float = 0.7, s_range: float = 0.05, points: int = 25
) -> PhasePortrait:
    """Return the plane for the straight line out of the workspace: no saddle, every path reflects.

    Arguments and errors as in `portrait`; s_range is less than the arm's reach.
    """
    check_arm(arm), _check_plane(speed, q4_range, points)
    finite_number("s_range", s_range, 0.0, math.nextafter(arm.reach, 0.0), above=True)
    path = radial(arm, beyond=s_range, run_up=s_range)
    return _portrait(arm, path, [path], n, speed, (q4_range, s_range, points), math.inf)


def _check_plane(speed: float, q4_range: float, points: int) -> None:
    positive("speed", speed), whole_number("points", points, 2, MOST_POINTS)
    finite_number("q4_range", q4_range, 0.0, math.nextafter(math.pi, 0.0), above=True)


def _portrait(arm, middle, paths, n, speed, size, radius) -> PhasePortrait:
    q4_range, s_range, points = size
    q4, s = np.linspace(-q4_range, q4_range, points), np.linspace(-s_range, s_range, points)
    field = np.array([[rates(arm, middle, a, b + s_range, speed, n) for a in q4.tolist()] for b in s.tolist()])
    saddle = eigenvalue(arm, radius, speed, n) if math.isfinite(radius) else math.nan
    lines = tuple(trace(arm, path, speed=speed, n=n, zero=s_range) for path in paths)
    direction = saddle / (time_scale(0.0, n)[1] * speed)
    return PhasePortrait(q4, s, field[..., 0], field[..., 1], saddle, direction, lines)


def trace(
    arm: SphericalArm, path: StretchPath, *, speed: float = 0.1, n: int = 2, zero: float = 0.0, dt: float = 2e-3,
    patience: float = 2.5,
) -> PhasePath:  # fmt: skip
    """Return the path's line in the plane, by Runge-Kutta steps of dt [s], until it leaves the path or time is up.

    speed [m/s]; patience: how many times the path's own duration it may take; zero [m]: where s is counted from. Raises
    InvalidType or InvalidValue that names the argument, also for more than a million steps.
    """
    here, rows = np.array([first_elbow(arm, path), 0.0]), []
    positive("speed", speed), positive("dt", dt), finite_number("zero", zero)
    finite_number("patience", patience, 0.0, MOST_PATIENCE, above=True)
    count = round(step_count(patience * path.length / speed, speed, dt))

    def slope(x: np.ndarray) -> np.ndarray:
        return np.array(rates(arm, path, float(x[0]), float(x[1]), speed, n))

    for step in range(count):
        rows.append((step * dt, here[0], here[1] - zero))
        one = slope(here)
        two = slope(here + 0.5 * dt * one)
        three = slope(here + 0.5 * dt * two)
        here = here + dt / 6.0 * (one + 2.0 * two + 2.0 * three + slope(here + dt * three))
        if not 0.0 <= here[1] <= path.length:
            break
    times, angles, places = np.array(rows).T
    return PhasePath(path.name, classify(arm, path), times, angles, places)
