"""Exercises 4 and 5 of notebook 4: what becomes of the wrist on a door's arc, and the twist of a follower."""

import math
from typing import Any

import numpy as np
import pinocchio as pin

from tutorialbot.checks.counting import ByHand
from tutorialbot.checks.guard import Student, Wrong, case, show
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.checks.passage_elbow import SEED
from tutorialbot.seeding import make_rng

# --- 4 ----------------------------------------------------------------------------------------------------------------
WORDS = ("passes", "reflects", "stalls", "folds")
TOUCH, SAMPLES = 1e-6, 20_001  # how near to the edge is touching it [m]; places on the arc that are looked at
CLEAR = 1e-3  # cases stay off the edges by this [m], but for those that touch


def distances(hinge: np.ndarray, radius: float, angles: np.ndarray) -> np.ndarray:
    """Return how far the shoulder is from the wrist (k,) [m] at the door's angles (k,) [rad]."""
    x, y, z = hinge
    return np.sqrt((x + radius * np.cos(angles)) ** 2 + (y - radius * np.sin(angles)) ** 2 + z * z)


def fate(hinge: np.ndarray, radius: float, start: float, end: float, near: float, reach: float) -> tuple[str, float]:
    """Return what becomes of the wrist, one of WORDS, and the angle [rad] there: looked for place by place."""
    angles = np.linspace(start, end, SAMPLES)
    r = distances(hinge, radius, angles)
    inner = r[1:-1]
    touching = np.zeros(SAMPLES, dtype=bool)
    touching[1:-1] = (np.abs(inner - reach) <= TOUCH) & (inner >= r[:-2]) & (inner >= r[2:])
    outside, folded = r > reach + TOUCH, r < near
    ends = np.flatnonzero(touching | outside | folded)
    if not ends.size:
        return "passes", end
    first = ends[0]
    if touching[first]:
        return "stalls", float(angles[first])
    edge, low, high = (reach if outside[first] else near), angles[first - 1], angles[first]
    for _ in range(60):
        middle = (low + high) / 2.0
        beyond = distances(hinge, radius, np.array([middle]))[0] > edge
        low, high = (low, middle) if beyond == outside[first] else (middle, high)
    return ("reflects" if outside[first] else "folds"), float(high)


def nearest_edge(hinge: np.ndarray, radius: float, start: float, end: float, near: float, reach: float) -> float:
    """Return how far the extremes of r on the arc stay off both edges, and the start inside of them [m]."""
    r = distances(hinge, radius, np.linspace(start, end, SAMPLES))
    inner = r[1:-1]
    turning = inner[(inner - r[:-2]) * (r[2:] - inner) <= 0.0]
    extremes = np.concatenate([turning, r[[0, -1]]])
    off = np.abs(extremes[:, None] - [near, reach]).min()
    return min(float(off), float(r[0] - near), float(reach - r[0]))


def _judge_fate(student: Student) -> None:
    rng, ask = make_rng(SEED, 4), ByHand(student)

    def trial(check: str, reason: str, hinge, *numbers_: float) -> str:
        inputs = (np.array(hinge, dtype=float), *map(float, numbers_))
        answer = ask(*inputs)
        word, angle = fate(*inputs)
        if not isinstance(answer, list | tuple) or len(answer) != 2 or answer[0] not in WORDS:
            told = f"expected two things, one of {', '.join(WORDS)}, and an angle; got {show(answer)}"
            raise Wrong("shape of the answer", told + case(inputs))
        if answer[0] != word:
            raise Wrong(check, f"{reason}\nyours {answer[0]!r}, expected {word!r}{case(inputs)}")
        told = f"{reason} And how far does the door get?"
        found = numbers(answer[1], (), inputs, told)
        agree(f"{check}: angle", found, np.array(angle), inputs, told, 5e-3 if word == "stalls" else 1e-5)
        return word

    def touching(margin: float, radius: float, reach: float, at: float, z: float = 0.0) -> tuple[float, float, float]:
        """A hinge for which the arc comes within `margin` of the edge, at the angle `at`."""
        flat = math.sqrt((reach - margin) ** 2 - z * z) - radius
        return flat * math.cos(at), -flat * math.sin(at), z

    arc = (0.78, 0.0, math.radians(90.0), 0.18, 0.7)
    reason = "As long as the distance from shoulder to wrist stays within both edges, the door gets to its last angle."
    trial("passes", reason, touching(0.05, 0.45, 0.7, 0.6), 0.45, 0.0, 1.2, 0.18, 0.7)
    trial("passes", reason, touching(0.001, 0.45, 0.7, 0.6), 0.45, 0.1, 1.2, 0.18, 0.7)
    reason = "The distance grows through upper + lower at an angle: q4 goes through zero, and time runs back."
    for x, y in ((-0.2, 0.05), (-0.1, 0.0), (-0.3, -0.05)):
        trial("reflects", reason, (x, y, 0.0), *arc)
    trial("reflects", reason, touching(-0.02, 0.45, 0.7, 0.6), 0.45, 0.0, 1.2, 0.18, 0.7)
    trial("reflects", reason, touching(-0.001, 0.45, 0.7, 0.6), 0.45, 0.0, 1.2, 0.18, 0.7)
    reason = "Touching the edge from inside, within a micrometre: the saddle, which takes for ever."
    for at, radius in ((0.6, 0.45), (0.9, 0.3), (-0.4, 0.2)):
        trial("stalls", reason, touching(0.0, radius, 0.7, at), radius, at - 0.5, at + 0.4, 0.1, 0.7)
    for margin in (5e-7, -5e-7):
        trial("stalls", reason, touching(margin, 0.45, 0.7, 0.6), 0.45, 0.0, 1.2, 0.18, 0.7)
    reason = "Two micrometres inside is not touching."
    trial("passes", reason, touching(2e-6, 0.45, 0.7, 0.6), 0.45, 0.0, 1.2, 0.18, 0.7)
    reason = "Where the arc is nearest to the edge counts only if the door gets there."
    trial("not on the way", reason, touching(0.0, 0.45, 0.7, 0.6), 0.45, 0.7, 1.4, 0.18, 0.7)
    trial("not on the way", reason, touching(-0.1, 0.45, 0.7, 0.1), 0.45, 1.3, 1.9, 0.18, 0.7)
    reason = "The elbow bends so far and no further: nearer than `near` the arm is folded."
    trial("folds", reason, (-0.35, 0.55, 0.0), 0.5, 0.0, 1.5, 0.25, 0.7)
    trial("folds", reason, (-0.4, 0.5, 0.0), 0.6, 0.0, 1.5, 0.25, 0.7)
    reason = "The shoulder is not at the wrist's height: the third coordinate is part of the distance."
    trial("height", reason, touching(0.0, 0.4, 0.7, 0.5, 0.25), 0.4, 0.0, 1.2, 0.18, 0.7)
    trial("height", reason, touching(-0.03, 0.4, 0.7, 0.5, -0.3), 0.4, -0.8, 1.2, 0.18, 0.7)
    reason = "A door that is shut goes from a larger angle to a smaller one."
    trial("shut", reason, touching(-0.02, 0.45, 0.7, 0.6), 0.45, 1.3, 0.0, 0.18, 0.7)
    trial("shut", reason, touching(0.0, 0.45, 0.7, 0.6), 0.45, 1.3, 0.1, 0.18, 0.7)
    trial("shoulder above the hinge", "No angle is nearer than another one.", (0, 0, 0.2), 0.5, 0.0, 2.0, 0.18, 0.7)
    seen = dict.fromkeys(WORDS, 0)
    while min(seen[word] for word in ("passes", "reflects", "folds")) < 8:
        hinge, radius = (*rng.uniform(-1.2, 1.2, 2), rng.uniform(-0.3, 0.3)), rng.uniform(0.2, 0.9)
        inputs = np.array(hinge), float(radius), *rng.uniform(-2.5, 2.5, 2).tolist(), 0.2, 0.7
        if nearest_edge(*inputs) > CLEAR and seen[fate(*inputs)[0]] < 8:
            seen[trial("any door", "What comes first on the way ends it.", *inputs)] += 1


fate_on_arc = Exercise(
    "fate_on_arc",
    "what becomes of the wrist on a door's arc: passes, reflects, stalls or folds, and at which angle.",
    (
        "The squared distance is |hinge|^2 + radius^2 + 2 radius (x cos theta - y sin theta): one cosine,"
        " A + B cos(theta - phi). Where is it largest, and where does it have a given value?",
        "With B = 2 radius hypot(x, y) and phi = atan2(-y, x): largest at phi, smallest half a turn from there. It is"
        " reach^2 at phi + acos((reach^2 - A) / B) and at phi minus this. Angles are the same a full turn later.",
        "Collect all of these angles between start and end (touching ones from r at phi, within 1e-6 of reach), and"
        " take the first one on the way. Looking at 20,000 angles, then bisecting, does as well.",
    ),
    _judge_fate,
)


# --- 5 ----------------------------------------------------------------------------------------------------------------
def followed(wanted: pin.SE3, here: pin.SE3, direction, b: float, onward: float, speed, gain, most) -> np.ndarray:
    """Return the twist (6,) and ds/dt: what b times the twist ought to be, divided by b."""
    turn = pin.Quaternion(wanted.rotation) * pin.Quaternion(here.rotation).conjugate()
    about = pin.AngleAxis(turn)
    error = np.concatenate([wanted.translation - here.translation, about.axis * about.angle])
    correction = abs(b) * gain * error
    pace = np.sqrt(correction[:3] @ correction[:3]) / abs(b)
    correction = correction * (most / pace if pace > most else 1.0)
    s_rate = onward * b * speed
    whole = np.concatenate([np.asarray(direction) * s_rate, np.zeros(3)]) + correction
    return np.append(whole / b, s_rate)


def _turned_by(axis: Any, angle: float) -> pin.SE3:
    vector = np.asarray(axis, dtype=float)
    return pin.SE3(pin.exp3(vector * angle), np.zeros(3))


def _judge_follow(student: Student) -> None:
    rng, ask = make_rng(SEED, 5), ByHand(student)

    def unit() -> np.ndarray:
        v = rng.standard_normal(3)
        return v / np.sqrt(v @ v)

    def pose() -> pin.SE3:
        place = _turned_by(unit(), float(rng.uniform(0.2, 2.5)))
        place.translation = rng.uniform(-0.5, 0.5, 3)
        return place

    def trial(check: str, reason: str, wanted: pin.SE3, here: pin.SE3, b: float, onward: float, most=9.0) -> None:
        inputs = (wanted, here, unit(), b, onward, *rng.uniform((0.05, 2.0), (0.3, 12.0)).tolist(), most)
        answer = ask(*inputs)
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            raise Wrong("shape of the answer", f"expected two things, the twist and ds/dt{case(inputs)}")
        twist, s_rate = numbers(answer[0], (6,), inputs, reason), numbers(answer[1], (), inputs, reason)
        if b == 0.0:
            return
        expected = followed(*inputs)
        agree(f"{check}: ds/dt", s_rate, expected[6], inputs, reason, 1e-9)
        agree(f"{check}: linear", twist[:3], expected[:3], inputs, reason, 1e-9)
        agree(f"{check}: angular", twist[3:], expected[3:6], inputs, reason, 1e-6)

    def off(wanted: pin.SE3, far: float, turned: float) -> pin.SE3:
        here = pin.SE3(_turned_by(unit(), turned).rotation @ wanted.rotation, wanted.translation + far * unit())
        return here

    reason = "Without an error the twist is speed along the path; the arm makes b of it, so s goes on by b speed dt."
    for b in (1.0, 0.4):
        trial("on the path", reason, wanted := pose(), wanted.copy(), b, 1.0)
    reason = "On the other branch b < 0: s runs back along the same path. The twist stays what it was."
    trial("running back", reason, wanted := pose(), wanted.copy(), -0.7, 1.0)
    reason = "An arm that starts with q4 < 0 has b < 0 there: `onward` = -1 makes it go forward all the same."
    for b in (-1.0, -0.3, 0.6):
        trial("started on the other branch", reason, wanted := pose(), wanted.copy(), b, -1.0)
    reason = "The tip has to move toward where it is wanted, by gain times what is missing; so the twist, as b is 1."
    for _ in range(3):
        trial("back to the path", reason, wanted := pose(), off(wanted, 0.01, 0.0), 1.0, 1.0)
    reason = "The arm makes b times the twist. What corrects at b > 0 drives away at b < 0, faster and faster."
    for onward in (1.0, -1.0):
        for b in (-1.0, -0.2):
            trial("back on the other branch", reason, wanted := pose(), off(wanted, 0.01, 0.0), b, onward)
    reason = "Near the singularity the correction becomes weaker with |b|, as all else does: no division by b."
    for b in (0.01, -0.01, 0.3):
        trial("near the singularity", reason, wanted := pose(), off(wanted, 0.01, 0.0), b, 1.0)
    reason = "The turn from `here` to `wanted`, as a rotation vector in the world's axes: R_wanted R_here^T."
    for b in (1.0, -0.5):
        trial("turned", reason, wanted := pose(), off(wanted, 0.0, 0.3), b, 1.0)
        trial("turned", reason, wanted := pose(), off(wanted, 0.02, 1.5), b, 1.0)
    reason = "gain times the distance is `most` at most; where it would be more, all six numbers of it shrink alike."
    for b in (1.0, 0.5, -0.8):
        trial("no faster than that", reason, wanted := pose(), off(wanted, 0.4, 0.3), b, 1.0, 0.05)
    reason = "At b = 0 nothing moves, whatever is asked for; but it is a number."
    trial("at the singularity", reason, pose(), pose(), 0.0, 1.0)
    for _ in range(20):
        b, onward, most = float(rng.uniform(0.02, 1.0) * rng.choice((-1, 1))), float(rng.choice((-1, 1))), 0.1
        far, turned = rng.uniform(0.0, (0.1, 2.0)).tolist()
        trial("anywhere", "Anywhere.", wanted := pose(), off(wanted, far, turned), b, onward, most)


follow_twist = Exercise(
    "follow_twist",
    "the twist of a follower that comes back to its path on either branch, and how fast s goes.",
    (
        "Write down what the tip ought to do: ds/dt along the path, and a correction that is never turned round. The"
        " arm does b times your twist. Which sign makes the correction come out right for b < 0?",
        "ds/dt = onward b speed, so the twist's share of it is onward speed direction: no b. The correction in the"
        " twist is sign(b) gain error; after the arm's b it is |b| gain error.",
        "error = (wanted.translation - here.translation, pin.log3(wanted.rotation @ here.rotation.T)). Then the factor"
        " min(1, most / (gain |linear error|)) on all six; mind a linear error of zero.",
    ),
    _judge_follow,
)
