"""Every plot draws the data that it is given, and names its axes with units."""

from types import SimpleNamespace

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mujoco
import numpy as np
import pytest

from tutorialbot import plots, plots_door, robots
from tutorialbot.scene.door import Door


def labels(ax) -> tuple[str, str]:
    return ax.get_xlabel(), ax.get_ylabel()


def legend(ax) -> list[str]:
    return [text.get_text() for text in ax.legend().get_texts()]


def trace(values, outcome="finished"):
    values = np.array(values, dtype=float)
    return SimpleNamespace(times=0.01 * np.arange(1, len(values) + 1), force=values, torque=values / 5, outcome=outcome)


def test_norms_show_the_curve_the_threshold_and_where_it_was_crossed(ax):
    drawn = {"soft": trace([1, 2, 3]), "hard": trace([10, 30, 50], "collision")}
    assert plots.plot_norms(ax, drawn, "force", 40.0) is ax
    assert labels(ax) == ("time [s]", "force [N]")
    soft, hard, crossing, threshold = ax.lines
    assert soft.get_ydata().tolist() == [1, 2, 3] and hard.get_ydata().tolist() == [10, 30, 50]
    assert crossing.get_ydata() == [50] and crossing.get_xdata() == [0.03]
    assert list(threshold.get_ydata()) == [40.0, 40.0]
    assert legend(ax) == ["soft", "hard"] and ax.get_ylim()[1] >= 50


def test_norms_of_torque_are_in_newton_metres(ax):
    plots.plot_norms(ax, {"soft": trace([5, 10])}, "torque", 8.0)
    assert ax.get_ylabel() == "torque [Nm]" and ax.lines[0].get_ydata().tolist() == [1, 2]


def test_response_draws_each_signal(ax):
    times = np.linspace(0, 1, 5)
    plots.plot_response(ax, times, {"reference": times, "measured": 0.5 * times}, "angle [deg]")
    assert labels(ax) == ("time [s]", "angle [deg]")
    assert np.array_equal(ax.lines[1].get_ydata(), 0.5 * times) and legend(ax) == ["reference", "measured"]


def test_sphere_points_are_where_they_should_be(space):
    points = np.eye(3)
    plots.plot_sphere_points(space, points, "three axes")
    assert np.allclose(np.transpose(space.collections[0]._offsets3d), points)
    assert space.get_title() == "three axes" and space.get_zlabel() == "z"


def test_the_map_puts_the_first_row_at_the_bottom(ax):
    values = np.arange(8.0).reshape(2, 4)
    plots.plot_direction_map(ax, values, "t [s]")
    image = ax.images[0]
    assert np.array_equal(image.get_array(), values) and image.origin == "lower"
    assert list(image.get_extent()) == [-1, 1, -1, 1] and image.get_clim() == (0.0, 4.0)
    assert image.colorbar.ax.get_ylabel() == "t [s]"
    assert {text.get_text() for text in ax.texts} == {way[0] for way in plots.WAYS}
    assert "c_1" in ax.get_xlabel() and "c_2" in ax.get_ylabel()


def test_a_surrogate_is_drawn_over_what_it_is_about():
    figure, (upper, lower) = plt.subplots(2, 1)
    x, truth, mean, doubt = np.array([-1.0, 0, 1]), np.array([3.0, 4, 5]), np.array([1.0, 2, 3]), np.array([0.5, 0, 1])
    plots.plot_surrogate(upper, lower, x, truth, mean, doubt, np.array([0.0, 0.2, 0.1]), [2])
    curves = {line.get_label(): line.get_xydata() for line in upper.lines}
    assert np.array_equal(curves["truth"][:, 1], truth) and np.array_equal(curves[r"mean $\mu$"][:, 1], mean)
    assert curves["trials"].tolist() == [[1, 5]]
    band = upper.collections[0].get_paths()[0].vertices
    assert {(-1, 0), (-1, 2), (1, 1), (1, 5)} <= set(map(tuple, band))
    assert [ax.lines[-1].get_xdata()[0] for ax in (upper, lower)] == [0, 0]  # where the gain is largest
    assert upper.get_title() == "after 1 trials" and "[s]" in upper.get_ylabel() and "[s]" in lower.get_ylabel()
    plt.close(figure)


def test_distances_are_drawn_over_degrees(ax):
    plots.plot_distances(ax, np.array([0, np.pi]), {"atan": np.array([0.0, 2.0])})
    assert labels(ax) == ("door angle [deg]", "SO(4) distance [-]")
    assert np.allclose(ax.lines[0].get_xdata(), [0, 180]) and ax.lines[0].get_ydata().tolist() == [0, 2]


def test_best_so_far_never_rises_and_its_median_is_the_thick_line(ax):
    costs = [[3, 1, 2], [5, 4, 0], [4, 4, 4]]
    plots.plot_best_so_far(ax, {"three runs": costs, "one": [1, 2, 0]}, {"one": "student"})
    assert labels(ax) == ("trial", "lowest cost so far [s]")
    single, median, one = ax.lines[1], ax.lines[3], ax.lines[4]
    assert single.get_ydata().tolist() == [5, 4, 0]
    assert median.get_ydata().tolist() == [4, 4, 1] and median.get_xdata().tolist() == [1, 2, 3]
    assert one.get_ydata().tolist() == [1, 1, 0] and one.get_color() == plots.COLOURS["student"]
    assert legend(ax) == ["three runs", "one"]


def test_costs_show_each_trial_and_the_lowest(ax):
    plots.plot_costs(ax, iter([2.0, 3.0, 1.0]))
    assert ax.lines[0].get_ydata().tolist() == [2, 3, 1] and ax.lines[1].get_ydata().tolist() == [2, 2, 1]
    assert labels(ax) == ("trial", "cost [s]")


def test_slice_rings_the_last_point(ax):
    points = np.array([[0.1, 0.2, 0, 0, 0], [0.5, -0.5, 0, 0, 0]])
    plots.plot_slice(ax, np.eye(3), points, "mean [s]")
    assert np.array_equal(ax.images[0].get_array(), np.eye(3)) and ax.images[0].origin == "lower"
    tried, ring = ax.lines
    assert np.array_equal(tried.get_xydata(), points[:, :2]) and np.array_equal(ring.get_xydata(), points[-1:, :2])
    assert ax.images[0].colorbar.ax.get_ylabel() == "mean [s]"


def test_door_angles_are_in_degrees_and_sections_are_marked(ax):
    watch = np.array([[0, 0, 0], [1, 0, -np.pi / 4], [2, np.pi / 2, 0]])
    plots.plot_door_angles(ax, watch, [1.0])
    hinge, lever, mark = ax.lines
    assert np.allclose(hinge.get_ydata(), [0, 0, 90]) and np.allclose(lever.get_ydata(), [0, -45, 0])
    assert list(mark.get_xdata()) == [1.0, 1.0] and labels(ax) == ("time [s]", "angle [deg]")


def test_success_draws_a_line_a_preset_with_its_interval(ax):
    rows = [{"preset": name, "trials": trials, "opened_12": share, "low": share - 0.1, "high": share + 0.2}
            for name, share in (("improved", 0.5), ("improved, random", 0.4)) for trials in (15, 5)]  # fmt: skip
    plots.plot_success(ax, rows)
    line, _, (bars,) = ax.containers[0]
    assert line.get_ydata().tolist() == [0.5, 0.5] and (np.diff(line.get_xdata()) > 0).all()
    low, high = bars.get_segments()[0][:, 1]
    assert np.isclose(low, 0.4) and np.isclose(high, 0.7)
    assert legend(ax) == ["improved", "improved, random"]
    assert labels(ax) == ("trials a section", "share of doors opened [-]")


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_door_is_drawn_to_its_own_measures(ax, side):
    door = Door(spindle_radius=0.6, side=side)
    plots_door.plot_door_front(ax, door)
    panel = ax.patches[0]
    assert np.isclose(panel.get_width(), 0.66) and np.isclose(panel.get_height(), door.panel_height)
    x = panel.get_x() + panel.get_width() / 2
    assert np.sign(x) == (1 if side == "right" else -1)  # y points left, and the hinge is at y = 0
    assert ax.get_xlim()[0] > ax.get_xlim()[1]  # as the robot sees it: left is left
    assert labels(ax) == ("y [m]", "z [m]")
    assert any("0.6 m" in text.get_text() for text in ax.texts)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_door_opens_toward_the_robot(ax, side):
    plots_door.plot_door_top(ax, Door(side=side), np.pi / 2)
    shut, opened = (patch.get_xy() for patch in ax.patches[:2])
    assert np.isclose(abs(shut[:, 1]).max(), 0.48) and shut[:, 0].min() >= 0.0
    assert np.isclose(opened[:, 0].min(), -0.48)
    assert labels(ax) == ("x [m]", "y [m]")


def test_the_skeleton_shows_six_joints_and_the_hand(space):
    model = robots.load("mobile_manipulator")
    data = mujoco.MjData(model)
    plots_door.plot_skeleton(space, model, data)
    names = {text.get_text() for text in space.texts}
    assert {f"$q_{i}$" for i in range(1, 7)} <= names
    tool = data.site("tool").xpos
    ends = [np.array(arrow._segments3d[0]) for arrow in space.collections]
    assert all(np.isclose(np.linalg.norm(end - tool, axis=1), 0.0, atol=1e-6).any() for end in ends)
    assert np.allclose(sorted(np.ptp(end, axis=0).argmax() for end in ends), [0, 1, 2])


def test_the_base_shows_two_casters_that_turn_with_it(ax):
    model = robots.load("mobile_manipulator")
    data = mujoco.MjData(model)
    data.joint("base_x").qpos = 1.0
    data.joint("caster_left_steer").qpos = np.pi / 2
    plots_door.plot_base(ax, model, data)
    pivots = [line.get_xydata()[0] for line in ax.lines if line.get_marker() == "o" and len(line.get_xydata()) == 1]
    assert np.allclose(pivots, [(1.0, 0.2), (1.0, -0.2)])
    orange = [line for line in ax.lines if line.get_color() == plots.COLOURS["lever"]]
    trails = [line.get_xydata() for line in orange if line.get_lw() == 2]
    assert np.allclose(trails[0][1] - trails[0][0], [0, -0.05]) and np.allclose(trails[1][1] - trails[1][0], [-0.05, 0])
