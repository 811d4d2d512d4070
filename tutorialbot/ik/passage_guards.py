"""What is watched in each phase of the passage, and how a phase knows that it is done.

A guard is a margin: how far a number is on the good side of its limit, in m, rad or rad/s; below zero it has failed.
"""

from dataclasses import dataclass

import numpy as np

from tutorialbot.ik import passage_clearance as clearance
from tutorialbot.ik import srs
from tutorialbot.ik.passage_follow import Piece
from tutorialbot.ik.passage_legs import ArmLeg, HandLeg
from tutorialbot.ik.passage_plan import WayPoints, one_end
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import ANCHOR_HEIGHT, PAD_BEHIND, PAD_RADIUS

CLEAR, CLEAR_ITSELF, LEAN = 0.04, 0.02, 5e-4  # to door and frame; to the robot itself; into the door [m]
FASTEST, TIP = 2.5, 1e-4  # joint rate [rad/s], tip's error [m]
STRETCHED = 0.985  # of the arm's reach, while the hand holds something
THERE, ANGLE, OFF_KNOB = 1e-3, 1e-3, 0.05  # when a place [m], an angle [rad] is reached; when the knob is left [m]
STAYING = ("e let go of the knob", "f fold the arm", "g drive round the door", "h drive through")


@dataclass(frozen=True)
class Watched:
    """Margins of one phase by name (see the module's text), and the least distance [m] to door and frame in it."""

    margins: dict[str, float]
    nearest: float


def watch(arm: SphericalArm, door: ClosingDoor, legs: tuple[HandLeg | ArmLeg, ...], pieces: list[Piece]) -> Watched:
    """Return the margins of a phase that went along `legs` as in `pieces`.

    "frame", "door": base, arm and hand, but for a hand that holds, takes or leaves something at the door, and the base
    while it leans on it, comes to that or leaves it, in one go; "lean": how far it goes into the door; "itself",
    "base": arm from arm, arm from base.
    """
    base, q, theta = (np.concatenate([getattr(p, name) for p in pieces]) for name in ("base", "q", "theta"))
    rates = np.concatenate([p.rates for p in pieces])
    touching, leaning = (np.concatenate([np.full(len(p.times), getattr(leg, name)) for leg, p in zip(legs, pieces,
                         strict=True)]) for name in ("touching", "leaning"))  # fmt: skip
    far = clearance.measure(arm, door, theta, base, q)
    near = far.panel[:, 0] < CLEAR
    leans = leaning & near & one_end(near, far.panel[:, 0], LEAN)
    apart = np.minimum(far.panel, far.knob)
    apart[leans, 0] = np.inf
    apart[touching, 3:] = np.inf
    margins = {
        "limits": float((np.array(arm.limits) - np.abs(q)).min()),
        "rates": float(FASTEST - np.abs(rates).max()),
        "frame": float(far.frame.min() - CLEAR),
        "door": float(apart.min() - CLEAR),
        "itself": float(far.itself.min() - CLEAR_ITSELF),
        "base": float(far.deck.min() - CLEAR_ITSELF),
        "tip": float(TIP - max(p.tip_error.max() for p in pieces)),
        "lean": float(LEAN + far.panel[leaning, 0].min(initial=np.inf)),
    }
    return Watched({name: value for name, value in margins.items() if np.isfinite(value)},
                   float(min(far.frame.min(), apart.min())))  # fmt: skip


def least_elbow(arm: SphericalArm) -> float:
    """Return the elbow's angle [rad] at which the wrist is STRETCHED times the reach from the shoulder."""
    return float(np.arccos(arm.elbow_cosine(STRETCHED * arm.reach)))


def stop_margin(arm: SphericalArm, piece: Piece) -> float:
    """Return the margin, < 0, of the guard that stopped a leg (`Piece.stop`): [rad], b, or what is left of the leg."""
    return float({
        "stretch": piece.q[-1, 3] - least_elbow(arm),
        "branch": piece.scale[-1],
        "limits": min(-1e-6, (np.array(arm.limits) - np.abs(piece.q[-1])).min()),
        "stall": piece.s - 1.0,
    }[piece.stop])  # fmt: skip


def exit_margin(name: str, arm: SphericalArm, door: ClosingDoor, way: WayPoints, opening: float, piece: Piece) -> float:
    """Return how far the end of a phase is on the good side of its exit test, < 0 where it has not come there."""
    base, q, theta = piece.base[-1], piece.q[-1], float(piece.theta[-1])
    tip, axis = hand(arm, base, q)
    along, across = clearance.in_panel(base[None, None, :2], np.array([theta]))[0, 0]
    panel, _ = clearance.base_alone(door, np.array([theta]), base[None])
    pad = tip - PAD_BEHIND * axis
    off_face = clearance.in_panel(pad[None, None, :2], np.array([theta]))[0, 0][1] - door.thickness / 2 - PAD_RADIUS
    from_knob = float(np.linalg.norm(tip - door.knob(theta)))
    angle_off = {"b": way.little, "c": opening, "h": way.nearly}.get(name[0], theta) - theta
    tests = {
        "a": THERE - from_knob,
        "b": ANGLE - abs(angle_off),
        "c": ANGLE - abs(angle_off),
        "d": min(across - door.thickness / 2, along - door.width, THERE - from_knob),
        "e": min(from_knob - OFF_KNOB, THERE - abs(panel[0])),
        "f": THERE - abs(off_face),
        "g": panel[0] - CLEAR,
        "h": min(base[1] - door.wall[0], ANGLE - abs(angle_off)),
        "i": min(ANGLE - theta, tip[1] - door.wall[1]),
    }
    free = {"e": from_knob - OFF_KNOB, "f": from_knob - OFF_KNOB, "g": panel[0] - CLEAR, "h": base[1] - door.wall[1]}
    return float((free if name in STAYING else tests)[name[0]])


def hand(arm: SphericalArm, base: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the tip (..., 3) [m] and the hand's axis (..., 3) in the world for base (..., 3) and q (..., 7)."""
    points = srs.chain(arm, q)
    wrist, tip = points[..., 3, :], points[..., 4, :]
    c, s = np.cos(base[..., 2]), np.sin(base[..., 2])

    def world(v: np.ndarray) -> np.ndarray:
        return np.stack([c * v[..., 0] - s * v[..., 1], s * v[..., 0] + c * v[..., 1], v[..., 2]], axis=-1)

    place = np.stack([base[..., 0], base[..., 1], np.full(base.shape[:-1], ANCHOR_HEIGHT)], axis=-1)
    return world(tip) + place, world((tip - wrist) / arm.tip_offset)
