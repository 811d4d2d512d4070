"""The door after it is let go: the closer shuts it, and it cannot go through the hand that is still in its way.

    I theta'' = -(closer torque + damping theta' + friction),    I = mass width^2 / 3

theta is at least where the panel's face touches the hand's pad, whose centre is at the distance rho from the hinge:

    rho sin(theta + psi) = thickness / 2 + pad radius,    psi = atan2(y, x) of the centre.
"""

import numpy as np

from tutorialbot.ik.passage_follow import Piece
from tutorialbot.ik.passage_guards import hand
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import PAD_BEHIND, PAD_RADIUS

SUBSTEPS, PATIENCE = 10, 8.0  # of the door's motion a sample; how long it may take to shut after the robot stands [s]


def touching_angle(arm: SphericalArm, door: ClosingDoor, base: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the door angles (n,) [rad] below which the panel would go into the hand: base (n, 3), q (n, 7)."""
    tip, axis = hand(arm, base, q)
    x, y = (tip - PAD_BEHIND * axis)[:, :2].T
    sine = (door.thickness / 2 + PAD_RADIUS) / np.hypot(x, y)
    angle = np.arcsin(sine.clip(-1.0, 1.0)) - np.arctan2(y, x)
    return np.where((sine < 1.0) & (np.hypot(x, y) < door.width), angle, -np.inf)


def let_go(arm: SphericalArm, door: ClosingDoor, piece: Piece) -> Piece:
    """Return `piece` with the door's angle as it follows from its own motion, and as long as the door needs to shut."""
    lowest, step = touching_angle(arm, door, piece.base, piece.q), piece.times[1] - piece.times[0]
    theta, rate = [float(piece.theta[0])], 0.0
    inertia, small = door.mass * door.width**2 / 3.0, step / SUBSTEPS
    count, most = len(piece.times), len(piece.times) + int(PATIENCE / step)
    while len(theta) < count or (theta[-1] > 0.0 and len(theta) < most):
        floor = max(0.0, float(lowest[min(len(theta), count - 1)]))
        angle = theta[-1]
        for _ in range(SUBSTEPS):
            torque = door.closer(angle) + door.hinge_damping * rate + np.sign(rate) * door.hinge_friction
            rate = rate - small * torque / inertia
            angle += small * rate
        if angle < floor:
            angle, rate = floor, min(0.0, (floor - theta[-1]) / step)
        theta.append(angle)
    more = len(theta) - count
    if not more:
        return _with(piece, np.array(theta), 0, step)
    return _with(piece, np.array(theta), more, step)


def _with(piece: Piece, theta: np.ndarray, more: int, step: float) -> Piece:
    """The same piece with door angles (n + more,); the robot stands during what is more."""

    def longer(values: np.ndarray, last: float | None = None) -> np.ndarray:
        tail = values[-1:] if last is None else np.full_like(values[-1:], last)
        return np.concatenate([values, np.repeat(tail, more, axis=0)])

    times = step * np.arange(len(theta))
    return Piece(times, longer(piece.base), longer(piece.q), longer(piece.rates, 0.0), theta, longer(piece.tip_error),
                 longer(piece.scale))  # fmt: skip
