"""Answers that differ from ours and are as right: other branches, other libraries, other formulas."""

import pytest

from tests.exercises.sets import EXERCISES, RIGHT


@pytest.mark.parametrize(("function", "name"), RIGHT, ids=[function.__name__ for function, _ in RIGHT])
def test_another_right_answer_is_correct(function, name):
    verdict = EXERCISES[name].verdict(function)
    assert (verdict.outcome, verdict.check, verdict.message) == ("correct", "", "")
