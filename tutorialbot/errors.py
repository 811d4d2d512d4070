"""The exceptions of the package, and the checks at its boundary that raise them.

A message always names the argument, the value that came, and what is accepted. A pose that cannot be reached or a
search that fails is a *result*, not an exception; an exception means misuse or a broken file.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

MOST_STEPS = 1_000_000  # of a simulation in one call
USUAL_SPEED, USUAL_STEP = 0.1, 5e-3  # [m/s], [s]


class TutorialbotError(Exception):
    """Root of everything that this package raises on purpose."""


class InvalidValue(TutorialbotError, ValueError):
    """An argument has the right type and an impossible value."""

    def __init__(self, argument: str, value: Any, expected: str):
        super().__init__(f"{argument} = {value!r}: expected {expected}")
        self.argument, self.value, self.expected = argument, value, expected


class InvalidType(TutorialbotError, TypeError):
    """An argument has the wrong type."""

    def __init__(self, argument: str, value: Any, expected: str):
        super().__init__(f"{argument} = {value!r} ({type(value).__name__}): expected {expected}")
        self.argument, self.value, self.expected = argument, value, expected


class BrokenFile(TutorialbotError, ValueError):
    """A file that was read is damaged, cut short, or not what its name promises."""


def finite_number(
    argument: str, value: Any, low: float = -np.inf, high: float = np.inf, *, above: bool = False
) -> float:
    """Return `value` as a float in [low, high], or in (low, high] when `above`; raise InvalidType or InvalidValue."""
    bounds = f"a finite number {'>' if above else '>='} {low:g}" if np.isfinite(low) else "a finite number"
    bounds += f" and <= {high:g}" if np.isfinite(high) else ""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InvalidType(argument, value, bounds)
    if isinstance(value, int) and abs(value) > 2**1000:
        raise InvalidValue(argument, "a whole number beyond every float", bounds)
    if not np.isfinite(float(value)) or value < low or value > high or (above and value == low):
        raise InvalidValue(argument, value, bounds)
    return float(value)


def positive(argument: str, value: Any) -> float:
    """Return `value` as a float > 0, or raise InvalidType or InvalidValue."""
    return finite_number(argument, value, 0.0, above=True)


def whole_number(argument: str, value: Any, low: int = 0, high: float = np.inf) -> int:
    """Return `value` as an int in [low, high], or raise InvalidType or InvalidValue."""
    bounds = f"a whole number >= {low}" + (f" and <= {high}" if np.isfinite(high) else "")
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InvalidType(argument, value, bounds)
    if value < low or value > high:
        shown = value if abs(value) <= 2**1000 else "a whole number beyond every float"
        raise InvalidValue(argument, shown, bounds)
    return int(value)


def step_count(seconds: float, speed: float, dt: float, least: float = 2.0) -> float:
    """Return how many steps of dt [s] `seconds` are, `least` to MOST_STEPS: as long as a way takes at `speed` [m/s].

    Raises InvalidValue for other counts. It names the one of `speed` and `dt` that is farther from what is usual.
    """
    count = seconds / dt
    if least <= count <= MOST_STEPS:
        return count
    odd_speed, odd_step = abs(math.log(speed / USUAL_SPEED)), abs(math.log(dt / USUAL_STEP))
    name, value = ("speed", speed) if odd_speed > odd_step else ("dt", dt)
    takes = f"it takes {seconds:.3g} s, a step {dt:.3g} s"
    raise InvalidValue(name, value, f"{least:g} to {MOST_STEPS} steps in all: {takes}")


def one_of(argument: str, value: Any, choices: Iterable[str]) -> str:
    """Return `value` when it is among `choices`, or raise InvalidValue that lists them."""
    names = sorted(choices)
    if not isinstance(value, str) or value not in names:
        raise InvalidValue(argument, value, "one of " + ", ".join(map(repr, names)))
    return value


def finite_array(argument: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return `value` as a float array of `shape` (-1 stands for any length) with finite entries, or raise."""
    array = float_array(argument, value, f"numbers of shape {shape}")
    fits = array.ndim == len(shape) and all(s in (-1, n) for s, n in zip(shape, array.shape, strict=True))
    if not fits:
        raise InvalidValue(argument, f"array of shape {array.shape}", f"shape {shape}")
    if not np.isfinite(array).all():
        raise InvalidValue(argument, value, "finite numbers (no NaN, no infinity)")
    return array


def binary_array(argument: str, array: np.ndarray, expected: str = "an array of 0 and 1") -> np.ndarray:
    """Return an array of 0 and 1, or of truth values, as bool; raise InvalidType or InvalidValue for another."""
    if array.dtype == bool:
        return array
    if array.dtype.kind not in "iuf":
        raise InvalidType(argument, f"array of {array.dtype}", expected)
    if not ((array == 0) | (array == 1)).all():
        raise InvalidValue(argument, f"values from {array.min()} to {array.max()}", "0 and 1 only")
    return array.astype(bool)


def float_array(argument: str, value: Any, expected: str = "numbers") -> np.ndarray:
    """Return `value` as a float array of whatever shape, or raise; text, truth values and dates are no numbers."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "iufO":
            raise TypeError(array.dtype)
        return np.asarray(array, dtype=float)
    except OverflowError:
        raise InvalidValue(argument, "a whole number beyond every float", expected) from None
    except Exception:  # whatever an object raises that is asked for its numbers
        raise InvalidType(argument, value, expected) from None
