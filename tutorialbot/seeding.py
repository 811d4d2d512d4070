"""Random numbers: one way in, so that the same seed gives the same result."""

import numpy as np

from tutorialbot.errors import whole_number


def make_rng(seed: int, *stream: int) -> np.random.Generator:
    """Return a generator for `seed` (whole number >= 0); `stream` numbers name independent streams of that seed."""
    return np.random.default_rng([whole_number("seed", seed), *stream])
