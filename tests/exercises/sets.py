"""The exercises of all notebooks, with what is planted for them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from tests.exercises import (
    right_answers_arm,
    right_answers_cspace,
    right_answers_door,
    right_answers_passage,
    solutions_arm,
    solutions_cspace,
    solutions_door,
    solutions_passage,
    wrong_answers_arm,
    wrong_answers_cspace,
    wrong_answers_door,
    wrong_answers_passage,
)
from tutorialbot.checks.mechanism import Exercise
from tutorialbot.checks.sets import SETS
from tutorialbot.paths import NOTEBOOKS


@dataclass(frozen=True)
class Planted:
    """One notebook's exercises. page: the notebook; solutions: a module with a function for each exercise; wrong:
    (function, exercise, check, outcome); right: (function, exercise); taught: some global names of its sections.
    """

    page: Path
    exercises: tuple[Exercise, ...]
    solutions: ModuleType
    wrong: list[tuple[Callable, str, str, str]]
    right: list[tuple[Callable, str]]
    taught: frozenset[str]


PLANTED = {
    "door": Planted(
        NOTEBOOKS / "01_door_opening.ipynb", SETS["door"], solutions_door, wrong_answers_door.WRONG,
        right_answers_door.RIGHT, frozenset({"lever_arc", "SEED", "np"}),
    ),
    "arm": Planted(
        NOTEBOOKS / "02_cleaning_arm.ipynb", SETS["arm"], solutions_arm, wrong_answers_arm.WRONG,
        right_answers_arm.RIGHT, frozenset({"tip_position", "TILT", "plt"}),
    ),
    "cspace": Planted(
        NOTEBOOKS / "03_vox2c_space.ipynb", SETS["cspace"], solutions_cspace, wrong_answers_cspace.WRONG,
        right_answers_cspace.RIGHT, frozenset({"bar_meets_box", "cross_entropy", "plt"}),
    ),
    "passage": Planted(
        NOTEBOOKS / "04_door_passage.ipynb", SETS["passage"], solutions_passage, wrong_answers_passage.WRONG,
        right_answers_passage.RIGHT, frozenset({"joint_velocity", "share", "plt"}),
    ),
}  # fmt: skip
EXERCISES = {exercise.name: exercise for planted in PLANTED.values() for exercise in planted.exercises}
SOLUTIONS = {e.name: getattr(planted.solutions, e.name) for planted in PLANTED.values() for e in planted.exercises}
WRONG = [entry for planted in PLANTED.values() for entry in planted.wrong]
RIGHT = [entry for planted in PLANTED.values() for entry in planted.right]
OF_SET = [(name, exercise.name) for name, planted in PLANTED.items() for exercise in planted.exercises]
