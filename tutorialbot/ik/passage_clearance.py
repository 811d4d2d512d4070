"""Distances of paper 4's robot from door, frame and itself, for many postures at once.

All that can be in the way stands upright: panel, frame and walls are prisms from the floor to above the robot, and so
is the knob here, which is on the safe side. Their distance from the robot is that of its shadow on the floor: a disc
for the base, segments with a radius for the arm. The lintel alone is looked at from below.
"""

from dataclasses import dataclass

import numpy as np

from tutorialbot.ik import srs
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT, ARM_RADIUS, BASE_RADIUS

JAW_LENGTH = 0.05  # of the jaws, up to the tip [m]
PARTS = ("base", "upper", "fore", "palm", "jaws")


@dataclass(frozen=True)
class Clearances:
    """Distances [m] of n postures: part by part from panel, knob and frame (n, 5) as in PARTS, and of the robot itself.

    panel, knob, frame: (n, 5); itself (n,): forearm and hand from column and upper arm; deck (n,): arm from base.
    """

    panel: np.ndarray
    knob: np.ndarray
    frame: np.ndarray
    itself: np.ndarray
    deck: np.ndarray


def measure(arm: SphericalArm, door: ClosingDoor, theta: np.ndarray, base: np.ndarray, q: np.ndarray) -> Clearances:
    """Return the distances for door angles theta (n,) [rad], base (n, 3) [m, m, rad] and arm q (n, 7) [rad].

    Touching is 0; where parts overlap the number is negative and not deeper than the part is thick.
    """
    points = srs.chain(arm, q)
    segments = shadows(arm, points, base)
    turned = in_panel(segments, theta)
    centre = in_panel(base[:, None, :2], theta)[:, 0]
    panel, knob = door.panel_box[:, :2], door.knob_box[:, :2]
    boxes = [box[:, :2] for box in door.frame_boxes if box[0, 2] < door.height]
    frame = np.min([_parts(base[:, :2], segments, box) for box in boxes], axis=0)
    under = door.height - ANCHOR_HEIGHT - ARM_RADIUS - points[..., 2].max(axis=-1)
    frame[:, 1:] = np.minimum(frame[:, 1:], under[:, None])
    return Clearances(_parts(centre, turned, panel), _parts(centre, turned, knob), frame, *_inner(arm, points))


def base_alone(door: ClosingDoor, theta: np.ndarray, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (n,), (n,) [m] of the base's disc at base (n, 2 or 3) from the panel and from the frame."""
    xy = base[:, :2]
    boxes = [box[:, :2] for box in door.frame_boxes if box[0, 2] < door.height]
    frame = np.min([_to_box(xy, box) for box in boxes], axis=0) - BASE_RADIUS
    return _to_box(in_panel(xy[:, None], theta)[:, 0], door.panel_box[:, :2]) - BASE_RADIUS, frame


def shadows(arm: SphericalArm, points: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return the segments (n, 4, 2 ends, 2) [m] of upper arm, forearm, palm and jaws on the floor, in the world."""
    _, shoulder, elbow, wrist, tip = np.moveaxis(points[..., :2], -2, 0)
    jaws = tip + (wrist - tip) * (JAW_LENGTH / arm.tip_offset)
    chain = np.stack([shoulder, elbow, wrist, jaws, tip], axis=1)
    c, s = np.cos(base[:, 2]), np.sin(base[:, 2])
    chain = np.einsum("nij,nkj->nki", np.stack([c, -s, s, c], -1).reshape(-1, 2, 2), chain) + base[:, None, :2]
    return np.stack([chain[:, :-1], chain[:, 1:]], axis=2)


def in_panel(points: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return points (n, ..., 2) [m] of the floor in the panel's frame at theta (n,) [rad]."""
    shape = (-1, *(1,) * (points.ndim - 2))
    c, s = np.cos(theta).reshape(shape), np.sin(theta).reshape(shape)
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _parts(centre: np.ndarray, segments: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Distances (n, 5) of disc and segments from one box, low and high corner (2, 2)."""
    found = np.empty((len(centre), 5))
    found[:, 0] = _to_box(centre, box) - BASE_RADIUS
    found[:, 1:] = segment_to_box(segments[:, :, 0], segments[:, :, 1], box) - ARM_RADIUS
    return found


def _to_box(point: np.ndarray, box: np.ndarray) -> np.ndarray:
    outside = np.maximum(box[0] - point, point - box[1]).clip(0.0)
    return np.hypot(outside[..., 0], outside[..., 1])


def segment_to_box(a: np.ndarray, b: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return the distance (...) of segments a b (..., 2) from a box with sides along the axes; 0 where they meet."""
    step = b - a
    best = np.minimum(_to_box(a, box), _to_box(b, box))
    length = (step * step).sum(-1).clip(1e-18)
    for corner in (box[0], box[1], np.array([box[0, 0], box[1, 1]]), np.array([box[1, 0], box[0, 1]])):
        away = corner - a
        share = ((away * step).sum(-1) / length).clip(0.0, 1.0)
        off = away - share[..., None] * step
        best = np.minimum(best, np.hypot(off[..., 0], off[..., 1]))
    safe = np.where(np.abs(step) < 1e-12, 1e-12, step)  # slabs: where the segment is between both pairs of sides
    t = np.stack([(box[0] - a) / safe, (box[1] - a) / safe])
    enter, leave = t.min(axis=0).max(axis=-1), t.max(axis=0).min(axis=-1)
    return np.where((enter <= leave) & (leave >= 0.0) & (enter <= 1.0), 0.0, best)


def _inner(arm: SphericalArm, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,) of the arm from itself and from the base, taken as a drum that goes up to the arm's anchor."""
    foot, shoulder, elbow, wrist, tip = np.moveaxis(points, -2, 0)
    pairs = ((foot, shoulder, elbow, wrist), (foot, shoulder, wrist, tip), (shoulder, elbow, wrist, tip))
    itself = np.min([segment_to_segment(*pair) for pair in pairs], axis=0) - 2.0 * ARM_RADIUS
    share = np.linspace(0.0, 1.0, 5)[:, None, None]
    chain = np.concatenate([a + share * (b - a) for a, b in ((shoulder, elbow), (elbow, wrist), (wrist, tip))])
    out, up = np.hypot(chain[..., 0], chain[..., 1]) - BASE_RADIUS, chain[..., 2]
    inside = np.maximum(out, up)
    deck = np.where(inside < 0.0, inside, np.hypot(out.clip(0.0), up.clip(0.0))).min(axis=0) - ARM_RADIUS
    return itself, deck


def segment_to_segment(p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return the distance (n,) between segments p q and r s (n, 3) (Ericson, Real-Time Collision Detection, 5.1.9)."""
    u, v, w = q - p, s - r, p - r
    a, e = (u * u).sum(-1).clip(1e-18), (v * v).sum(-1).clip(1e-18)
    b, c, f = (u * v).sum(-1), (u * w).sum(-1), (v * w).sum(-1)
    first = ((b * f - c * e) / (a * e - b * b).clip(1e-18)).clip(0.0, 1.0)
    second = (b * first + f) / e
    first = np.where(second < 0.0, -c / a, np.where(second > 1.0, (b - c) / a, first)).clip(0.0, 1.0)
    second = second.clip(0.0, 1.0)
    return np.sqrt(((w + first[:, None] * u - second[:, None] * v) ** 2).sum(-1))
