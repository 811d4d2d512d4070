"""Plots of notebook 2: the seven-axis arm and its genetic algorithm (paper 2, Figs 2 to 4)."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle

from tutorialbot.ik.arm7 import ARM, Arm, product, quaternion, rotate
from tutorialbot.plots import AXES_RGB, COLOURS

COMPONENTS = ("x", "y", "z", "roll", "pitch", "yaw")
STEPS = (
    "random\njoint angles", "fitness,\neq. (5)", "select\nparents", "cross over\n60 %", "mutate\n40 %",
    "fitness of\nthe children", "select\nsurvivors",
)  # fmt: skip


def joint_frames(q: Sequence[float], arm: Arm = ARM) -> tuple[np.ndarray, np.ndarray]:
    """Return where the joints are, shoulder to tip (8, 3) [m], and how they point there (7, 3), in the abdomen's frame.

    q (7,) [rad]. Paper 2, eqs (1)-(3).
    """
    turned, points, axes = (1.0, 0.0, 0.0, 0.0), [arm.offsets[0]], []
    for angle, axis, link in zip(q, arm.axes.tolist(), arm.offsets[1:].tolist(), strict=True):
        axes.append(rotate(turned, axis))
        turned = product(turned, quaternion(angle, axis))
        points.append(points[-1] + rotate(turned, link))
    return np.array(points), np.array(axes)


def plot_arm(ax, q: Sequence[float], arm: Arm = ARM, *, label: str = "", colour: str = "#555555") -> Axes:
    """Draw the arm's kinematic diagram (paper 2, Fig. 2) on 3-D axes: links, joints as bars along their axes, the tip.

    q (7,) [rad]; lengths in m, frame of the abdomen.
    """
    points, axes = joint_frames(q, arm)
    ax.plot(*np.transpose([(0, 0, 0), (0, 0, points[0][2]), points[0]]), color="#bbbbbb", lw=4)
    ax.plot(*points.T, color=colour, lw=3, solid_capstyle="round", label=label or None)
    for number, (point, axis) in enumerate(zip(points[:7], axes, strict=True), start=1):
        along = 0.045 * axis
        ax.plot(*np.transpose([point - along, point + along]), color=COLOURS["ours"], lw=5, alpha=0.75)
        if not label:
            ax.text(*(point + 1.9 * along), f"$q_{number}$", color=COLOURS["ours"], fontsize=11, ha="center")
    ax.plot(*points[-1:].T, "o", color=COLOURS["bad"], ms=6)
    for axis, colour_ in zip(np.eye(3), AXES_RGB, strict=True):
        ax.quiver(0, 0, 0, *(0.1 * axis), color=colour_, lw=2)
    ax.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", xlim=(-0.15, 0.45), ylim=(-0.1, 0.5))
    ax.set(xticks=[0, 0.2, 0.4], yticks=[0, 0.2, 0.4])
    ax.set_aspect("equal")
    ax.view_init(18, -50)
    return ax


def plot_flow_chart(ax: Axes, steps: Sequence[str] = STEPS) -> Axes:
    """Draw the loop of the algorithm (paper 2, Fig. 3): the first two steps once, the others every generation."""
    xs, width, height = np.linspace(0.0, 6.0, len(steps)), 0.86, 0.6
    for i, (x, text) in enumerate(zip(xs, steps, strict=True)):
        colour = "#e8eef7" if i < 2 else "#fdf1e3"
        ax.add_patch(FancyBboxPatch((x - width / 2, -height / 2), width, height, boxstyle="round,pad=0.03", fc=colour,
                                    ec="#444444"))  # fmt: skip
        ax.text(x, 0.0, text, ha="center", va="center", fontsize=9.5)
        if i:
            ax.add_patch(FancyArrowPatch((xs[i - 1] + width / 2, 0), (x - width / 2, 0), arrowstyle="-|>",
                                         mutation_scale=12, color="#444444"))  # fmt: skip
    back = FancyArrowPatch((xs[-1], -height / 2), (xs[2], -height / 2), arrowstyle="-|>", mutation_scale=14,
                           connectionstyle="bar,fraction=-0.12", color=COLOURS["bad"])  # fmt: skip
    ax.add_patch(back)
    ax.text((xs[2] + xs[-1]) / 2, -0.98, "next generation, 200 times; then the best individual is the answer",
            ha="center", va="top", fontsize=9.5, color=COLOURS["bad"])  # fmt: skip
    ax.set(xlim=(-0.6, 6.6), ylim=(-1.25, 0.5))
    ax.axis("off")
    return ax


def plot_errors(ax: Axes, errors: np.ndarray, evaluations: np.ndarray | None = None) -> Axes:
    """Draw the size of each error of the best individual over the generations, logarithmic.

    errors (g, 6): x, y, z [m], roll, pitch, yaw [rad]; evaluations (g,): the abscissa instead of the generation.
    """
    over = np.arange(len(errors)) if evaluations is None else evaluations
    colours = [*AXES_RGB, *AXES_RGB]
    for i, (name, column) in enumerate(zip(COMPONENTS, np.abs(errors).T, strict=True)):
        ax.plot(over, np.maximum(column, 1e-7), "-" if i < 3 else ":", color=colours[i], lw=1.8,
                label=f"{name} [{'m' if i < 3 else 'rad'}]")  # fmt: skip
    ax.axhline(1e-3, color=COLOURS["limit"], lw=1, ls="--")
    ax.set(yscale="log", xlabel="generation" if evaluations is None else "evaluations", ylabel="|error|")
    return ax


def plot_ridge(ax: Axes, population: np.ndarray, children: np.ndarray, better: np.ndarray, title: str) -> Axes:
    """Draw a population on its ridge, and where mutation takes it, in the plane that matters.

    population (n, 7), children (m, 7) [rad]; better (m,): whether a child is better than the worst parent. Abscissa:
    the direction in which the population is widest; ordinate: the one in which it is thinnest.
    """
    middle = population.mean(axis=0)
    axes = np.linalg.svd(population - middle, full_matrices=False)[2][[0, -1]]
    for points, keep, colour, label in (
        (children, ~better, COLOURS["bad"], "a child, worse than all"),
        (children, better, COLOURS["good"], "a child that may live"),
        (population, slice(None), "black", "the population"),
    ):
        ax.plot(*((points[keep] - middle) @ axes.T).T, ".", ms=4, color=colour, alpha=0.7, label=label)
    ax.set(xlabel="along the ridge [rad]", ylabel="across it [rad]", title=title)
    return ax


def plot_success(ax: Axes, errors: Mapping[str, np.ndarray]) -> Axes:
    """Draw how far above the optimum's fitness each of several runs ended, a row a variant, logarithmic.

    errors: label -> (runs,).
    """
    for row, values in enumerate(errors.values()):
        values = np.maximum(np.asarray(values, dtype=float), 1e-7)
        ax.plot(values, np.full(len(values), row), "o", color=COLOURS["ours"], alpha=0.5, ms=6)
        ax.plot(np.median(values), row, "|", color="black", ms=18, mew=2)
    ax.axvline(1e-3, color=COLOURS["limit"], lw=1, ls="--")
    ax.set(xscale="log", xlabel="fitness above the optimum [-]", yticks=range(len(errors)), yticklabels=list(errors))
    ax.invert_yaxis()
    return ax


def plot_tip_paths(ax: Axes, paths: Mapping[str, np.ndarray], targets: np.ndarray, plane: str = "xz") -> Axes:
    """Draw ways of the tip in one plane of the abdomen's frame (paper 2, Fig. 4), and the targets as squares.

    paths: label -> (n, 3) [m]; targets (k, 3) [m]; plane: two of "xyz".
    """
    i, j = ("xyz".index(letter) for letter in plane)
    for number, (label, path) in enumerate(paths.items()):
        ax.plot(path[:, i], path[:, j], color=f"C{number}", lw=1.4, label=label)
    ax.plot(targets[:, i], targets[:, j], "s", color="none", mec=COLOURS["bad"], mew=1.8, ms=9)
    ax.set(xlabel=f"{plane[0]} [m]", ylabel=f"{plane[1]} [m]", aspect="equal")
    return ax


def plot_deviation(ax: Axes, curves: Mapping[str, np.ndarray]) -> Axes:
    """Draw how far the tip is from the straight line along a stroke, logarithmic; curves: label -> (n,) [m]."""
    for i, (label, away) in enumerate(curves.items()):
        share = np.linspace(0.0, 100.0, len(away))
        ax.plot(share, np.maximum(1000 * np.asarray(away), 1e-3), color=f"C{i}", lw=1.5, label=label)
    ax.set(yscale="log", xlabel="share of the stroke [%]", ylabel="deviation [mm]")
    return ax


def plot_coverage(ax: Axes, floor: np.ndarray, pieces: Sequence[np.ndarray], cells: Mapping[str, np.ndarray]) -> Axes:
    """Draw a room from above: floor (k, 2), furniture (k, 2) each, and cells by what became of them.

    cells: "covered", "missed" or "out of reach" -> centres (n, 2) [m].
    """
    colours = {"covered": COLOURS["good"], "missed": COLOURS["bad"], "out of reach": "#cccccc"}
    for name, points in cells.items():
        if len(points):
            ax.plot(*np.asarray(points).T, "s", ms=2.5, color=colours[name], alpha=0.6, label=name)
    ax.fill(*np.asarray(floor).T, fc="none", ec="black", lw=2)
    for piece in pieces:
        ax.fill(*np.asarray(piece).T, fc="#8c6d4f", ec="black", lw=0.8, alpha=0.9)
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    return ax


def plot_limits(ax: Axes, q: np.ndarray, arm: Arm = ARM) -> Axes:
    """Draw each joint of q (7,) or (n, 7) within its limits [deg]."""
    for i, (low, high) in enumerate(np.rad2deg([arm.lower, arm.upper]).T, start=1):
        ax.add_patch(Rectangle((low, i - 0.3), high - low, 0.6, fc="#e8eef7", ec="#888888"))
    for row in np.rad2deg(np.atleast_2d(q)):
        ax.plot(row, np.arange(1, 8), "o", color=COLOURS["bad"], ms=6)
    ax.set(xlabel="joint angle [deg]", yticks=range(1, 8), yticklabels=[f"$q_{i}$" for i in range(1, 8)])
    ax.invert_yaxis()
    return ax
