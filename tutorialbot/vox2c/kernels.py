"""The compiled loops of paper 3: bars against rectangles in the plane of their motion.

Bars and boxes are prisms along y. So a bar meets a box exactly when their intervals along y overlap *and* their
rectangles in the x-z plane do; the rectangles are separate exactly when one of their four axes shows it (separating
axes in 2-D). Faces that merely touch do not collide. Rectangles are rows (centre x, centre z, half side x, half side z)
relative to joint 1 [m]. `bar` is arm.BAR: it is an argument, for what is compiled once stays in numba's cache.

A direction of angle a is (sin a, cos a): zero is up, positive leans toward +x.
"""

import math

import numpy as np
from numba import njit


def compiled(function):
    """Compile `function` at its first call, and keep the machine code on disk where a folder for it can be written."""
    options = {"error_model": "numpy", "nogil": True}
    try:
        return njit(cache=True, **options)(function)
    except RuntimeError:  # numba finds no folder for its cache: a checkout and a home that are read-only
        return njit(**options)(function)


@compiled
def rectangles(low, high, slab_low, slab_high, x, z):
    """Return the rectangles (k, 4), relative to (x, z), of those boxes (corners low, high (n, 3)) that enter a slab."""
    found = np.empty((len(low), 4))
    k = 0
    for i in range(len(low)):
        if low[i, 1] < slab_high and high[i, 1] > slab_low:
            found[k, 0] = (low[i, 0] + high[i, 0]) / 2 - x
            found[k, 1] = (low[i, 2] + high[i, 2]) / 2 - z
            found[k, 2] = (high[i, 0] - low[i, 0]) / 2
            found[k, 3] = (high[i, 2] - low[i, 2]) / 2
            k += 1
    return found[:k]


@compiled
def merged(filled):
    """Return rectangles (k, 4) of cells (first x, first z, beyond the last x, beyond the last z) that together are the
    filled cells of a map (x, z): runs along x, and equal runs of neighbouring rows as one.
    """
    left = filled.copy()
    found = np.empty((filled.size, 4), dtype=np.int64)
    k = 0
    for j in range(left.shape[1]):
        i = 0
        while i < left.shape[0]:
            if not left[i, j]:
                i += 1
                continue
            end = i
            while end < left.shape[0] and left[end, j]:
                end += 1
            top = j + 1
            while top < left.shape[1] and left[i:end, top].all():
                top += 1
            left[i:end, j:top] = False
            found[k] = i, j, end, top
            k += 1
            i = end
    return found[:k]


@compiled
def meets(x, z, half_x, half_z, s, c, bar):
    """Say whether a bar of direction (s, c) from the origin meets a rectangle around (x, z)."""
    middle, length, width = bar[1], bar[2], bar[3]
    x -= middle * s
    z -= middle * c
    a, b = abs(s), abs(c)
    return (
        abs(x * c - z * s) < width + half_x * b + half_z * a
        and abs(x * s + z * c) < length + half_x * a + half_z * b
        and abs(x) < half_x + length * a + width * b
        and abs(z) < half_z + length * b + width * a
    )


@compiled
def _window(x, z, half_x, half_z, n, zero, bar):
    """Return the first and last index i of the angles zero + 2 pi i / n at which a bar from the origin may meet a
    rectangle.

    Indices may be negative or beyond n (they wrap); first > last when there is none. No angle outside is a hit.
    """
    middle, length, width = bar[1], bar[2], bar[3]
    out_x, out_z = max(abs(x) - half_x, 0.0), max(abs(z) - half_z, 0.0)
    near = out_x * out_x + out_z * out_z
    if near >= (middle + length) ** 2 + width * width:
        return 0, -1
    back = length - middle
    if near <= 1.01 * (max(back, width) ** 2 + width * width):
        return 0, n - 1
    side_x, side_z = math.copysign(half_x, x), math.copysign(half_z, z)
    if out_x == 0.0:  # straight above or below: both corners of the near side
        ax, az, bx, bz = x - half_x, z - side_z, x + half_x, z - side_z
    elif out_z == 0.0:
        ax, az, bx, bz = x - side_x, z - half_z, x - side_x, z + half_z
    else:
        ax, az, bx, bz = x - side_x, z + side_z, x + side_x, z - side_z
    start = math.atan2(ax, az) - zero
    span = math.atan2(az * bx - ax * bz, ax * bx + az * bz)  # from corner a to corner b
    if span < 0.0:
        start, span = start + span, -span
    margin = math.asin(width / math.sqrt(near)) + 1e-9
    step = 2.0 * math.pi / n
    first = math.ceil((start - margin) / step)
    last = math.floor((start + span + margin) / step)
    return first, min(last, first + n - 1)


@compiled
def cspace(second, third, tables, bar):
    """Return the C-space (n, n) of the arm among rectangles: `second` those in link 2's slab, `third` in link 3's.

    tables (4, n): sine and cosine of theta1 = -pi + 2 pi k / n, then of phi = 2 pi j / n. Link 2 depends on theta1
    alone and blocks whole rows. Link 3 depends on the elbow and on phi = theta1 + theta2: cell (k, j - k).
    """
    n = tables.shape[1]
    found = np.zeros((n, n), dtype=np.bool_)
    blocked = np.zeros(n, dtype=np.bool_)
    for r in range(len(second)):
        x, z, half_x, half_z = second[r]
        first, last = _window(x, z, half_x, half_z, n, -math.pi, bar)
        for i in range(first, last + 1):
            k = i % n
            if not blocked[k] and meets(x, z, half_x, half_z, tables[0, k], tables[1, k], bar):
                blocked[k] = True
                found[k] = True
    for k in range(n):
        if blocked[k]:
            continue
        elbow_x, elbow_z = bar[0] * tables[0, k], bar[0] * tables[1, k]
        for r in range(len(third)):
            x, z = third[r, 0] - elbow_x, third[r, 1] - elbow_z
            half_x, half_z = third[r, 2], third[r, 3]
            first, last = _window(x, z, half_x, half_z, n, 0.0, bar)
            for i in range(first, last + 1):
                j = i % n
                m = j - k if j >= k else j - k + n
                if not found[k, m] and meets(x, z, half_x, half_z, tables[2, j], tables[3, j], bar):
                    found[k, m] = True
    return found


@compiled
def united(voxels, entries, masks):
    """Return the union (words,) of the masks (k, words) of 64-bit words whose entry has an occupied voxel.

    entries (k, 4): index along x, first layer along y, one beyond the last, index along z.
    """
    found = np.zeros(masks.shape[1], dtype=np.uint64)
    for e in range(len(entries)):
        x, first, last, z = entries[e]
        for y in range(first, last):
            if voxels[x, y, z]:
                for w in range(masks.shape[1]):
                    found[w] |= masks[e, w]
                break
    return found


@compiled
def collides(second, third, theta1, theta2, bar):
    """Say whether the configuration (theta1, theta2) [rad] collides with the rectangles of either slab."""
    s, c = math.sin(theta1), math.cos(theta1)
    for r in range(len(second)):
        if meets(second[r, 0], second[r, 1], second[r, 2], second[r, 3], s, c, bar):
            return True
    x, z = bar[0] * s, bar[0] * c
    s, c = math.sin(theta1 + theta2), math.cos(theta1 + theta2)
    for r in range(len(third)):  # noqa: SIM110 - compiled as it stands
        if meets(third[r, 0] - x, third[r, 1] - z, third[r, 2], third[r, 3], s, c, bar):
            return True
    return False


@compiled
def collide(second, third, q, bar):
    """Return for each configuration of q (k, 2) [rad] whether it collides, bool (k,)."""
    found = np.empty(len(q), dtype=np.bool_)
    for i in range(len(q)):
        found[i] = collides(second, third, q[i, 0], q[i, 1], bar)
    return found
