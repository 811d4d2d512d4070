"""Random numbers: one way in, so that the same seed gives the same result."""

import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from tutorialbot.errors import whole_number

_one_at_a_time = threading.RLock()  # the global generators are one for all threads


def make_rng(seed: int, *stream: int) -> np.random.Generator:
    """Return a generator for `seed` (whole number >= 0); `stream` numbers name independent streams of that seed."""
    return np.random.default_rng([whole_number("seed", seed), *stream])


@contextmanager
def numpy_global(rng: np.random.Generator) -> Iterator[None]:
    """Seed the global generator from `rng` inside the block, put it back afterwards: CMA-ES draws from it."""
    with _one_at_a_time:
        before = np.random.get_state()  # noqa: NPY002
        try:
            np.random.seed(int(rng.integers(2**32)))  # noqa: NPY002
            yield
        finally:
            np.random.set_state(before)  # noqa: NPY002


@contextmanager
def python_global(stream: random.Random) -> Iterator[None]:
    """Let Python's global generator go on from `stream` inside the block, which moves on; put it back afterwards.

    DEAP's operators draw from it.
    """
    with _one_at_a_time:
        before, its = random.getstate(), stream.getstate()
        try:
            random.setstate(its)
            yield
        finally:
            try:
                stream.setstate(random.getstate())
            finally:  # also when Ctrl-C comes just here
                random.setstate(before)
