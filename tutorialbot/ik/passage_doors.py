"""Doors that the way points were not made for: how many of `ClosingDoor.random` the robot passes."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from tutorialbot.errors import InvalidType, whole_number
from tutorialbot.ik.passage import Failure, Passage, run_passage, run_with
from tutorialbot.ik.passage_plan import WayPoints
from tutorialbot.runs import progress
from tutorialbot.scene.closing_door import ClosingDoor


@dataclass(frozen=True)
class DoorResult:
    """One door: its seed, whether it was passed, and if not what failed; how many way points were looked at.

    seconds: of motion; min_clearance [m], max_joint_rate [rad/s], max_tip_error [m] as in `Passage`; angle_gap [rad].
    """

    seed: int
    door: ClosingDoor
    passed: bool
    failure: Failure | None
    looked_at: int
    seconds: float
    min_clearance: float
    max_joint_rate: float
    max_tip_error: float
    angle_gap: float


def pass_random_doors(
    seeds: Iterable[int], *, opening_deg: float = 70, dynamics: bool = False, searched: bool = True
) -> Iterator[DoorResult]:
    """Yield a result for each seed of `ClosingDoor.random`, with a progress bar; arguments as in `run_passage`.

    searched=False: the usual door's way points as they are, for comparison: those in the doorway are not fitted to the
    door's width, and none are searched for. Raises InvalidType or InvalidValue for seeds that are no whole
    numbers >= 0.
    """
    if isinstance(seeds, str | bytes) or not isinstance(seeds, Iterable):
        raise InvalidType("seeds", seeds, "whole numbers, one for each door")
    if not isinstance(searched, bool):
        raise InvalidType("searched", searched, "True or False")
    seeds = [whole_number(f"seeds[{i}]", seed) for i, seed in enumerate(seeds)]
    for seed in progress(seeds, description="doors"):
        door = ClosingDoor.random(seed)
        if searched:
            passage = run_passage(door, opening_deg=opening_deg, dynamics=dynamics, seed=seed)
        else:
            passage = run_with(WayPoints(), door, opening_deg=opening_deg, dynamics=dynamics)
        yield _result(seed, door, passage)


def _result(seed: int, door: ClosingDoor, passage: Passage) -> DoorResult:
    rate = float(np.abs(passage.joint_rates).max(initial=0.0))
    seconds = float(passage.times[-1]) if len(passage.times) else 0.0
    return DoorResult(seed, door, passage.passed, passage.failure, passage.looked_at, seconds, passage.min_clearance,
                      rate, passage.max_tip_error, passage.angle_gap)  # fmt: skip
