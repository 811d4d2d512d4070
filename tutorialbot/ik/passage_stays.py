"""The passage where the door stays open by itself: opened beyond the closer's hold angle, it needs no holding.

After (c) the hand lets go of the knob, the arm folds over the base, and the robot drives round the free edge and
through the doorway. (Paper 4, section 4.3: there the arm may come to its singularity while it lets go.)
"""

import numpy as np

from tutorialbot.ik import passage_clearance as clearance
from tutorialbot.ik.passage_connect import connect
from tutorialbot.ik.passage_guards import STAYING
from tutorialbot.ik.passage_legs import BASE_SPEED, ArmLeg, arm_duration, duration
from tutorialbot.ik.passage_plan import (
    BACK,
    KEEP,
    KEEP_LIMIT,
    SAMPLES,
    Option,
    WayPoints,
    back_off,
    contact_point,
    free_of,
    opening_paths,
    spline_through,
    to_world,
)
from tutorialbot.ik.passage_search import (
    BENT,
    PHASES,
    TRIES,
    NoPlan,
    Phase,
    Plan,
    Tally,
    fitted,
    hand_legs,
    tried,
    vary_opening,
    vary_through,
)
from tutorialbot.ik.singularity_consistent import SphericalArm
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.seeding import make_rng

FOLDED = np.array([0.0, -0.9, 0.0, 2.4, 0.0, -1.5, 0.0])  # the arm over its base, seen from above within its disc
AROUND = 0.12  # from the base to the free edge on its way round [m]
BEYOND = 0.45  # how far the base goes on after `through` [m]


def search_staying(
    arm: SphericalArm, door: ClosingDoor, opening: float, seed: int = 0, way: WayPoints | None = None,
    skipped: int = 0, draws: int = TRIES,
) -> Plan | NoPlan:  # fmt: skip
    """Return a plan that opens the door to `opening` [rad], beyond its hold angle, and drives through, or why not.

    Arguments as in `search`.
    """
    first, rng, tally = fitted(door, opening) if way is None else way, make_rng(seed, 5), Tally.empty()
    for number in range(skipped, skipped + draws):
        way = first if number == 0 else vary_opening(first, rng, number)
        paths = _paths(door, way, opening)
        found = tried(arm, door, paths, "knob", tally)
        fold = _fold(arm, door, opening, paths[-1][-1], found[:6], rng) if found else None
        if fold:
            break
        if found:
            tally.add("free motion", -1.0)
    else:
        return tally.result(PHASES[2])
    tally = Tally.empty()
    for more in range(draws):
        way = way if skipped + more == 0 else vary_through(door, way, rng)
        drives = _drives(door, way, opening)
        margin = _drive_margin(arm, door, opening, drives, fold[1][-1])
        if margin > 0.0:
            return Plan(*_phases(arm, paths, fold, drives, opening), way, number + more + 2)
        tally.add("footprint", margin)
    return tally.result(STAYING[2])


def _paths(door: ClosingDoor, way: WayPoints, opening: float) -> list[np.ndarray]:
    """Samples of HAND: grasp, b, c, and the hand that lets go."""
    grasp, little, wide, *_ = opening_paths(door, way, opening)
    return [grasp, little, wide, back_off(wide[-1], "knob", BACK * np.linspace(0.0, 1.0, SAMPLES // 2 + 1))]


def _fold(arm, door, opening, sample, found: list[Option], rng) -> tuple[Option, list[np.ndarray]] | None:
    """An option and postures, yaw 0, from where its hand has let go to FOLDED."""
    free = free_of(arm, door, opening, sample[:3])
    high = np.array(arm.limits) - KEEP_LIMIT
    for option in found:
        start = option.joints[-1][-1]
        end = FOLDED + np.r_[start[0], np.zeros(6)]
        middle = np.r_[start[0], np.zeros(6)]
        between = connect(free, start, end, np.r_[middle[:3] - high[:3], BENT, -high[4:]], middle + high, rng)
        if between:
            return option, between
    return None


def _drives(door: ClosingDoor, way: WayPoints, opening: float) -> list[np.ndarray]:
    """Base x, y (m, 2) [m] in (g), from in front of the door round its edge, and in (h)."""
    edge = np.array([door.width, 0.0])
    corner = np.array([door.width, door.thickness / 2])
    leaning = contact_point(door, way) - corner
    past = corner + leaning * (1.0 + AROUND / np.linalg.norm(leaning))
    points = to_world(np.array([way.wide + edge, *(way.around[:-1] + edge), past]), opening)
    end = np.array(way.through) + [0.0, BEYOND]
    return [
        spline_through(np.array([*points, way.aside, way.inside]), 4 * SAMPLES),
        spline_through(np.array([way.inside, way.through, end]), 2 * SAMPLES),
    ]


def _drive_margin(arm, door, opening, drives, folded: np.ndarray) -> float:
    """By how much base and folded arm keep KEEP [m] on both drives; the arm turns with nothing."""
    xy = np.vstack(drives)
    base, q = np.column_stack([xy, np.zeros(len(xy))]), np.tile(folded, (len(xy), 1))
    far = clearance.measure(arm, door, np.full(len(xy), opening), base, q)
    return float(min(far.panel.min(), far.knob.min(), far.frame.min()) - KEEP)


def _phases(arm, paths, fold, drives, opening) -> tuple[tuple[Phase, ...], np.ndarray]:
    option, between = fold
    legs, first = hand_legs(arm, paths, option, 0.0)
    here = legs[3].path[-1]
    postures = np.array(between) - np.r_[here[2], np.zeros(6)]
    folding = [ArmLeg(np.array(two), np.tile(here[:3], (2, 1)), np.full(2, opening), arm_duration(np.array(two)))
               for two in zip(postures[:-1], postures[1:], strict=True)]  # fmt: skip
    driving = [_drive(xy, here[2], postures[-1], opening) for xy in drives]
    groups = [*([leg] for leg in legs), folding, [driving[0]], [driving[1]]]
    names = (*PHASES[:3], *STAYING)
    return tuple(Phase(name, tuple(group)) for name, group in zip(names, groups, strict=True)), first


def _drive(xy: np.ndarray, yaw: float, q: np.ndarray, opening: float) -> ArmLeg:
    speed = np.abs(np.gradient(xy, 1.0 / (len(xy) - 1), axis=0))
    seconds = duration(np.hypot(speed[:, 0], speed[:, 1])[:, None], np.array([BASE_SPEED]))
    base = np.column_stack([xy, np.full(len(xy), yaw)])
    return ArmLeg(np.tile(q, (len(xy), 1)), base, np.full(len(xy), opening), seconds)
