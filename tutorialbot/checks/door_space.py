"""Exercises 1 to 4 of notebook 1: from five numbers to where the hand goes (paper 1, section 4).

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation, Slerp

from tutorialbot.checks.guard import Student, Wrong, case
from tutorialbot.checks.mechanism import Exercise, agree, numbers, pose
from tutorialbot.seeding import make_rng

SEED = 1
REACH, MOST_TURN = 0.15, np.pi  # paper 1, section 4


def random_pose(rng: np.random.Generator, far: float = 0.5) -> pin.SE3:
    """Return a pose with any attitude, each coordinate within `far` [m]."""
    quaternion = rng.standard_normal(4)
    return pin.SE3(Rotation.from_quat(quaternion).as_matrix(), rng.uniform(-far, far, 3))


def _on_sphere(a: float, b: float) -> np.ndarray:
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
        answer = numbers(student(c5), (2,), (c5,))
        agree(check, answer, [REACH * (1.0 - c5) / 2.0, MOST_TURN * (1.0 + c5) / 2.0], (c5,), reason)


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
def _judge_direction(student: Student) -> None:
    rng = make_rng(SEED, 2)
    points = [tuple(map(float, point)) for point in rng.uniform(-0.999, 0.999, (4000, 2))]
    first = numbers(student(*points[0]), (3,), points[0])
    agree(
        "same answer twice",
        numbers(student(*points[0]), (3,), points[0]),
        first,
        points[0],
        "Two numbers must name one direction, always the same.",
    )
    vectors = np.empty((len(points), 3))
    for i, point in enumerate(points):
        vectors[i] = numbers(student(*point), (3,), point)
        agree(
            "unit length",
            np.linalg.norm(vectors[i]),
            1.0,
            point,
            "A direction has the length 1: the ratio c5 says how far to go.",
        )
    jumps = 0
    for i, (a, b) in enumerate(points[:400]):
        beside = (a + 1e-3, b)
        jumps += np.linalg.norm(numbers(student(*beside), (3,), beside) - vectors[i]) > 0.05
    if jumps > 20:
        raise Wrong(
            "neighbours stay neighbours",
            f"{jumps} of 400 directions jump by more than 3 degrees when a changes by 0.001:"
            " the surrogate can learn nothing from a neighbour. Are the angles in radians?",
        )
    spread = vectors.T @ vectors / len(vectors)
    axes = np.vstack([np.eye(3), -np.eye(3), rng.standard_normal((60, 3))])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    inside = (vectors @ axes.T > np.cos(np.deg2rad(25.0))).mean(axis=0)
    fair = (1.0 - np.cos(np.deg2rad(25.0))) / 2.0
    worst = int(np.argmax(np.abs(inside - fair)))
    if np.abs(inside - fair).max() > 0.016 or np.abs(spread - np.eye(3) / 3.0).max() > 0.03:
        raise Wrong(
            "even coverage",
            f"Of 4000 random (a, b), {100 * inside[worst]:.1f} % lead within 25 degrees of"
            f" {np.round(axes[worst], 2).tolist()};"
            f" with equal areas it is {100 * fair:.1f} % anywhere. The robot must not overlook a direction"
            f" in which the door moves.",
        )


direction = Exercise(
    "direction",
    "map two numbers in [-1, 1] to a direction, so that all directions are equally likely.",
    (
        "A sphere between two parallel planes has the same area as the cylinder around it (Archimedes).",
        "So let one number be the height z itself, not the latitude, and the other one the azimuth.",
        "With z = b, the radius of the circle at that height is sqrt(1 - b^2), and the azimuth is a pi.",
    ),
    _judge_direction,
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
    stages = (
        (
            "translation alone",
            "world",
            -1.0,
            False,
            "c5 = -1: w = 0.15 m along the direction of (c1, c2), and no rotation.",
        ),
        (
            "rotation alone",
            "world",
            1.0,
            False,
            "c5 = +1: the hand turns about the axis of (c3, c4) on the spot, by pi rad.",
        ),
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
    )
    for check, frame, c5, turned, reason in stages:
        for _ in range(8):
            c = rng.uniform(-0.95, 0.95, 5)
            c[4] = c[4] if c5 is None else c5
            inputs = (random_pose(rng) if turned else here, c, frame)
            answer = pose(student(*inputs), inputs)
            agree(check, answer.homogeneous, _goal(*inputs).homogeneous, inputs, reason)


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
        agree(
            "unit quaternion", np.linalg.norm(quaternion), 1.0, inputs, "Only a quaternion of length 1 is a rotation."
        )
        agree(
            "straight line",
            position,
            a.translation + s * (b.translation - a.translation),
            inputs,
            "The position runs on the straight line between both.",
        )
        xyzw = Slerp([0.0, 1.0], Rotation.from_matrix([a.rotation, b.rotation]))(s).as_quat()
        wxyz = np.roll(xyzw, 1)
        for sign in (1.0, -1.0):
            if np.abs(quaternion - sign * xyzw).max() < 1e-6:
                raise Wrong(
                    "quaternion order", f"The right rotation, with w last: MuJoCo wants (w, x, y, z){case(inputs)}"
                )
        wxyz *= np.copysign(1.0, wxyz @ quaternion)
        agree(
            "SLERP",
            quaternion,
            wxyz,
            inputs,
            "The rotation turns at constant speed about one axis, the shorter way round: q and -q are the"
            " same rotation.",
        )


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
