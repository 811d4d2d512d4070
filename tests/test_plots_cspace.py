"""The plots of notebook 3 draw the data that they are given."""

import matplotlib

matplotlib.use("Agg")
import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgba

from tutorialbot import pictures, plots_cspace
from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.vox2c.arm import forward_kinematics
from tutorialbot.vox2c.scenes import BoxScene, random_scene


def colour_at(ax, theta1: float, theta2: float) -> str:
    """Return the colour of the image at a place of the axes [deg]."""
    (image,) = ax.images
    left, right, bottom, top = image.get_extent()
    values = image.get_array()
    column = int((theta1 - left) / (right - left) * values.shape[1])
    row = int((theta2 - bottom) / (top - bottom) * values.shape[0])
    return to_hex(image.cmap(image.norm(values[row, column])))


def test_a_cell_is_drawn_around_its_angles(ax):
    cspace = np.zeros((36, 36), dtype=bool)
    cspace[20, 5] = True  # theta1 = 20, theta2 = -130
    plots_cspace.plot_cspace(ax, cspace, title="map")
    for a, b in ((0, 0), (4.9, 4.9), (-4.9, -4.9)):
        assert colour_at(ax, 20 + a, -130 + b) == plots_cspace.HIT
    for a, b in ((5.1, 0), (-5.1, 0), (0, 5.1), (0, -5.1)):
        assert colour_at(ax, 20 + a, -130 + b) == plots_cspace.FREE
    assert (ax.get_xlabel(), ax.get_title()) == (r"$\theta_1$ [deg]", "map")


def test_probabilities_are_shades_of_grey(ax):
    plots_cspace.plot_cspace(ax, np.array([[0.0, 0.5], [0.5, 1.0]]))
    shades = [int(colour_at(ax, *place)[1:3], 16) for place in ((-180, -180), (0, -180), (0, 0))]
    assert shades[0] == 255 > shades[1] > shades[2]


def test_a_comparison_tells_what_is_missed_from_what_is_made_up(ax):
    truth, predicted = np.array([[0, 0], [1, 1]], dtype=bool), np.array([[0, 1], [0, 1]], dtype=bool)
    plots_cspace.plot_comparison(ax, truth, predicted)
    drawn = {(i, j): colour_at(ax, -180 * (1 - i), -180 * (1 - j)) for i in (0, 1) for j in (0, 1)}
    expected = {(0, 0): plots_cspace.FREE, (0, 1): plots_cspace.FALSE_ALARM, (1, 0): plots_cspace.MISSED,
                (1, 1): plots_cspace.HIT}  # fmt: skip
    assert drawn == {cell: to_hex(colour) for cell, colour in expected.items()}
    plots_cspace.legend_of_errors(ax)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["collision", "missed", "false alarm"]


def test_a_path_goes_on_at_the_other_side(ax):
    plots_cspace.plot_path(ax, np.radians([[170.0, 10.0], [190.0, 10.0], [190.0, 40.0]]), label="way")
    first, second, start, goal = ax.lines
    assert first.get_xdata()[0] == pytest.approx(170) and first.get_xdata().max() <= 180
    assert second.get_xdata().min() < -178 and second.get_xdata()[-1] == pytest.approx(-170)
    assert second.get_ydata()[-1] == pytest.approx(40)
    assert [line.get_label() == "way" for line in (first, second)] == [True, False]
    assert start.get_xydata() == pytest.approx(np.array([[170.0, 10.0]]))
    assert goal.get_xydata() == pytest.approx(np.array([[-170.0, 40.0]]))


def test_a_path_of_one_point_and_one_of_none(ax):
    plots_cspace.plot_path(ax, np.radians([[30.0, 60.0]]))
    assert ax.lines[-1].get_xydata() == pytest.approx(np.array([[30.0, 60.0]]))
    ax.clear()
    plots_cspace.plot_path(ax, np.empty((0, 2)))
    assert len(ax.lines) == 0 and ax.get_xlim() == (-180, 180)


def test_edges_over_the_border_are_left_out(ax):
    edges = np.array([[[0.0, 0.0], [0.1, 0.2]], [[3.0, 0.0], [-3.0, 0.0]], [[1.0, 1.0], [1.0, 2.0]]])
    plots_cspace.plot_tree(ax, edges)
    drawn = ax.lines[0].get_xydata()
    np.testing.assert_allclose(drawn[[0, 1, 3, 4]], np.degrees(edges[[0, 2]].reshape(-1, 2)))
    assert np.isnan(drawn[[2, 5]]).all() and len(drawn) == 6
    ax.clear()
    plots_cspace.plot_tree(ax, np.empty((0, 2, 2)))


def test_the_side_view_tells_the_slabs_apart_and_shows_the_arm(ax):
    boxes = [[0.6, 0.05, 0.5, 0.2, 0.02, 0.2], [-0.6, 0.1, 0.5, 0.2, 0.02, 0.2], [0.6, 0.075, 1.5, 0.2, 0.1, 0.2],
             [0.0, -0.8, 1.8, 0.3, 0.1, 0.4]]  # fmt: skip
    q = np.array([0.4, -1.1])
    plots_cspace.plot_side(ax, BoxScene(boxes), [q], alpha=[0.5])
    second, third, both, none = ax.patches[:4]
    assert [box.get_hatch() for box in ax.patches[:4]] == [None, None, "//", None]
    assert [to_hex(box.get_facecolor()) for box in (second, third)] == [to_hex(c) for c in plots_cspace.LINKS]
    assert to_hex(none.get_facecolor()) == "#dddddd" and (none.get_xy(), none.get_width()) == ((-0.15, 1.6), 0.3)
    bars = [patch.get_xy()[:4] for patch in ax.patches[5:]]
    joints = forward_kinematics(q)[0][:, [0, 2]]
    assert len(bars) == 2 and ax.patches[-1].get_alpha() == 0.5
    np.testing.assert_allclose(bars[1][2:].mean(axis=0), joints[2], atol=1e-12)  # the far end of link 3 is the tip
    for bar, joint in zip(bars, joints, strict=False):  # a joint lies 25 mm inside the near end of its bar
        assert np.linalg.norm(bar[:2].mean(axis=0) - joint) == pytest.approx(0.025)


def test_the_torus_shows_each_cell_around_its_angles_and_the_path_on_it(space, monkeypatch):
    cspace, drawn = np.zeros((8, 8), dtype=bool), {}
    cspace[4, 6] = True  # theta1 = 0, theta2 = 90 degrees: toward +x, on top of the ring
    monkeypatch.setattr(space, "plot_surface", lambda *xyz, facecolors, **_: drawn.update(xyz=xyz, colours=facecolors))
    plots_cspace.plot_torus(space, cspace, path=np.array([[0.0, np.pi / 2], [0.5, np.pi / 2]]), radii=(2.0, 0.9))
    surface = np.stack(drawn["xyz"], axis=-1)
    middles = (surface[:-1, :-1] + surface[1:, :-1] + surface[:-1, 1:] + surface[1:, 1:]) / 4
    assert middles.shape == drawn["colours"].shape == (8, 8, 3)
    dark = np.unravel_index(np.argmin(drawn["colours"].sum(axis=-1)), (8, 8))
    assert dark == (4, 6)
    x, y, z = middles[dark]
    assert 1.5 < x < 2.0 and y == pytest.approx(0.0) and 0.7 < z < 0.9
    line = np.array(space.lines[0].get_data_3d()).T
    np.testing.assert_allclose(line[[0, -1]], [[2, 0, 0.95], [2 * np.cos(0.5), 2 * np.sin(0.5), 0.95]], atol=1e-12)


@pytest.mark.parametrize("path", [None, np.empty((0, 2)), np.zeros((1, 2))])
def test_a_torus_without_a_way(space, path):
    plots_cspace.plot_torus(space, np.zeros((4, 4)), path=path)
    assert len(space.lines) == 0


def test_a_network_has_a_box_a_layer_in_its_size(ax):
    plots_cspace.plot_network(ax, [("in", 3.2, 1.0, "red"), ("code", 0.4, 2.0, "blue")])
    assert [(box.get_height(), box.get_width()) for box in ax.patches] == [(3.2, 1.0), (0.4, 2.0)]
    assert [to_hex(box.get_facecolor()) for box in ax.patches] == [to_hex("red"), to_hex("blue")]
    assert {"in", "code"} <= {text.get_text() for text in ax.texts}


def test_losses_are_drawn_over_steps(ax):
    plots_cspace.plot_losses(ax, {"a": np.array([[0, 1.0], [5, 0.5]]), "b": [[0, 2.0]]}, "cross entropy")
    assert ax.lines[0].get_xydata().tolist() == [[0, 1.0], [5, 0.5]] and ax.lines[1].get_label() == "b"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("step", "cross entropy")


def test_the_picture_has_both_spaces_and_the_path():
    picture = np.asarray(pictures.cspace(random_scene(27), np.array([[0.0, 0.0], [0.4, -0.6]]), 320, 180)).astype(int)
    assert picture.shape == (180, 320, 3)
    red = (picture[..., 0] > 150) & (picture[..., 1:].max(axis=-1) < 90)
    assert red[:, :140].any() and red[:, 140:].any()


@pytest.mark.parametrize("path", [np.empty((0, 2)), None, [[0.0, np.nan]], "way"])
def test_a_picture_needs_a_path(path):
    with pytest.raises((InvalidType, InvalidValue), match="^path = "):
        pictures.cspace(random_scene(27), path)


def test_colours_of_the_map_are_told_apart():
    kinds = (plots_cspace.FREE, plots_cspace.HIT, plots_cspace.FALSE_ALARM, plots_cspace.MISSED)
    assert len({to_rgba(colour) for colour in kinds}) == 4
