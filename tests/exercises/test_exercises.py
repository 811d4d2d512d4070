"""Each exercise: solution correct, stub not attempted, every wrong answer rejected by its named check."""

import inspect
from collections import Counter

import numpy as np
import pytest

import tutorialbot.bo.objective
from tests.exercises import solutions_door
from tests.exercises.sets import EXERCISES, PLANTED, SOLUTIONS, WRONG
from tutorialbot.checks import arm_optimum, cspace_descent, door_motion, door_physics, guard, mechanism, passage_door
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.paths import ROOT
from tutorialbot.scene.door import Door


@pytest.fixture
def tools(monkeypatch):
    """Put back what a wrong answer replaces."""
    for owner, name in (
        (tutorialbot.bo.objective, "so4_distance"),
        (np.linalg, "norm"),
        (mechanism, "agree"),
        (mechanism, "numbers"),
        (guard.Tools, "changed"),
        (tutorialbot.bo.objective.DoorTask, "commit"),
        (arm_optimum, "NEAR_POSITION"),
        (cspace_descent, "DEARER"),
        (passage_door, "ROOM"),
    ):
        monkeypatch.setattr(owner, name, getattr(owner, name))


@pytest.mark.parametrize("name", EXERCISES)
def test_the_solution_is_correct(name):
    verdict = EXERCISES[name].verdict(SOLUTIONS[name])
    assert (verdict.outcome, verdict.check, verdict.message) == ("correct", "", "")


@pytest.mark.parametrize("name", EXERCISES)
def test_the_stub_is_not_attempted(name):
    def stub(*_):
        raise NotImplementedError

    assert EXERCISES[name].verdict(stub).outcome == "not attempted"


@pytest.mark.parametrize(("function", "name", "check", "outcome"), WRONG, ids=[f.__name__ for f, *_ in WRONG])
def test_the_wrong_answer_is_rejected_by_its_check(function, name, check, outcome, tools, capsys, monkeypatch):
    monkeypatch.setattr(door_motion, "BUDGET", 100)  # nobody here needs more
    monkeypatch.setattr(mechanism, "_tools", [guard.Tools()])
    verdict = EXERCISES[name].verdict(function, limit=0.5 if check == "time limit" else None)
    assert (verdict.outcome, verdict.check) == (outcome, check)
    assert verdict.message
    assert len(capsys.readouterr().out) < 3_000


@pytest.mark.parametrize(("title", "least"), [("door", 8), ("arm", 7), ("cspace", 8), ("passage", 8)])
def test_every_exercise_has_a_solution_three_wrong_answers_and_hints(title, least):
    names = [exercise.name for exercise in PLANTED[title].exercises]
    planted = Counter(name for _, name, *_ in PLANTED[title].wrong)
    assert set(planted) == set(names)
    assert len(set(names)) >= least
    for name in names:
        assert planted[name] >= 3
        assert len(EXERCISES[name].hints) >= 3
        assert list(inspect.signature(SOLUTIONS[name]).parameters)


def test_no_two_exercises_or_answers_share_a_name():
    names = [exercise.name for planted in PLANTED.values() for exercise in planted.exercises]
    answers = [function.__name__ for function, *_ in WRONG]
    assert len(names) == len(set(names)) and len(answers) == len(set(answers))


def test_no_solution_is_in_the_package():
    package = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tutorialbot").rglob("*.py"))
    for name, function in SOLUTIONS.items():
        assert inspect.getsource(function).partition("\n")[2] not in package
        assert not hasattr(EXERCISES[name], "solution")


def test_a_verdict_is_the_same_each_time_and_names_input_and_reason():
    answers = [EXERCISES["lengths"].verdict(lambda c5: (0.15 * (1 - c5) / 2, 90 * (1 + c5))) for _ in range(2)]
    assert repr(answers[0]) == repr(answers[1])
    assert "radians" in answers[0].message
    assert "expected [0.    , 3.1416]" in answers[0].message
    assert "for the input (1)" in answers[0].message
    assert "incorrect" in answers[0]._repr_html_()
    assert "<script" not in mechanism.Verdict("x", "error", "", "<script>")._repr_html_()


def test_what_is_no_number_comes_with_the_reason_too():
    def lost_at_a_pole(v):
        return np.nan if v[0] == v[1] == 0 else np.arctan2(v[1], v[0]) / np.pi, v[2] / np.linalg.norm(v)

    verdict = EXERCISES["two_numbers"].verdict(lost_at_a_pole)
    assert verdict.check == "finite numbers"
    assert "every azimuth is right" in verdict.message and "for the input ([0., 0., 1.])" in verdict.message


def test_hints_come_one_at_a_time(capsys):
    exercise = mechanism.Exercise("x", "y", ("first", "second"), lambda student: None)
    shown = ["Hint 1: first\n(1 more)\n"] + 2 * ["Hint 1: first\nHint 2: second\n(that was the last one)\n"]
    for text in shown:
        exercise.hint()
        assert capsys.readouterr().out == text


def test_misuse_is_an_error_of_ours():
    with pytest.raises(InvalidType, match="function"):
        EXERCISES["lengths"].verdict(solutions_door.lengths(0.5))
    with pytest.raises(InvalidValue, match="limit"):
        EXERCISES["lengths"].verdict(solutions_door.lengths, limit=0.0)


def test_a_robot_has_so_many_moves_and_no_more():
    robot = door_motion.Robot(Door(), 3)
    robot.attempt(np.zeros(5)), robot.keep(np.zeros(5)), robot.attempt(np.zeros(5))
    assert robot.moves_left == 0
    with pytest.raises(guard.Wrong) as caught:
        robot.attempt(np.zeros(5))
    assert caught.value.check == "budget"


def test_a_lever_that_was_turned_and_taken_back_counts_no_more():
    """Else a latch switched off afterwards would seem to have been opened by the lever."""
    robot = door_motion.Robot(Door(), 3)
    robot.keep(np.array([0.5, -0.88, 0.0, 0.0, -0.1]))
    assert robot._records[-1].lowest < np.deg2rad(-20.0)
    robot.undo()
    robot.keep(np.array([0.0, 0.0, 0.0, 0.0, -1.0]))
    assert robot._records[-1].lowest > np.deg2rad(-10.0)


def test_a_rule_that_was_softened_is_noticed(monkeypatch):
    def softened(robot):
        monkeypatch.setattr(door_motion, "OPEN_ANGLE", -1.0)
        monkeypatch.setattr(door_physics, "SLACK", 1e9)
        return robot.kept

    verdict = EXERCISES["open_the_door"].verdict(softened)
    assert (verdict.outcome, verdict.check) == ("incorrect", "tools left alone")


def _loop():
    answer = []
    answer.append(answer)
    return answer


class Silent(Exception):
    def __str__(self):
        raise RuntimeError


def _raise_silent():
    raise Silent


@pytest.mark.parametrize(
    ("answer", "outcome"), [(_loop, "incorrect"), (lambda: (10**400, 1), "incorrect"), (_raise_silent, "error")]
)
def test_no_answer_is_odd_enough_to_break_a_check(answer, outcome):
    assert EXERCISES["lengths"].verdict(lambda c5: answer()).outcome == outcome


def test_an_interrupt_passes_through():
    def interrupted(c5):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        EXERCISES["lengths"].verdict(interrupted)
