"""Exercises 1 to 4 of notebook 1: from five numbers to where the hand goes (paper 1, section 4).

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation, Slerp

from tutorialbot.checks.guard import Student, Wrong, case
from tutorialbot.checks.mechanism import Exercise, agree, expect, numbers
from tutorialbot.seeding import make_rng

SEED = 1
REACH, MOST_TURN = 0.15, np.pi  # paper 1, section 4


def random_pose(rng: np.random.Generator, far: float = 0.5) -> pin.SE3:
    """Return a pose with any attitude, each coordinate within `far` [m]."""
    quaternion = rng.standard_normal(4)
    return pin.SE3(Rotation.from_quat(quaternion).as_matrix(), rng.uniform(-far, far, 3))


def random_step(rng: np.random.Generator, angle: float, length: float) -> pin.SE3:
    """Return a motion by `angle` [rad] and `length` [m], about an axis and in a direction drawn by chance."""
    axis, along = (v / np.sqrt(v @ v) for v in rng.standard_normal((2, 3)))
    return pin.SE3(Rotation.from_rotvec(angle * axis).as_matrix(), length * along)


def _on_sphere(a: float, b: float) -> np.ndarray:
    """Return the unit vector (3,) that a and b in [-1, 1] name."""
    ring = np.sqrt(1.0 - b * b) * np.exp(1j * np.pi * a)
    return np.array([ring.real, ring.imag, b])


# --- 1 ----------------------------------------------------------------------------------------------------------------
def _judge_lengths(student: Student) -> None:
    rng = make_rng(SEED, 1)
    for check, c5, reason in (
        ("c5 = -1", -1.0, "At c5 = -1 the hand moves by w = 0.15 m and does not turn."),
        ("c5 = +1", 1.0, "At c5 = +1 the hand turns by 180 degrees on the spot: in radians, as everywhere."),
        *(
            ("in between", float(c5), "The share of the rotation grows linearly from 0 at c5 = -1 to 1 at c5 = +1.")
            for c5 in rng.uniform(-1, 1, 20)
        ),
    ):
        expect(student, check, (c5,), [REACH * (1.0 - c5) / 2.0, MOST_TURN * (1.0 + c5) / 2.0], reason)


lengths = Exercise(
    "lengths",
    "how far (m) and by how much (rad) does the hand move for a given c5?",
    (
        "c5 = -1 is translation alone, c5 = +1 rotation alone: which straight line s(c5) is 0 at -1 and 1 at +1?",
        "s = (1 + c5) / 2 is the share of the rotation; the translation gets the rest.",
        "The largest translation is w = 0.15 m, the largest rotation 180 degrees = pi rad.",
    ),
    _judge_lengths,
)


# --- 2 ----------------------------------------------------------------------------------------------------------------
def _judge_two_numbers(student: Student) -> None:
    rng = make_rng(SEED, 2)
    level = [_on_sphere(a, 0.0) for a in (1 / 3, *rng.uniform(-0.45, 0.45, 9))]
    anywhere = [_on_sphere(a, b) for a, b in rng.uniform(-0.95, 0.95, (20, 2))]
    for check, vectors, reason in (
        ("azimuth", level, "a is the azimuth as a share of 180 degrees, in whatever unit you found it."),
        ("every quadrant", [-v for v in level], "y / x cannot tell a direction from its opposite: look at both signs."),
        ("height", anywhere, "b is the height z at which the direction meets the unit sphere, not its latitude."),
        ("any length", [rng.uniform(0.01, 2.0) * v for v in anywhere], "A direction has no length: divide it out."),
        (
            "seam",
            [np.array([-0.1, y, z]) for y in (0.0, -0.0) for z in (0.0, 0.03, -0.2)],
            "Where the azimuth is 180 degrees, a = 1 and a = -1 are both right, and a = 0 is the other side.",
        ),
        (
            "poles",
            [np.array([0.0, 0.0, z]) for z in (1.0, -1.0, 0.15, -0.02)],
            "At a pole b is 1 or -1, and every azimuth is right.",
        ),
    ):
        for v in vectors:
            a, b = numbers(student(v), (2,), (v,), reason)
            told = f"{reason} Your numbers {a:.4f} and {b:.4f} name another direction than v:"
            agree(check, _on_sphere(a, np.clip(b, -1.0, 1.0)), v / np.linalg.norm(v), (v,), told)
            if max(abs(a), abs(b)) > 1.0 + 1e-9:
                raise Wrong(
                    "inside the square",
                    f"{a:.4f} and {b:.4f} name the right direction, but the search knows -1 to 1 alone{case((v,))}",
                )


two_numbers = Exercise(
    "two_numbers",
    "the way back: which two numbers in [-1, 1] name the direction of a given vector?",
    (
        "Turn the formulas of section 2 round, one at a time. What is b, if the vector has the length 1? And if not?",
        "b = z / |v|. Of x and y only the angle counts: (x, y) is some positive number times (cos a pi, sin a pi).",
        "`np.arctan2(y, x)` is that angle in all four quadrants, in radians from -pi to pi, and 0 at a pole.",
    ),
    _judge_two_numbers,
)


# --- 3 ----------------------------------------------------------------------------------------------------------------
def _goal(start: pin.SE3, c: np.ndarray, frame: str) -> pin.SE3:
    share = (1.0 + c[4]) / 2.0
    step = (1.0 - share) * REACH * _on_sphere(c[0], c[1])
    turn = Rotation.from_rotvec(share * MOST_TURN * _on_sphere(c[2], c[3])).as_matrix()
    if frame == "world":
        return pin.SE3(turn @ start.rotation, start.translation + step)
    return pin.SE3(start.rotation @ turn, start.translation + start.rotation @ step)


def _judge_goal(student: Student) -> None:
    rng = make_rng(SEED, 3)
    here = pin.SE3(np.eye(3), np.array([0.1, 0.2, 1.0]))
    for check, frame, c5, turned, reason in (
        ("translation alone", "world", -1.0, False, "c5 = -1: w = 0.15 m in the direction of (c1, c2), no rotation."),
        ("rotation alone", "world", 1.0, False, "c5 = +1: a turn by pi rad about the axis of (c3, c4), on the spot."),
        ("ratio of both", "world", None, False, "s = (1 + c5) / 2 of the rotation and 1 - s of the translation."),
        (
            "world frame",
            "world",
            None,
            True,
            "In the world's frame the hand's own attitude does not matter: the rotation comes from the left,"
            " the position is moved by the same vector whichever way the hand points.",
        ),
        (
            "tool frame",
            "tool",
            None,
            True,
            "In the tool's frame the direction turns with the hand: the step is seen from the hand,"
            " and the rotation comes from the right.",
        ),
    ):
        for _ in range(8):
            c = rng.uniform(-0.95, 0.95, 5)
            c[4] = c[4] if c5 is None else c5
            inputs = (random_pose(rng) if turned else here, c, frame)
            expect(student, check, inputs, _goal(*inputs), reason)


goal = Exercise(
    "goal",
    "five numbers, a start pose and a frame: where does the hand go?",
    (
        "Build the translation and the rotation vector first: `to_sphere` gives the directions, c5 the lengths.",
        "`pinocchio.exp3(v)` turns a rotation vector v [rad] into a matrix.",
        "World: SE3(exp3(v) R, p + t). Tool: SE3(R, p) * SE3(exp3(v), t), which is the start pose times the motion.",
    ),
    _judge_goal,
)


# --- 4 ----------------------------------------------------------------------------------------------------------------
def _judge_way(student: Student) -> None:
    rng = make_rng(SEED, 4)
    for i in range(60):
        inputs = (random_pose(rng), random_pose(rng), [0.0, 1.0, 0.5][i] if i < 3 else float(rng.uniform()))
        a, b, s = inputs
        answer = student(*inputs)
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            raise Wrong(
                "shape of the answer", f"expected two things, a position (3,) and a quaternion (4,){case(inputs)}"
            )
        position, quaternion = numbers(answer[0], (3,), inputs), numbers(answer[1], (4,), inputs)
        length = np.linalg.norm(quaternion)
        agree("unit quaternion", length, 1.0, inputs, "Only a quaternion of length 1 is a rotation.")
        line = a.translation + s * (b.translation - a.translation)
        agree("straight line", position, line, inputs, "The position runs on the straight line between both.")
        xyzw = Slerp([0.0, 1.0], Rotation.from_matrix([a.rotation, b.rotation]))(s).as_quat()
        if min(np.abs(quaternion - xyzw).max(), np.abs(quaternion + xyzw).max()) < 1e-6:
            raise Wrong("quaternion order", f"The right rotation, with w last: MuJoCo wants (w, x, y, z){case(inputs)}")
        wxyz = np.roll(xyzw, 1)
        reason = "The turn is at constant speed about one axis, the shorter way round: q and -q are the same rotation."
        agree("SLERP", quaternion, np.copysign(1.0, wxyz @ quaternion) * wxyz, inputs, reason)


way_between = Exercise(
    "way_between",
    "the pose at the share s of the way: linear position, SLERP rotation, quaternion as MuJoCo orders it.",
    (
        "`pinocchio.Quaternion(R).coeffs()` is (x, y, z, w): reorder it at the end.",
        "SLERP: sin((1 - s) o)/sin(o) q0 + sin(s o)/sin(o) q1, with cos(o) = q0 . q1.",
        "When q0 . q1 < 0, take -q1: otherwise the hand turns the long way round.",
    ),
    _judge_way,
)
