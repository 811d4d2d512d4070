"""The search space of paper 1, section 4: five numbers in [-1, 1] name a direction in which the hand may move.

Six dimensions of motion less the one along the free path leave five. (c1, c2) name a direction of translation, (c3, c4)
an axis of rotation, and c5 the ratio of both: -1 translation alone, +1 rotation alone.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tutorialbot.errors import InvalidValue, finite_array, finite_number, one_of, positive

FRAMES = ("world", "tool")


def to_sphere(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Map a, b (...,) in [-1, 1] to unit vectors (..., 3), equal areas to equal areas.

    Archimedes' cylinder: `a` is the azimuth a*pi, `b` the height, so that uniform numbers cover the sphere uniformly.
    Paper 1 says "a point in the unit ball"; we read its surface, for a point near the centre would hardly move and
    never collide.
    """
    azimuth, height = np.pi * np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    radius = np.sqrt(np.maximum(0.0, 1.0 - height**2))
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=-1)


def from_sphere(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse of `to_sphere`: vectors (..., 3) of any length to a, b (...,) in [-1, 1]; zero gives (0, 0)."""
    v = np.asarray(v, dtype=float)
    length = np.linalg.norm(v, axis=-1)
    height = np.divide(v[..., 2], length, out=np.zeros_like(length), where=length > 0.0)
    return np.arctan2(v[..., 1], v[..., 0]) / np.pi, np.clip(height, -1.0, 1.0)


@dataclass(frozen=True)
class SearchSpace:
    """How far a direction reaches: `reach` w [m] of translation, `rotation_max` [rad], and in which frame it is meant.

    Paper 1 fixes w = 0.15 m and 180 degrees and does not name the frame. frame="world" keeps a direction while the hand
    turns; "tool" turns with the hand, so that pulling an opening door stays one and the same direction.
    """

    reach: float = 0.15
    rotation_max: float = np.pi
    frame: str = "world"

    def __post_init__(self):
        positive("reach", self.reach)
        finite_number("rotation_max", self.rotation_max, 0.0, np.pi, above=True)
        one_of("frame", self.frame, FRAMES)

    def motion(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return translation (3,) [m] and rotation vector (3,) [rad], in `frame`, of the point c (5,) of the cube."""
        c = finite_array("c", c, (5,))
        if np.abs(c).max() > 1.0 + 1e-9:
            raise InvalidValue("c", c, "five numbers in [-1, 1]")
        share = (1.0 + c[4]) / 2.0
        return (1.0 - share) * self.reach * to_sphere(c[0], c[1]), share * self.rotation_max * to_sphere(c[2], c[3])

    def point(self, translation: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Return the point c (5,) whose motion is proportional to the given one: inverse of `motion`, up to length."""
        forth = np.linalg.norm(translation) / self.reach
        turn = np.linalg.norm(rotation) / self.rotation_max
        share = turn / (forth + turn) if forth + turn > 0.0 else 0.0
        return np.array([*from_sphere(translation), *from_sphere(rotation), 2.0 * share - 1.0])

    def goal(self, start: pin.SE3, c: np.ndarray) -> pin.SE3:
        """Return the pose that the direction c (5,) leads to from `start`."""
        translation, rotation = self.motion(c)
        turn = pin.exp3(rotation)
        if self.frame == "tool":
            return start * pin.SE3(turn, translation)
        return pin.SE3(turn @ start.rotation, start.translation + translation)

    def moved(self, start: pin.SE3, end: pin.SE3) -> tuple[np.ndarray, np.ndarray]:
        """Return translation and rotation vector, in `frame`, that lead from `start` to `end`."""
        if self.frame == "tool":
            step = start.actInv(end)
            return step.translation.copy(), pin.log3(step.rotation)
        return end.translation - start.translation, pin.log3(end.rotation @ start.rotation.T)


def twist_features(c: np.ndarray) -> np.ndarray:
    """Map points (n, 5) to what they do: (n, 6) = [(1 - s) u, s v], s = (1 + c5) / 2, on which the surrogate is smooth.

    Where s is near 0 the axis of rotation does not matter, and the azimuth's seam at +-1 is no seam: both are lost in
    c.
    """
    c = np.atleast_2d(np.asarray(c, dtype=float))
    share = ((1.0 + c[:, 4]) / 2.0)[:, None]
    return np.hstack([(1.0 - share) * to_sphere(c[:, 0], c[:, 1]), share * to_sphere(c[:, 2], c[:, 3])])
