"""Between a check and a student's function: limits on time and output, copies of the inputs, untouched tools.

In one process nothing is safe from code that means harm; this catches what happens by mistake or in passing, and says
which rule was broken. `python3 -m tutorialbot grade` adds a process of its own, with the system's own limits.
"""

import copy
import inspect
import io
import math
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from types import FunctionType, ModuleType
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import scipy.spatial.transform

SHOWN, MOST = 2_000, 100_000  # characters of a function's output that are shown, and that are borne
LIBRARIES = (math, copy, signal, np, np.linalg, np.random, mujoco, pin, scipy.spatial.transform)


class Wrong(Exception):
    """An answer was rejected by the check called `check`, for the reason given."""

    def __init__(self, check: str, reason: str):
        super().__init__(check, reason)
        self.check, self.reason = check, reason


class NotAttempted(Exception):
    """The stub is still a stub."""


class Crashed(Exception):
    """The function raised; the text says what and where."""


class TimeUp(BaseException):
    """Raised inside a function that takes too long; no `except Exception` holds it."""


class Flood(BaseException):
    """Raised inside a function that prints too much."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeUp inside the block after `seconds`; works on the main thread alone, elsewhere there is no limit."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    over = False

    def ring(*_):
        if not over:
            raise TimeUp

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds, 0.5)
    try:
        yield
    finally:
        over = True
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


class Outlet(io.TextIOBase):
    """A text stream that passes the first SHOWN characters on, swallows the next ones, and raises Flood after MOST."""

    def __init__(self, target):
        self.target, self.count = target, 0

    def write(self, text: str) -> int:
        """Take `text`."""
        passed = text[: max(0, SHOWN - self.count)]
        self.count += len(text)
        if passed:
            self.target.write(passed)
        if self.count > MOST:
            raise Flood
        return len(text)


class Student:
    """A student's function under guard: called like the function itself, with copies of the inputs.

    Raises NotAttempted, Crashed, or Wrong by the checks "time limit", "little output", "inputs left alone".
    """

    def __init__(self, function: Callable, limit: float):
        self.function, self.limit = function, limit
        self._out, self._err = Outlet(sys.stdout), Outlet(sys.stderr)

    def __call__(self, *inputs: Any) -> Any:
        given = copy_of(inputs)
        try:
            with redirect_stdout(self._out), redirect_stderr(self._err), time_limit(self.limit):
                answer = self.function(*given)
        except NotImplementedError as error:
            raise NotAttempted(str(error)) from None
        except TimeUp:
            raise Wrong("time limit", f"one call took longer than {self.limit:g} s{case(inputs)}") from None
        except Flood:
            raise Wrong(
                "little output", f"the function prints more than {MOST} characters: remove the print in its loop"
            ) from None
        except (Wrong, KeyboardInterrupt):
            raise
        except BaseException as error:
            raise Crashed(f"{where(error)}{case(inputs)}") from None
        for i, (before, after) in enumerate(zip(inputs, given, strict=True)):
            if not same(before, after):
                raise Wrong(
                    "inputs left alone", f"the function changed its input number {i + 1}: work on a copy{case(inputs)}"
                )
        return answer


def copy_of(value: Any) -> Any:
    """Copy numbers, arrays, poses and lists of them; pass functions and robots on as they are."""
    if isinstance(value, list | tuple):
        return type(value)(copy_of(part) for part in value)
    return value.copy() if isinstance(value, np.ndarray | pin.SE3) else value


def same(a: Any, b: Any) -> bool:
    """Whether two inputs are equal to the last bit."""
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, pin.SE3):
        return np.array_equal(a.homogeneous, b.homogeneous)
    if isinstance(a, np.ndarray):
        return a.shape == b.shape and np.array_equal(a, b, equal_nan=True)
    return True


def where(error: BaseException) -> str:
    """Return the kind and the words of an error, and the line of the student's code that raised it."""
    frames = traceback.extract_tb(error.__traceback__)[1:]  # the first is ours
    own = [frame for frame in frames if "site-packages" not in frame.filename] or frames
    line = f" in line {own[-1].lineno}: {own[-1].line}" if own and own[-1].line else ""
    try:
        words = str(error)[:500]
    except Exception:
        words = "(an error that cannot be printed)"
    return f"{type(error).__name__}: {words}{line}"


def case(inputs: tuple) -> str:
    """Return the inputs as text for a message."""
    shown = [show(value) for value in inputs]
    return f"\nfor the input ({', '.join(shown)})" if inputs else ""


def show(value: Any) -> str:
    """Return a number, an array or a pose as short text; the same on every machine and in every session."""
    if isinstance(value, pin.SE3):
        return f"pose(translation {show(value.translation)}, rotation vector {show(pin.log3(value.rotation))})"
    if isinstance(value, float | np.floating):
        return f"{value:.5g}"
    if isinstance(value, np.ndarray):
        return np.array2string(value, precision=4, suppress_small=True, threshold=12, edgeitems=2, separator=", ")
    if isinstance(value, list | tuple):
        parts = (f"a {type(v).__name__}" if isinstance(v, list | tuple) else show(v) for v in value[:6])
        return "[" + ", ".join(parts) + (", ...]" if len(value) > 6 else "]")
    text = repr(value) if isinstance(value, int | str | bool | None) else f"a {type(value).__name__}"
    return text[:200]


# --- tools that must stay as they were --------------------------------------------------------------------------------
def tools(modules: list[ModuleType]) -> dict[str, Any]:
    """Return name -> what decides its behaviour, of every function, class and constant in `modules`."""
    found: dict[str, Any] = {}
    for module in modules:
        for name, value in list(vars(module).items()):
            label = f"{module.__name__}.{name}"
            if isinstance(value, FunctionType):
                found[label] = (value, value.__code__, value.__defaults__)
            elif inspect.isclass(value) and value.__module__.startswith("tutorialbot"):
                found[label] = (value,)
                for part, method in list(vars(value).items()):
                    if isinstance(method, FunctionType):
                        found[f"{label}.{part}"] = (method, method.__code__, method.__defaults__)
                    elif isinstance(method, property | staticmethod | classmethod):
                        found[f"{label}.{part}"] = (method,)
            elif callable(value) or (name.isupper() and isinstance(value, bool | int | float | str | tuple)):
                found[label] = (value,)
    return found


class Tools:
    """What the functions of the project and of its libraries were when this was made."""

    def __init__(self):
        self.modules = [m for name, m in sorted(sys.modules.items()) if name.partition(".")[0] == "tutorialbot"]
        self.before = tools([*self.modules, *LIBRARIES])

    def changed(self) -> list[str]:
        """Return the names of what is no longer what it was."""
        now = tools([*self.modules, *LIBRARIES])
        gone = (None,)
        return [
            name
            for name, parts in self.before.items()
            if len(now.get(name, gone)) != len(parts) or any(a is not b for a, b in zip(parts, now[name], strict=True))
        ]
