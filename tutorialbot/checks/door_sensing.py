"""Exercises 5 to 8 of notebook 1: what the hand feels, eq. (1), the SO(4) distance, and the casters under the robot.

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from tutorialbot.checks.door_space import SEED, random_pose
from tutorialbot.checks.guard import Student
from tutorialbot.checks.mechanism import Exercise, agree, numbers
from tutorialbot.seeding import make_rng


# --- 5 ----------------------------------------------------------------------------------------------------------------
def _judge_collision(student: Student) -> None:
    rng = make_rng(SEED, 5)
    times = 0.01 * np.arange(1, 101)
    plain, upright = np.zeros((100, 6)), np.tile([0.0, 0.0, 1.0], (100, 1))
    tilt = np.linspace(0.0, 2.0, 100)
    turning = np.column_stack([np.sin(tilt), np.zeros(100), np.cos(tilt)])

    def carrying(wrench: np.ndarray, up: np.ndarray, weight: float, center: np.ndarray) -> np.ndarray:
        return wrench + np.hstack([weight * up, np.cross(center, weight * up)])

    def trial(
        check: str, wrench: np.ndarray, up: np.ndarray, weight: float, center: np.ndarray, expected: float, reason: str,
        limits: tuple[float, float] = (40.0, 8.0),
    ) -> None:
        inputs = (times, carrying(wrench, up, weight, center), up, weight, center, limits)
        agree(check, numbers(student(*inputs), (), inputs), expected, inputs, reason, 1e-9)

    center = np.array([0.10, 0.02, 0.0])
    trial(
        "no collision",
        plain,
        upright,
        0.0,
        center,
        1.0,
        "Nothing was felt: the move lasts to its end, which is the last instant.",
    )
    diagonal = plain.copy()
    diagonal[50:, :3] = 30.0
    trial(
        "norm of the force",
        diagonal,
        upright,
        0.0,
        center,
        times[50],
        "The threshold is for the norm of the force: three times 30 N is 52 N.",
    )
    reason = "The thresholds are inputs: here the hand may feel 60 N."
    trial("limits as given", diagonal, upright, 0.0, center, 1.0, reason, (60.0, 8.0))
    twisted = plain.copy()
    twisted[70:, 3:] = [5.0, -5.0, 5.0]
    trial(
        "torque counts",
        twisted,
        upright,
        0.0,
        center,
        times[70],
        "The torque has a threshold of its own, and either one ends the move.",
    )
    trial(
        "tare",
        plain,
        upright,
        50.0,
        np.zeros(3),
        1.0,
        "Only the hand's own weight hangs at the sensor: subtract it, weight * up.",
    )
    trial(
        "the hand turns",
        plain,
        turning,
        50.0,
        np.zeros(3),
        1.0,
        "When the hand tilts, its weight wanders through the sensor's axes: subtract it at each instant,"
        " not the first reading.",
    )
    trial(
        "torque of the weight",
        plain,
        turning,
        30.0,
        np.array([0.0, 0.4, 0.0]),
        1.0,
        "The weight acts at the centre of mass and makes a torque at the sensor: center x (weight * up).",
    )
    for _ in range(30):
        k = int(rng.integers(1, 100))
        wrench = 0.3 * rng.uniform(-1, 1, (100, 6))
        part, size = (slice(0, 3), 41.0) if rng.uniform() < 0.5 else (slice(3, 6), 8.5)
        push = rng.standard_normal(3)
        wrench[k, part] = size * push / np.linalg.norm(push)
        trial(
            "first reading beyond",
            wrench,
            turning,
            float(rng.uniform(5, 20)),
            center,
            times[k],
            "The collision is at the first reading beyond a threshold, even if the force falls again.",
        )


time_to_collision = Exercise(
    "time_to_collision",
    "from a force/torque trace to the time to collision t_c.",
    (
        "First take the hand's weight off each reading: force weight * up, torque center x (weight * up),"
        " both in the sensor's axes.",
        "Then compare the norm (n,) of the force and of the torque with the limits: `np.linalg.norm(..., axis=1)`.",
        "`np.flatnonzero(beyond)` lists the instants beyond; there may be none.",
    ),
    _judge_collision,
)


# --- 6, 7 -------------------------------------------------------------------------------------------------------------
def _so4(a: pin.SE3, b: pin.SE3, radius: float = 0.1) -> float:
    """2 sqrt(1 - |cos(theta/2) cos(psi/2)|): the closed form of the 8-vectors' distance."""
    step = a.rotation.T @ (b.translation - a.translation)
    theta = Rotation.from_matrix(a.rotation.T @ b.rotation).magnitude()
    psi = np.arctan2(np.sqrt(step @ step), radius)
    return 2.0 * float(np.sqrt(max(0.0, 1.0 - abs(np.cos(theta / 2.0) * np.cos(psi / 2.0)))))


def _judge_cost(student: Student) -> None:
    rng = make_rng(SEED, 6)
    for i in range(150):
        first, start, settled = (random_pose(rng, 0.15) for _ in range(3))
        nearer, before = _so4(first, settled), _so4(first, start)
        if abs(nearer - before) < 1e-3:
            continue
        time = float(rng.uniform(0.1, 4.0))
        done = 0 if i < 20 else int(rng.integers(1, 9))
        inputs = (time, start, settled, first, done)
        penalty = 5.0 if nearer < before and done else 0.0
        check, reason = (
            ("first section", "The first section has no penalty: every way leads away from the first pose.")
            if not done
            else ("coming nearer", "The hand came nearer to the first pose: t_p = 5.")
            if penalty
            else (
                "moving away",
                "The hand moved away from the first pose: t_p = 0, and the longer without a collision the"
                " lower f_b = -t_c.",
            )
        )
        agree(
            check,
            numbers(student(*inputs), (), inputs),
            -time + penalty,
            inputs,
            f"{reason} (distances from the first pose: {before:.3f} before, {nearer:.3f} after)",
        )


cost = Exercise(
    "cost",
    "eq. (1): f_b = -t_c + t_p, with the penalty of the paper.",
    (
        "f_b is minimised, so a long time must make it small.",
        "t_p = 5 when so4_distance(first, settled) < so4_distance(first, start), else 0.",
        "In the first section (no section done yet) there is no penalty.",
    ),
    _judge_cost,
)


def _judge_distance(student: Student) -> None:
    rng = make_rng(SEED, 7)
    unit = pin.SE3.Identity()

    def trial(check: str, a: pin.SE3, b: pin.SE3, reason: str) -> None:
        agree(check, numbers(student(a, b), (), (a, b)), _so4(a, b), (a, b), reason, 1e-5)

    def turned(angle: float) -> pin.SE3:
        axis = rng.standard_normal(3)
        return pin.SE3(Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix(), np.zeros(3))

    here = random_pose(rng)
    trial("equal poses", here, here, "Equal poses have the distance 0.")
    for _ in range(10):
        trial(
            "rotation alone",
            unit,
            turned(rng.uniform(0.1, 1.5)),
            "A rotation by theta: the 8-vector is (q, q), and half of theta stands in q.",
        )
    for length in (0.01, 0.1, 0.3, 1.0):
        step = rng.standard_normal(3)
        trial(
            "angle of a translation",
            unit,
            pin.SE3(np.eye(3), length * step / np.linalg.norm(step)),
            "A translation becomes a rotation by psi = atan(|d| / R), R = 0.1 m; |d| / R would wind round"
            " the hypersphere and alias.",
        )
    for _ in range(40):
        trial(
            "both signs",
            unit,
            turned(rng.uniform(2.2, 3.14)),
            "(G, H) and (-G, -H) are the same rotation: the nearer of both counts.",
        )
    for _ in range(40):
        trial(
            "seen from a",
            random_pose(rng),
            random_pose(rng),
            "Take a as the frame of reference, inverse(a) * b: the world's origin must not matter.",
        )


distance = Exercise(
    "distance",
    "the SO(4) distance of two poses, radius 0.1 m, angle atan(|d| / R).",
    (
        "Begin with the displacement: `a.actInv(b)`, its rotation as unit quaternion q and its translation d.",
        "G = D q and H = conj(D) q with D = cos(psi/2) + sin(psi/2) d/|d| and psi = atan(|d| / R)."
        " Standing still is G = H = 1.",
        "The distance is the length of (G - 1, H - 1) or of (G + 1, H + 1), whichever is less.",
    ),
    _judge_distance,
)


# --- 8 ----------------------------------------------------------------------------------------------------------------
def _caster(twist: np.ndarray, steer: float, x: float, y: float, offset: float, radius: float) -> np.ndarray:
    """Rates (phi', theta') from the wheel's centre: it is a point of the base, moved by the fork, and may only roll."""
    along = np.exp(1j * steer)
    center = complex(x, y) - offset * along
    moved = complex(twist[0], twist[1]) + 1j * twist[2] * center  # as a point that stands still on the base
    inside = moved / along  # real: along the wheel; imaginary: sideways, which only the fork's turning can undo
    return np.array([inside.imag / offset, inside.real / radius])


def _judge_caster(student: Student) -> None:
    rng = make_rng(SEED, 8)
    stages = (
        ("straight ahead", (1, 0, 0), 0, 0, "A wheel that points ahead rolls at v / r and its fork stands still."),
        (
            "a turned wheel",
            (1, 1, 0),
            1,
            0,
            "Split the pivot's velocity along and across the wheel; the angle is in radians. Across is"
            " what the fork's offset b must give.",
        ),
        (
            "the base turns",
            (0, 0, 1),
            1,
            0,
            "The fork keeps its heading over the ground unless it is turned: seen from a base that turns"
            " at w, its rate is less by w.",
        ),
        ("pivot off the centre", (1, 1, 1), 1, 1, "The pivot at (x, y) moves with u = (vx - w y, vy + w x)."),
    )
    for check, which, turned, off, reason in stages:
        for _ in range(10):
            twist = rng.uniform(-1, 1, 3) * which
            x, y = (off * rng.uniform(-0.4, 0.4, 2)).tolist()
            inputs = (
                twist,
                turned * float(rng.uniform(-3, 3)),
                x,
                y,
                float(rng.uniform(0.03, 0.09)),
                float(rng.uniform(0.1, 0.2)),
            )
            agree(check, numbers(student(*inputs), (2,), inputs), _caster(*inputs), inputs, reason)


caster = Exercise(
    "caster",
    "from the base's twist to the steering and the driving rate of one caster.",
    (
        "First the velocity of the pivot: u = (vx - w y, vy + w x).",
        "Along the wheel, h = (cos phi, sin phi): r theta' = u . h.",
        "Across it, n = (-sin phi, cos phi): b (w + phi') = u . n.",
    ),
    _judge_caster,
)
