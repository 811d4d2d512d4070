"""`pytest --full` runs the tests marked `full` too; otherwise they are skipped and say so."""

import pytest
from hypothesis import settings

# The same inputs in every run, and no time limit: a slow machine is not a fault.
settings.register_profile("steady", deadline=None, derandomize=True, database=None)
settings.load_profile("steady")


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="run the tests marked `full` too (browsers, kills, long runs)")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--full"):
        return
    skip = pytest.mark.skip(reason="heavy: runs in `python3 -m tutorialbot test --full` only")
    for item in items:
        if "full" in item.keywords:
            item.add_marker(skip)
