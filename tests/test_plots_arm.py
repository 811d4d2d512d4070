"""The plots of notebook 2 draw the data that they are given."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from tutorialbot import plots_arm
from tutorialbot.ik import genetic


def test_joint_frames_end_at_the_tip():
    q = np.random.default_rng(0).uniform(genetic.ARM.lower, genetic.ARM.upper)
    points, axes = plots_arm.joint_frames(q)
    np.testing.assert_allclose(points[-1], genetic.forward_kinematics(q)[0], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0)
    np.testing.assert_allclose(np.linalg.norm(points[4] - points[3]), 0.23)  # the forearm


def test_the_diagram_has_seven_joints_and_the_hand():
    figure = plt.figure()
    ax = plots_arm.plot_arm(figure.add_subplot(projection="3d"), np.zeros(7))
    assert [text.get_text() for text in ax.texts] == [f"$q_{i}$" for i in range(1, 8)]
    assert ax.get_xlabel() == "x [m]"
    figure.canvas.draw()
    plt.close(figure)


def test_the_flow_chart_names_every_step(ax):
    plots_arm.plot_flow_chart(ax)
    assert {*plots_arm.STEPS} <= {text.get_text() for text in ax.texts}


def test_errors_are_drawn_with_their_units(ax):
    errors = np.array([[-1e-1] * 6, [1e-3, 0, 1e-2, 1e-4, 1e-4, 1e-4]])
    plots_arm.plot_errors(ax, errors)
    assert [line.get_label() for line in ax.lines[:6]] == [
        "x [m]", "y [m]", "z [m]", "roll [rad]", "pitch [rad]", "yaw [rad]",
    ]  # fmt: skip
    assert ax.lines[0].get_ydata().tolist() == [1e-1, 1e-3] and ax.get_yscale() == "log"


def test_success_has_a_row_a_variant_and_its_median(ax):
    plots_arm.plot_success(ax, {"a": [1.0, 1e-2, 1e-4], "b": [1e-3] * 3})
    assert ax.lines[1].get_xdata().tolist() == [1e-2]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["a", "b"]


def test_the_ridge_is_seen_along_its_widest_direction(ax):
    rng = np.random.default_rng(1)
    population = rng.standard_normal((50, 7)) * [1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.001]
    plots_arm.plot_ridge(ax, population, population + 1.0, np.arange(50) < 20, "title")
    drawn = ax.lines[2].get_xydata()
    assert drawn[:, 0].std() > 100 * drawn[:, 1].std()
    assert [len(line.get_xdata()) for line in ax.lines] == [30, 20, 50]


def test_paths_deviations_and_limits(ax):
    path = np.array([[0.0, 1, 2], [3, 4, 5]])
    plots_arm.plot_tip_paths(ax, {"way": path}, path, "xz")
    assert ax.lines[0].get_xydata().tolist() == [[0, 2], [3, 5]] and ax.get_ylabel() == "z [m]"
    ax.clear()
    plots_arm.plot_deviation(ax, {"a": [0.001, 0.01]})
    assert ax.lines[0].get_ydata().tolist() == [1.0, 10.0] and "[mm]" in ax.get_ylabel()
    ax.clear()
    plots_arm.plot_limits(ax, np.zeros(7))
    assert len(ax.patches) == 7 and ax.lines[0].get_xdata().tolist() == [0.0] * 7


def test_coverage_shows_every_cell(ax):
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    cells = {"covered": square, "missed": square[:1], "out of reach": np.empty((0, 2))}
    plots_arm.plot_coverage(ax, square, [square / 2], cells)
    assert [len(line.get_xdata()) for line in ax.lines] == [4, 1] and len(ax.patches) == 2
