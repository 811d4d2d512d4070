"""Motion of the joints and of the base: the trapezoidal speed profile, and the kinematics of caster wheels.

A caster is a wheel of radius r whose contact point trails its steering pivot by an offset b. In the frame of the base
(x forward, y left), with the pivot at (x, y), the steering angle phi and the rolling direction h = (cos phi, sin phi),
the contact point lies at c = (x, y) - b h. Let n = (-sin phi, cos phi) be the sideways direction, (vx, vy, w) the
base's twist in its own frame, and

    u = (vx - w y, vy + w x)                    the pivot's velocity.

The fork turns over the ground at w + phi', so the wheel's centre moves with u - b (w + phi') n. A wheel that neither
skids nor slides has a centre that moves along h alone, and by r theta' for the drive rate theta':

    r theta'        =  u . h =  cos(phi) ux + sin(phi) uy
    b (w + phi')    =  u . n = -sin(phi) ux + cos(phi) uy

Both rates follow from any twist at any steering angle (the determinant is r b, never zero): this is what makes a base
on active casters omnidirectional. A caster without motors obeys the same two equations, so they turn it visibly too.
Backwards, each wheel's centre is a point of the base (at c) whose velocity is known but for w in the fork's turning:

    (vx - w c_y, vy + w c_x) = r theta' h + b phi' n

Two casters give four equations for three unknowns: least squares, and the residual is the slip that rates which do
not belong together would force on the wheels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, finite_number, positive


@dataclass(frozen=True)
class Caster:
    """One caster: its pivot (x, y) in the base's frame, the trail `offset` b and the wheel's `radius` r, all [m]."""

    x: float
    y: float
    offset: float
    radius: float

    def __post_init__(self):
        finite_number("x", self.x), finite_number("y", self.y)
        positive("offset", self.offset), positive("radius", self.radius)


def to_casters(casters: Sequence[Caster], twist: np.ndarray, steer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rates that roll every caster without slip under the base's `twist`.

    twist: (3,) vx, vy [m/s] and w [rad/s] in the base's frame; steer: (n,) phi [rad].
    Returns phi' (n,) and theta' (n,) [rad/s].
    """
    x, y, offset, radius = _columns(casters)
    twist = finite_array("twist", twist, (3,))
    steer = finite_array("steer", steer, (len(casters),))
    ux, uy = twist[0] - twist[2] * y, twist[1] + twist[2] * x
    cosine, sine = np.cos(steer), np.sin(steer)
    return (cosine * uy - sine * ux) / offset - twist[2], (cosine * ux + sine * uy) / radius


def to_twist(
    casters: Sequence[Caster], steer: np.ndarray, steer_rates: np.ndarray, drive_rates: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the twist (3,) [m/s, m/s, rad/s] in the base's frame that fits the rates best, and the slip [m/s].

    steer (n,) [rad], steer_rates (n,) and drive_rates (n,) [rad/s] of at least two casters. The slip is the length of
    the residual of the 2 n rolling equations: zero when the rates belong together.
    """
    x, y, offset, radius = _columns(casters)
    n = len(casters)
    if n < 2:
        raise InvalidValue("casters", f"{n} of them", "at least two (one alone leaves the turning unknown)")
    steer = finite_array("steer", steer, (n,))
    steer_rates = finite_array("steer_rates", steer_rates, (n,))
    drive_rates = finite_array("drive_rates", drive_rates, (n,))
    cosine, sine = np.cos(steer), np.sin(steer)
    equations = np.zeros((2 * n, 3))
    equations[:n, 0] = equations[n:, 1] = 1.0
    equations[:n, 2], equations[n:, 2] = offset * sine - y, x - offset * cosine
    along, across = radius * drive_rates, offset * steer_rates
    known = np.concatenate([along * cosine - across * sine, along * sine + across * cosine])
    twist = np.linalg.lstsq(equations, known, rcond=None)[0]
    return twist, float(np.linalg.norm(equations @ twist - known))


def limit(
    casters: Sequence[Caster], twist: np.ndarray, steer: np.ndarray, max_steer_rate: float, max_drive_rate: float
) -> np.ndarray:
    """Return `twist`, scaled down just so far that no caster exceeds its steering or driving rate [rad/s].

    The rates are linear in the twist, so one factor in [0, 1] serves all, and the direction of motion stays.
    """
    steer_rates, drive_rates = to_casters(casters, twist, steer)
    excess = max(
        np.abs(steer_rates).max() / positive("max_steer_rate", max_steer_rate),
        np.abs(drive_rates).max() / positive("max_drive_rate", max_drive_rate),
        1.0,
    )
    return np.asarray(twist, dtype=float) / excess


def trapezoid_step(
    reference: np.ndarray, velocity: np.ndarray, goal: np.ndarray, vmax: np.ndarray, amax: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Advance the outer loop of paper 1, Fig. 4 by one period: speed up, cruise, brake, each joint for itself.

    All arrays (n,) [rad, rad/s, rad/s^2, or the same in m], amax > 0; dt > 0 [s]. Returns reference' and velocity'
    with reference' = reference + dt velocity'. It is made for a tight loop, so it checks nothing.

    With a = amax dt the largest change of speed in one period, a joint that goes on at v and brakes as hard as it may
    covers dt (v + (v - a) + (v - 2 a) + ...), with m terms while (m - 1) a <= v < m a. The fastest v which that brings
    to rest just at the distance e is

        m = floor(1/2 + sqrt(1/4 + 2 e / (a dt))),    v = e / (m dt) + a (m - 1) / 2

    so from rest the joint never passes its goal, not even by a fraction of a period, and ends on it exactly. Only when
    a new goal comes too late to brake, it must pass and return.
    """
    change = amax * dt
    ahead = goal - reference
    z = np.abs(ahead) * (2.0 / dt) / change
    m = np.floor(np.sqrt(z + 0.25) + 0.5)
    speed = np.copysign(np.minimum((z / m + m - 1.0) * (0.5 * change), vmax), ahead)
    velocity = np.minimum(np.maximum(speed, velocity - change), velocity + change)
    return reference + dt * velocity, velocity


def _columns(casters: Sequence[Caster]) -> np.ndarray:
    """Pivots, offsets and radii as rows of a (4, n) array [m]; raises InvalidType when `casters` are none."""
    if not isinstance(casters, list | tuple) or not casters or not all(isinstance(c, Caster) for c in casters):
        raise InvalidType("casters", casters, "a list of Caster")
    return np.array([(c.x, c.y, c.offset, c.radius) for c in casters]).T
