"""`pytest --full` runs the tests marked `full` too; otherwise they are skipped and say so."""

import pytest
from hypothesis import settings

# The same inputs in every run, and no time limit: a slow machine is not a fault.
settings.register_profile("steady", deadline=None, derandomize=True, database=None)
settings.load_profile("steady")


@pytest.fixture
def figure():
    """An empty figure that needs no screen; drawn at the end, so that what cannot be drawn fails."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure()
    yield figure
    figure.canvas.draw()
    plt.close(figure)


@pytest.fixture
def ax(figure):
    return figure.add_subplot()


@pytest.fixture
def space(figure):
    return figure.add_subplot(projection="3d")


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="run the tests marked `full` too (browsers, kills, long runs)")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--full"):
        return
    skip = pytest.mark.skip(reason="heavy: runs in `python3 -m tutorialbot test --full` only")
    for item in items:
        if "full" in item.keywords:
            item.add_marker(skip)
