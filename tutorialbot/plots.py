"""Plots of the notebooks: each function draws on the axes that it is given, and returns them.

One meaning, one colour, throughout: see COLOURS. Angles are shown in degrees, everything else in SI units.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

COLOURS = {
    "good": "#1a9850", "bad": "#d73027", "ours": "#1f77b4", "student": "#e6550d", "random": "#7f7f7f",
    "peer": "#9467bd", "hinge": "#1f77b4", "lever": "#e6a000", "limit": "#444444", "path": "#66ccff",
}  # fmt: skip
AXES_RGB = ("#d62728", "#2ca02c", "#1f77b4")  # of a frame: x, y, z
WAYS = (  # name, c1, c2 and how the text is aligned there: the azimuths +1 and -1 are both "pull"
    ("push", 0, 0, "center", "center"), ("left", 0.5, 0, "center", "center"), ("right", -0.5, 0, "center", "center"),
    ("pull", 0.99, 0, "right", "center"), ("pull", -0.99, 0, "left", "center"),
    ("up", 0, 1, "center", "top"), ("down", 0, -1, "center", "bottom"),
)  # fmt: skip


def plot_norms(ax: Axes, traces: Mapping[str, object], quantity: str, limit: float) -> Axes:
    """Draw the force or torque of moves over time, and the threshold.

    traces: label -> `Trace`, drawn in green, red and further colours in this order; quantity: "force" or "torque".
    """
    colours = [COLOURS[name] for name in ("good", "bad", "ours", "peer", "random")]
    for (label, trace), colour in zip(traces.items(), colours, strict=False):
        values = getattr(trace, quantity)
        ax.plot(trace.times, values, color=colour, label=label, lw=1.8)
        if trace.outcome == "collision":
            ax.plot(trace.times[-1], values[-1], "o", color=colour, ms=7)
    ax.axhline(limit, color=COLOURS["limit"], ls="--", lw=1.2)
    right = ax.get_yaxis_transform()
    ax.text(0.99, limit, f"threshold {limit:g}", transform=right, ha="right", va="bottom", fontsize=9)
    ax.set(xlabel="time [s]", ylabel=f"{quantity} [{'N' if quantity == 'force' else 'Nm'}]", xlim=(0.0, None))
    ax.set_ylim(0.0, max(1.15 * limit, ax.get_ylim()[1]))
    return ax


def plot_response(ax: Axes, times: np.ndarray, curves: Mapping[str, np.ndarray], ylabel: str) -> Axes:
    """Draw signals of one joint over time [s]; curves: label -> (n,) values in the unit that `ylabel` names."""
    styles = [("#888888", "--"), (COLOURS["ours"], "-"), (COLOURS["bad"], "-"), (COLOURS["good"], "-")]
    for (label, values), (colour, dash) in zip(curves.items(), styles, strict=False):
        ax.plot(times, values, dash, color=colour, label=label, lw=1.6)
    ax.set(xlabel="time [s]", ylabel=ylabel, xlim=(times[0], times[-1]))
    return ax


def plot_sphere_points(ax, points: np.ndarray, title: str) -> Axes:
    """Draw unit vectors (n, 3) on 3-D axes; the far half of the sphere is paler."""
    ax.scatter(*np.asarray(points).T, s=7, c=COLOURS["ours"], depthshade=True)
    ax.set(xlabel="x", ylabel="y", zlabel="z", title=title, box_aspect=(1, 1, 1))
    ax.set_xticks([-1, 0, 1]), ax.set_yticks([-1, 0, 1]), ax.set_zticks([-1, 0, 1])
    return ax


def plot_direction_map(ax: Axes, values: np.ndarray, label: str, vmax: float | None = 4.0) -> Axes:
    """Draw values (heights, azimuths) over all directions; the map is true to area, as (c1, c2) is.

    Rows are c2 from -1 to 1, columns c1 from -1 to 1, cell centres evenly spaced. The colour bar carries `label`; it
    runs from 0 to `vmax`, by default the 4 s of a whole move.
    """
    image = ax.imshow(values, origin="lower", extent=(-1, 1, -1, 1), aspect=0.5, cmap="viridis", vmin=0.0, vmax=vmax)
    for name, a, b, ha, va in WAYS:
        ax.text(a, b, name, color="white", fontsize=9, ha=ha, va=va, fontweight="bold")
    ax.set(xlabel="$c_1$: azimuth / 180 deg", ylabel="$c_2$: height", xticks=[-1, -0.5, 0, 0.5, 1], yticks=[-1, 0, 1])
    ax.figure.colorbar(image, ax=ax, label=label, shrink=0.85)
    return ax


def plot_distances(ax: Axes, angles: np.ndarray, curves: Mapping[str, np.ndarray]) -> Axes:
    """Draw SO(4) distances (n,) without unit over the angle of the door (n,) [rad]; curves: label -> values."""
    for (label, values), colour in zip(curves.items(), ("good", "bad", "ours", "peer"), strict=False):
        ax.plot(np.rad2deg(angles), values, color=COLOURS[colour], label=label, lw=1.8)
    ax.set(xlabel="door angle [deg]", ylabel="SO(4) distance [-]", ylim=(0.0, None))
    return ax


def plot_best_so_far(ax: Axes, curves: Mapping[str, Sequence], colours: Mapping[str, str] | None = None) -> Axes:
    """Draw the lowest cost observed over the trials (paper 1, Fig. 6), one curve a searcher.

    curves: label -> costs (n,) of one run, or (runs, n) of several, whose median is drawn over the thin single runs.
    """
    colours = colours or {}
    for label, costs in curves.items():
        best = np.minimum.accumulate(np.atleast_2d(np.asarray(costs, dtype=float)), axis=1)
        colour = COLOURS.get(colours.get(label, label), COLOURS["peer"])
        trials = np.arange(1, best.shape[1] + 1)
        if len(best) > 1:
            ax.plot(trials, best.T, color=colour, lw=0.6, alpha=0.35)
        ax.plot(trials, np.median(best, axis=0), "o-", color=colour, ms=4, lw=2, label=label)
    ax.set(xlabel="trial", ylabel="lowest cost so far [s]")
    ax.xaxis.get_major_locator().set_params(integer=True)
    return ax


def plot_costs(ax: Axes, costs: Iterable[float]) -> Axes:
    """Draw the cost of each trial (n,) as a dot and the lowest so far as a line."""
    costs = np.asarray(list(costs), dtype=float)
    trials = np.arange(1, len(costs) + 1)
    ax.plot(trials, costs, "o", color=COLOURS["random"], label="a trial")
    ax.step(trials, np.minimum.accumulate(costs), where="post", color=COLOURS["ours"], lw=2, label="lowest so far")
    ax.set(xlabel="trial", ylabel="cost [s]")
    ax.xaxis.get_major_locator().set_params(integer=True)
    return ax


def plot_slice(ax: Axes, values: np.ndarray, points: np.ndarray, label: str, cmap: str = "viridis") -> Axes:
    """Draw a slice over (c1, c2): values (n, n), rows along c2; points (m, 5) tried, the last one ringed."""
    image = ax.imshow(values, origin="lower", extent=(-1, 1, -1, 1), cmap=cmap)
    ax.plot(points[:, 0], points[:, 1], "o", color="white", mec="black", ms=5)
    ax.plot(*points[-1, :2], "o", mfc="none", mec=COLOURS["bad"], mew=2, ms=11)
    ax.set(xlabel="$c_1$", ylabel="$c_2$", xticks=[-1, 0, 1], yticks=[-1, 0, 1])
    ax.figure.colorbar(image, ax=ax, label=label, shrink=0.8)
    return ax


def plot_surrogate(
    upper: Axes, lower: Axes, x: np.ndarray, truth: np.ndarray, mean: np.ndarray, doubt: np.ndarray,
    gain: np.ndarray, seen: Sequence[int],
) -> tuple[Axes, Axes]:
    """Draw a surrogate along a line: above what it believes, below what its acquisition function promises.

    All arrays (n,) over x; truth, mean and doubt (one standard deviation) [s], gain the expected improvement [s];
    `seen` are the indices of the trials so far. The dotted line is where the next trial would be.
    """
    upper.plot(x, truth, color=COLOURS["random"], lw=1.2, label="truth")
    low, high = mean - 2 * doubt, mean + 2 * doubt
    upper.fill_between(x, low, high, color=COLOURS["ours"], alpha=0.2, label=r"$\pm 2\,\sigma$")
    upper.plot(x, mean, color=COLOURS["ours"], lw=2, label=r"mean $\mu$")
    upper.plot(x[seen], truth[seen], "o", color="white", mec="black", ms=6, label="trials")
    lower.fill_between(x, 0.0, gain, color=COLOURS["good"], alpha=0.6)
    for ax in (upper, lower):
        ax.axvline(x[np.argmax(gain)], color=COLOURS["bad"], ls=":", lw=1.5)
    upper.set(ylabel="cost [s]", title=f"after {len(seen)} trials")
    lower.set(xlabel="$c_1$: azimuth / 180 deg", ylabel="expected\nimprovement [s]", ylim=(0.0, None))
    for ax in (upper, lower):
        ax.label_outer()
    return upper, lower


def plot_door_angles(ax: Axes, watch: np.ndarray, ends: Sequence[float] = ()) -> Axes:
    """Draw hinge and lever angle over time, and where sections end.

    watch (n, 3): time [s], hinge [rad], lever [rad], as `DoorSimulation.watch` records; ends: times [s] of the ends.
    """
    time, hinge, lever = np.asarray(watch).T
    ax.plot(time, np.rad2deg(hinge), color=COLOURS["hinge"], lw=2, label=r"hinge $\phi_{door}$")
    ax.plot(time, np.rad2deg(lever), color=COLOURS["lever"], lw=2, label=r"lever $\phi_{handle}$")
    for end in ends:
        ax.axvline(end, color=COLOURS["limit"], lw=0.8, ls=":")
    ax.set(xlabel="time [s]", ylabel="angle [deg]", xlim=(time[0], time[-1]))
    return ax


def plot_success(ax: Axes, rows: Sequence[Mapping]) -> Axes:
    """Draw the share of doors opened within 12 sections over the trials a section, with its interval.

    rows: mappings with preset, trials, opened_12, low and high (shares in [0, 1]), as `door_bench.summarise` returns
    them; one line a preset.
    """
    names = list(dict.fromkeys(row["preset"] for row in rows))
    for i, name in enumerate(names):
        mine = sorted((row for row in rows if row["preset"] == name), key=lambda row: row["trials"])
        shares, low, high = np.array([(row["opened_12"], row["low"], row["high"]) for row in mine]).T
        trials = np.array([row["trials"] for row in mine]) * (1 + 0.02 * (i - (len(names) - 1) / 2))
        bars = np.maximum(0.0, [shares - low, high - shares])
        colour = COLOURS["random"] if "random" in name else f"C{i}"
        ax.errorbar(trials, shares, bars, fmt="o-", color=colour, capsize=3, label=name)
    ax.set(xlabel="trials a section", ylabel="share of doors opened [-]", ylim=(-0.03, 1.03))
    return ax
