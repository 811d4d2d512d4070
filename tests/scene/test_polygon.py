"""Polygons: cut into triangles, asked for points, refused when they are none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.scene.polygon import area, checked, contains, contains_polygon, distance_to_edges, triangles

L_SHAPE = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [0, 2.0]])
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
stars = st.lists(st.floats(0.3, 2.0), min_size=4, max_size=12).map(
    lambda radii: np.array([[r * np.cos(t), r * np.sin(t)]
                            for r, t in zip(radii, 2 * np.pi * np.arange(len(radii)) / len(radii), strict=True)])
)  # fmt: skip


@given(stars)
def test_triangles_tile_the_polygon(star):
    cut = star[triangles(star)]
    areas = [area(triangle) for triangle in cut]
    assert len(cut) == len(star) - 2 and min(areas) > 0
    assert sum(areas) == pytest.approx(area(star))
    points = np.random.default_rng(1).uniform(-2, 2, (200, 2))
    points = points[distance_to_edges(star, points) > 1e-6]
    inside = np.any([contains(triangle, points) for triangle in cut], axis=0)
    np.testing.assert_array_equal(contains(star, points), inside)


@given(stars, st.floats(-3, 3), st.integers(0, 11))
def test_inside_is_inside_however_the_polygon_is_turned_and_numbered(star, angle, shift):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    points = np.random.default_rng(2).uniform(-2, 2, (100, 2))
    points = points[distance_to_edges(star, points) > 1e-6]
    turned = np.roll(star, shift, axis=0) @ turn.T
    np.testing.assert_array_equal(contains(star, points), contains(turned, points @ turn.T))
    np.testing.assert_allclose(distance_to_edges(star, points), distance_to_edges(turned, points @ turn.T), atol=1e-9)


def test_area_corners_and_edges():
    assert area(L_SHAPE) == 4.0 and area(L_SHAPE[::-1]) == -4.0
    np.testing.assert_array_equal(checked("floor", L_SHAPE[::-1]), L_SHAPE)
    assert contains(L_SHAPE, L_SHAPE).all() and contains(L_SHAPE, np.array([[1.5, 1.0]])).all()
    assert not contains(L_SHAPE, np.array([[1.5, 1.5], [-0.1, 1.0], [4.0, 0.0]])).any()
    np.testing.assert_allclose(distance_to_edges(L_SHAPE, np.array([[0.5, 0.4], [2.0, 1.5], [4, 2]])), [0.4, 0.5, 2**0.5])


@pytest.mark.parametrize(
    ("inner", "answer"),
    [
        (SQUARE, True),  # it shares edges
        (SQUARE + [2.0, 0.0], True),
        (SQUARE + [2.0 + 1e-12, -1e-12], True),
        (SQUARE + [0.5, 0.5], False),  # a corner of the L pokes into it
        (SQUARE + [1.2, 0.5], False),
        (SQUARE + [-0.5, 0.0], False),
        (SQUARE + [7.0, 0.0], False),
        (np.array([[0, 0], [3, 1], [0, 2.0]]), False),  # corners inside, an edge across the notch
        (SQUARE * 9 - 1, False),  # it holds the L
    ],
)
def test_polygon_within_polygon(inner, answer):
    assert contains_polygon(L_SHAPE, np.asarray(inner, dtype=float)) is answer


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
