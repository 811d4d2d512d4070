"""Exercises 5 to 8 of notebook 1: what the hand feels, the mended cost, the literal metric, and casters backwards.

The references are written here once more, by other formulas than the package's own, so that neither vouches for itself.
"""

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from tutorialbot.checks.door_space import SEED, random_pose, random_step
from tutorialbot.checks.guard import Student
from tutorialbot.checks.mechanism import Exercise, agree, expect, numbers
from tutorialbot.seeding import make_rng


# --- 5 ----------------------------------------------------------------------------------------------------------------
def _judge_collision(student: Student) -> None:
    rng = make_rng(SEED, 5)
    times = 0.01 * np.arange(1, 101)
    center, origin, outside = np.array([0.10, 0.02, 0.0]), np.zeros(3), np.array([0.0, 0.4, 0.0])
    plain, upright, tilt = np.zeros((100, 6)), np.tile([0.0, 0.0, 1.0], (100, 1)), np.linspace(0.0, 2.0, 100)
    turning = np.column_stack([np.sin(tilt), np.zeros(100), np.cos(tilt)])
    diagonal, twisted = plain.copy(), plain.copy()
    diagonal[50:, :3], twisted[70:, 3:] = 30.0, [5.0, -5.0, 5.0]

    def trial(check, reason, expected, wrench, up=upright, weight=0.0, center=center, limits=(40.0, 8.0)) -> None:
        own = weight * up
        felt = wrench + np.hstack([own, np.cross(center, own)])
        expect(student, check, (times, felt, up, weight, center, limits), expected, reason, 1e-9)

    reason = "Nothing was felt: the move lasts to its end, which is the last instant."
    trial("no collision", reason, 1.0, plain)
    reason = "The threshold is for the norm of the force: three times 30 N is 52 N."
    trial("norm of the force", reason, times[50], diagonal)
    reason = "The thresholds are inputs: here the hand may feel 60 N."
    trial("limits as given", reason, 1.0, diagonal, limits=(60.0, 8.0))
    reason = "The torque has a threshold of its own, and either one ends the move."
    trial("torque counts", reason, times[70], twisted)
    reason = "Only the hand's own weight hangs at the sensor: subtract it, weight * up."
    trial("tare", reason, 1.0, plain, weight=50.0, center=origin)
    reason = "When the hand tilts, its weight wanders through the sensor's axes: subtract it at each instant."
    trial("the hand turns", reason, 1.0, plain, turning, 50.0, origin)
    reason = "The weight acts at the centre of mass and makes a torque at the sensor: center x (weight * up)."
    trial("torque of the weight", reason, 1.0, plain, turning, 30.0, outside)
    reason = "The collision is at the first reading beyond a threshold, even if the force falls again."
    for _ in range(30):
        k = int(rng.integers(1, 100))
        wrench = 0.3 * rng.uniform(-1, 1, (100, 6))
        part, size = (slice(0, 3), 41.0) if rng.uniform() < 0.5 else (slice(3, 6), 8.5)
        wrench[k, part] = random_step(rng, 0.0, size).translation
        trial("first reading beyond", reason, times[k], wrench, turning, float(rng.uniform(5, 20)))


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
def _so4(frame: pin.SE3, a: pin.SE3, b: pin.SE3, radius: float = 0.1) -> float:
    """The distance of the 8-vectors of a and b seen from `frame`, in closed form.

    With half angles and directions of both translations, cos and sin times n, and r = (w, v) the turn from a to b as a
    quaternion, the 8-vectors have the product 2 (cos cos + sin sin n.n) w + 2 sin sin (n x n).v.
    """
    steps = [frame.rotation.T @ (pose.translation - frame.translation) for pose in (a, b)]
    lengths = [np.linalg.norm(step) for step in steps]
    halves = [np.arctan2(length, radius) / 2.0 for length in lengths]
    m, n = (np.sin(half) * d / max(length, 1e-12) for half, d, length in zip(halves, steps, lengths, strict=True))
    *v, w = Rotation.from_matrix(frame.rotation.T @ b.rotation @ a.rotation.T @ frame.rotation).as_quat()
    product = (np.cos(halves[0]) * np.cos(halves[1]) + m @ n) * w + np.cross(m, n) @ v
    return 2.0 * float(np.sqrt(max(0.0, 1.0 - abs(product))))


def _judge_cost(student: Student) -> None:
    rng = make_rng(SEED, 6)

    def trial(check: str, reason: str, path: list[pin.SE3], settled: pin.SE3) -> None:
        new = min(_so4(pose, pose, settled) for pose in path)
        *before, after = (float(np.linalg.norm(pose.translation - path[0].translation)) for pose in [*path, settled])
        back = max(before) - after
        if min(abs(new - 0.1), abs(back - 0.06)) > 1e-3:  # else rounding decides
            time = float(rng.uniform(0.1, 4.0))
            expected = -time + (5.0 if new < 0.1 or back > 0.06 else -10.0 * new)
            told = f"{reason} (d_new = {new:.3f}; the hand came back by {back:.3f} m)"
            expect(student, check, (time, settled, path), expected, told)

    for _ in range(10):
        first = random_pose(rng)
        reason = "The hand rests where it has never been: each unit of d_new counts like ten seconds."
        trial("something new", reason, [first], first * random_step(rng, rng.uniform(0.3, 1.5), 0.1))
        reason = "The hand rests where it was, it has only pressed: 5 s on top of -t_c."
        trial("nothing new", reason, [first], first * random_step(rng, 0.05, 0.005))
    for i in range(20):
        first = random_pose(rng)
        path = [first, *(first * random_step(rng, angle, 0.0) for angle in (0.6, 1.3, 2.0))]
        reason = "d_new is the distance to the nearest pose of the whole path, whichever that is."
        trial("anywhere on the path", reason, path, path[i % 4] * random_step(rng, rng.choice([0.05, 0.4]), 0.005))
    for _ in range(20):
        first, out, turn = random_pose(rng), random_step(rng, 0.0, 1.0).translation, random_step(rng, 1.0, 0.0)
        path = [pin.SE3(first.rotation, first.translation + r * out) for r in (0.0, 0.15, 0.30, rng.uniform(0.2, 0.3))]
        reason = "The pose is new, but nearer to the first one than the furthest of the path by more than 0.06 m."
        shift = rng.uniform(0.1, 0.2) * out
        trial("coming back", reason, path, pin.SE3((first * turn).rotation, first.translation + shift))
        reason = "Coming back by up to 0.06 m does not count, and moving sideways is no coming back at all."
        aside = np.cross(out, random_step(rng, 0.0, 1.0).translation)
        shift = rng.uniform(0.25, 0.32) * aside / np.linalg.norm(aside)
        trial("no coming back", reason, path, pin.SE3((first * turn).rotation, first.translation + shift))


mended_cost = Exercise(
    "mended_cost",
    "the cost that asks for a new pose instead of a long time alone.",
    (
        "Two questions: is the pose of the path nearest to `settled` less than 0.1 away? And has the hand come back?",
        "Coming back is counted in metres: how far from path[0] was the hand at most, and how far is it now?",
        "`min(so4_distance(pose, settled) for pose in path)` is d_new. -t_c is part of the cost in either case.",
    ),
    _judge_cost,
)


def _judge_distance(student: Student) -> None:
    rng = make_rng(SEED, 7)
    unit = pin.SE3.Identity()

    def turned(angle: float) -> pin.SE3:
        return random_step(rng, angle, 0.0)

    def moved(angle: float = 0.0) -> pin.SE3:
        return random_step(rng, angle, rng.uniform(0.02, 0.5))

    def trials(check: str, reason: str, draw: Callable[[], tuple[pin.SE3, pin.SE3, pin.SE3]]) -> None:
        for _ in range(20):
            inputs = draw()
            expect(student, check, inputs, _so4(*inputs), reason, 1e-5)

    reason = "Equal poses have the distance 0, from wherever they are seen."
    trials("equal poses", reason, lambda: (random_pose(rng), *[random_pose(rng)] * 2))
    reason = "A rotation q without translation is G = H = q, and half of its angle stands in q."
    trials("rotation alone", reason, lambda: (unit, unit, turned(rng.uniform(0.1, 1.5))))
    reason = "A translation turns by psi = atan(|d| / R), R = 0.1 m, and half of psi stands in D."
    trials("angle of a translation", reason, lambda: (unit, unit, moved()))
    reason = "(G, H) and (-G, -H) are the same 4-D rotation: the nearer of both counts."
    trials("both signs", reason, lambda: (unit, turned(2.5), turned(3.0)))
    reason = "Each pose is turned in 4-D as seen from the frame: the displacement from a to b alone does not tell."
    trials("two translations", reason, lambda: (unit, moved(), moved()))
    reason = "G = D q and H = conj(D) q, in this order: H undoes what G does to the translation."
    trials("G and H", reason, lambda: (unit, moved(0.5), moved(1.0)))
    reason = "Both poses are meant as seen from the frame: inverse(frame) * pose."
    trials("seen from the frame", reason, lambda: (random_pose(rng), random_pose(rng), random_pose(rng)))


distance_seen_from = Exercise(
    "distance_seen_from",
    "the literal SO(4) metric: how far apart are two poses, both seen from a frame?",
    (
        "First see both poses from the frame: `frame.actInv(a)`. A function turns each of them into its eight numbers.",
        "`pinocchio.Quaternion(w, x, y, z)` multiplies with `*`; `.conjugate()` and `.coeffs()` do the rest."
        " Mind d = 0, which has no direction.",
        "With u and v the eight numbers of a and b, the distance is |u - v| or |u + v|, whichever is less.",
    ),
    _judge_distance,
)


# --- 8 ----------------------------------------------------------------------------------------------------------------
def _fit(centers: np.ndarray, moved: np.ndarray) -> tuple[list[float], float]:
    """The rigid motion of complex points (n,) [m] that fits their velocities (n,) [m/s] best, and what is left over."""
    arms, swings = centers - centers.mean(), moved - moved.mean()
    w = (arms.conjugate() @ swings).imag / (arms.conjugate() @ arms).real
    v = moved.mean() - 1j * w * centers.mean()
    return [v.real, v.imag, w], float(np.sqrt(np.sum(np.abs(moved - v - 1j * w * centers) ** 2)))


def _judge_twist(student: Student) -> None:
    rng = make_rng(SEED, 8)

    def trials(check: str, reason: str, moves: tuple[int, int, int], turned: float = 3.0, slips: float = 0.0) -> None:
        n = 3 if slips else 2
        for _ in range(10):
            steer, (vx, vy, w) = rng.uniform(-turned, turned, n), rng.uniform(-1, 1, 3) * moves
            x, y = rng.uniform(-0.1, 0.1, n), np.linspace(0.25, -0.25, n) + rng.uniform(-0.05, 0.05, n)
            offset, radius = rng.uniform(0.03, 0.09, n), rng.uniform(0.1, 0.2, n)
            along = np.exp(1j * steer)
            centers = x + 1j * y - offset * along  # of the wheels: points of the base, moved by the forks
            rates = (complex(vx, vy) + 1j * w * centers) / along  # real: along the wheel; imaginary: across it
            turning = rates.imag / offset + rng.uniform(-slips, slips, n)
            rolling = rates.real / radius + rng.uniform(-slips, slips, n)
            inputs = (steer, turning, rolling, x, y, offset, radius)
            answer = numbers(student(*inputs), (4,), inputs, reason)
            twist, slip = _fit(centers, (radius * rolling + 1j * offset * turning) * along)
            agree(check, answer[:3], twist, inputs, reason)
            agree("slip", answer[3], slip, inputs, "The slip is the length of all residuals in m/s: a root of squares.")

    reason = "Wheels that point ahead and roll at v / r carry the base at v."
    trials("straight ahead", reason, (1, 0, 0), turned=0.0)
    reason = "Each wheel tells two parts of a velocity: along the wheel by rolling, across it by the fork's swing."
    trials("turned wheels", reason, (1, 1, 0))
    reason = "The pivot at (x, y) moves with (vx - w y, vy + w x); a fork turns over the ground at w + its own rate."
    trials("the base turns", reason, (1, 1, 1))
    reason = "Rates that do not belong together: the twist leaves the least sum of squares, in m/s, of all equations."
    trials("least squares", reason, (1, 1, 1), slips=1.0)


base_twist = Exercise(
    "base_twist",
    "casters backwards: from the rates of n casters to the base's twist, and how much they slip.",
    (
        "Write both equations of section 1 with the unknowns vx, vy, w on one side and what is measured on the other.",
        "Along: cos phi vx + sin phi vy + (x sin phi - y cos phi) w = r theta'. The other one has b phi' on the right.",
        "Stack the 2 n rows into A (2 n, 3) and m (2 n,): `np.linalg.lstsq(A, m)[0]` is the twist. What is left of m?",
    ),
    _judge_twist,
)
