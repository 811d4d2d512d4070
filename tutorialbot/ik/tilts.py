"""What the "inclination" of paper 2, eq. (4), may mean: five readings of the tip's tilt, and the error in each.

The paper turns a unit vector, states a target as roll, pitch, yaw (Table 1), and does not say how these compose. A
target is (roll, pitch, yaw) [rad] in every reading; what is compared differs.

- "pitch-first", R = Ry(pitch) Rx(roll) Rz(yaw): regular at the paper's pitch of -90 degrees. The default.
- "zyx", R = Rz(yaw) Ry(pitch) Rx(roll): the usual one, and singular exactly at that pitch.
- "geodesic": one angle, that of the turn which is left.
- "two vectors": where the thumb and the forearm's axis point, six numbers.
- "one vector": where the hand points, three numbers; how it is rolled about that direction stays free.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tutorialbot.ik.quaternions import product

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Reading:
    """tilt: quaternions (4, ...) -> (k, ...); error: found (k, ...), wanted (k, ...) -> difference (m, ...);
    order: the axes about which a target turns, one after the other, each turned by those before it.
    """

    tilt: Callable[[np.ndarray], np.ndarray]
    error: Callable[[np.ndarray, np.ndarray], np.ndarray]
    order: str = "yxz"

    def wanted(self, tilt: np.ndarray) -> np.ndarray:
        """Return what a target tilt (..., 3) [rad] is in this reading, (k, ...)."""
        return self.tilt(self.quaternion(tilt))

    def quaternion(self, tilt: np.ndarray) -> np.ndarray:
        """Return the target's orientation as a quaternion (4, ...), w first, for tilt (..., 3) = (roll, pitch, yaw)."""
        cos, sin, turned = np.cos(0.5 * tilt), np.sin(0.5 * tilt), (1.0, 0.0, 0.0, 0.0)
        for axis in self.order:
            i = "xyz".index(axis)
            turned = product(turned, (cos[..., i], *(sin[..., i] if axis == other else 0.0 for other in "xyz")))
        return np.array(turned)


def pitch_first(turned: np.ndarray) -> np.ndarray:
    """Return (roll, pitch, yaw) (3, ...) [rad] of quaternions (4, ...) with R = Ry(pitch) Rx(roll) Rz(yaw)."""
    w, x, y, z = turned
    roll = np.arcsin(np.clip(2.0 * (w * x - y * z), -1.0, 1.0))
    xx = x * x
    return np.stack([
        roll,
        np.arctan2(x * z + w * y, 0.5 - xx - y * y),
        np.arctan2(x * y + w * z, 0.5 - xx - z * z),
    ])  # fmt: skip


def zyx(turned: np.ndarray) -> np.ndarray:
    """Return (roll, pitch, yaw) (3, ...) [rad] of quaternions (4, ...) with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    w, x, y, z = turned
    yy = y * y
    return np.stack([
        np.arctan2(w * x + y * z, 0.5 - x * x - yy),
        np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)),
        np.arctan2(w * z + x * y, 0.5 - yy - z * z),
    ])  # fmt: skip


def forward(turned: np.ndarray) -> np.ndarray:
    """Return where the thumb, x at q = 0, points (3, ...)."""
    w, x, y, z = turned
    return np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)])


def downward(turned: np.ndarray) -> np.ndarray:
    """Return where the hand, -z at q = 0, points (3, ...)."""
    w, x, y, z = turned
    return np.stack([-2.0 * (x * z + w * y), 2.0 * (w * x - y * z), 2.0 * (x * x + y * y) - 1.0])


def two_vectors(turned: np.ndarray) -> np.ndarray:
    """Return both directions (6, ...)."""
    return np.concatenate([forward(turned), downward(turned)])


def turned_by(angle: np.ndarray) -> np.ndarray:
    """Return an angle [rad] within half a turn of zero."""
    return angle - TURN * np.rint(angle / TURN)


def _angles(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    return turned_by(found - wanted)


def _geodesic(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Angle (1, ...) between quaternions, from the chord: exact also where they all but agree."""
    chord = np.minimum(np.square(found - wanted).sum(axis=0), np.square(found + wanted).sum(axis=0))
    return 4.0 * np.arcsin(np.minimum(0.5 * np.sqrt(chord), 1.0))[None]


READINGS = {
    "pitch-first": Reading(pitch_first, _angles),
    "zyx": Reading(zyx, _angles, "zyx"),
    "geodesic": Reading(lambda turned: turned, _geodesic),
    "two vectors": Reading(two_vectors, np.subtract),
    "one vector": Reading(downward, np.subtract),
}
