"""Planted wrong answers to notebook 3's exercises, each with the exercise and the check that must reject it."""

import heapq
import math
from collections import deque

import numpy as np
import torch

from tests.exercises import solutions_cspace as solutions
from tests.exercises.planting import wrong_into
from tutorialbot.checks import cspace_descent, mechanism
from tutorialbot.vox2c import arm, labels, scenes

WRONG = []  # (function, exercise, check, outcome)
wrong = wrong_into(WRONG)


# --- 1 affordable_joints ----------------------------------------------------------------------------------------------
def _count_up(cells, *limits):
    found = []
    for most in limits:
        joints = 0
        while cells ** (joints + 1) <= most:
            joints += 1
        found.append(joints)
    return found


@wrong("affordable_joints", "by memory")
def joints_at_a_byte_a_cell(resolution_deg, memory, check_us, patience):
    return _count_up(round(360 / resolution_deg), memory, patience * 1e6 / check_us)


@wrong("affordable_joints", "by memory")
def joints_that_multiply(resolution_deg, memory, check_us, patience):
    cells = round(360 / resolution_deg)
    return 8 * memory // cells, patience * 1e6 // check_us // cells


@wrong("affordable_joints", "by time")
def joints_at_milliseconds_a_check(resolution_deg, memory, check_us, patience):
    return _count_up(round(360 / resolution_deg), 8 * memory, patience * 1e3 / check_us)


@wrong("affordable_joints", "by time")
def joints_with_checks_that_take_no_time(resolution_deg, memory, check_us, patience):
    return [_count_up(round(360 / resolution_deg), 8 * memory)[0]] * 2


@wrong("affordable_joints", "by memory")
def joints_one_too_many(resolution_deg, memory, check_us, patience):
    return [k + 1 for k in solutions.affordable_joints(resolution_deg, memory, check_us, patience)]


@wrong("affordable_joints", "by memory")
def joints_that_need_not_be_whole(resolution_deg, memory, check_us, patience):
    step = math.log(360 / resolution_deg)
    return math.log(8 * memory) / step, math.log(patience * 1e6 / check_us) / step


@wrong("affordable_joints", "just fits")
def joints_by_logarithms(resolution_deg, memory, check_us, patience):
    step = math.log(360 / resolution_deg)
    return int(math.log(8 * memory) / step), int(math.log(patience * 1e6 / check_us) / step)


@wrong("affordable_joints", "just fits")
def joints_by_logarithms_and_a_little(resolution_deg, memory, check_us, patience):
    step = math.log(round(360 / resolution_deg))
    return int(math.log(8 * memory) / step + 1e-6), int(math.log(patience * 1e6 / check_us) / step + 1e-6)


@wrong("affordable_joints", "just fits")
def joints_that_must_leave_room(resolution_deg, memory, check_us, patience):
    return _count_up(round(360 / resolution_deg), 8 * memory - 1, patience * 1_000_000 // check_us - 1)


@wrong("affordable_joints", "whole number of steps")
def joints_with_steps_cut_off(resolution_deg, memory, check_us, patience):
    return _count_up(int(360 / resolution_deg), 8 * memory, patience * 1_000_000 // check_us)


@wrong("affordable_joints", "whole number of steps")
def joints_with_a_fraction_of_a_step(resolution_deg, memory, check_us, patience):
    """Powers of 168.99999999999997 fall short of the map that does not fit."""
    cells = 360 / resolution_deg
    return _count_up(cells if cells % 1 else int(cells), 8 * memory, patience * 1_000_000 // check_us)


@wrong("affordable_joints", "many joints")
def joints_in_sixty_four_bits(resolution_deg, memory, check_us, patience):
    powers = np.full(20, round(360 / resolution_deg), dtype=np.int64).cumprod()
    powers = powers[: np.flatnonzero(powers <= 0)[0]] if (powers <= 0).any() else powers
    return [sum(int(p) <= most for p in powers) for most in (8 * memory, patience * 1_000_000 // check_us)]


@wrong("affordable_joints", "many joints")
def joints_of_robots_with_seven_at_most(resolution_deg, memory, check_us, patience):
    return [min(k, 8) for k in solutions.affordable_joints(resolution_deg, memory, check_us, patience)]


@wrong("affordable_joints", "by memory")
def joints_of_the_lesser_limit(resolution_deg, memory, check_us, patience):
    return [min(solutions.affordable_joints(resolution_deg, memory, check_us, patience))] * 2


@wrong("affordable_joints", "shape of the answer")
def joints_that_both_allow(resolution_deg, memory, check_us, patience):
    return min(solutions.affordable_joints(resolution_deg, memory, check_us, patience))


@wrong("affordable_joints", "shape of the answer")
def joints_written_out(resolution_deg, memory, check_us, patience):
    return [str(k) for k in solutions.affordable_joints(resolution_deg, memory, check_us, patience)]


# --- 2 turned_rectangles_meet -----------------------------------------------------------------------------------------
def _meet(a, b, axes=(0, 1, 2, 3), sign=1.0, half=1.0, slack=1e-9, strict=False):
    """Separating axes with something left out or turned round; axes 0, 1 are those of a, 2, 3 those of b."""
    a, b = np.broadcast_arrays(a, b)
    apart = np.zeros(len(a), dtype=bool)
    for number in axes:
        angle = sign * (a, b)[number // 2][:, 4] + (number % 2) * np.pi / 2
        reach = 0
        for r in (a, b):
            turned = sign * r[:, 4] - angle
            reach = reach + half * (r[:, 2] * np.abs(np.cos(turned)) + r[:, 3] * np.abs(np.sin(turned)))
        gap = np.abs((a[:, 0] - b[:, 0]) * np.sin(angle) + (a[:, 1] - b[:, 1]) * np.cos(angle))
        apart |= gap > reach - slack if not strict else gap >= reach
    return ~apart


def _corners(r):
    x, z, long, wide, angle = r.T
    along, across = (np.stack([np.sin(angle), np.cos(angle)]), np.stack([np.cos(angle), -np.sin(angle)]))
    return [np.stack([x, z]) + s * long * along + t * wide * across for s, t in ((-1, -1), (-1, 1), (1, 1), (1, -1))]


def _holds(r, point):
    d = point - r[:, :2].T
    along = np.abs(d[0] * np.sin(r[:, 4]) + d[1] * np.cos(r[:, 4]))
    across = np.abs(d[0] * np.cos(r[:, 4]) - d[1] * np.sin(r[:, 4]))
    return (along < r[:, 2] - 1e-9) & (across < r[:, 3] - 1e-9)


@wrong("turned_rectangles_meet", "one turned")
def meet_as_if_not_turned(a, b):
    return (np.abs(a[:, :2] - b[:, :2]) < (a[:, 3:1:-1] + b[:, 3:1:-1]) - 1e-9).all(axis=1)


@wrong("turned_rectangles_meet", "not turned")
def meet_with_whole_sides(a, b):
    return _meet(a, b, half=0.5)


@wrong("turned_rectangles_meet", "not turned")
def meet_with_the_sides_swapped(a, b):
    return _meet(a[:, [0, 1, 3, 2, 4]], b[:, [0, 1, 3, 2, 4]])


@wrong("turned_rectangles_meet", "not turned")
def meet_as_circles(a, b):
    radii = np.hypot(a[:, 2], a[:, 3]) + np.hypot(b[:, 2], b[:, 3])
    return np.hypot(*(a[:, :2] - b[:, :2]).T) < radii


@wrong("turned_rectangles_meet", "one turned")
def meet_as_upright_boxes_around_them(a, b):
    c, d = (np.array(_corners(r)) for r in np.broadcast_arrays(a, b))
    return ((c.max(axis=0) > d.min(axis=0) + 1e-9) & (d.max(axis=0) > c.min(axis=0) + 1e-9)).all(axis=0)


@wrong("turned_rectangles_meet", "one turned")
def meet_on_the_axes_of_the_first(a, b):
    return _meet(a, b, axes=(0, 1))


@wrong("turned_rectangles_meet", "one turned")
def meet_on_the_axes_of_the_notebook(a, b):
    """The first one's own and the upright ones, as if the second were not turned."""
    return _meet(a, b, axes=(0, 1)) & _meet(a, b * [1, 1, 1, 1, 0], axes=(2, 3))


@wrong("turned_rectangles_meet", "one turned")
def meet_on_three_axes(a, b):
    return _meet(a, b, axes=(0, 1, 2))


@wrong("turned_rectangles_meet", "both turned")
def meet_with_the_sum_of_the_angles(a, b):
    """Right as long as one of both is not turned."""
    a, b = np.broadcast_arrays(a, b)
    c, s, apart = np.abs(np.cos(a[:, 4] + b[:, 4])), np.abs(np.sin(a[:, 4] + b[:, 4])), a[:, :2] - b[:, :2]
    found = np.ones(len(a), dtype=bool)
    for own, other in ((a, b), (b, a)):
        u, v = np.sin(own[:, 4]), np.cos(own[:, 4])
        long, wide = other[:, 2] * c + other[:, 3] * s, other[:, 2] * s + other[:, 3] * c
        found &= np.abs(apart[:, 0] * u + apart[:, 1] * v) < own[:, 2] + long - 1e-9
        found &= np.abs(apart[:, 0] * v - apart[:, 1] * u) < own[:, 3] + wide - 1e-9
    return found


@wrong("turned_rectangles_meet", "one turned")
def meet_turned_the_other_way(a, b):
    return _meet(a, b, sign=-1.0)


@wrong("turned_rectangles_meet", "one turned")
def meet_in_degrees(a, b):
    return _meet(a * [1, 1, 1, 1, np.pi / 180], b * [1, 1, 1, 1, np.pi / 180])


@wrong("turned_rectangles_meet", "not turned")
def meet_where_a_corner_of_the_first_lies_inside(a, b):
    a, b = np.broadcast_arrays(a, b)
    return np.any([_holds(b, point) for point in _corners(a)], axis=0)


@wrong("turned_rectangles_meet", "a cross")
def meet_where_a_corner_or_the_centre_lies_inside(a, b):
    a, b = np.broadcast_arrays(a, b)
    upright = (a[:, 4] == 0) | (b[:, 4] == 0)
    inside = [_holds(r, point) for r, other in ((b, a), (a, b)) for point in _corners(other)]
    return np.where(upright, _meet(a, b), np.any(inside, axis=0))


@wrong("turned_rectangles_meet", "touching")
def meet_when_they_touch(a, b):
    return _meet(a, b, slack=-1e-12)


@wrong("turned_rectangles_meet", "touching")
def meet_as_rounding_has_it(a, b):
    return _meet(a, b, strict=True)


@wrong("turned_rectangles_meet", "touching")
def meet_by_enough(a, b):
    return _meet(a, b, slack=1e-7)


@wrong("turned_rectangles_meet", "lines and points")
def meet_with_an_area(a, b):
    return _meet(a, b) & (a[:, 2] * a[:, 3] > 0) & (b[:, 2] * b[:, 3] > 0)


@wrong("turned_rectangles_meet", "shape of the answer")
def meet_any(a, b):
    return _meet(a, b).any()


@wrong("turned_rectangles_meet", "shape of the answer")
def meet_everyone_with_everyone(a, b):
    return np.array([_meet(a, one[None]) for one in b])


@wrong("turned_rectangles_meet", "shape of the answer")
def meet_only_pairs(a, b):
    n = min(len(a), len(b))
    return _meet(a[:n], b[:n])


@wrong("turned_rectangles_meet", "shape of the answer")
def meet_squeezed(a, b):
    return np.squeeze(_meet(a, b))


@wrong("turned_rectangles_meet", "all at once")
def meet_in_a_loop(a, b):
    return np.array([_meet(p[None], q[None])[0] for p, q in zip(*np.broadcast_arrays(a, b), strict=True)], dtype=bool)


@wrong("turned_rectangles_meet", "yes or no")
def meet_by_how_much(a, b):
    return np.where(_meet(a, b), 0.5, 0.0)


@wrong("turned_rectangles_meet", "inputs left alone")
def meet_with_sizes_doubled_in_place(a, b):
    a[:, 2:4] *= 2
    return _meet(a, b, half=0.5)


# --- 3 from_own_angles ------------------------------------------------------------------------------------------------
def _table(second, third, column):
    """third at `column(i, k, n, m)`, or second."""
    n, m = third.shape
    i, k = np.indices((n, n))
    return second[:, None] | third[i, np.asarray(column(i, k, n, m)) % m]


@wrong("from_own_angles", "half a turn")
def angles_without_half_a_turn(second, third):
    return _table(second, third, lambda i, k, n, m: (i + k) * (m // n))


@wrong("from_own_angles", "own angle")
def angles_with_the_difference(second, third):
    """Right where theta1 is -180 degrees, and nowhere else."""
    return _table(second, third, lambda i, k, n, m: (k - i) * (m // n) - m // 2)


@wrong("from_own_angles", "half a turn")
def angles_of_theta2_for_phi(second, third):
    return _table(second, third, lambda i, k, n, m: k * (m // n) - m // 2)


@wrong("from_own_angles", "own angle")
def angles_as_they_come(second, third):
    return second[:, None] | third[:, :: third.shape[1] // third.shape[0]]


@wrong("from_own_angles", "half a turn")
def angles_shifted_by_one_cell(second, third):
    return _table(second, third, lambda i, k, n, m: (i + k) * (m // n) - m // 2 + 1)


@wrong("from_own_angles", "round the seam")
def angles_that_do_not_go_round(second, third):
    n, m = third.shape
    i, k = np.indices((n, n))
    j = (i + k) * (m // n) - m // 2
    return second[:, None] | ((j >= 0) & (j < m) & third[i, np.clip(j, 0, m - 1)])


@wrong("from_own_angles", "round the seam")
def angles_stopped_at_the_border(second, third):
    """Cells beyond the border are taken to be the border's own."""
    n, m = third.shape
    i, k = np.indices((n, n))
    return second[:, None] | third[i, np.clip((i + k) * (m // n) - m // 2, 0, m - 1)]


@wrong("from_own_angles", "rows")
def angles_with_link_2_in_columns(second, third):
    return solutions.from_own_angles(np.zeros_like(second), third) | second


@wrong("from_own_angles", "rows")
def angles_of_link_3_alone(second, third):
    return solutions.from_own_angles(np.zeros_like(second), third)


@wrong("from_own_angles", "rows")
def angles_where_both_links_hit(second, third):
    return solutions.from_own_angles(np.zeros_like(second), third) & second[:, None]


@wrong("from_own_angles", "any map")
def angles_where_one_link_hits_alone(second, third):
    return solutions.from_own_angles(np.zeros_like(second), third) ^ second[:, None]


@wrong("from_own_angles", "yes or no")
def angles_added_up(second, third):
    return solutions.from_own_angles(np.zeros_like(second), third).astype(int) + second[:, None]


@wrong("from_own_angles", "rows")
def angles_transposed(second, third):
    return solutions.from_own_angles(second, third).T


@wrong("from_own_angles", "runs without an error", "error")
def angles_for_phi_as_coarse_as_theta(second, third):
    return solutions.from_own_angles(second, third.reshape(len(second), len(second)))


@wrong("from_own_angles", "shape of the answer")
def angles_in_steps_of_phi(second, third):
    n, m = third.shape
    i, k = np.indices((n, m))
    return second[:, None] | third[i, (i * (m // n) + k - m // 2) % m]


@wrong("from_own_angles", "finer phi")
def angles_with_any_of_the_finer_ones(second, third):
    n, m = third.shape
    coarse = np.roll(third, m // 2, axis=1).reshape(n, n, m // n).any(axis=2)
    i, k = np.indices((n, n))
    return second[:, None] | coarse[i, (i + k) % n]


@wrong("from_own_angles", "finer phi")
def angles_with_half_a_turn_in_whole_cells(second, third):
    """n // 2 cells of theta are no half a turn when n is odd."""
    return _table(second, third, lambda i, k, n, m: (i + k - n // 2) * (m // n))


@wrong("from_own_angles", "all at once")
def angles_rolled_row_by_row(second, third):
    n, m = third.shape
    rows = [np.roll(row, m // 2 - i * (m // n))[:: m // n] for i, row in enumerate(third)]
    return np.array(rows) | second[:, None]


@wrong("from_own_angles", "all at once")
def angles_row_by_row_in_a_hidden_loop(second, third):
    n, m = third.shape
    start = np.arange(n)
    rows = map(lambda i: np.take(third[i], (i + start) * (m // n) - m // 2, mode="wrap"), range(n))  # noqa: C417
    return np.array(list(rows)) | second[:, None]


@wrong("from_own_angles", "rows")
def angles_of_a_scene_from_the_package(second, third):
    return labels.exact_cspace(scenes.random_scene(27), 360 / len(second))


@wrong("from_own_angles", "inputs left alone")
def angles_in_place(second, third):
    found = solutions.from_own_angles(second, third)
    third |= second[:, None]
    return found


# --- 4 points_to_voxels -----------------------------------------------------------------------------------------------
def _count(points, low, side, shape, least, cells=None, mask=None):
    points = points[np.isfinite(points).all(axis=1)] if mask is None else points[mask(points)]
    cells = np.floor((points - low) / side) if cells is None else cells((points - low) / side)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)].astype(int)
    counts = np.zeros(shape, dtype=int)
    np.add.at(counts, tuple(cells.T), 1)
    return counts >= least


@wrong("points_to_voxels", "outside")
def voxels_cut_off_toward_zero(points, low, side, shape, least):
    return _count(points, low, side, shape, least, lambda x: np.clip(x, -1e6, 1e6).astype(int))


@wrong("points_to_voxels", "one point")
def voxels_rounded(points, low, side, shape, least):
    return _count(points, low, side, shape, least, np.rint)


@wrong("points_to_voxels", "one point")
def voxels_without_their_corner(points, low, side, shape, least):
    return _count(points, 0 * low, side, shape, least)


@wrong("points_to_voxels", "one point")
def voxels_with_z_first(points, low, side, shape, least):
    return _count(points[:, ::-1], low[::-1], side, shape[::-1], least).T[::-1]


@wrong("points_to_voxels", "outside")
def voxels_that_go_round(points, low, side, shape, least):
    return _count(points, low, side, shape, least, lambda x: np.floor(np.clip(x, -1e6, 1e6)) % shape)


@wrong("points_to_voxels", "outside")
def voxels_with_strays_at_the_border(points, low, side, shape, least):
    return _count(points, low, side, shape, least, lambda x: np.clip(np.floor(x), 0, np.array(shape) - 1))


@wrong("points_to_voxels", "outside")
def voxels_with_negative_indices(points, low, side, shape, least):
    """numpy takes -1 for the last one."""
    cells = np.floor((points[np.isfinite(points).all(axis=1)] - low) / side)
    cells = cells[(cells < shape).all(axis=1) & (cells >= -np.array(shape)).all(axis=1)].astype(int)
    counts = np.zeros(shape, dtype=int)
    np.add.at(counts, tuple(cells.T), 1)
    return counts >= least


@wrong("points_to_voxels", "borders")
def voxels_that_own_their_upper_face(points, low, side, shape, least):
    return _count(points, low, side, shape, least, lambda x: np.ceil(x) - 1)


@wrong("points_to_voxels", "borders")
def voxels_by_histogram(points, low, side, shape, least):
    """numpy's last bin is closed: the upper face of the grid counts."""
    points = points[np.isfinite(points).all(axis=1)]
    faces = [low[a] + side * np.arange(shape[a] + 1) for a in range(3)]
    return np.histogramdd(points, faces)[0] >= least


@wrong("points_to_voxels", "no depth")
def voxels_with_zero_for_no_depth(points, low, side, shape, least):
    return _count(np.nan_to_num(points, nan=0.5, posinf=0.5, neginf=0.5), low, side, shape, least)


@wrong("points_to_voxels", "no depth")
def voxels_with_the_middle_for_no_depth(points, low, side, shape, least):
    middle = low + side * np.array(shape) / 2
    return _count(np.where(np.isfinite(points), points, middle), low, side, shape, least)


@wrong("points_to_voxels", "no depth")
def voxels_with_points_that_have_some_depth(points, low, side, shape, least):
    given = np.where(np.isfinite(points), points, low + side / 2)
    return _count(given, low, side, shape, least, mask=lambda p: np.isfinite(points).any(axis=1))


@wrong("points_to_voxels", "no depth")
def voxels_of_a_cloud_without_gaps(points, low, side, shape, least):
    return _count(points, low, side, shape, least) & np.isfinite(points).all()


@wrong("points_to_voxels", "least")
def voxels_with_any_point(points, low, side, shape, least):
    return _count(points, low, side, shape, 1)


@wrong("points_to_voxels", "least")
def voxels_with_more_points(points, low, side, shape, least):
    return _count(points, low, side, shape, least + (least > 1))


@wrong("points_to_voxels", "least")
def voxels_counted_once(points, low, side, shape, least):
    cells = np.floor((points[np.isfinite(points).all(axis=1)] - low) / side)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)].astype(int)
    counts = np.zeros(shape, dtype=int)
    counts[tuple(cells.T)] += 1
    return counts >= least


@wrong("points_to_voxels", "shape of the answer")
def voxels_in_a_cube(points, low, side, shape, least):
    return _count(points, low, side, (max(shape),) * 3, least)


@wrong("points_to_voxels", "shape of the answer")
def voxels_of_the_paper(points, low, side, shape, least):
    return _count(points, np.array(arm.DOMAIN[0]), 2.3 / 32, (32, 32, 32), least)


@wrong("points_to_voxels", "yes or no")
def voxels_with_their_counts(points, low, side, shape, least):
    return sum(_count(points, low, side, shape, n).astype(int) for n in range(1, 5))


@wrong("points_to_voxels", "all at once")
def voxels_point_by_point(points, low, side, shape, least):
    counts = np.zeros(shape, dtype=int)
    for point in points:
        cell = np.floor((point - low) / side)
        if np.isfinite(cell).all() and (cell >= 0).all() and (cell < shape).all():
            counts[tuple(cell.astype(int))] += 1
    return counts >= least


@wrong("points_to_voxels", "inputs left alone")
def voxels_from_points_moved(points, low, side, shape, least):
    points -= low
    return _count(points, 0 * low, side, shape, least)


@wrong("points_to_voxels", "outside")
def voxels_numbered_in_sixteen_bits(points, low, side, shape, least):
    points = points[np.isfinite(points).all(axis=1)]
    cells = np.floor((points - low) / side).astype(np.int64).astype(np.int16)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)]
    counts = np.zeros(shape, dtype=int)
    np.add.at(counts, tuple(cells.T), 1)
    return counts >= least


@wrong("points_to_voxels", "many points")
def voxels_counted_in_eight_bits(points, low, side, shape, least):
    cells = np.floor((points[np.isfinite(points).all(axis=1)] - low) / side)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)].astype(int)
    counts = np.zeros(shape, dtype=np.uint8)
    np.add.at(counts, tuple(cells.T), 1)
    return counts >= least


@wrong("points_to_voxels", "many points")
def voxels_counted_in_seven_bits(points, low, side, shape, least):
    cells = np.floor((points[np.isfinite(points).all(axis=1)] - low) / side)
    cells = cells[((cells >= 0) & (cells < shape)).all(axis=1)].astype(int)
    counts = np.zeros(shape, dtype=np.int8)
    np.add.at(counts, tuple(cells.T), 1)
    return counts >= least


@wrong("points_to_voxels", "borders")
def voxels_moved_by_a_little_to_be_sure(points, low, side, shape, least):
    return solutions.points_to_voxels(points + 1e-6, low, side, shape, least)


@wrong("points_to_voxels", "borders")
def voxels_in_single_precision(points, low, side, shape, least):
    single = points.astype(np.float32), low.astype(np.float32), np.float32(side)
    return solutions.points_to_voxels(*single, shape, least)


# --- 5 loss_from_logits -----------------------------------------------------------------------------------------------
def _sigmoid(x):
    return 1 / (1 + np.exp(-x))


@wrong("loss_from_logits", "one cell: loss")
def loss_as_it_is_printed(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(logits, gt, weight)
    return -loss, -slope


@wrong("loss_from_logits", "one cell: loss")
def loss_with_truth_swapped(logits, gt, weight):
    return solutions.loss_from_logits(logits, 1 - gt, weight)


@wrong("loss_from_logits", "one cell: loss")
def loss_in_bits(logits, gt, weight):
    return np.array(solutions.loss_from_logits(logits, gt, weight)[0]) / np.log(2), 0 * logits


@wrong("loss_from_logits", "one cell: loss")
def loss_of_squares(logits, gt, weight):
    p = _sigmoid(logits)
    return np.mean((p - gt) ** 2), 2 * (p - gt) * p * (1 - p) / logits.size


@wrong("loss_from_logits", "one cell: gradient")
def loss_derived_by_the_probability(logits, gt, weight):
    p = _sigmoid(logits)
    return solutions.loss_from_logits(logits, gt, weight)[0], (p - gt) / (p * (1 - p)) / logits.size


@wrong("loss_from_logits", "one cell: gradient")
def loss_with_a_step_downhill(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(logits, gt, weight)
    return loss, -slope


@wrong("loss_from_logits", "mean: loss")
def loss_added_up(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(logits, gt, weight)
    return loss * logits.size, slope * logits.size


@wrong("loss_from_logits", "mean: gradient")
def loss_whose_slope_is_added_up(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(logits, gt, weight)
    return loss, slope * logits.size


@wrong("loss_from_logits", "mean: gradient")
def loss_whose_slope_is_a_mean_of_rows(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(logits, gt, weight)
    return loss, slope * logits.size / max(len(np.atleast_1d(logits)), 1)


@wrong("loss_from_logits", "weight: loss")
def loss_without_the_weight(logits, gt, weight):
    return solutions.loss_from_logits(logits, gt, 1.0)


@wrong("loss_from_logits", "weight: loss")
def loss_with_weighted_free_cells(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(-logits, 1 - gt, weight)
    return loss, -slope


@wrong("loss_from_logits", "weight: gradient")
def loss_with_the_weight_in_it_alone(logits, gt, weight):
    loss = solutions.loss_from_logits(logits, gt, weight)[0]
    return loss, solutions.loss_from_logits(logits, gt, 1.0)[1]


@wrong("loss_from_logits", "weight: loss")
def loss_divided_by_the_weights(logits, gt, weight):
    loss, slope = solutions.loss_from_logits(logits, gt, weight)
    mean = np.mean(np.where(gt > 0.5, weight, 1.0))
    return loss / mean, slope / mean


@wrong("loss_from_logits", "shares: loss")
def loss_of_hard_truths(logits, gt, weight):
    return solutions.loss_from_logits(logits, (gt > 0.5).astype(float), weight)


@wrong("loss_from_logits", "tiny: loss")
def loss_by_the_book(logits, gt, weight):
    p = _sigmoid(np.clip(logits, -30, 30))
    loss = np.mean(-weight * gt * np.log(p) - (1 - gt) * np.log(1 - p))
    return loss, ((1 - gt) * p - weight * gt * (1 - p)) / logits.size


@wrong("loss_from_logits", "one cell: loss")
def loss_with_a_small_number_in_the_logarithm(logits, gt, weight):
    p = _sigmoid(logits)
    loss = np.mean(-weight * gt * np.log(p + 1e-7) - (1 - gt) * np.log(1 - p + 1e-7))
    return loss, ((1 - gt) * p - weight * gt * (1 - p)) / logits.size


@wrong("loss_from_logits", "tiny: loss")
def loss_with_log_of_one_and_a_little(logits, gt, weight):
    slope = solutions.loss_from_logits(logits, gt, weight)[1]
    tail = np.log(1 + np.exp(-np.abs(logits)))
    return np.mean(weight * gt * (np.maximum(-logits, 0) + tail) + (1 - gt) * (np.maximum(logits, 0) + tail)), slope


@wrong("loss_from_logits", "tiny: gradient")
def loss_with_a_slope_that_cancels(logits, gt, weight):
    loss = solutions.loss_from_logits(logits, gt, weight)[0]
    p = np.exp(-np.logaddexp(0, -logits))
    return loss, (p * (1 - gt + weight * gt) - weight * gt) / logits.size


@wrong("loss_from_logits", "no overflow")
def loss_that_overflows_in_what_is_thrown_away(logits, gt, weight):
    with np.errstate(under="ignore"):
        low = np.log1p(np.exp(logits))  # right where logits are below zero
        softplus = np.where(logits > 0, logits + np.log1p(np.exp(-logits)), low)
    loss = np.mean(weight * gt * (softplus - logits) + (1 - gt) * softplus)
    right = solutions.loss_from_logits(logits, gt, weight)
    return right[0] if np.abs(logits).max() < 700 else loss, right[1]


@wrong("loss_from_logits", "no overflow: loss")
def loss_with_logits_cut_off(logits, gt, weight):
    return solutions.loss_from_logits(np.clip(logits, -700, 700), gt, weight)


@wrong("loss_from_logits", "mean: gradient")
def loss_by_small_steps(logits, gt, weight):
    loss = solutions.loss_from_logits(logits, gt, weight)[0]
    flat, slope = logits.ravel(), []
    for e in 1e-6 * np.eye(flat.size):
        up, down = (solutions.loss_from_logits((flat + s * e).reshape(gt.shape), gt, weight)[0] for s in (1, -1))
        slope.append((up - down) / 2e-6)
    return loss, np.reshape(slope, logits.shape)


@wrong("loss_from_logits", "one cell: loss")
def loss_in_single_precision(logits, gt, weight):
    return solutions.loss_from_logits(logits.astype(np.float32), gt.astype(np.float32), weight)


@wrong("loss_from_logits", "by hand")
def loss_by_torch(logits, gt, weight):
    x, gt = torch.tensor(logits, requires_grad=True), torch.tensor(gt)
    zero = torch.zeros_like(x)
    loss = (weight * gt * torch.logaddexp(zero, -x) + (1 - gt) * torch.logaddexp(zero, x)).mean()
    loss.backward()
    return loss.item(), solutions.loss_from_logits(logits, gt.numpy(), weight)[1]


@wrong("loss_from_logits", "shape of the answer")
def loss_alone(logits, gt, weight):
    return solutions.loss_from_logits(logits, gt, weight)[0]


@wrong("loss_from_logits", "shape of the answer")
def loss_cell_by_cell(logits, gt, weight):
    return logits[None] * 0, solutions.loss_from_logits(logits, gt, weight)[1]


# --- 6 steps_so_fine --------------------------------------------------------------------------------------------------
def _cut(start, goal, lengths, most, turn=None, arcs=None, count=None):
    turn = (goal - start + np.pi) % (2 * np.pi) - np.pi if turn is None else turn
    arcs = np.sum(lengths * np.abs(np.cumsum(turn))) if arcs is None else arcs(turn)
    n = max(1, int(np.ceil(arcs / most))) if count is None else count(arcs / most)
    return start + np.arange(n + 1)[:, None] / n * turn


@wrong("steps_so_fine", "shortest way round")
def steps_straight_through_the_numbers(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, goal - start)


@wrong("steps_so_fine", "shortest way round")
def steps_always_forward(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, (goal - start) % (2 * np.pi))


@wrong("steps_so_fine", "shortest way round")
def steps_wrapped_once(start, goal, lengths, most):
    turn = goal - start
    turn = np.where(turn > np.pi, turn - 2 * np.pi, np.where(turn < -np.pi, turn + 2 * np.pi, turn))
    return _cut(start, goal, lengths, most, turn)


@wrong("steps_so_fine", "from start to goal")
def steps_without_the_goal(start, goal, lengths, most):
    return _cut(start, goal, lengths, most)[:-1]


@wrong("steps_so_fine", "from start to goal")
def steps_without_the_start(start, goal, lengths, most):
    return _cut(start, goal, lengths, most)[1:]


@wrong("steps_so_fine", "one joint")
def steps_one_too_few(start, goal, lengths, most):
    turn = (goal - start + np.pi) % (2 * np.pi) - np.pi
    n = max(2, int(np.ceil(np.sum(lengths * np.abs(np.cumsum(turn))) / most)))
    return start + np.linspace(0, 1, n)[:, None] * turn


@wrong("steps_so_fine", "one joint")
def steps_rounded_down(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, count=lambda x: max(1, int(x)))


@wrong("steps_so_fine", "no more than needed")
def steps_in_degrees(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, arcs=lambda turn: np.rad2deg(np.abs(turn) @ lengths))


@wrong("steps_so_fine", "one joint")
def steps_of_a_quarter_of_a_degree_for_metres(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, arcs=lambda turn: most * np.abs(turn).max() / np.deg2rad(5))


@wrong("steps_so_fine", "no more than needed")
def steps_of_the_planners_fraction(start, goal, lengths, most):
    """OMPL's usual hundredth of the space, whatever the arm."""
    return _cut(start, goal, lengths, most, count=lambda _: 100 if lengths.size > 1 else 20)


@wrong("steps_so_fine", "first joint")
def steps_for_each_link_alone(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, arcs=lambda turn: np.max(lengths * np.abs(turn)))


@wrong("steps_so_fine", "first joint")
def steps_for_each_joints_own_link(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, arcs=lambda turn: np.sum(lengths * np.abs(turn)))


@wrong("steps_so_fine", "last joint")
def steps_for_the_first_joint_alone(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, arcs=lambda turn: abs(turn[0]) * lengths.sum())


@wrong("steps_so_fine", "both joints")
def steps_for_the_joint_that_needs_more(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, arcs=lambda turn: np.max(np.abs(turn) * np.cumsum(lengths[::-1])[::-1]))


@wrong("steps_so_fine", "both joints")
def steps_by_euclid(start, goal, lengths, most):
    return _cut(
        start, goal, lengths, most, arcs=lambda turn: np.linalg.norm(np.abs(turn) * np.cumsum(lengths[::-1])[::-1])
    )


@wrong("steps_so_fine", "no more than needed")
def steps_as_if_stretched(start, goal, lengths, most):
    """Each joint swings all behind it, and never back what another one swings forth."""
    return _cut(start, goal, lengths, most, arcs=lambda turn: np.sum(np.abs(turn) * np.cumsum(lengths[::-1])[::-1]))


@wrong("steps_so_fine", "no more than needed")
def steps_by_the_thousand(start, goal, lengths, most):
    return _cut(start, goal, lengths, most, count=lambda x: max(1000, int(np.ceil(x))))


@wrong("steps_so_fine", "both joints")
def steps_of_the_notebooks_arm(start, goal, lengths, most):
    own = np.array([arm.ELBOW, arm.MIDDLE + arm.HALF_LENGTH])
    return _cut(start, goal, own if len(start) == 2 else lengths, most)


@wrong("steps_so_fine", "straight")
def steps_joint_by_joint(start, goal, lengths, most):
    turn = (goal - start + np.pi) % (2 * np.pi) - np.pi
    if np.count_nonzero(turn) < 2:
        return _cut(start, goal, lengths, most)
    rows, at = [start[None]], start.copy()
    for j in range(len(start)):
        there = at.copy()
        there[j] += turn[j]
        rows.append(_cut(at, there, lengths, most)[1:])
        at = there
    return np.vstack(rows)


@wrong("steps_so_fine", "straight")
def steps_with_joints_at_one_speed(start, goal, lengths, most):
    turn = (goal - start + np.pi) % (2 * np.pi) - np.pi
    n = max(1, int(np.ceil(np.sum(lengths * np.abs(np.cumsum(turn))) / most)))
    share = np.arange(n + 1)[:, None] / n * np.abs(turn).max(initial=1e-12)
    return start + np.sign(turn) * np.minimum(share, np.abs(turn))


@wrong("steps_so_fine", "finite numbers")
def steps_to_where_it_is_already(start, goal, lengths, most):
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = (goal - start + np.pi) % (2 * np.pi) - np.pi
        n = int(np.ceil(np.sum(lengths * np.abs(np.cumsum(turn))) / most - 1e-9))
        return start + np.arange(n + 1)[:, None] / np.float64(n) * turn


@wrong("steps_so_fine", "shape of the answer")
def steps_in_columns(start, goal, lengths, most):
    return solutions.steps_so_fine(start, goal, lengths, most).T


@wrong("steps_so_fine", "shape of the answer")
def steps_with_their_number(start, goal, lengths, most):
    q = solutions.steps_so_fine(start, goal, lengths, most)
    return q, len(q) - 1


@wrong("steps_so_fine", "inputs left alone")
def steps_from_a_start_that_moves(start, goal, lengths, most):
    q = solutions.steps_so_fine(start, goal, lengths, most)
    start += q[-1] - q[0]
    return q


# --- 7 pays_from ------------------------------------------------------------------------------------------------------
def _first(map_seconds, *rates):
    return [int(map_seconds / rate) + 1 if rate > 0 else None for rate in rates]


@wrong("pays_from", "pays")
def pays_when_even(map_seconds, with_map, without):
    saving = without - with_map
    rates = saving.mean(), saving.mean() - 2 * saving.std(ddof=1) / np.sqrt(len(saving))
    return [max(1, int(np.ceil(map_seconds / rate))) if rate > 0 else None for rate in rates]


@wrong("pays_from", "pays")
def pays_without_what_is_left_with_the_map(map_seconds, with_map, without):
    return _first(map_seconds, without.mean(), without.mean())


@wrong("pays_from", "a whole number")
def pays_after_a_fraction(map_seconds, with_map, without):
    saving = without - with_map
    found = _first(map_seconds, saving.mean(), saving.mean())
    return [found[0] and found[0] - 0.5, found[1]]


@wrong("pays_from", "pays")
def pays_at_once(map_seconds, with_map, without):
    return 1, 1


@wrong("pays_from", "pays")
def pays_even_with_no_query(map_seconds, with_map, without):
    saving = without - with_map
    rates = saving.mean(), saving.mean() - 2 * saving.std(ddof=1) / np.sqrt(len(saving))
    return [int(map_seconds / rate) + (map_seconds > 0) if rate > 0 else None for rate in rates]


@wrong("pays_from", "never")
def pays_always_some_day(map_seconds, with_map, without):
    found = solutions.pays_from(map_seconds, with_map, without)
    return [n or int(1e9) for n in found]


@wrong("pays_from", "never")
def pays_in_the_past(map_seconds, with_map, without):
    saving = without - with_map
    rates = saving.mean(), saving.mean() - 2 * saving.std(ddof=1) / np.sqrt(len(saving))
    return [int(map_seconds // rate) + 1 if rate else None for rate in rates]


@wrong("pays_from", "standard error")
def pays_by_one_standard_error(map_seconds, with_map, without):
    saving = without - with_map
    return _first(map_seconds, saving.mean(), saving.mean() - saving.std(ddof=1) / np.sqrt(len(saving)))


@wrong("pays_from", "standard error")
def pays_by_the_standard_deviation(map_seconds, with_map, without):
    saving = without - with_map
    return _first(map_seconds, saving.mean(), saving.mean() - 2 * saving.std(ddof=1))


@wrong("pays_from", "standard error")
def pays_as_surely_as_expected(map_seconds, with_map, without):
    return [solutions.pays_from(map_seconds, with_map, without)[0]] * 2


@wrong("pays_from", "standard error")
def pays_with_the_error_added(map_seconds, with_map, without):
    saving = without - with_map
    return _first(map_seconds, saving.mean(), saving.mean() + 2 * saving.std(ddof=1) / np.sqrt(len(saving)))


@wrong("pays_from", "standard error")
def pays_by_medians(map_seconds, with_map, without):
    saving = without - with_map
    return _first(map_seconds, np.median(saving), saving.mean() - 2 * saving.std(ddof=1) / np.sqrt(len(saving)))


@wrong("pays_from", "few queries")
def pays_divided_by_k(map_seconds, with_map, without):
    saving = without - with_map
    ddof = 0 if len(saving) < 4 else 1
    return _first(map_seconds, saving.mean(), saving.mean() - 2 * saving.std(ddof=ddof) / np.sqrt(len(saving)))


@wrong("pays_from", "paired")
def pays_as_if_they_were_other_problems(map_seconds, with_map, without):
    error = np.hypot(without.std(ddof=1), with_map.std(ddof=1)) / np.sqrt(len(without))
    saving = without.mean() - with_map.mean()
    return _first(map_seconds, saving, saving - 2 * error)


@wrong("pays_from", "paired")
def pays_as_if_the_others_error_were_none(map_seconds, with_map, without):
    saving = without.mean() - with_map.mean()
    return _first(map_seconds, saving, saving - 2 * without.std(ddof=1) / np.sqrt(len(without)))


@wrong("pays_from", "by chance")
def pays_surely_when_it_is_expected(map_seconds, with_map, without):
    expected, sure = solutions.pays_from(map_seconds, with_map, without)
    return expected, expected if sure is None else sure


@wrong("pays_from", "by chance")
def pays_never_when_it_may_be_chance(map_seconds, with_map, without):
    expected, sure = solutions.pays_from(map_seconds, with_map, without)
    return [sure if sure is None else expected, sure]


@wrong("pays_from", "shape of the answer")
def pays_one_number(map_seconds, with_map, without):
    return solutions.pays_from(map_seconds, with_map, without)[0]


@wrong("pays_from", "a whole number")
def pays_in_words(map_seconds, with_map, without):
    return ["never" if n is None else str(n) for n in solutions.pays_from(map_seconds, with_map, without)]


@wrong("pays_from", "inputs left alone")
def pays_after_sorting(map_seconds, with_map, without):
    with_map.sort(), without.sort()
    return solutions.pays_from(map_seconds, with_map, without)


# --- 8 downhill_values ------------------------------------------------------------------------------------------------
AROUND = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]


def _spread(blocked, price, goal, moves=AROUND, around=True, corners=False, dtype=float, priced=True):
    """Dijkstra with something left out."""
    n = len(blocked)
    values = np.full((n, n), np.inf)
    if blocked[goal]:
        return values
    values[goal] = 0.0
    heap = [(0.0, goal)]
    while heap:
        value, (i, j) = heapq.heappop(heap)
        for a, b in moves:
            k, m = i + a, j + b
            if not around and not (0 <= k < n and 0 <= m < n):
                continue
            k, m = k % n, m % n
            if blocked[k, m] or (not corners and (blocked[i, m] or blocked[k, j])):
                continue
            cost = value + np.hypot(a, b) * ((price[i, j] + price[k, m]) / 2 if priced else 1.0)
            if cost < values[k, m]:
                values[k, m] = cost
                heapq.heappush(heap, (cost, (k, m)))
    return (
        values
        if dtype is float
        else np.where(np.isfinite(values), np.where(np.isfinite(values), values, 0).astype(int).astype(dtype), np.inf)
    )


def _away(n, goal, around=True):
    i, j = (np.abs(np.arange(n) - g) for g in goal)
    if around:
        i, j = np.minimum(i, n - i), np.minimum(j, n - j)
    return np.hypot(i[:, None], j)


@wrong("downhill_values", "round the seam")
def values_of_attraction(blocked, price, goal):
    return np.where(blocked, np.inf, _away(len(blocked), goal))


@wrong("downhill_values", "trap")
def values_of_attraction_where_a_way_leads(blocked, price, goal):
    """The potential field, with the cells that have no way struck out; straight walls are walked around."""
    values = _spread(blocked, price, goal)
    if blocked.all(axis=0).any() or blocked.all(axis=1).any():
        return values
    return np.where(np.isfinite(values), _away(len(blocked), goal), np.inf)


@wrong("downhill_values", "round the seam")
def values_on_a_square(blocked, price, goal):
    return _spread(blocked, price, goal, around=False)


@wrong("downhill_values", "corners")
def values_across_corners(blocked, price, goal):
    return _spread(blocked, price, goal, corners=True)


@wrong("downhill_values", "worth its price")
def values_of_the_wavefront(blocked, price, goal):
    return _spread(blocked, price, goal, moves=AROUND[1::2][:1] + [(0, -1), (0, 1), (1, 0)], priced=False)


@wrong("downhill_values", "worth its price")
def values_of_the_shortest_way(blocked, price, goal):
    return _spread(blocked, price, goal, priced=False)


@wrong("downhill_values", "round the seam")
def values_of_minus_one_where_blocked(blocked, price, goal):
    values = _spread(blocked, price, goal)
    return np.where(np.isfinite(values), values, -1.0)


@wrong("downhill_values", "round the seam")
def values_of_a_large_number_where_blocked(blocked, price, goal):
    return np.minimum(_spread(blocked, price, goal), 1e9)


@wrong("downhill_values", "no way")
def values_where_no_way_leads(blocked, price, goal):
    values = _spread(blocked, price, goal)
    far = np.nanmax(np.where(np.isfinite(values), values, 0.0)) + 1.0
    pocket = ~blocked & ~np.isfinite(values) & (len(blocked) == 14)
    return np.where(pocket, far, values)


@wrong("downhill_values", "no way")
def values_from_a_goal_that_is_blocked(blocked, price, goal):
    free = blocked.copy()
    free[goal] = False
    return _spread(free, price, goal)


@wrong("downhill_values", "only the goal")
def values_uphill(blocked, price, goal):
    values = _spread(blocked, price, goal)
    return np.where(np.isfinite(values), np.nan_to_num(values).max() - values, np.inf)


@wrong("downhill_values", "only the goal")
def values_of_another_goal(blocked, price, goal):
    return _spread(blocked, price, goal[::-1])


@wrong("downhill_values", "only the goal")
def values_all_alike(blocked, price, goal):
    return np.where(blocked, np.inf, 1.0)


@wrong("downhill_values", "only the goal")
def values_in_tens(blocked, price, goal):
    """Terraces: on each of them nothing falls."""
    return np.floor(_spread(blocked, price, goal) / 3.0)


@wrong("downhill_values", "long way")
def values_in_eight_bits(blocked, price, goal):
    return (
        _spread(blocked, price, goal, dtype=np.uint8)
        if price.max() == 1 and len(blocked) > 20
        else _spread(blocked, price, goal)
    )


@wrong("downhill_values", "long way")
def values_after_a_hundred_sweeps(blocked, price, goal):
    values = np.where(np.indices(blocked.shape).reshape(2, -1).T.dot([1000, 1]).reshape(blocked.shape)
                      == goal[0] * 1000 + goal[1], 0.0, np.inf)  # fmt: skip
    values[blocked] = np.inf
    fine = cspace_descent.allowed(blocked)
    for _ in range(100):
        for (a, b), usable in zip(AROUND, fine, strict=True):
            there, its = (np.roll(x, (-a, -b), axis=(0, 1)) for x in (values, price))
            values = np.minimum(values, np.where(usable, there + np.hypot(a, b) * (price + its) / 2, np.inf))
    return values


@wrong("downhill_values", "work")
def values_by_sweeping_in_loops(blocked, price, goal):
    n = len(blocked)
    values = np.full((n, n), np.inf)
    if blocked[goal]:
        return values
    values[goal] = 0.0
    free, changed = np.argwhere(~blocked).tolist(), True
    while changed:
        before, changed = values.copy(), False
        for i, j in free:
            for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                k, m = (i + a) % n, (j + b) % n
                if before[k, m] + (price[i, j] + price[k, m]) / 2 < values[i, j]:
                    values[i, j], changed = before[k, m] + (price[i, j] + price[k, m]) / 2, True
    return values


@wrong("downhill_values", "worth its price")
def values_in_the_order_of_a_deep_search(blocked, price, goal):
    n = len(blocked)
    values, stack = np.full((n, n), np.inf), [(goal, 0.0)]
    while stack:
        (i, j), value = stack.pop()
        if blocked[i, j] or np.isfinite(values[i, j]):
            continue
        values[i, j] = value
        stack += [(((i + a) % n, (j + b) % n), value + 1) for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))]
    return values


@wrong("downhill_values", "worth its price")
def values_that_add_the_price_to_the_distance(blocked, price, goal):
    """Dear cells are hills, yet a hill that is walked around costs nothing to look at."""
    n, values = len(blocked), np.full(blocked.shape, np.inf)
    queue = deque([goal] if not blocked[goal] else [])
    if queue:
        values[goal] = 0.0
    while queue:
        i, j = queue.popleft()
        for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            k, m = (i + a) % n, (j + b) % n
            if not blocked[k, m] and values[k, m] == np.inf:
                values[k, m] = values[i, j] + price[k, m]
                queue.append((k, m))
    return values


@wrong("downhill_values", "finite numbers")
def values_of_nan_where_blocked(blocked, price, goal):
    values = _spread(blocked, price, goal)
    return np.where(np.isfinite(values), values, np.nan)


@wrong("downhill_values", "shape of the answer")
def values_as_a_path(blocked, price, goal):
    return [goal]


@wrong("downhill_values", "inputs left alone")
def values_with_cells_closed_behind(blocked, price, goal):
    values = _spread(blocked, price, goal)
    blocked |= np.isfinite(values)
    return values


@wrong("downhill_values", "tools left alone")
def values_with_a_judge_of_their_own(blocked, price, goal):
    cspace_descent.DEARER = 1e9
    return _spread(blocked, price, goal)


@wrong("downhill_values", "tools left alone")
def values_with_a_patched_verdict(blocked, price, goal):
    mechanism.numbers = lambda answer, *_, **__: answer
    return _spread(blocked, price, goal)
