"""The plots of notebook 4 draw the data that they are given."""

import math

import numpy as np
import pytest

from tutorialbot import pictures, plots_passage
from tutorialbot.errors import InvalidValue
from tutorialbot.ik import knob_release, moving_base, phase_portrait, stretch
from tutorialbot.ik.arm_frames import arm_frames, elbow_rate, robot_frames
from tutorialbot.ik.full_workspace import full_workspace
from tutorialbot.ik.passage import run_passage
from tutorialbot.ik.singularity_consistent import SphericalArm, elbow_peak_rate
from tutorialbot.ik.stretch_paths import radial
from tutorialbot.scene.closing_door import ClosingDoor

ARM = SphericalArm()
Q = np.array([0.3, 1.2, -0.4, 0.9, 0.5, 0.8, 0.1])


def test_the_frames_of_fig_2_and_3(space):
    frames = arm_frames(ARM, Q)
    np.testing.assert_allclose(frames.points[-1], ARM.forward(Q).translation, atol=1e-12)
    shoulder, wrist = frames.points[1], frames.points[3]
    np.testing.assert_allclose(shoulder + frames.r * frames.wrist_frame.rotation[:, 2], wrist, atol=1e-12)
    np.testing.assert_allclose(frames.wrist_frame.rotation[:, 1], frames.axes[3], atol=1e-12)
    np.testing.assert_allclose(ARM.jacobian(Q)[3:], frames.axes.T, atol=1e-12)
    assert math.cos(frames.alpha) == pytest.approx(frames.wrist_frame.rotation[:, 2] @ frames.axes[2])
    assert frames.alpha + frames.beta == pytest.approx(Q[3])
    plots_passage.plot_arm_frames(space, frames)
    assert {f"$q_{i}$" for i in range(1, 8)} <= {text.get_text() for text in space.texts}


def test_the_frames_of_fig_3(space):
    base = np.array([1.0, -0.5, 0.7])
    frames = robot_frames(ARM, base, Q)
    there = frames.arm_anchor.act(ARM.forward(Q).translation)
    np.testing.assert_allclose(frames.arm.tip.translation, there, atol=1e-12)
    assert frames.mobile_base.translation == pytest.approx([1.0, -0.5, 0.0])
    plots_passage.plot_robot_frames(space, frames)
    assert {"$F_0$", "$F_{mb}$", "$F_a$", "$F_W$"} <= {text.get_text() for text in space.texts}


def test_the_elbow_s_rate_is_the_joint_s_and_peaks_at_the_closed_form(ax):
    q = Q.copy()
    q[3] = 0.2
    line = arm_frames(ARM, q).wrist_frame.rotation[:, 2]
    found = elbow_rate(ARM, 0.2, 0.1, 2)
    assert found.rate == pytest.approx(ARM.joint_velocity(q, np.concatenate([0.1 * line, np.zeros(3)])).qdot[3])
    assert found.plain_rate * found.scale == pytest.approx(found.rate) and found.inside
    assert elbow_rate(ARM, 0.0, 0.1, 2).plain_rate == -math.inf
    assert abs(elbow_rate(ARM, 0.0, 0.1, 2).rate) == pytest.approx(elbow_peak_rate(ARM, 0.1, 2))
    plots_passage.plot_elbow_rate(ax, ARM, 0.1, 2, 0.2)
    ours = ax.lines[1]
    assert max(ours.get_ydata()) == pytest.approx(elbow_peak_rate(ARM, 0.1, 2), rel=1e-3)


def test_eq_2_has_a_line_an_order(ax):
    plots_passage.plot_time_scale(ax, (1, 3))
    assert [line.get_label() for line in ax.lines[:2]] == ["n = 1, sine", "n = 3, sine"]
    assert max(ax.lines[0].get_ydata()) == 1.0


def test_the_phase_portrait_shows_paths_and_saddle(ax):
    data = phase_portrait.portrait(ARM, points=15)
    plots_passage.plot_phase_portrait(ax, data, 0.1, 0.02)
    labels = [line.get_label() for line in ax.lines]
    assert [label.rpartition(": ")[2] for label in labels[:3]] == ["passes", "stalls", "reflects"]
    assert any(label.startswith("saddle, 0.85") for label in labels)


def test_methods_over_time_have_their_colours(ax):
    names = ("singularity-consistent n=2", "damped 0.02")
    runs = {name: stretch.follow(ARM, radial(ARM), stretch.solvers()[name], dt=1e-2) for name in names}
    for quantity in ("peak_rate", "deviation", "behind", "scale"):
        plots_passage.plot_followed(ax, runs, quantity)
    assert ax.lines[0].get_color() == plots_passage.COLOURS["ours"]
    assert len(ax.lines[0].get_xdata()) == len(runs[names[0]].times)


def test_fig_6_has_seven_rates_and_the_region(figure):
    upper, lower = figure.subplots(2, 1)
    data = knob_release.release(dt=1e-2)
    plots_passage.plot_release(upper, lower, data, 5.0)
    assert len(lower.lines) == 7 and lower.get_ylim() == (-5.0, 5.0)
    np.testing.assert_allclose(upper.lines[0].get_ydata(), data.sin_q4)


def test_lines_and_workspace(figure):
    one, two, three, four = figure.subplots(2, 2).flat
    plots_passage.plot_lines(one, {"base inside": moving_base.line(dt=1e-2, length=0.1)})
    data = full_workspace(margins_deg=(0.0, 40.0), shares=(0.0, 0.5))
    plots_passage.plot_workspace_share(two, data)
    plots_passage.plot_opening(three, data, "pivoting")
    plots_passage.plot_reach(four, ARM, 0.5)
    np.testing.assert_allclose(three.lines[0].get_ydata(), np.rad2deg(data.opening[1, :, 0]))
    assert [patch.radius for patch in four.patches][0] == 0.7


@pytest.fixture(scope="module")
def passed():
    return run_passage()


def test_a_door_from_above_has_its_panel_at_each_angle(ax):
    door = ClosingDoor()
    plots_passage.plot_door(ax, door, [0.0, 1.0])
    panels = [patch.get_xy()[:4] for patch in ax.patches if len(getattr(patch, "get_xy", list)()) == 5]
    assert len(panels) == 2
    for angle, panel in zip((0.0, 1.0), panels, strict=True):
        np.testing.assert_allclose(panel, door.panel_corners(angle))


def test_a_plan_shows_base_arm_and_what_the_hand_does(ax, passed):
    colours = {}
    for held in (True, False):
        ax.clear()
        instant = int(np.flatnonzero(passed.grasped == held)[-1])
        plots_passage.plot_plan(ax, passed, instant)
        *_, arm, hand = ax.lines
        np.testing.assert_allclose(arm.get_xydata()[0], passed.base[instant, :2], atol=1e-12)
        np.testing.assert_allclose(hand.get_xydata()[0], arm.get_xydata()[-1])
        colours[held] = hand.get_color()
    assert colours[True] != colours[False]


def test_the_picture_of_the_passage_moves_with_the_robot(passed):
    one, other = (np.asarray(pictures.through(passed, share, 320, 180)).astype(int) for share in (0.2, 0.8))
    assert one.shape == (180, 320, 3) and (np.abs(one - other).max(axis=2) > 40).mean() > 0.01
    failed = run_passage(ClosingDoor(width=0.6))
    with pytest.raises(InvalidValue, match="run"):
        pictures.through(failed)
