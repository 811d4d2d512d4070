"""The five numbers and what they mean."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tutorialbot.bo.space import SearchSpace, from_sphere, to_sphere, twist_features

UNIT = st.floats(-1.0, 1.0)
POINT = st.tuples(UNIT, UNIT, UNIT, UNIT, UNIT).map(np.array)


def test_uniform_numbers_cover_the_sphere_uniformly():
    """The share of directions in caps of 25 degrees round any axis is the cap's share of the sphere."""
    rng = np.random.default_rng(0)
    directions = to_sphere(*rng.uniform(-1, 1, (2, 200_000)))
    share = (1 - np.cos(np.deg2rad(25.0))) / 2
    for axis in np.vstack([np.eye(3), -np.eye(3), rng.standard_normal((10, 3))]):
        inside = (directions @ (axis / np.linalg.norm(axis)) > np.cos(np.deg2rad(25.0))).mean()
        assert inside == pytest.approx(share, abs=0.003)


@given(st.floats(-0.999, 0.999), st.floats(-0.999, 0.999))
def test_sphere_there_and_back(a, b):
    direction = to_sphere(a, b)
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert np.array(from_sphere(3.0 * direction)) == pytest.approx([a, b], abs=1e-9)


@given(POINT)
def test_ratio_is_linear_between_translation_and_rotation(c):
    space = SearchSpace()
    translation, rotation = space.motion(c)
    assert np.linalg.norm(translation) / 0.15 + np.linalg.norm(rotation) / np.pi == pytest.approx(1.0)
    assert np.linalg.norm(rotation) / np.pi == pytest.approx((1 + c[4]) / 2)


@pytest.mark.parametrize(
    ("ratio", "metres", "radians"), [(-1.0, 0.15, 0.0), (1.0, 0.0, np.pi), (0.0, 0.075, np.pi / 2)]
)
def test_ends_of_the_ratio_as_the_paper_words_them(ratio, metres, radians):
    translation, rotation = SearchSpace().motion(np.array([0.3, -0.2, 0.9, 0.1, ratio]))
    assert np.linalg.norm(translation) == pytest.approx(metres)
    assert np.linalg.norm(rotation) == pytest.approx(radians)


@given(POINT, st.sampled_from(["world", "tool"]))
def test_point_undoes_motion_and_moved_undoes_goal(c, frame):
    space = SearchSpace(rotation_max=np.pi / 2, frame=frame)
    start = pin.SE3(pin.exp3(np.array([0.3, -1.0, 0.5])), np.array([0.4, 0.1, 1.0]))
    translation, rotation = space.motion(c)
    assert np.hstack(space.moved(start, space.goal(start, c))) == pytest.approx(
        np.hstack([translation, rotation]), abs=1e-9
    )
    again = space.point(0.3 * translation, 0.3 * rotation)
    assert np.hstack(space.motion(again)) == pytest.approx(np.hstack([translation, rotation]), abs=1e-9)


def test_a_tool_frame_direction_turns_with_the_hand_and_a_world_one_does_not():
    c = SearchSpace().point(np.array([-0.15, 0.0, 0.0]), np.zeros(3))
    turned = pin.SE3(pin.exp3(np.array([0.0, 0.0, np.pi / 2])), np.zeros(3))
    assert SearchSpace(frame="world").goal(turned, c).translation == pytest.approx([-0.15, 0.0, 0.0])
    assert SearchSpace(frame="tool").goal(turned, c).translation == pytest.approx([0.0, -0.15, 0.0])


def test_a_rotation_turns_about_the_axis_of_its_frame():
    """The axis stays where it is under its own rotation: the world's x in the world, the hand's x in the hand."""
    start = pin.SE3(pin.exp3(np.array([0.4, -0.9, 1.1])), np.array([0.3, 0.2, 1.0]))
    c = SearchSpace().point(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    in_world = SearchSpace(rotation_max=1.0).goal(start, c)
    in_tool = SearchSpace(rotation_max=1.0, frame="tool").goal(start, c)
    assert in_world.rotation @ start.rotation.T == pytest.approx(pin.exp3(np.array([1.0, 0.0, 0.0])))
    assert start.rotation.T @ in_tool.rotation == pytest.approx(pin.exp3(np.array([1.0, 0.0, 0.0])))
    assert in_world.translation == pytest.approx(start.translation) == in_tool.translation


def test_features_are_smooth_where_the_coordinates_are_not():
    """The seam of the azimuth is no seam, and the axis of no rotation does not matter."""
    left, right = twist_features(np.array([[-1.0, 0.2, 0, 0, -0.5], [1.0, 0.2, 0, 0, -0.5]]))
    assert left == pytest.approx(right)
    one, other = twist_features(np.array([[0.1, 0.2, 0.9, 0.9, -1.0], [0.1, 0.2, -0.5, 0.3, -1.0]]))
    assert one == pytest.approx(other)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("reach", 0.0),
        ("reach", float("nan")),
        ("rotation_max", -1.0),
        ("rotation_max", 4.0),
        ("frame", "door"),
    ],
)
def test_impossible_spaces_are_refused_by_name(argument, value):
    with pytest.raises(ValueError, match=argument):
        SearchSpace(**{argument: value})


@pytest.mark.parametrize("c", [np.zeros(4), np.full(5, np.nan), "abcde"])
def test_impossible_points_are_refused(c):
    with pytest.raises((ValueError, TypeError), match=r"^c = "):
        SearchSpace().motion(c)
