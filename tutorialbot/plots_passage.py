"""Plots of notebook 4: the arm and its frames, eq (2), the phase portrait, solvers side by side, Fig. 6, workspace."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon, Rectangle

from tutorialbot.ik.arm_frames import ArmFrames, RobotFrames, arm_frames, elbow_rate
from tutorialbot.ik.full_workspace import FullWorkspace
from tutorialbot.ik.knob_release import Release
from tutorialbot.ik.moving_base import Line
from tutorialbot.ik.passage import Passage
from tutorialbot.ik.phase_portrait import PhasePortrait
from tutorialbot.ik.singularity_consistent import SphericalArm, elbow_peak_rate, time_scale
from tutorialbot.ik.stretch import Followed
from tutorialbot.plots import AXES_RGB, COLOURS
from tutorialbot.scene.closing_door import ClosingDoor
from tutorialbot.scene.home_robot import BASE_RADIUS

OUTCOMES = {"passes": COLOURS["good"], "stalls": COLOURS["lever"], "reflects": COLOURS["bad"]}
METHODS = {"singularity-consistent": COLOURS["ours"], "pseudo-inverse": COLOURS["bad"], "damped": COLOURS["peer"],
           "adaptive": COLOURS["lever"], "rate-limited": COLOURS["good"]}  # fmt: skip


def colour_of(method: str) -> str:
    """Return the colour of a method: "damped 0.1" has that of "damped"."""
    return next((colour for name, colour in METHODS.items() if method.startswith(name)), COLOURS["random"])


def plot_frame(ax, pose: pin.SE3, name: str = "", size: float = 0.12):
    """Draw a frame on 3-D axes: x red, y green, z blue, with its name at its origin."""
    for axis, colour in zip(pose.rotation.T, AXES_RGB, strict=True):
        ax.quiver(*pose.translation, *(size * axis), color=colour, lw=2)
    if name:
        ax.text(*(pose.translation - 0.25 * size), name, fontsize=11, ha="right")
    return ax


def plot_arm_frames(ax, frames: ArmFrames, *, named: bool = True):
    """Draw paper 4's Fig. 2 on 3-D axes: links, joints as bars along their axes, the virtual prismatic joint, W."""
    ax.plot(*frames.points.T, color="#777777", lw=4, solid_capstyle="round")
    ax.plot(*frames.points[[1, 3]].T, color=COLOURS["student"], lw=2, ls="--", label="virtual prismatic joint")
    for number, (place, axis) in enumerate(zip(frames.joints, frames.axes, strict=True), start=1):
        ax.plot(*np.transpose([place - 0.05 * axis, place + 0.05 * axis]), color=COLOURS["ours"], lw=5, alpha=0.7)
        if named:
            ax.text(*(place + 0.08 * axis), f"$q_{number}$", color=COLOURS["ours"], ha="center")
    plot_frame(ax, frames.wrist_frame, "$F_W$")
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    ax.set_aspect("equal")
    return ax


def plot_robot_frames(ax, frames: RobotFrames, *, radius: float = 0.25):
    """Draw paper 4's Fig. 3 on 3-D axes: the base, a disc of `radius` [m], the arm, and the frames F_0, F_mb, F_a."""
    around = np.linspace(0.0, 2.0 * np.pi, 60)
    centre, top = frames.mobile_base.translation, frames.arm_anchor.translation
    for height in (0.0, 0.25):
        x, y = centre[0] + radius * np.cos(around), centre[1] + radius * np.sin(around)
        ax.plot(x, y, height, color="#777777", lw=1.5)
    ax.plot(*np.transpose([centre, top]), color="#777777", lw=3)
    plot_arm_frames(ax, frames.arm, named=False)
    for name, pose in (("$F_0$", frames.world), ("$F_{mb}$", frames.mobile_base), ("$F_a$", frames.arm_anchor)):
        plot_frame(ax, pose, name, 0.2)
    ax.set_aspect("equal")
    return ax


def plot_time_scale(ax: Axes, orders: Sequence[int] = (1, 2, 3), scaling: str = "sine") -> Axes:
    """Draw b of eq (2) over q4 [deg], a line an n."""
    q4 = np.linspace(-np.pi / 2, np.pi / 2, 721)
    for n in orders:
        b = [time_scale(float(angle), n, scaling)[0] for angle in q4]
        ax.plot(np.rad2deg(q4), b, label=f"n = {n}, {scaling}", lw=1.8)
    ax.axhline(0.0, color=COLOURS["limit"], lw=0.6)
    ax.set(xlabel="$q_4$ [deg]", ylabel="$b$ [-]")
    return ax


def plot_elbow_rate(ax: Axes, arm: SphericalArm, speed: float, n: int, q4: float | None = None) -> Axes:
    """Draw |dq4/dt| over q4 [deg] with and without eq (2), its peak by the closed form, and a point at q4 [rad]."""
    angles = np.linspace(-1.0, 1.0, 801)
    found = [elbow_rate(arm, float(angle), speed, n) for angle in angles]
    peak = elbow_peak_rate(arm, speed, n)
    ax.plot(np.rad2deg(angles), [abs(one.plain_rate) for one in found], color=COLOURS["bad"], label="pseudo-inverse")
    ax.plot(np.rad2deg(angles), [abs(one.rate) for one in found], color=COLOURS["ours"], lw=2, label=f"eq (2), n = {n}")
    ax.axhline(peak, color=COLOURS["limit"], ls="--", lw=1, label=f"closed form: {peak:.2f} rad/s")
    if q4 is not None:
        ax.plot(math.degrees(q4), abs(elbow_rate(arm, q4, speed, n).rate), "o", color=COLOURS["student"], ms=9)
    ax.set(xlabel="$q_4$ [deg]", ylabel=r"$|\dot q_4|$ [rad/s]", ylim=(0.0, 1.6 * peak))
    return ax


def plot_phase_portrait(ax: Axes, data: PhasePortrait, q4: float | None = None, s: float = 0.0) -> Axes:
    """Draw the plane (q4, s) [deg, mm]: streamlines, the saddle with its lines, paths by what becomes of them.

    q4 [rad], s [m]: a state that is marked.
    """
    x, y = np.rad2deg(data.q4), 1e3 * data.s
    ax.streamplot(x, y, np.rad2deg(data.q4_rate), 1e3 * data.s_rate, color="#bbbbbb", density=1.1, linewidth=0.8)
    for path in data.paths:
        ax.plot(np.rad2deg(path.q4), 1e3 * path.s, color=OUTCOMES[path.outcome], lw=2.4,
                label=f"{path.name}: {path.outcome}")  # fmt: skip
    if math.isfinite(data.saddle):
        side = np.array([-1.0, 1.0]) * data.s[-1]
        for sign, style in ((1, "--"), (-1, ":")):
            ax.plot(np.rad2deg(sign * data.direction * side), 1e3 * side, color="black", ls=style, lw=1)
        ax.plot(0.0, 0.0, "o", color="black", ms=7, label=f"saddle, {data.saddle:.2f} 1/s")
    if q4 is not None:
        ax.plot(math.degrees(q4), 1e3 * s, "o", color=COLOURS["student"], ms=9)
    ax.set(xlabel="$q_4$ [deg]", ylabel="place on the path $s$ [mm]", xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    return ax


def plot_followed(ax: Axes, runs: Mapping[str, Followed], quantity: str = "peak_rate") -> Axes:
    """Draw methods on one path over time: "peak_rate" (max |dq/dt| [rad/s]), "deviation", "behind" [mm] or "scale"."""
    labels = {"peak_rate": r"max $|\dot q_i|$ [rad/s]", "deviation": "off the path [mm]", "scale": "$b$ [-]"}
    for name, run in runs.items():
        values = np.abs(run.qdot).max(axis=1) if quantity == "peak_rate" else getattr(run, quantity)
        shown = 1e3 * values if quantity in ("deviation", "behind") else values
        ax.plot(run.times, shown, label=name, color=colour_of(name), lw=1.6)
    ax.set(xlabel="time [s]", ylabel=labels.get(quantity, "behind its time [mm]"))
    if quantity != "scale":
        ax.set_yscale("log")
    return ax


def plot_release(upper: Axes, lower: Axes, data: Release, limit: float | None = None) -> tuple[Axes, Axes]:
    """Draw paper 4's Fig. 6: above sin q4 with the region of eq (2), below the seven joint rates.

    limit [rad/s]: cuts the lower axis, where a method's rates grow without bound.
    """
    edge = math.sin(data.epsilon)
    upper.axhspan(-edge, edge, color=COLOURS["path"], alpha=0.25, label=r"$|q_4| < \epsilon$")
    upper.plot(data.times, data.sin_q4, color=COLOURS["ours"], lw=2)
    upper.axhline(0.0, color=COLOURS["limit"], lw=0.6)
    for number, rates in enumerate(data.joint_rates.T, start=1):
        lower.plot(data.times, rates, lw=1.5, label=rf"$\dot q_{number}$")
    upper.set(ylabel=r"$\sin q_4$ [-]", title=data.way)
    lower.set(xlabel="time [s]", ylabel="joint rate [rad/s]")
    if limit is not None:
        lower.set_ylim(-limit, limit)
    for ax in (upper, lower):
        ax.label_outer()
    return upper, lower


def plot_lines(ax: Axes, lines: Mapping[str, Line]) -> Axes:
    """Draw how far the tip is from where it must be [mm], logarithmic, while base and arm move together."""
    for i, (name, line) in enumerate(lines.items()):
        ax.plot(line.times, np.maximum(1e3 * line.error, 1e-4), color=f"C{i}", lw=1.6, label=name)
    ax.axhline(1.0, color=COLOURS["limit"], ls="--", lw=1)
    ax.set(xlabel="time [s]", ylabel="error [mm]", yscale="log")
    return ax


def plot_workspace_share(ax: Axes, data: FullWorkspace) -> Axes:
    """Draw which share of the wrist's space is left [%] when a solver keeps a margin of |q4| [deg]."""
    ax.plot(np.rad2deg(data.margins), 100 * data.volume, "o-", color=COLOURS["ours"], lw=2)
    ax.set(xlabel="margin of $|q_4|$ [deg]", ylabel="space of the wrist [%]", ylim=(0.0, 105.0))
    return ax


def plot_opening(ax: Axes, data: FullWorkspace, grasp: str = "rigid") -> Axes:
    """Draw how far the door opens [deg] over the base's share K, a line a margin."""
    for i, margin in enumerate(data.margins):
        label = "singularity-consistent" if margin == 0.0 else f"keeps {math.degrees(margin):.0f} deg"
        opening = np.rad2deg(data.opening[data.grasps.index(grasp), :, i])
        ax.plot(data.shares, opening, "o-", lw=2.4 if margin == 0.0 else 1.0, label=label)
    ax.set(xlabel="share of the base $K$ [-]", ylabel="door angle [deg]", title=f"{grasp} grasp")
    return ax


def plot_reach(ax: Axes, arm: SphericalArm, margin: float = 0.0) -> Axes:
    """Draw the wrist's space from the side: the stretched arm's circle, and the one at |q4| = margin [rad]."""
    ax.add_patch(Circle((0.0, 0.0), arm.reach, fc=COLOURS["bad"], alpha=0.25, label="lost to the margin"))
    ax.add_patch(Circle((0.0, 0.0), arm.distance_at(margin), fc=COLOURS["good"], alpha=0.5))
    ax.add_patch(Circle((0.0, 0.0), arm.distance_at(arm.limits[3]), fc="white"))
    ax.plot(0.0, 0.0, "k+")
    ax.set(xlim=(-0.8, 0.8), ylim=(-0.8, 0.8), xlabel="[m]", ylabel="[m]", aspect="equal")
    return ax


def plot_door(ax: Axes, door: ClosingDoor, angles: Sequence[float]) -> Axes:
    """Draw a door from above [m]: walls and frame, and the panel with its knob at each of `angles` [rad]."""
    for low, high in door.frame_boxes:
        if low[2] < 0.5:  # not the lintel
            ax.add_patch(Rectangle(low[:2], *(high - low)[:2], fc="#c9c3b8", ec="#8d8678", lw=0.6))
    for k, angle in enumerate(angles, start=1):
        shade = k / len(angles)
        ax.add_patch(Polygon(door.panel_corners(angle), fc="#b08968", ec="black", lw=0.6, alpha=0.3 + 0.7 * shade))
        ax.plot(*door.knob(angle)[:2], "o", color=COLOURS["lever"], ms=4, alpha=0.3 + 0.7 * shade)
    ax.set(xlim=(-0.6, 1.9), ylim=(-1.65, 0.9), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    return ax


def plot_plan(ax: Axes, run: Passage, instant: int, arm: SphericalArm | None = None) -> Axes:
    """Draw one instant of a passage from above [m]: door, base with its way so far, and the arm's joints."""
    plot_door(ax, run.door, [float(run.door_angle[instant])])
    base = run.base[instant]
    frames = arm_frames(SphericalArm() if arm is None else arm, run.q[instant], base)
    ax.plot(*run.base[: instant + 1, :2].T, color=COLOURS["ours"], lw=0.8)
    ax.add_patch(Circle(base[:2], BASE_RADIUS, fc=COLOURS["ours"], alpha=0.35))
    front = base[:2] + BASE_RADIUS * np.array([np.cos(base[2]), np.sin(base[2])])
    ax.plot(*np.transpose([base[:2], front]), "k-", lw=1)
    ax.plot(*frames.points[:, :2].T, "o-", color="#333333", lw=2.5, ms=4)
    colour = COLOURS["good"] if run.grasped[instant] else COLOURS["student"]
    ax.plot(*frames.points[-1, :2], "o", color=colour, ms=7)
    return ax
