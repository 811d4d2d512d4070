"""Exercises: a statement, hints one at a time, and a check that takes the student's function.

    exercise.check(my_function)     # shows the verdict: correct, incorrect, not attempted or error
    exercise.hint()                 # shows one hint more with each call

Both show what they have to say wherever their line stands, in a notebook and in a terminal, and return nothing: so it
is neither lost nor shown twice. A program takes the Verdict of `exercise.verdict(function)`.

A check runs the function on random cases from a fixed seed, against a reference of its own, and stops at the first one
that fails: the verdict names the rule that was broken (`verdict.check`), the input, and the physics behind it.
"""

import html
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from IPython.display import display

from tutorialbot.checks.guard import Crashed, NotAttempted, Student, Tools, Wrong, case, show
from tutorialbot.errors import InvalidType, positive

CORRECT, INCORRECT, NOT_ATTEMPTED, ERROR = OUTCOMES = ("correct", "incorrect", "not attempted", "error")
COLORS = {CORRECT: "#1a7f37", INCORRECT: "#cf222e", NOT_ATTEMPTED: "#6e7781", ERROR: "#bc4c00"}
_tools: list[Tools] = []


@dataclass(frozen=True)
class Verdict:
    """What a check found. `check` names the rule that was broken, "" when none was."""

    exercise: str
    outcome: str
    check: str = ""
    message: str = ""

    def __repr__(self) -> str:
        head = f"{self.exercise}: {self.outcome}" + (f" ({self.check})" if self.check else "")
        return head + (f"\n{self.message}" if self.message else "")

    def _repr_html_(self) -> str:
        color = COLORS[self.outcome]
        check = f" &middot; {html.escape(self.check)}" if self.check else ""
        return (
            f'<div style="border-left:4px solid {color};padding:4px 12px"><b>{html.escape(self.exercise)}</b> &nbsp;'
            f'<span style="color:{color};font-weight:bold">{self.outcome}</span>{check}'
            f'<div style="white-space:pre-wrap">{html.escape(self.message)}</div></div>'
        )


@dataclass(frozen=True)
class Hints:
    """The hints revealed so far."""

    texts: tuple[str, ...]
    left: int

    def __repr__(self) -> str:
        lines = [f"Hint {i}: {text}" for i, text in enumerate(self.texts, start=1)]
        return "\n".join([*lines, f"({self.left} more)" if self.left else "(that was the last one)"])


@dataclass(frozen=True)
class Exercise:
    """One exercise. `judge(student)` raises Wrong for the first rule that the guarded function breaks.

    `limit` [s] is the longest that one call may take.
    """

    name: str
    statement: str
    hints: tuple[str, ...]
    judge: Callable[[Student], None]
    limit: float = 10.0
    _revealed: list[None] = field(default_factory=list, repr=False, compare=False)

    def __repr__(self) -> str:
        return f"{self.name}: {self.statement}"

    def hint(self) -> None:
        """Show the hints seen so far and one more."""
        if len(self._revealed) < len(self.hints):
            self._revealed.append(None)
        seen = len(self._revealed)
        display(Hints(self.hints[:seen], len(self.hints) - seen))

    def check(self, function: Callable, limit: float | None = None) -> None:
        """Judge `function` and show the verdict; see `verdict`."""
        display(self.verdict(function, limit))

    def verdict(self, function: Callable, limit: float | None = None) -> Verdict:
        """Judge `function` and return the verdict; whatever the function does, this does not raise.

        limit [s]: of one call, the exercise's own when None. Raises InvalidType when `function` is no function.
        """
        if not callable(function):
            raise InvalidType("function", function, "your function itself, without brackets behind its name")
        student = Student(function, self.limit if limit is None else positive("limit", limit))
        untouched = _lookout()
        try:
            untouched()
            try:
                self.judge(student)
            finally:
                untouched()
        except Wrong as wrong:
            return Verdict(self.name, INCORRECT, wrong.check, wrong.reason)
        except NotAttempted:
            return Verdict(self.name, NOT_ATTEMPTED, "", "Replace `raise NotImplementedError` by your own lines.")
        except Crashed as crash:
            return Verdict(self.name, ERROR, "runs without an error", str(crash))
        return Verdict(self.name, CORRECT)


def remember_tools() -> None:
    """Take all that is loaded now as what it should be: called once, when the exercises have been imported."""
    _tools[:] = [Tools()]


def _lookout() -> Callable[[], None]:
    """Return a function that raises Wrong when a function that the checks or the simulation stand on was replaced.

    It holds what it needs itself: replacing that by name, in this module or another, does not reach it any more.
    """
    looks = [known.changed for known in _tools] or [lambda: ["what the tools were"]]

    def untouched() -> None:
        changed = [name for look in looks for name in look()]
        if changed:
            raise Wrong(
                "tools left alone",
                f"{', '.join(changed[:3])} was replaced: a check that can be changed proves nothing."
                " Restart the kernel.",
            )

    return untouched


# --- what judges need -------------------------------------------------------------------------------------------------
def numbers(answer: Any, shape: tuple[int, ...], inputs: tuple, reason: str = "") -> np.ndarray:
    """Return the answer as a float array of `shape`; raises Wrong by "shape of the answer" or "finite numbers".

    `reason` says what the finite numbers would be.
    """
    wanted = "one number" if shape == () else f"{' x '.join(map(str, shape))} numbers"
    try:
        array = np.array(answer)
        if array.dtype.kind in "SU":
            raise TypeError("text")
        array = array.astype(float)
    except Exception:  # whatever the answer is made of
        raise Wrong("shape of the answer", f"the answer is {show(answer)}, expected {wanted}{case(inputs)}") from None
    if array.shape != shape:
        raise Wrong("shape of the answer", f"the answer has the shape {array.shape}, expected {wanted}{case(inputs)}")
    if not np.isfinite(array).all():
        raise Wrong("finite numbers", f"the answer is {show(array)}. {reason}".rstrip() + case(inputs))
    return array


def pose(answer: Any, inputs: tuple) -> pin.SE3:
    """Return a copy of the answer when it is a proper pose; raises Wrong by "shape of the answer" or "a rotation"."""
    if not isinstance(answer, pin.SE3):
        raise Wrong("shape of the answer", f"the answer is {show(answer)}, expected a pinocchio.SE3{case(inputs)}")
    matrix = numbers(answer.homogeneous, (4, 4), inputs)
    rotation = matrix[:3, :3]
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-6 or np.linalg.det(rotation) < 0.0:
        raise Wrong(
            "a rotation", f"the matrix of the answer is not a rotation: R^T R is not 1 or det R is not +1{case(inputs)}"
        )
    return pin.SE3(matrix)


def agree(
    check: str, answer: np.ndarray, expected: np.ndarray, inputs: tuple, reason: str, tolerance: float = 1e-6
) -> None:
    """Raise Wrong by `check` when the answer is off the expected numbers by more than `tolerance`."""
    expected = np.asarray(expected, dtype=float)
    if np.abs(answer - expected).max(initial=0.0) > tolerance:
        raise Wrong(check, f"{reason}\nyours {show(np.asarray(answer))}, expected {show(expected)}{case(inputs)}")


def expect(student: Student, check: str, inputs: tuple, expected: Any, reason: str, tolerance: float = 1e-6) -> None:
    """Ask for the answer to `inputs`; raises Wrong by `check` when it is not the `expected` pose, number or array."""
    answer = student(*inputs)
    if isinstance(expected, pin.SE3):
        answer, expected = pose(answer, inputs).homogeneous, expected.homogeneous
    else:
        answer = numbers(answer, np.shape(expected), inputs, reason)
    agree(check, answer, expected, inputs, reason, tolerance)
