"""Kinematic diagrams of the door and of the robot (paper 1, Figs 2 and 3), drawn from the models themselves."""

import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Rectangle

from tutorialbot.plots import AXES_RGB, COLOURS
from tutorialbot.scene.door import LEVER_LOW, Door

WOOD, METAL = "#d9b891", "#8a6d1f"


def plot_door_front(ax: Axes, door: Door) -> Axes:
    """Draw the shut door as the robot sees it: hinge axis, lever at rest and turned, the hand's frame at its end."""
    sign = 1.0 if door.side == "right" else -1.0
    width, height = door.spindle_radius + door.edge, door.panel_height
    bottom = door.handle_height - height / 2
    ax.add_patch(Rectangle((0.0 if sign > 0 else -width, bottom), width, height, fc=WOOD, ec="black", alpha=0.6))
    ax.plot([0, 0], [bottom - 0.06, bottom + height + 0.06], "-.", color=COLOURS["hinge"], lw=2)
    ax.annotate("hinge axis", (0, bottom + height + 0.06), ha="center", va="bottom", color=COLOURS["hinge"])
    spindle = np.array([sign * door.spindle_radius, door.handle_height])
    for angle, alpha in ((0.0, 1.0), (LEVER_LOW, 0.35)):
        tip = spindle + door.lever_length * np.array([-sign * np.cos(angle), np.sin(angle)])
        ax.plot(*np.transpose([spindle, tip]), color=METAL, lw=6, alpha=alpha, solid_capstyle="round")
    ax.plot(*spindle, "o", color="black", ms=7)
    start, end = (180, 225) if sign > 0 else (-45, 0)
    size = 2.5 * door.lever_length
    ax.add_patch(Arc(spindle, size, size, theta1=start, theta2=end, color=COLOURS["lever"], lw=2))
    below = [(0.5 * width if sign > 0 else -0.5 * width), door.handle_height - 0.95 * door.lever_length]
    ax.annotate(r"$\phi_{handle}$: $-45$ to $0$ deg", below, color=COLOURS["lever"], ha="center", va="top")
    grip = spindle - [sign * door.lever_length, 0]
    for direction, colour, name in (((0.09, 0), AXES_RGB[1], "y"), ((0, 0.09), AXES_RGB[2], "z")):
        ax.quiver(*grip, *direction, color=colour, angles="xy", scale_units="xy", scale=1, width=0.012, zorder=5)
        beside = np.array([0, 0.03]) if name == "y" else np.array([0, 0.025])
        ax.annotate(name, grip + np.array(direction) + beside, color=colour, ha="center", va="center", zorder=6)
    ax.plot(*grip, "o", color=AXES_RGB[0], ms=7, zorder=6)
    _measure(ax, (0, bottom + 0.06), (spindle[0], bottom + 0.06), f"{door.spindle_radius:g} m")
    ax.set(xlabel="y [m]", ylabel="z [m]", aspect="equal", title="front, as the robot sees it")
    ax.set_xlim((width + 0.08, -0.12) if sign > 0 else (0.12, -width - 0.08))
    ax.set_ylim(bottom - 0.1, bottom + height + 0.14)
    return ax


def plot_door_top(ax: Axes, door: Door, angle: float = np.pi / 3) -> Axes:
    """Draw the door from above, shut and opened by `angle` [rad], with its lever and the sense of the hinge angle."""
    sign = 1.0 if door.side == "right" else -1.0
    width = door.spindle_radius + door.edge
    for turn, alpha in ((0.0, 0.9), (angle, 0.35)):
        c, s = np.cos(sign * turn), np.sin(sign * turn)
        turned = np.array([[c, -s], [s, c]])

        def line(points, turned=turned):
            return turned @ np.transpose(points)

        ax.fill(*line([(0, 0), (0, sign * width), (door.panel_thickness, sign * width), (door.panel_thickness, 0)]),
                fc=WOOD, ec="black", alpha=alpha)  # fmt: skip
        lever = [(0, sign * door.spindle_radius), (-door.stand_off, sign * door.spindle_radius),
                 (-door.stand_off, sign * (door.spindle_radius - door.lever_length))]  # fmt: skip
        ax.plot(*line(lever), color=METAL, lw=4, alpha=alpha, solid_capstyle="round")
    ax.plot(0, 0, "o", color=COLOURS["hinge"], ms=9)
    start, end = (90, 90 + np.rad2deg(angle)) if sign > 0 else (-90 - np.rad2deg(angle), -90)
    ax.add_patch(Arc((0, 0), 1.1 * width, 1.1 * width, theta1=start, theta2=end, color=COLOURS["hinge"], lw=2))
    middle = np.deg2rad((start + end) / 2)
    ax.annotate(r"$\phi_{door}$", (0.65 * width * np.cos(middle), 0.65 * width * np.sin(middle)),
                color=COLOURS["hinge"], ha="center", va="center")  # fmt: skip
    ax.annotate("robot", (-0.62, sign * 0.08), ha="center")
    ax.annotate("", (-0.47, sign * 0.06), (-0.57, sign * 0.06), arrowprops={"arrowstyle": "-|>", "lw": 2})
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="from above", xlim=(-0.72, 0.12))
    return ax


def plot_skeleton(ax, model: mujoco.MjModel, data: mujoco.MjData, axis_length: float = 0.12) -> Axes:
    """Draw a robot's kinematic skeleton on 3-D axes: bodies joined by lines, hinges as bars, the hand's frame.

    `data` must hold the configuration; positions are those of `mujoco.mj_kinematics`.
    """
    mujoco.mj_kinematics(model, data)
    for body in range(1, model.nbody):
        here, there = data.xpos[model.body_parentid[body]], data.xpos[body]
        if model.body(body).name.endswith("shoulder") or not model.body(body).name.count("arm"):
            way = [here, [*here[:2], there[2]], there]  # up the column, then out to the side
        else:
            way = [here, there]
        if model.body_parentid[body]:
            ax.plot(*np.transpose(way), color="#555555", lw=3, solid_capstyle="round")
    for joint in range(model.njnt):
        name, at, axis = model.joint(joint).name, data.xanchor[joint], data.xaxis[joint]
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE or name == "base_yaw":
            continue
        colour = COLOURS["lever"] if name.startswith("caster") else COLOURS["ours"]
        ends = np.transpose([at - 0.5 * axis_length * axis, at + 0.5 * axis_length * axis])
        ax.plot(*ends, color=colour, lw=5, alpha=0.75)
        if name.startswith("arm"):
            number = int(name[-1])
            beside = [0.12, -0.02, -0.14] if number == 6 else [0, -0.02, 0.08 if number % 2 else -0.15]
            ax.text(*(at + beside), f"$q_{number}$", color=colour, fontsize=12)
    tool = data.site("tool")
    for i, colour in enumerate(AXES_RGB):
        ax.quiver(*tool.xpos, *(0.16 * tool.xmat.reshape(3, 3)[:, i]), color=colour, lw=2)
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", zlim=(0, 1.3), xticks=[-0.2, 0.2], yticks=[-0.2, 0.2])
    ax.set_aspect("equal")
    ax.view_init(18, -60)
    return ax


def plot_base(ax: Axes, model: mujoco.MjModel, data: mujoco.MjData) -> Axes:
    """Draw the base from above: its square, active casters with pivot, trail and wheel, and passive casters."""
    mujoco.mj_kinematics(model, data)
    base, turned = data.body("base").xpos[:2], data.body("base").xmat.reshape(3, 3)[:2, :2]
    corners = base + 0.27 * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)]) @ turned.T
    ax.plot(*corners.T, color="black")
    ax.annotate("", base + turned @ [0.2, 0], base, arrowprops={"arrowstyle": "-|>", "lw": 1.5})
    ax.annotate("forward", base + turned @ [0.1, 0.02], ha="center", va="bottom")
    for name in ("caster_left", "caster_right"):
        pivot, wheel = data.body(f"{name}_fork").xpos[:2], data.body(f"{name}_wheel").xpos[:2]
        along = (pivot - wheel) / np.linalg.norm(pivot - wheel)
        ax.plot(*np.transpose([wheel - 0.075 * along, wheel + 0.075 * along]), color="#333333", lw=9, alpha=0.7,
                solid_capstyle="butt")  # fmt: skip
        ax.plot(*np.transpose([pivot, wheel]), color=COLOURS["lever"], lw=2)
        ax.plot(*pivot, "o", color=COLOURS["lever"], ms=8)
    passive = [model.body(i).name for i in range(model.nbody) if model.body(i).name.startswith("passive")]
    places = np.array([data.body(name).xpos[:2] for name in passive])
    ax.plot(*places.T, "o", color="#bbbbbb", mec="black", ms=9)
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="base from above")
    return ax


def _measure(ax: Axes, a: tuple[float, float], b: tuple[float, float], text: str) -> None:
    """Draw a dimension line from a to b."""
    ax.annotate("", a, b, arrowprops={"arrowstyle": "<->", "lw": 1})
    ax.annotate(text, ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), ha="center", va="bottom", fontsize=9)
