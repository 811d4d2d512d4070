"""Plots of notebook 3: configuration spaces, predictions of them, paths, and the arm among its boxes (paper 3)."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.patches import Polygon, Rectangle

from tutorialbot.plots import COLOURS
from tutorialbot.vox2c.arm import HALF_LENGTH, HALF_WIDTH, MIDDLE, SLABS, link_poses
from tutorialbot.vox2c.scenes import BoxScene

TICKS = (-180, -90, 0, 90, 180)  # [deg]
FREE, HIT, FALSE_ALARM, MISSED = "#ffffff", "#555555", COLOURS["lever"], COLOURS["bad"]
LINKS = (COLOURS["ours"], COLOURS["good"])  # link 2 and what its slab holds, link 3 and what its slab holds


def plot_cspace(ax: Axes, cspace: np.ndarray, *, title: str = "") -> Axes:
    """Draw a C-space (n, n), theta1 to the right and theta2 upward: obstacles dark; values between 0 and 1 in grey."""
    colours = ListedColormap(np.linspace(to_rgb(FREE), to_rgb(HIT), 64))
    return _image(ax, np.asarray(cspace, dtype=float), title, cmap=colours, vmin=0.0, vmax=1.0)


def plot_comparison(ax: Axes, truth: np.ndarray, predicted: np.ndarray, *, title: str = "") -> Axes:
    """Draw where two bool C-spaces (n, n) agree (white, grey), where an obstacle is missed (red), where one is made up.

    Returns the axes; `legend_of_errors` names the colours.
    """
    kind = np.asarray(truth, dtype=int) + 2 * np.asarray(predicted, dtype=int)  # 0 free, 1 missed, 2 false, 3 hit
    colours = ListedColormap([FREE, MISSED, FALSE_ALARM, HIT])
    return _image(ax, kind, title, cmap=colours, vmin=-0.5, vmax=3.5)


def legend_of_errors(ax: Axes, **options) -> Axes:
    """Name the colours of `plot_comparison`; options go to `Axes.legend`."""
    names = {"collision": HIT, "missed": MISSED, "false alarm": FALSE_ALARM}
    ax.legend([Rectangle((0, 0), 1, 1, fc=colour) for colour in names.values()], names, **options)
    return ax


def _image(ax: Axes, values: np.ndarray, title: str, **options) -> Axes:
    half = 180.0 / len(values)
    extent = (-180 - half, 180 - half, -180 - half, 180 - half)  # cell k is around -180 + k * resolution
    ax.imshow(values.T, origin="lower", extent=extent, interpolation="nearest", **options)
    ax.set(xlabel=r"$\theta_1$ [deg]", ylabel=r"$\theta_2$ [deg]", xticks=TICKS, yticks=TICKS)
    ax.set_title(title)
    ax.grid(False)
    return ax


def plot_path(ax: Axes, path: np.ndarray, *, colour: str = COLOURS["ours"], label: str = "") -> Axes:
    """Draw a path (k, 2) [rad] over a C-space; where it crosses the border it goes on at the other side.

    A path without points, as an unsolved plan has it, draws nothing.
    """
    ax.set(xlim=(-180, 180), ylim=(-180, 180))
    if not len(path):
        return ax
    whole = np.rad2deg(np.unwrap(np.asarray(path, dtype=float), axis=0))
    steps = [np.linspace(a, b, 1 + int(np.abs(b - a).max())) for a, b in zip(whole[:-1], whole[1:], strict=True)]
    fine = (np.concatenate([*steps, whole[-1:]]) + 180.0) % 360.0 - 180.0
    jumps = 1 + np.flatnonzero(np.abs(np.diff(fine, axis=0)).max(axis=1) > 180.0)
    for k, part in enumerate(np.split(fine, jumps)):
        ax.plot(*part.T, color=colour, lw=2, label=label if label and k == 0 else None)
    ax.plot(*fine[0], "o", color=colour, ms=8, mec="black")
    ax.plot(*fine[-1], "*", color=colour, ms=14, mec="black")
    return ax


def plot_tree(ax: Axes, edges: np.ndarray, *, colour: str = COLOURS["random"]) -> Axes:
    """Draw the edges (k, 2, 2) [rad] of a search tree, those that cross the border left out."""
    short = np.rad2deg(edges[(np.abs(edges[:, 1] - edges[:, 0]) < np.pi).all(axis=1)])
    ax.plot(*np.swapaxes(np.insert(short, 2, np.nan, axis=1).reshape(-1, 2), 0, 1), color=colour, lw=0.6)
    return ax


def plot_side(ax: Axes, scene: BoxScene, configurations: Sequence, *, alpha: Sequence[float] | None = None) -> Axes:
    """Draw the plane in which the arm moves, x and z [m]: boxes by the slab that they enter, and the arm at each
    configuration (2,) [rad].

    Blue: link 2 and the boxes in its slab; green: link 3 and the boxes in its slab; both: hatched; grey: out of reach.
    """
    low, high = scene.corners
    inside = [(low[:, 1] < slab[1]) & (high[:, 1] > slab[0]) for slab in SLABS]
    for i, (a, b) in enumerate(zip(low, high, strict=True)):
        second, third = inside[0][i], inside[1][i]
        colour = LINKS[0] if second else LINKS[1] if third else "#dddddd"
        ax.add_patch(Rectangle(a[[0, 2]], *(b - a)[[0, 2]], fc=colour, ec=LINKS[1] if third else colour, lw=1.2,
                               alpha=0.45 if second or third else 0.25, hatch="//" if second and third else None,
                               zorder=2 if second or third else 1))  # fmt: skip
    ax.add_patch(Rectangle((-0.025, 0.0), 0.05, 1.0, fc="#eeb07a", ec="black", lw=0.6))
    alphas = np.ones(len(configurations)) if alpha is None else alpha
    bar = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [HALF_WIDTH, HALF_LENGTH] + [0, MIDDLE]
    for q, strong in zip(configurations, alphas, strict=True):
        for pose, colour in zip(link_poses(q), LINKS, strict=True):
            corners = [pose.act(np.array([x, 0.0, z]))[[0, 2]] for x, z in bar]
            ax.add_patch(Polygon(corners, fc=colour, ec="black", lw=0.8, alpha=float(strong), zorder=3))
    ax.set(xlim=(-1.15, 1.15), ylim=(0.0, 2.3), xlabel="x [m]", ylabel="z [m]", aspect="equal")
    return ax


def plot_torus(ax, cspace: np.ndarray, *, path: np.ndarray | None = None, radii: tuple[float, float] = (2.0, 0.9)):
    """Draw a C-space (n, n) on 3-D axes as what it is, a torus: theta1 the long way round, theta2 the short one.

    path (k, 2) [rad] is drawn a little above the surface, from two points on. Coarse grids (5 or 10 degrees) draw fast.
    """
    angle = np.linspace(-np.pi, np.pi, len(cspace) + 1) - np.pi / len(cspace)  # cell k is around -180 + k * resolution

    def surface(theta1, theta2, small):
        ring = radii[0] + small * np.cos(theta2)
        return ring * np.cos(theta1), ring * np.sin(theta1), small * np.sin(theta2)

    grid = np.asarray(cspace, dtype=float)[..., None]
    shade = (1.0 - grid) * np.array(to_rgb("#dfe8f5")) + grid * np.array(to_rgb(HIT))
    shade *= (0.85 + 0.15 * np.sin(angle[:-1]))[:, None]  # lit from above
    ax.plot_surface(*surface(*np.meshgrid(angle, angle, indexing="ij"), radii[1]), facecolors=shade, rstride=1,
                    cstride=1, linewidth=0, antialiased=False, shade=False)  # fmt: skip
    if path is not None and len(path) > 1:
        whole = np.unwrap(np.asarray(path, dtype=float), axis=0)
        fine = np.concatenate([np.linspace(a, b, 20) for a, b in zip(whole[:-1], whole[1:], strict=True)])
        ax.plot(*surface(*fine.T, radii[1] + 0.05), color=COLOURS["bad"], lw=2.5, zorder=10)
    ax.set_box_aspect((1, 1, 0.35))
    ax.set_axis_off()
    return ax


def plot_network(ax: Axes, layers: Sequence[tuple[str, float, float, str]]) -> Axes:
    """Draw a network as boxes from left to right (paper 3, Fig. 2).

    layers: (name, height, width, colour), heights and widths in any unit, the sides of what flows through.
    """
    x = 0.0
    for name, height, width, colour in layers:
        ax.add_patch(Rectangle((x, -height / 2), width, height, fc=colour, ec="black", lw=0.8))
        ax.text(x + width / 2, -height / 2 - 0.25, name, ha="center", va="top", fontsize=8)
        ax.annotate("", (x + width + 0.42, 0), (x + width + 0.08, 0), arrowprops={"arrowstyle": "-|>"})
        x += width + 0.5
    highest = max(height for _, height, _, _ in layers)
    ax.set(xlim=(-0.3, x), ylim=(-highest / 2 - 1.3, highest / 2 + 0.2))
    ax.axis("off")
    return ax


def plot_losses(ax: Axes, curves: Mapping[str, np.ndarray], ylabel: str) -> Axes:
    """Draw curves over training steps; label -> (n, 2): step, value."""
    for i, (label, curve) in enumerate(curves.items()):
        ax.plot(*np.asarray(curve, dtype=float).T, color=f"C{i}", lw=1.8, label=label)
    ax.set(xlabel="step", ylabel=ylabel)
    return ax
