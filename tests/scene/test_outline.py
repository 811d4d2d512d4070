"""Outlines on the floor: cut into triangles, refused when they are none; furniture must stand inside the room."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.scene.furniture import Furniture
from tutorialbot.scene.outline import checked, triangles
from tutorialbot.scene.room import Room

L_SHAPE = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2.0]])
stars = st.lists(st.floats(0.3, 2.0), min_size=4, max_size=12).map(
    lambda radii: np.array([[r * np.cos(t), r * np.sin(t)]
                            for r, t in zip(radii, 2 * np.pi * np.arange(len(radii)) / len(radii), strict=True)])
)  # fmt: skip


@given(stars)
def test_triangles_tile_the_polygon_counterclockwise(star):
    cut = triangles(star)
    a, b, c = np.moveaxis(star[cut], 1, 0)
    u, v = b - a, c - a
    areas = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    x, y = star.T
    shoelace = 0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum()
    assert len(cut) == len(star) - 2 and areas.min() > 0
    assert areas.sum() == pytest.approx(shoelace)


def test_corners_are_kept_and_go_counterclockwise():
    np.testing.assert_array_equal(checked("floor", L_SHAPE[::-1]), L_SHAPE)
    np.testing.assert_array_equal(checked("floor", L_SHAPE), L_SHAPE)


@pytest.mark.parametrize(
    ("corners", "error", "words"),
    [
        ([[0, 0], [1, 0]], InvalidValue, "2 corners"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], InvalidValue, "cross"),
        ([[0, 0], [2, 0], [1, 0]], InvalidValue, "cross"),  # flat
        ([[0, 0], [2, 0], [2, 1], [1, 0], [0, 1]], InvalidValue, "cross"),  # a corner on an edge
        ([[0, 0], [0, 0], [1, 1], [0, 1]], InvalidValue, "differ"),
        ([[0, 0], [1, 0], [1, np.nan]], InvalidValue, "finite"),
        ([0, 1, 2], InvalidValue, "shape"),
        ("square", InvalidType, "numbers"),
    ],
)
def test_what_is_no_polygon_is_refused(corners, error, words):
    with pytest.raises(error, match=words):
        checked("floor", corners)


@pytest.mark.parametrize(
    ("x", "y", "fits"),
    [
        (0.5, 0.5, True),  # it touches two walls
        (2.5 + 1e-12, 0.5 - 1e-12, True),
        (1.0, 1.0, False),  # the inner corner pokes into it
        (1.5, 1.2, False),
        (-0.1, 0.5, False),
        (7.0, 0.5, False),
    ],
)
def test_furniture_stands_inside_the_room(x, y, fits):
    piece = Furniture("carton", "carton", x, y, length=1.0, width=1.0, height=0.3)
    start = (0.3, 1.5, 0.0) if y < 0.9 else (2.5, 0.5, 0.0)
    if fits:
        assert Room("room", L_SHAPE, (piece,), start=start).polygon.covers(shapely.Point(start[:2]))
    else:
        with pytest.raises(InvalidValue, match="inside the room"):
            Room("room", L_SHAPE, (piece,), start=start)


@pytest.mark.parametrize("start", [(5.0, 0.5, 0.0), (0.2, 1.0, 0.0), (2.5, 0.5, 0.0)])
def test_the_start_is_free(start):
    piece = Furniture("carton", "carton", 2.5, 0.5, length=1.0, width=1.0, height=0.3)
    with pytest.raises(InvalidValue, match="start"):
        Room("room", L_SHAPE, (piece,), start=start)
