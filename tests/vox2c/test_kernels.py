"""Compiled code: also without a place for its cache, and never other code than stands in the file."""

import numpy as np

from tutorialbot.vox2c import kernels

LOOP = "def total(values):\n    result = 0.0\n    for v in values:\n        result += v\n    return result\n"


def test_without_a_place_for_the_cache_it_compiles_all_the_same():
    """numba refuses to cache a function of no file, as it does where all folders are read-only."""
    names = {}
    exec(compile(LOOP, "<nowhere>", "exec"), names)
    function = kernels.compiled(names["total"])
    assert function(np.arange(4.0)) == 6.0 and function.signatures


def test_where_there_is_a_place_the_code_is_kept():
    assert type(kernels.cspace._cache).__name__ == "FunctionCache"


def test_compiled_and_plain_python_agree():
    """The same source without numba: what is compiled is what stands there."""
    bar = (0.45, 0.225, 0.25, 0.025)
    rng = np.random.default_rng(3)
    for _ in range(300):
        x, z = rng.uniform(-0.8, 0.8, 2)
        half_x, half_z = rng.uniform(0.001, 0.3, 2)
        angle = rng.uniform(-np.pi, np.pi)
        state = (x, z, half_x, half_z, np.sin(angle), np.cos(angle), bar)
        assert kernels.meets(*state) == kernels.meets.py_func(*state)
        window = (x, z, half_x, half_z, 72, -np.pi, bar)
        assert kernels._window(*window) == kernels._window.py_func(*window)
    filled = rng.random((9, 7)) < 0.5
    np.testing.assert_array_equal(kernels.merged(filled), kernels.merged.py_func(filled))


def test_no_angle_outside_the_window_is_a_hit():
    bar, n = (0.45, 0.225, 0.25, 0.025), 90
    angles = 2 * np.pi * np.arange(n) / n
    rng, hits = np.random.default_rng(5), 0
    for _ in range(3000):
        x, z = rng.uniform(-0.6, 0.6, 2)
        half_x, half_z = 10.0 ** rng.uniform(-3, -0.5, 2)
        found = [kernels.meets(x, z, half_x, half_z, np.sin(a), np.cos(a), bar) for a in angles]
        first, last = kernels._window(x, z, half_x, half_z, n, 0.0, bar)
        assert set(np.flatnonzero(found)) <= {i % n for i in range(first, last + 1)}
        hits += sum(found)
    assert hits > 10_000
