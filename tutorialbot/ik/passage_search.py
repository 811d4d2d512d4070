"""Find the way points of a passage for a door, and make them the legs of its phases.

Way points that fit many doors come first; where they do not, others are drawn around them, until the base's footprint
and the arm are clear of door, frame and robot all along and the arm has one way to do it (`passage_plan.options`).
"""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from tutorialbot.ik import passage_clearance as clearance
from tutorialbot.ik.base_sharing import Shares
from tutorialbot.ik.passage_connect import connect
from tutorialbot.ik.passage_legs import ArmLeg, HandLeg, arm_duration, hand_duration
from tutorialbot.ik.passage_plan import (
    DEG,
    KEEP,
    KEEP_LIMIT,
    Option,
    WayPoints,
    footprint,
    free_of,
    opening_paths,
    options,
    through_paths,
)
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.seeding import make_rng

PHASES = (
    "a grasp", "b open a little", "c open wide", "d turn about the knob", "e keep with the base", "f hold with the arm",
    "g move the base", "h go through", "i let go",
)  # fmt: skip
TRIES = 600  # draws of way points for each half of the passage
LONGEST, PATIENCE = 60.0, 40  # a plan that takes longer [s] has to compete with what so many more draws bring
PAIRS = 6  # postures before and after (f) that are tried together
BENT = 0.4  # the elbow in free motions, at least [rad]
BEHIND = 0.30  # the hand's distance from the closed door at the end [m]


@dataclass(frozen=True)
class Phase:
    """A phase of the passage: its name in PHASES, and the legs that it consists of."""

    name: str
    legs: tuple[HandLeg | ArmLeg, ...]


@dataclass(frozen=True)
class Plan:
    """Phases in order; q (7,) [rad] of the start; the way points that they come from; how many were looked at."""

    phases: tuple[Phase, ...]
    q: np.ndarray
    way: WayPoints
    tried: int

    @property
    def seconds(self) -> float:
        """How long all legs take [s], without recoveries."""
        return sum(leg.duration for phase in self.phases for leg in phase.legs)


@dataclass(frozen=True)
class NoPlan:
    """No way points were found: the phase that has none, the guard that stopped most of them, the best margin of it.

    reasons: how often each guard stopped one.
    """

    phase: str
    guard: str
    margin: float
    reasons: dict[str, int]


@dataclass
class Tally:
    """How often each guard stopped way points, and the best margin [m, rad] there was."""

    count: Counter
    best: dict[str, float]

    @classmethod
    def empty(cls) -> "Tally":
        """Return a tally of nothing."""
        return cls(Counter(), {})

    def add(self, guard: str, margin: float) -> None:
        """Count one more, and keep the better margin."""
        self.count[guard] += 1
        self.best[guard] = max(margin, self.best.get(guard, -np.inf))

    def result(self, phase: str) -> NoPlan:
        """Name the guard that stopped most."""
        guard = max(self.count, key=self.count.get)
        return NoPlan(phase, guard, self.best[guard], dict(self.count))


def search(
    arm: SphericalArm, door: ClosingDoor, opening: float, seed: int = 0, way: WayPoints | None = None,
    skipped: int = 0, draws: int = TRIES,
) -> Plan | NoPlan:  # fmt: skip
    """Return a plan that opens the door to `opening` [rad], or what stands in the way.

    way: way points to start from, by default `fitted`; seed: of the draws, which come where these do not do, or where
    `skipped` > 0 says that they have been tried; draws: how many are looked at for either half of the passage.
    """
    first, rng, tally = fitted(door, opening) if way is None else way, make_rng(seed, 4), Tally.empty()
    for number in range(skipped, skipped + draws):
        way = first if number == 0 else vary_opening(first, rng, number)
        paths = opening_paths(door, way, opening)
        found = tried(arm, door, paths, "knob", tally)
        if found:
            return _search_through(arm, door, opening, rng, way, (paths, found), number + 1, skipped, draws)
    return tally.result(PHASES[2])


def _search_through(arm, door, opening, rng, way, opened, tried_before, skipped, draws) -> Plan | NoPlan:
    """The second half: `opened` is the first, paths and options."""
    tally, plans, since = Tally.empty(), [], 0
    paths, found = opened
    for number in range(skipped, skipped + draws):
        way = way if number == 0 else vary_through(door, way, rng)
        later = through_paths(door, way, opening)
        after = tried(arm, door, later, "panel", tally)
        joined = _join(arm, door, opening, found, after, later, rng) if after else None
        if joined:
            phases, q = _phases(arm, (paths, joined[0]), (later, joined[1]), joined[2])
            plans.append(Plan(phases, q, way, tried_before + number - skipped + 1))
        elif after:
            tally.add("free motion", -1.0)
        since += bool(plans)
        if plans and (plans[-1].seconds < LONGEST or since > PATIENCE):
            break
    if plans:
        return min(plans, key=lambda plan: plan.seconds)
    return tally.result(PHASES[5] if tally.count["free motion"] else PHASES[6])


def fitted(door: ClosingDoor, opening: float) -> WayPoints:
    """Return the usual way points for this door: those in the doorway go with its width."""
    usual, wider = WayPoints(), door.width / 0.85
    stretched = {name: (getattr(usual, name)[0] * wider, getattr(usual, name)[1])
                 for name in ("aside", "inside", "through")}  # fmt: skip
    return replace(usual, little=min(usual.little, opening / 2), nearly=min(usual.nearly, opening / 2), **stretched)


def vary_opening(way: WayPoints, rng: np.random.Generator, number: int) -> WayPoints:
    """Return way points drawn around `way` for (a) to (e), the wider the more were tried."""
    size = 0.02 + 0.10 * min(1.0, number / 100.0)

    def near(point: tuple[float, float], share: float = 1.0) -> tuple[float, float]:
        return tuple((np.array(point) + share * rng.normal(0.0, size, 2)).tolist())

    pivots = np.array(way.pivots) + rng.normal(0.0, 2.0 * size, len(way.pivots))
    pivots[0] = 0.5 * pivots[0]
    return replace(
        way, start=near(way.start), wide=near(way.wide), around=tuple(near(point) for point in way.around),
        lean=float(np.clip(way.lean + rng.normal(0.0, 2.0 * size), 20.0 * DEG, 80.0 * DEG)),
        pivots=tuple(pivots.clip(-20.0 * DEG, 75.0 * DEG).tolist()),
    )  # fmt: skip


def vary_through(door: ClosingDoor, way: WayPoints, rng: np.random.Generator) -> WayPoints:
    """Return way points with those of (f) to (h) drawn afresh: hold, aside, inside, through, nearly."""
    room = clearance.BASE_RADIUS + KEEP
    left, right = door.opening[0] + room, door.opening[1] - room
    return replace(
        way,
        hold=tuple(rng.uniform((-0.55, 0.85, -0.3), (-0.2, 1.1, 0.3)).tolist()),
        aside=tuple(rng.uniform((0.4 * door.width, -0.6), (door.width, -0.3)).tolist()),
        off=float(rng.uniform(60.0 * DEG, 100.0 * DEG)),
        inside=tuple(rng.uniform((left, -0.25), (right, 0.2)).tolist()),
        through=tuple(rng.uniform((left, 0.25), (right, 0.5)).tolist()),
        nearly=float(rng.uniform(10.0 * DEG, 45.0 * DEG)),
    )


def tried(arm: SphericalArm, door: ClosingDoor, paths: list[np.ndarray], grip: str, tally: Tally) -> list[Option]:
    """Return the options for `paths`, and count what is wrong when there are none."""
    margin = footprint(door, paths)
    if margin < 0.0:
        tally.add("footprint", margin)
        return []
    found, guard, margin = options(arm, door, paths, grip)
    if not found:
        tally.add(guard, margin)
    return found


def _join(arm, door, opening, before, after, paths, rng) -> tuple[Option, Option, list] | None:
    """The first pair of options between which the arm can go, and the postures on its way (with yaw 0)."""
    free = free_of(arm, door, opening, paths[1][0, :3])
    pairs = []
    for one in before[:8]:
        for two in after[:8]:
            start, end = one.joints[-1][-1], two.joints[0][0].copy()
            end[0] = start[0] + (end[0] - start[0] + np.pi) % (2.0 * np.pi) - np.pi
            pairs.append((np.abs(end - start).max() + 0.5 * (one.effort + two.effort), one, two, start, end))
    pairs.sort(key=lambda pair: pair[0])
    for tries in (0, 300):
        for _, one, two, start, end in pairs[: 20 if tries == 0 else PAIRS]:
            high = np.array(arm.limits) - KEEP_LIMIT
            middle = np.r_[(start[0] + end[0]) / 2.0, np.zeros(6)]
            low = middle - high
            low[3] = BENT
            between = connect(free, start, end, low, middle + high, rng, tries)
            if between:
                return one, two, between
    return None


def _phases(arm, opened, gone, between) -> tuple[tuple[Phase, ...], np.ndarray]:
    """Legs of all phases, and the joints at the start; now the base's yaw comes in (see `passage_plan`)."""
    (paths, before), (later, after) = opened, gone
    yaw = (between[0][0] + between[-1][0]) / 2.0  # of the base in (e) and (f): joint 1 turns to both sides
    hands, start = hand_legs(arm, paths, before, before.joints[4][-1, 0] - yaw)
    shift = round((between[-1][0] - after.joints[0][0, 0]) / (2.0 * np.pi)) * 2.0 * np.pi
    joints = [q + np.r_[shift, np.zeros(6)] for q in after.joints]
    kept = joints[0][-1, 0] - yaw  # joint 1 from (g) on
    moved = [_turned(later[0], joints[0], joints[0][:, 0] - yaw)]
    moved += [_steadier(arm, path, q, kept) for path, q in zip(later[1:], joints[1:], strict=True)]
    hands += [HandLeg(path, "panel", after.roll, after.swivel, hand_duration(path, q), leaning=number < 2)
              for number, (path, q) in enumerate(moved)]  # fmt: skip
    postures, here = np.array(between) - np.r_[yaw, np.zeros(6)], hands[5].path[-1]
    free = [ArmLeg(np.array(two), np.tile(here[:3], (2, 1)), np.full(2, here[3]), arm_duration(np.array(two)),
                   leaning=True) for two in zip(postures[:-1], postures[1:], strict=True)]  # fmt: skip
    groups = [*([hand] for hand in hands[:4]), hands[4:6], [*free, hands[6]], [hands[7]], [hands[8]],
              [_leave(*moved[2])]]  # fmt: skip
    return tuple(Phase(name, tuple(group)) for name, group in zip(PHASES, groups, strict=True)), start


def hand_legs(
    arm: SphericalArm, paths: list[np.ndarray], option: Option, kept: float
) -> tuple[list[HandLeg], np.ndarray]:
    """Return legs for `paths` with the hand at the knob, and the joints (7,) at their start.

    The first is the grasp, the second (b), the last lets go; the base stands in the first and in the last. kept [rad]:
    joint 1 at the ends of those between.
    """
    legs = [_steadier(arm, path, q, kept) for path, q in zip(paths, option.joints, strict=True)]
    legs[1] = _shared_yaw(legs[1][0], paths[1], option.joints[1])
    for number, yaw in ((0, legs[1][0][0, 2]), (len(paths) - 1, legs[-2][0][-1, 2])):
        legs[number] = _turned(paths[number], option.joints[number], option.joints[number][:, 0] - yaw)
    last = len(legs) - 1
    hands = [HandLeg(path, "knob", option.roll, option.swivel, hand_duration(path, q), leaning=number > 3,
                     grasped=0 < number < last) for number, (path, q) in enumerate(legs)]  # fmt: skip
    return hands, legs[0][1][0]


def _turned(path: np.ndarray, q: np.ndarray, kept: float | np.ndarray, even: bool = False) -> tuple:
    """The same with the base turned so that joint 1 is `kept`; `even`: at both ends, the base turns evenly between."""
    path, q = path.copy(), q.copy()
    yaw = q[:, 0] - kept
    if even:
        yaw = np.linspace(yaw[0], yaw[-1], len(yaw))
    path[:, 2], q[:, 0] = yaw, q[:, 0] - yaw
    return path, q


def _steadier(arm: SphericalArm, path: np.ndarray, q: np.ndarray, kept: float) -> tuple[np.ndarray, np.ndarray]:
    """The base turns evenly if joint 1 allows, else with the arm."""
    turned = _turned(path, q, kept, even=True)
    return turned if np.abs(turned[1][:, 0]).max() < arm.limits[0] - KEEP_LIMIT else _turned(path, q, kept)


def _shared_yaw(path, bare, absolute) -> tuple[np.ndarray, np.ndarray]:
    """Phase (b), eq (4): the base turns by its share of the hand's turn, to where (c) begins."""
    hand = bare[:, 4] - bare[:, 3]
    yaw = path[-1, 2] + Shares().yaw * (hand - hand[-1])
    return _turned(bare, absolute, absolute[:, 0] - yaw)


def _leave(path: np.ndarray, q: np.ndarray) -> ArmLeg:
    """Phase (i): the base drives on and takes the arm along, as it is; the door is let go."""
    c, s = np.cos(path[-1, 3]), np.sin(path[-1, 3])
    hand = c * path[-1, 6] - s * path[-1, 5]  # y of the hand in the world
    way = BEHIND - hand
    base = path[-1, :3] + np.linspace(0.0, 1.0, 5)[:, None] * np.array([0.0, way, 0.0])
    return ArmLeg(np.tile(q[-1], (5, 1)), base, np.full(5, path[-1, 3]), max(1.0, 1.875 * way / 0.4), touching=True,
                  closing=True)  # fmt: skip
