"""What a student's function costs: evaluations of an objective that it is given, and lines of Python that it runs."""

import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from tutorialbot.checks.guard import Wrong


class Counted:
    """An objective that may be asked only so often; what students get is `evaluate`.

    `admit(x)` returns the points (..., k) as an array, or raises Wrong; `function` gives one number for each; `costs`
    are all of them so far. Asked for more than `budget`, it raises Wrong by "budget" for the `reason` given, and keeps
    that in `broken`: the function may have swallowed it.
    """

    def __init__(self, function: Callable[[np.ndarray], Any], budget: int, admit: Callable[[Any], np.ndarray], reason):
        self.costs: list[float] = []
        self.broken: Wrong | None = None

        def evaluate(x):
            try:
                points = admit(x)
                asked = len(self.costs) + points[..., 0].size
                if asked > budget:
                    raise Wrong("budget", f"evaluation number {asked} of {budget}: {reason}")
            except Wrong as wrong:
                self.broken = self.broken or wrong
                raise
            values = np.asarray(function(points), dtype=float)
            self.costs += values.ravel().tolist()
            return values.item() if points.ndim == 1 else values

        self.evaluate = evaluate


def lines_run(call: Callable[[], Any]) -> tuple[Any, int]:
    """Return what `call()` returns, and how many steps Python took for it: lines, and calls of any function."""
    steps = 0

    def step(*_):
        nonlocal steps
        steps += 1
        return step

    before = sys.gettrace(), sys.getprofile()
    sys.settrace(step), sys.setprofile(step)
    try:
        answer = call()
    finally:
        sys.settrace(before[0]), sys.setprofile(before[1])
    return answer, steps


def packages_called(call: Callable[[], Any]) -> set[str]:
    """Return the names of the packages of which `call()` calls a function, Python's or compiled."""
    found: set[str] = set()

    def note(frame, event, called):
        if event == "call":
            found.add(str(frame.f_globals.get("__name__")).partition(".")[0])
        elif event == "c_call":
            owner = getattr(called, "__self__", None)
            modules = (getattr(called, "__module__", None), getattr(owner, "__module__", None))
            modules += (getattr(type(owner), "__module__", None),)
            found.update(str(name).partition(".")[0] for name in modules if name)

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(before)
    return found


class ByHand:
    """A student's function that has to do the work itself: called like `student`, with no function of this project.

    Raises Wrong by "by hand" when it calls one. Making one of the project's dataclasses is no work.
    """

    OURS = ("tutorialbot.checks.guard", "tutorialbot.checks.counting")  # they stand around the student's call
    MADE = ("__init__", "__post_init__", "__eq__", "__repr__", "__hash__")

    def __init__(self, student: Callable[..., Any]):
        self.student = student

    def __call__(self, *inputs: Any) -> Any:
        called: list[str] = []

        def note(frame, event, _):
            module = str(frame.f_globals.get("__name__"))
            if event != "call" or module in self.OURS or frame.f_code.co_name in self.MADE:
                return
            if module.partition(".")[0] == "tutorialbot":
                called.append(f"{module}.{frame.f_code.co_name}")

        before = sys.getprofile()
        sys.setprofile(note), threading.setprofile(note)
        try:
            answer = self.student(*inputs)
        finally:
            watched = sys.getprofile() is note
            sys.setprofile(before), threading.setprofile(before)
        if not watched:
            raise Wrong("by hand", "the function turned the profiler off that looks for calls of this project.")
        if called:
            raise Wrong("by hand", f"{called[0]} did the work: write it with your own lines.")
        return answer
