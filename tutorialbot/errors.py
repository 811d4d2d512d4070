"""The exceptions of the package, and the checks at its boundary that raise them.

A message always names the argument, the value that came, and what is accepted. A pose that cannot be reached or a
search that fails is a *result*, not an exception; an exception means misuse or a broken file.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np


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
    if isinstance(value, int):
        if abs(value) > 2**1000:
            raise InvalidValue(argument, "a whole number beyond every float", bounds)
        value = float(value) if abs(value) > 2**53 else value  # numpy takes no larger ones than 2**64
    if not np.isfinite(value) or value < low or value > high or (above and value == low):
        raise InvalidValue(argument, value, bounds)
    return float(value)


def positive(argument: str, value: Any) -> float:
    """Return `value` as a float > 0, or raise InvalidType or InvalidValue."""
    return finite_number(argument, value, 0.0, above=True)


def whole_number(argument: str, value: Any, low: int = 0) -> int:
    """Return `value` as an int >= low, or raise InvalidType or InvalidValue."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InvalidType(argument, value, f"a whole number >= {low}")
    if value < low:
        raise InvalidValue(argument, value, f"a whole number >= {low}")
    return int(value)


def one_of(argument: str, value: Any, choices: Iterable[str]) -> str:
    """Return `value` when it is among `choices`, or raise InvalidValue that lists them."""
    names = sorted(choices)
    if not isinstance(value, str) or value not in names:
        raise InvalidValue(argument, value, "one of " + ", ".join(map(repr, names)))
    return value


def finite_array(argument: str, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return `value` as a float array of `shape` (-1 stands for any length) with finite entries, or raise."""
    try:
        array = np.asarray(value)
        if array.dtype.kind in "bcSUmM":  # truths, complex numbers, text and times would pass as numbers
            raise TypeError
        array = array.astype(float, copy=False)
    except OverflowError:
        raise InvalidValue(argument, "a whole number beyond every float", "finite numbers") from None
    except (TypeError, ValueError):
        raise InvalidType(argument, value, f"numbers of shape {shape}") from None
    fits = array.ndim == len(shape) and all(s in (-1, n) for s, n in zip(shape, array.shape, strict=True))
    if not fits:
        raise InvalidValue(argument, f"array of shape {array.shape}", f"shape {shape}")
    if not np.isfinite(array).all():
        raise InvalidValue(argument, value, "finite numbers (no NaN, no infinity)")
    return array
