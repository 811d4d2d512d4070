"""Through a door that shuts by itself (paper 4, section 4, Fig. 4): the passage as a state machine.

Each phase has a reference (its legs), guards that are watched while it runs and after it, an exit test, and a recovery:

    a grasp, b open a little, c open wide, d turn about the knob, e keep with the base, f hold with the arm,
    g move the base, h go through, i let go

Where the door stays open by itself, beyond the closer's hold angle, the hand lets go of the knob after (c), and the
robot drives through with its arm folded. Recoveries: a phase with joints that are too fast is done again slower; an arm
that is stretched too far, or changes its branch, while the hand holds something, has the base come closer and goes on;
a phase that fails otherwise is the end of this try, and the next one has other way points.
"""

from dataclasses import dataclass, replace

import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, finite_number, whole_number
from tutorialbot.ik.passage_closing import let_go
from tutorialbot.ik.passage_follow import Piece, follow, move_arm
from tutorialbot.ik.passage_guards import FASTEST, exit_margin, hand, least_elbow, stop_margin, watch
from tutorialbot.ik.passage_legs import ArmLeg, HandLeg, hand_duration, least_jerk, spline
from tutorialbot.ik.passage_plan import DEG, KEEP, WayPoints
from tutorialbot.ik.passage_search import NoPlan, Phase, Plan, search
from tutorialbot.ik.passage_stays import search_staying
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import BASE_RADIUS

TRIES, SLOWER, APPROACHES = 3, 3, 3  # of a passage; of a phase that is too fast; of the base toward the hand
HOPELESS = 5.0  # too fast by this factor: slower is no cure
CLOSER = 0.10  # how far the base comes closer [m]
LEAST_OPENING = 10.0 * DEG
ORDER = 2  # n of eq (2)
SURELY = 0.25 * DEG  # beyond the hold angle: a loaded arm gives way by 0.1 degree, and the door must stay
AGREE = 3.0 * DEG  # of the door's angle in MuJoCo with the kinematic one


@dataclass(frozen=True)
class Failure:
    """Where a passage ended: the phase, the guard (or "exit") that failed, and its margin, < 0 [m, rad or rad/s].

    margin: -1 also stands for "no margin known", where there is no free motion, and for a replay that failed. Of a
    bump in MuJoCo it is -force [N].
    """

    phase: str
    guard: str
    margin: float


@dataclass(frozen=True)
class PhaseReport:
    """One phase: seconds; margins of its guards and of its exit test; nearest [m] to door and frame; its recoveries.

    base_speed [m/s], base_turn, door_rate, joint_rate [rad/s]: the largest in it.
    """

    name: str
    seconds: float
    margins: dict[str, float]
    nearest: float
    base_speed: float
    base_turn: float
    door_rate: float
    joint_rate: float
    recoveries: tuple[str, ...]


@dataclass(frozen=True)
class Passage:
    """A passage through a door at n instants.

    phases: names in the order in which they were begun; times (n,) [s]; base (n, 3) x, y, yaw; q, joint_rates (n, 7);
    door_angle (n,) (measured, when it was played in MuJoCo, else as planned); grasped (n,): the hand holds the knob;
    phase (n,): number in `phases`; scale (n,): b; min_clearance [m]: base and arm from frame and door; apart, where the
    door is concerned: the base's rim while it leans, palm and jaws of a hand that takes, holds or leaves something;
    max_tip_error [m]; reports: one for each phase; failure: None when passed; tries: with how many sets of way points;
    looked_at: how many the search for them looked at; way: the last of them; replay: MuJoCo's answer, None without;
    angle_gap [rad]: how far its door was from the planned angle, up to (h).
    """

    door: ClosingDoor
    opening: float
    passed: bool
    phases: tuple[str, ...]
    times: np.ndarray
    base: np.ndarray
    q: np.ndarray
    joint_rates: np.ndarray
    door_angle: np.ndarray
    grasped: np.ndarray
    phase: np.ndarray
    scale: np.ndarray
    min_clearance: float
    max_tip_error: float
    reports: tuple[PhaseReport, ...]
    failure: Failure | None
    tries: int
    looked_at: int
    way: WayPoints | None
    replay: object = None
    angle_gap: float = float("nan")


def run_passage(
    door: ClosingDoor | None = None, *, opening_deg: float = 70, dynamics: bool = False, seed: int = 0
) -> Passage:
    """Take the home robot through `door` (default: the usual one), which it opens to `opening_deg` degrees.

    dynamics: play the motion in MuJoCo as well, whose door angle is then the result's; seed: of the search for way
    points, where the usual ones do not fit. What cannot be done is a result with `failure`, not an error.

    Raises InvalidType or InvalidValue for what is no ClosingDoor, a doorway that the robot does not fit through, an
    opening below 10 degrees or beyond the door's own stop, a seed that is no whole number >= 0.
    """
    door, opening = _checked(ClosingDoor() if door is None else door, opening_deg, dynamics)
    arm, seed = SphericalArm(), whole_number("seed", seed)
    for tries in range(1, TRIES + 1):
        plan = _look(door, opening)(arm, door, opening, seed, skipped=tries - 1)
        passage = _nothing(door, opening, plan) if isinstance(plan, NoPlan) else run_plan(arm, door, opening, plan)
        passage = replace(passage, tries=tries)
        if passage.passed or isinstance(plan, NoPlan):
            break
    return _in_mujoco(passage) if dynamics and passage.passed else passage


def run_with(
    way: WayPoints, door: ClosingDoor | None = None, *, opening_deg: float = 70, dynamics: bool = False
) -> Passage:
    """The same with given way points, which are taken as they are: no other ones are looked for."""
    if not isinstance(way, WayPoints):
        raise InvalidType("way", way, "WayPoints")
    door, opening = _checked(ClosingDoor() if door is None else door, opening_deg, dynamics)
    arm = SphericalArm()
    plan = _look(door, opening)(arm, door, opening, way=way, draws=1)
    passage = _nothing(door, opening, plan) if isinstance(plan, NoPlan) else run_plan(arm, door, opening, plan)
    return _in_mujoco(passage) if dynamics and passage.passed else passage


def _look(door: ClosingDoor, opening: float):
    """The search that this opening needs."""
    return search_staying if opening >= door.hold_angle + SURELY else search


def run_plan(arm: SphericalArm, door: ClosingDoor, opening: float, plan: Plan) -> Passage:
    """Go through the phases of `plan`, as far as their guards and exit tests let them. opening [rad]."""
    q, base = plan.q, plan.phases[0].legs[0].path[0, :3]
    runs, reports, failure = [], [], None
    for phase in plan.phases:
        legs, pieces, recoveries = _run_phase(arm, door, phase, base, q)
        base, q = pieces[-1].base[-1], pieces[-1].q[-1]
        watched = watch(arm, door, legs, pieces)
        margins = watched.margins | {"exit": exit_margin(phase.name, arm, door, plan.way, opening, pieces[-1])}
        if pieces[-1].stop:
            margins |= {pieces[-1].stop: stop_margin(arm, pieces[-1])}
        reports.append(_report(phase.name, pieces, margins, watched.nearest, recoveries))
        runs.append((legs, pieces))
        worst = min(margins, key=margins.get)
        if margins[worst] < 0.0:
            stopped = pieces[-1].stop or worst
            failure = Failure(phase.name, stopped, margins[stopped])
            break
    return _passage(door, opening, plan, runs, reports, failure)


def _run_phase(arm, door, phase: Phase, base, q) -> tuple[tuple, list[Piece], list[str]]:
    """Run a phase, and again slower while its joints are too fast."""
    legs, recoveries = phase.legs, []
    for again in range(SLOWER + 1):
        done, pieces, helped = _run_legs(arm, door, legs, base, q)
        fastest = max(np.abs(piece.rates).max() for piece in pieces)
        if not FASTEST < fastest < HOPELESS * FASTEST or again == SLOWER:
            break
        recoveries.append("slower")
        legs = tuple(replace(leg, duration=leg.duration * 1.05 * fastest / FASTEST) for leg in legs)
    return done, pieces, recoveries + helped


def _run_legs(arm, door, legs, base, q) -> tuple[tuple, list[Piece], list[str]]:
    done, pieces, recoveries, todo = [], [], [], list(legs)
    while todo:
        leg = _from_here(todo.pop(0), base, q)
        piece = _run_leg(arm, door, leg, q)
        base, q = piece.base[-1], piece.q[-1]
        done, pieces = [*done, leg], [*pieces, piece]
        if not piece.stop:
            continue
        if piece.stop not in ("stretch", "branch") or len(recoveries) == APPROACHES:
            break
        recoveries.append("base closer")
        todo = [*_closer(arm, leg, piece), *todo]
    return tuple(done), pieces, recoveries


def _run_leg(arm, door, leg: HandLeg | ArmLeg, q: np.ndarray) -> Piece:
    if isinstance(leg, HandLeg):
        watched = leg.path[-1, 3] < door.hold_angle and not leg.nearing  # where the door stays open, it may stretch
        return follow(arm, leg, q, ORDER, least_elbow(arm) if watched else 0.0)
    piece = move_arm(leg)
    return let_go(arm, door, piece) if leg.closing else piece


def _from_here(leg: HandLeg | ArmLeg, base: np.ndarray, q: np.ndarray) -> HandLeg | ArmLeg:
    """The same leg, from where base and arm are: what they are off is made good along it."""
    if isinstance(leg, HandLeg):
        path = leg.path.copy()
        path[:, :3] += np.linspace(1.0, 0.0, len(path))[:, None] * (base - path[0, :3])
        return replace(leg, path=path)
    left = np.linspace(1.0, 0.0, len(leg.q))[:, None]
    return replace(leg, q=leg.q + left * (q - leg.q[0]), base=leg.base + left * (base - leg.base[0]))


def _closer(arm: SphericalArm, leg: HandLeg, piece: Piece) -> list[HandLeg]:
    """Legs of the recovery: the base comes closer to the hand, which stays; then the rest of `leg`, as near."""
    s = float(least_jerk(np.array(piece.s))[0])
    here, m = spline(leg.path)(s), len(leg.path)
    away = hand(arm, piece.base[-1], piece.q[-1])[0][:2] - here[:2]
    step = CLOSER * away / np.linalg.norm(away)
    near, rest = np.tile(here, (m, 1)), spline(leg.path)(np.linspace(s, 1.0, m))
    near[:, :2] += np.linspace(0.0, 1.0, m)[:, None] * step
    rest[:, :2] += step
    still = np.zeros((m, 7))
    return [replace(leg, path=near, duration=1.5 * hand_duration(near, still), nearing=True),
            replace(leg, path=rest, duration=max(1.0, (1.0 - s) * leg.duration + 1.0))]  # fmt: skip


def _report(name, pieces, margins, nearest, recoveries) -> PhaseReport:
    flat, turn, door, joint = 0.0, 0.0, 0.0, 0.0
    for piece in pieces:
        gap = np.diff(piece.times).clip(1e-9)
        moved = np.abs(np.diff(piece.base, axis=0)) / gap[:, None]
        flat = max(flat, np.hypot(moved[:, 0], moved[:, 1]).max(initial=0.0))
        turn = max(turn, moved[:, 2].max(initial=0.0))
        door = max(door, (np.abs(np.diff(piece.theta)) / gap).max(initial=0.0))
        joint = max(joint, np.abs(piece.rates).max())
    seconds = float(sum(piece.times[-1] for piece in pieces))
    return PhaseReport(name, seconds, margins, nearest, float(flat), float(turn), float(door), float(joint),
                       tuple(recoveries))  # fmt: skip


def _passage(door, opening, plan: Plan, runs, reports, failure) -> Passage:
    columns, start = [], 0.0
    for number, (legs, pieces) in enumerate(runs):
        for leg, piece in zip(legs, pieces, strict=True):
            rows = slice(1 if columns else 0, None)  # a piece begins where the one before it ends
            count = len(piece.times[rows])
            columns.append((start + piece.times[rows], piece.base[rows], piece.q[rows], piece.rates[rows],
                            piece.theta[rows], np.full(count, leg.grasped), np.full(count, number),
                            piece.scale[rows]))  # fmt: skip
            start += piece.times[-1]
    merged = [np.concatenate(parts) for parts in zip(*columns, strict=True)]
    error = max(piece.tip_error.max() for _, pieces in runs for piece in pieces)
    nearest = min(report.nearest for report in reports)
    names = tuple(report.name for report in reports)
    return Passage(door, opening, failure is None, names, *merged, nearest, float(error), tuple(reports), failure, 1,
                   plan.tried, plan.way)  # fmt: skip


def _nothing(door: ClosingDoor, opening: float, plan: NoPlan) -> Passage:
    """A passage that has not begun, since no way points were found."""
    none, joints, nan = np.zeros(0), np.zeros((0, 7)), float("nan")
    failure = Failure(plan.phase, f"no way points: {plan.guard}", plan.margin)
    return Passage(door, opening, False, (), none, np.zeros((0, 3)), joints, joints, none, none.astype(bool),
                   none.astype(int), none, nan, nan, (), failure, 0, sum(plan.reasons.values()), None)  # fmt: skip


def _in_mujoco(passage: Passage) -> Passage:
    """The same passage as MuJoCo plays it: the door's angle is measured, and nothing but pads may touch the door."""
    from tutorialbot.scene.passage_world import replay

    played = replay(passage.door, passage.times, passage.base, passage.q, passage.grasped)
    held = passage.phase < len(passage.phases) - 1 if "let go" in passage.phases[-1] else passage.phase >= 0
    gap = float(np.abs(played.door_angle - passage.door_angle)[held].max())
    failure = None
    if played.outcome != "finished":
        failure = Failure(passage.phases[-1], played.outcome, -1.0)
    elif gap > AGREE:
        worst = int(np.argmax(np.where(held, np.abs(played.door_angle - passage.door_angle), 0.0)))
        failure = Failure(passage.phases[passage.phase[worst]], "door angle", AGREE - gap)
    elif played.bumps:
        bump = played.bumps[0]
        at = min(int(np.searchsorted(passage.times, bump.first)), len(passage.phase) - 1)
        failure = Failure(passage.phases[passage.phase[at]], f"{bump.robot} touches {bump.door}", -bump.force)
    return replace(passage, replay=played, angle_gap=gap, door_angle=played.door_angle, passed=failure is None,
                   failure=failure)  # fmt: skip


def _checked(door: ClosingDoor, opening_deg: float, dynamics: bool) -> tuple[ClosingDoor, float]:
    """The door and the opening [rad], or an error."""
    if not isinstance(door, ClosingDoor):
        raise InvalidType("door", door, "a ClosingDoor")
    left, right = door.opening
    needed = 2.0 * (BASE_RADIUS + KEEP)
    if right - left < needed:
        wanted = f"an opening of at least {needed:.2f} m: the robot's base is {2 * BASE_RADIUS:.2f} m wide"
        raise InvalidValue("door", f"ClosingDoor with an opening of {right - left:.3f} m", wanted)
    if not isinstance(dynamics, bool):
        raise InvalidType("dynamics", dynamics, "True or False")
    return door, finite_number("opening_deg", opening_deg, LEAST_OPENING / DEG, door.open_limit / DEG) * DEG
