"""Paper 4 measured: cost and exactness of a step, paths through full stretch, moving base, letting go, role swap, and
the passage through doors.
"""

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin

from tutorialbot.ik import knob_release, moving_base, role_swap, singular_peers, stretch
from tutorialbot.ik.full_workspace import full_workspace
from tutorialbot.ik.passage import run_passage
from tutorialbot.ik.passage_doors import pass_random_doors
from tutorialbot.ik.singularity_consistent import SphericalArm, elbow_peak_rate, joint_velocity_in_matrices
from tutorialbot.ik.stretch_paths import radial
from tutorialbot.measuring import cpu_seconds, wilson
from tutorialbot.runs import progress
from tutorialbot.seeding import make_rng

FIRST_SEED = 9000  # nothing was tuned on poses drawn from it
BASE = "damped least squares"  # with its Jacobian: what a step's cost is compared with
SPEED = 0.1  # of the tip on the paths [m/s]


def _drawn(arm: SphericalArm, count: int, stream: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return random poses within the limits, with random twists, (7,) [rad] and (6,)."""
    rng, limits = make_rng(FIRST_SEED, stream), np.array(arm.limits)
    return [(rng.uniform(-limits, limits), 0.1 * rng.normal(size=6)) for _ in range(count)]


# -- a step ----------------------------------------------------------------------------------------------------------


def steps(repeats: int = 7, count: int = 500) -> list[dict]:
    """Return CPU time [us] of a step from q and twist to qdot, Jacobian included, and how many times BASE's it is."""
    arm = SphericalArm()
    methods: dict[str, Callable] = {
        BASE: singular_peers.damped_least_squares,
        "singularity-consistent": lambda arm, q, twist: arm.joint_velocity(q, twist).qdot,
        "the same, in matrices": joint_velocity_in_matrices,
        "pseudo-inverse": singular_peers.pseudo_inverse,
        "adaptive damping": singular_peers.adaptive_least_squares,
        "rate-limited QP, DAQP": singular_peers.rate_limited_program,
        "rate-limited QP, pink": singular_peers.pink_program,
    }
    drawn = _drawn(arm, count, 0)
    few = drawn[: max(1, count // 20)]
    slow = ("the same, in matrices", "rate-limited QP, pink")
    used = {name: few if name in slow else drawn for name in methods}
    actions = {name: lambda name=name: [methods[name](arm, q, twist) for q, twist in used[name]] for name in methods}
    for action in actions.values():
        action()
    least = cpu_seconds(actions, repeats)
    each = {name: least[name] / len(used[name]) for name in methods}
    return [{"method": name, "microseconds": round(1e6 * each[name], 2), "times": round(each[name] / each[BASE], 2)}
            for name in methods]  # fmt: skip


def exactness(count: int = 2000) -> list[dict]:
    """Return the largest |J qdot - b twist| [m/s, rad/s], J by pinocchio, where no damping is on, by elbow's angle.

    "singular": sin q4 at the most that large; "damped": poses near the shoulder's or the wrist's own singularity.
    """
    arm, rows = SphericalArm(), []
    for near in (None, 1e-3, 1e-9, 0.0):
        worst, fastest, damped = 0.0, 0.0, 0
        for q, twist in _drawn(arm, count, 1):
            q[3] = q[3] if near is None else near * np.sign(q[3])
            found = arm.joint_velocity(q, twist)
            damped += found.damped
            if not found.damped:
                worst = max(worst, float(np.abs(arm.jacobian(q) @ found.qdot - found.scale * twist).max()))
                fastest = max(fastest, float(np.abs(found.qdot[3]) / np.linalg.norm(twist)))
        rows.append({"q4": "any" if near is None else near, "poses": count, "damped": damped, "residual": worst,
                     "elbow_rate_per_twist": round(fastest, 2)})  # fmt: skip
    return rows


def peaks() -> list[dict]:
    """Return the peak of |qdot4| [rad/s] on the straight line out of the workspace, and what the closed form says."""
    arm, rows = SphericalArm(), []
    path = radial(arm, run_up=0.02)
    for n in (1, 2, 3, 4, 5):
        for scaling in ("sine", "quintic"):
            solver, dt = stretch.singularity_consistent(n, scaling), 4e-3 / 2**n  # resolves epsilon / qdot4
            found = stretch.follow(arm, path, solver, speed=SPEED, dt=dt)
            peak, closed = float(np.abs(found.qdot[:, 3]).max()), elbow_peak_rate(arm, SPEED, n, scaling)
            rows.append({"n": n, "scaling": scaling, "closed_form": round(closed, 4), "measured": round(peak, 4),
                         "ratio": round(peak / closed, 4)})  # fmt: skip
    return rows


# -- paths -----------------------------------------------------------------------------------------------------------

DIGITS = {"peak_rate": 3, "direction_error": 9, "deviation": 4, "behind": 3, "seconds": 3, "nominal_seconds": 3}


def five_paths() -> list[dict]:
    """Return a row a path and method, see `stretch.table`, rounded."""
    rows = progress(stretch.table(speed=SPEED), total=5 * len(stretch.solvers()), description="paths")
    return [row | {name: round(row[name], digits) for name, digits in DIGITS.items()} for row in rows]


def together() -> list[dict]:
    """Return a row a method for the line on which base and arm move together: error [mm], rates, acceleration."""
    rows = []
    for method in progress(moving_base.METHODS, description="moving base"):
        found = moving_base.line(method)
        rows.append({
            "method": method, "error": round(1e3 * float(found.error.max()), 3),
            "peak_rate": round(float(np.abs(found.joint_rates).max()), 2), "least_q4": round(found.nearest, 6),
            "base_acceleration": round(found.base_acceleration, 2),
        })  # fmt: skip
    return rows


def release() -> list[dict]:
    """Return a row a way of letting go of the knob (Fig. 6): peak rate, how far the hand got off [mm], the elbow."""
    rows = []
    for way in knob_release.WAYS:
        found = knob_release.release(way)
        rows.append({
            "way": way, "peak_rate": round(found.peak_rate, 2), "off_at_the_end": round(1e3 * float(found.off[-1]), 2),
            "farthest": round(1e3 * float(found.off.max()), 2), "error": round(1e3 * float(found.error.max()), 3),
            "entered": found.entered, "flipped": found.flipped,
            "base_moved": round(1e3 * float(np.linalg.norm(found.base[-1, :2] - found.base[0, :2])), 1),
        })  # fmt: skip
    return rows


def workspace() -> list[dict]:
    """Return a row a margin of |q4| [deg]: the space left [%] and how far the door opens [deg] with a grasp, per K."""
    data = full_workspace()
    return [{
        "margin": round(math.degrees(margin)), "volume": round(100 * float(data.volume[i]), 1),
        **{f"{grasp} K={k:g}": round(math.degrees(data.opening[j, h, i]), 2)
           for j, grasp in enumerate(data.grasps) for h, k in enumerate(data.shares)},
    } for i, margin in enumerate(data.margins)]  # fmt: skip


def swaps(count: int = 500) -> list[dict]:
    """Return how far bodies move when base and tip change their roles, and the error of the identity behind it."""
    arm, moved, identity = SphericalArm(), 0.0, 0.0
    for q, twist in _drawn(arm, count, 2):
        before = role_swap.Stance(arm, pin.exp6(10.0 * twist), q)
        after = role_swap.swap(before)
        bodies = zip(role_swap.body_poses(before), role_swap.body_poses(after), strict=True)
        moved = max(moved, *(float(np.abs(a.homogeneous - b.homogeneous).max()) for a, b in bodies))
        seen = role_swap.F * arm.forward(q[::-1].copy()) * role_swap.F
        identity = max(identity, float(np.abs(arm.forward(q).inverse().homogeneous - seen.homogeneous).max()))
    return [{"poses": count, "bodies_moved": moved, "identity": identity}]


# -- the passage -----------------------------------------------------------------------------------------------------


def passages(repeats: int = 3) -> list[dict]:
    """Return a row each for the usual door, planned and played in MuJoCo: seconds of motion, CPU time (search, motion
    and guards together), how many times real time, and what was kept on the way.
    """
    runs = {"kinematic": run_passage(), "dynamic": run_passage(dynamics=True)}
    actions = {"kinematic": run_passage, "dynamic": lambda: run_passage(dynamics=True)}
    least = cpu_seconds(actions, repeats)
    return [{
        "run": name, "passed": run.passed, "seconds": round(float(run.times[-1]), 2),
        "cpu_seconds": round(least[name], 3),
        "times_real_time": round(float(run.times[-1]) / least[name], 1),
        "peak_rate": round(float(np.abs(run.joint_rates).max()), 3), "clearance": round(1e3 * run.min_clearance, 1),
        "tip_error": float(1e3 * run.max_tip_error),
        "door_gap": round(math.degrees(run.angle_gap), 2) if run.replay else None,
    } for name, run in runs.items()]  # fmt: skip


def phases() -> list[dict]:
    """Return a row a phase of the usual passage: seconds, the largest speeds in it, the nearest to door and frame."""
    return [{
        "phase": report.name, "seconds": round(report.seconds, 2), "base": round(report.base_speed, 2),
        "base_turn": round(report.base_turn, 2), "door_deg": round(math.degrees(report.door_rate), 1),
        "joints": round(report.joint_rate, 2), "nearest": round(1e3 * report.nearest, 1),
    } for report in run_passage().reports]  # fmt: skip


def doors(count: int = 100) -> list[dict]:
    """Return a row a way of choosing way points: how many of the doors 0, 1, ... are passed, and at what cost.

    Nothing was tuned on these doors. "as they are": the usual door's way points, no search.
    """
    rows = []
    for name, opening, dynamics, searched in (
        ("as they are", 70, False, False), ("searched", 70, False, True), ("searched, in MuJoCo", 70, True, True),
        ("searched", 60, False, True), ("searched", 55, False, True),
    ):  # fmt: skip
        results = list(pass_random_doors(range(count), opening_deg=opening, dynamics=dynamics, searched=searched))
        passed = [result for result in results if result.passed]
        low, high = wilson(len(passed), count)
        rows.append({
            "way_points": name, "opening_deg": opening, "doors": count, "passed": len(passed), "low": round(low, 3),
            "high": round(high, 3), "looked_at": max((result.looked_at for result in passed), default=0),
            "clearance": round(1e3 * min((result.min_clearance for result in passed), default=math.nan), 1),
            "peak_rate": round(max((result.max_joint_rate for result in passed), default=math.nan), 2),
            "door_gap": round(math.degrees(max(r.angle_gap for r in passed)), 2) if dynamics and passed else None,
        })  # fmt: skip
    return rows
