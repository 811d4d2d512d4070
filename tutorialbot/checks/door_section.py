"""Exercise 9 of notebook 1: one section of Bayesian optimisation, judged on smooth bowls and on a door."""

from collections.abc import Callable

import numpy as np

from tutorialbot.bo.objective import DoorTask, new_pose_cost
from tutorialbot.bo.space import SearchSpace
from tutorialbot.checks.counting import Counted
from tutorialbot.checks.guard import Student, Wrong, show
from tutorialbot.checks.mechanism import Exercise, numbers
from tutorialbot.scene.door import Door
from tutorialbot.seeding import make_rng

SEED = 1
SPACE = SearchSpace(rotation_max=np.pi / 2, frame="tool")
BOWL_BUDGET, DOOR_BUDGET = 30, 60  # evaluations
LEARNED = 0.27  # mean height of the best point in a bowl: random search comes to 0.48


def unknown_door() -> Door:
    """Return a door that the notebook never shows: its hinge is on the other side, and no length is the usual one."""
    rng = make_rng(SEED, 10)
    return Door(
        side="left",
        spindle_radius=float(rng.uniform(0.40, 0.46)),
        lever_length=float(rng.uniform(0.11, 0.13)),
        stand_off=float(rng.uniform(0.065, 0.08)),
    )


def inside(c: np.ndarray) -> np.ndarray:
    """Return c as five numbers in [-1, 1]; raises Wrong by the checks on numbers or by "inside the cube"."""
    c = numbers(c, (5,), ())
    if np.abs(c).max() > 1.0 + 1e-9:
        raise Wrong("inside the cube", f"c = {show(c)} leaves the cube [-1, 1]^5.")
    return np.clip(c, -1.0, 1.0)


def _ask(
    student: Student, function: Callable[[np.ndarray], float], budget: int, seed: int
) -> tuple[np.ndarray, Counted]:
    counted = Counted(function, budget, inside, "each one is a move of a real robot.")
    try:
        answer = student(counted.evaluate, budget, make_rng(SEED, 9, seed))
    finally:
        if counted.broken is not None:
            raise counted.broken
    answer = inside(answer)
    if len(counted.costs) < budget // 3:
        raise Wrong(
            "budget",
            f"only {len(counted.costs)} of {budget} evaluations were used: nobody can know the direction after so few.",
        )
    return answer, counted


def _judge_section(student: Student) -> None:
    heights = []
    for seed in range(3):
        lowest = make_rng(SEED, 9, seed, 1).uniform(-0.6, 0.6, 5)

        def bowl(c: np.ndarray, lowest: np.ndarray = lowest) -> float:
            return float(np.sum((c - lowest) ** 2))

        answer, counted = _ask(student, bowl, BOWL_BUDGET, seed)
        heights.append(bowl(answer))
        fifth = float(np.sort(counted.costs)[4])
        if heights[-1] > fifth:
            raise Wrong(
                "the best point",
                f"the direction returned costs {heights[-1]:.2f}; among those tried five cost {fifth:.2f} or less."
                " Return the best one (the lowest cost).",
            )
    if np.mean(heights) > LEARNED:
        raise Wrong(
            "learns from the costs",
            f"on a smooth bowl the best of {BOWL_BUDGET} points lies at {np.mean(heights):.2f} on average;"
            f" random points"
            " come to 0.48, a Gaussian process to 0.1 or less. What you are told must decide what you ask next.",
        )
    levers = []
    for seed in (3, 4):  # chance may fail a good search once (1 in 12), hardly twice
        task = DoorTask(unknown_door(), space=SPACE, cost=new_pose_cost)
        answer, _ = _ask(student, lambda c, task=task: task.attempt(c).cost, DOOR_BUDGET, seed)
        task.simulation.watch = []
        task.commit(answer)
        levers.append(min(angle for _, _, angle in task.simulation.watch))
        if levers[-1] < task.simulation.door.release_angle:
            return
    raise Wrong(
        "the latch on the door",
        f"your directions turn the lever to {np.rad2deg(levers[0]):.0f} and {np.rad2deg(levers[1]):.0f} degrees;"
        f" the latch lets go at {np.rad2deg(task.simulation.door.release_angle):.0f}.",
    )


find_direction = Exercise(
    "find_direction",
    "one section of Bayesian optimisation: your own loop of asking and telling finds the direction that unlatches.",
    (
        "The loop: choose c, call evaluate(c), remember both; as often as the budget allows.",
        "A first few points at random; then fit a Gaussian process to what you know and take, among some"
        " thousand random candidates,"
        " the one with the largest expected improvement.",
        "`tutorialbot.bo.optimizers.TwistSearch(rng)` has ask(), tell(c, cost, seconds) and best(): the loop is yours.",
    ),
    _judge_section,
    limit=180.0,
)
