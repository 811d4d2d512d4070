"""The compiled loops of the link-frame predictor: footprints of a bar as bit words, feature maps, features of poses.

Lengths are measured from the lowest corner of the domain: x + 1.15 m, z. A direction of angle a is (sin a, cos a). A
word holds one row of voxels, bit k for the voxel k along z; so a grid may have up to 64 voxels along a side. `bar` is
(middle, half length, half width) of a link [m], the half sides already grown by the cull's outset.
"""

import math

import numpy as np

from tutorialbot.vox2c.kernels import compiled, meets

TOUCH = 1e-9  # footprints are wider by this much [m]: rounding never frees a pose


@compiled
def footprint(x, z, s, c, bar, cell, size, words):
    """Fill `words` (rows,) uint64 with the voxels that a bar touches; return its first row and how many there are.

    The bar starts at the joint (x, z) and points along (s, c). Each row is a strip of the plane; within it the bar's
    outline, clipped to the strip, spans the voxels. Rows beyond the grid are left out.
    """
    middle, length, width = bar[0], bar[1] + TOUCH, bar[2] + TOUCH
    corner_x, corner_z = np.empty(5), np.empty(5)
    for i in range(5):
        a = middle + (length if i % 4 < 2 else -length)
        b = width if i % 4 in (0, 3) else -width
        corner_x[i] = x + a * s + b * c
        corner_z[i] = z + a * c - b * s
    first = max(int(math.floor(corner_x.min() / cell)), 0)
    last = min(int(math.floor(corner_x.max() / cell)), size - 1)
    for row in range(first, last + 1):
        low_x, high_x = row * cell, (row + 1) * cell
        low, high = np.inf, -np.inf
        for i in range(4):
            x0, z0, x1, z1 = corner_x[i], corner_z[i], corner_x[i + 1], corner_z[i + 1]
            if x0 > x1:
                x0, z0, x1, z1 = x1, z1, x0, z0
            if x1 < low_x or x0 > high_x:
                continue
            slope = (z1 - z0) / (x1 - x0) if x1 > x0 else 0.0
            at_low = z0 + slope * (low_x - x0) if x0 < low_x else z0
            at_high = z0 + slope * (high_x - x0) if x1 > high_x else z1
            low, high = min(low, at_low, at_high), max(high, at_low, at_high)
        bottom = max(int(math.floor((low - TOUCH) / cell)), 0)
        top = min(int(math.floor((high + TOUCH) / cell)), size - 1)
        word = np.uint64(0)
        for k in range(bottom, top + 1):
            word |= np.uint64(1) << np.uint64(k)
        words[row - first] = word
    return first, max(last - first + 1, 0)


@compiled
def footprint_table(joints, sines, cosines, bar, cell, size, rows):
    """Return the footprints of a bar at every joint (m, 2) and angle (n,): words (m, n, rows) and [first, count]."""
    m, n = len(joints), len(sines)
    words = np.zeros((m, n, rows), dtype=np.uint64)
    spans = np.zeros((m, n, 2), dtype=np.uint8)
    for k in range(m):
        for j in range(n):
            first, count = footprint(joints[k, 0], joints[k, 1], sines[j], cosines[j], bar, cell, size, words[k, j])
            spans[k, j, 0], spans[k, j, 1] = first, count
    return words, spans


@compiled
def occupied_words(voxels, first, last):
    """Return the words (size,) of the voxels that are occupied in any of the layers first..last - 1 along y."""
    size = len(voxels)
    words = np.zeros(size, dtype=np.uint64)
    for i in range(size):
        for y in range(first, last):
            for k in range(size):
                if voxels[i, y, k]:
                    words[i] |= np.uint64(1) << np.uint64(k)
    return words


@compiled
def touching(words, spans, occupied, skipped):
    """Return the poses (k, j) of a footprint table that touch an occupied voxel, (q, 2), but for the rows k skipped."""
    m, n = spans.shape[0], spans.shape[1]
    found = np.empty((m * n, 2), dtype=np.int32)
    q = 0
    for k in range(m):
        if skipped[k]:
            continue
        for j in range(n):
            first = spans[k, j, 0]
            for r in range(spans[k, j, 1]):
                if words[k, j, r] & occupied[first + r]:
                    found[q, 0], found[q, 1] = k, j
                    q += 1
                    break
    return found[:q]


@compiled
def first_convolution(voxels, first, weights, biases):
    """Return relu(3 x 3 convolution) of a grid in the plane, (size + 2, size + 2, f) with a border of zeros.

    Its inputs are the layers along y from `first` on: weights (layers, 3, 3, f), biases (f,). Most voxels are empty, so
    each occupied one adds its share to its neighbours.
    """
    size, layers, f = len(voxels), len(weights), np.uint64(len(biases))
    found = np.zeros((size + 2, size + 2, len(biases)), dtype=np.float32)
    found[1:-1, 1:-1] = biases
    for i in range(size):
        for y in range(layers):
            for k in range(size):
                if voxels[i, first + y, k]:
                    for di in range(3):
                        for dk in range(3):
                            to, share = found[i + 2 - di, k + 2 - dk], weights[y, di, dk]
                            for h in range(f):
                                to[h] += share[h]
    for i in range(size + 2):
        for k in range(size + 2):
            inside = 0 < i <= size and 0 < k <= size
            for h in range(f):
                found[i, k, h] = max(found[i, k, h], np.float32(0.0)) if inside else np.float32(0.0)
    return found


@compiled
def pose_features(maps, poses, points, cell, pad, found):
    """Fill `found` (q, p c + 10) with the features of poses (q, 3): joint x, z [m] and angle [rad].

    maps (m, m, c) is sampled bilinearly at the p points (along, across) [m] of the link's frame; then come ten terms of
    the pose: sine and cosine of one, two and four times the angle, and where in its voxel the joint lies.
    """
    side, c = maps.shape[1], maps.shape[2]
    flat = maps.reshape(-1)
    row = np.uint64(side * c)
    for q in range(len(poses)):
        x, z, angle = poses[q, 0], poses[q, 1], poses[q, 2]
        s, t = math.sin(angle), math.cos(angle)
        base_u, base_v = x / cell - 0.5 + pad, z / cell - 0.5 + pad
        s_cell, t_cell = s / cell, t / cell
        filled = found[q]
        for p in range(len(points)):
            u = base_u + points[p, 0] * s_cell + points[p, 1] * t_cell
            v = base_v + points[p, 0] * t_cell - points[p, 1] * s_cell
            i, k = np.uint64(u), np.uint64(v)
            u, v = np.float32(u - i), np.float32(v - k)
            w11 = u * v
            w10, w01 = u - w11, v - w11
            w00 = np.float32(1.0) - u - w01
            at, to = i * row + k * np.uint64(c), np.uint64(p * c)
            for j in range(np.uint64(c)):
                low, high = at + j, at + row + j
                filled[to + j] = (
                    w00 * flat[low]
                    + w01 * flat[low + np.uint64(c)]
                    + w10 * flat[high]
                    + w11 * flat[high + np.uint64(c)]
                )
        end = len(points) * c
        filled[end], filled[end + 1] = s, t
        filled[end + 2], filled[end + 3] = 2 * s * t, t * t - s * s
        filled[end + 4], filled[end + 5] = math.sin(4 * angle), math.cos(4 * angle)
        phase_x, phase_z = 2 * math.pi * x / cell, 2 * math.pi * z / cell
        filled[end + 6], filled[end + 7] = math.sin(phase_x), math.cos(phase_x)
        filled[end + 8], filled[end + 9] = math.sin(phase_z), math.cos(phase_z)


@compiled
def touching_poses(poses, occupied, bar, cell, size):
    """Say for each pose (q, 3), joint x, z and angle, whether a bar touches an occupied voxel: bool (q,)."""
    found = np.zeros(len(poses), dtype=np.bool_)
    words = np.empty(size, dtype=np.uint64)
    for q in range(len(poses)):
        s, c = math.sin(poses[q, 2]), math.cos(poses[q, 2])
        first, count = footprint(poses[q, 0], poses[q, 1], s, c, bar, cell, size, words)
        for r in range(count):
            if words[r] & occupied[first + r]:
                found[q] = True
                break
    return found


@compiled
def bars_meet(rectangles, poses, bar):
    """Say for each pose (q, 3), joint x, z and angle, whether the bar meets one of the rectangles: bool (q,)."""
    found = np.zeros(len(poses), dtype=np.bool_)
    for q in range(len(poses)):
        s, c = math.sin(poses[q, 2]), math.cos(poses[q, 2])
        for r in range(len(rectangles)):
            x, z = rectangles[r, 0] - poses[q, 0], rectangles[r, 1] - poses[q, 1]
            if meets(x, z, rectangles[r, 2], rectangles[r, 3], s, c, bar):
                found[q] = True
                break
    return found


@compiled
def posterior_boxes(first, last, cell, shortest, longest, length, rng):
    """Draw boxes that fill exactly the voxels first..last (n, 3), as random scenes have them; corners (n, 3) each.

    Sides are even in [shortest, longest], and a box's place is even in what the domain leaves: so of two sides that are
    possible the longer one is a little more likely, by 1 / (length - side).
    """
    low, high = np.empty_like(first), np.empty_like(first)
    for i in range(len(first)):
        for a in range(3):
            while True:
                low[i, a] = (first[i, a] + rng.random()) * cell
                high[i, a] = (last[i, a] + rng.random()) * cell
                side = high[i, a] - low[i, a]
                possible = shortest <= side <= longest
                if possible and rng.random() * (length - side) < length - longest:
                    break
    return low, high
