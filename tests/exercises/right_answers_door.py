"""Answers to notebook 1's exercises that differ from ours and are as right."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from tests.exercises.planting import right_into
from tutorialbot.bo.objective import new_pose_cost
from tutorialbot.bo.space import from_sphere
from tutorialbot.pose import so4_distance_seen_from
from tutorialbot.scene.control import Caster, to_twist

RIGHT = []  # (function, exercise)
right = right_into(RIGHT)


# --- 2 two_numbers ----------------------------------------------------------------------------------------------------
@right("two_numbers")
def numbers_with_the_other_end_of_the_seam(v):
    a = 1.0 - np.arctan2(v[1], -v[0]) / np.pi  # from 0 to 2, and -0.0 the other way round
    return (a - 2.0 if a >= 1.0 else a), v[2] / np.linalg.norm(v)


@right("two_numbers")
def numbers_with_any_azimuth_at_a_pole(v):
    x, y, z = v / np.linalg.norm(v)
    ring = np.hypot(x, y)
    return np.copysign(np.arccos(x / ring) / np.pi, y) if ring > 0 else 0.7, z


@right("two_numbers")
def numbers_by_complex_and_polar_angle(v):
    return np.angle(v[0] + 1j * v[1]) / np.pi, np.cos(np.arctan2(np.hypot(v[0], v[1]), v[2]))


@right("two_numbers")
def numbers_as_a_list_of_the_package(v):
    return list(from_sphere(v))


# --- 6 mended_cost ----------------------------------------------------------------------------------------------------
@right("mended_cost")
def cost_of_the_package(t_c, settled, path):
    return new_pose_cost(t_c, path[-1], settled, SimpleNamespace(poses=path, sections_done=len(path) - 1))


@right("mended_cost")
def cost_by_a_loop_and_the_closed_formula(t_c, settled, path):
    new, furthest = np.inf, 0.0
    for pose in path:
        theta = np.linalg.norm(pin.log3(pose.rotation.T @ settled.rotation))
        psi = np.arctan(np.linalg.norm(pose.translation - settled.translation) / 0.1)
        new = min(new, 2 * np.sqrt(max(0.0, 1 - abs(np.cos(theta / 2) * np.cos(psi / 2)))))
        furthest = max(furthest, np.linalg.norm(pose.translation - path[0].translation))
    if new < 0.1:
        return 5 - t_c
    if np.linalg.norm(settled.translation - path[0].translation) < furthest - 0.06:
        return 5 - t_c
    return -(t_c + 10 * new)


# --- 7 distance_seen_from ---------------------------------------------------------------------------------------------
@right("distance_seen_from")
def distance_of_the_package(frame, a, b):
    return so4_distance_seen_from(frame, a, b)


def by_matrices(pose, sign=1.0):
    """G and H, w last, with quaternions as 4 x 4 matrices that multiply from the left."""
    d = pose.translation
    half = np.arctan2(np.linalg.norm(d), 0.1) / 2
    x, y, z = np.sin(half) * d / max(np.linalg.norm(d), 1e-15)
    turned = np.array([[0, -z, y, x], [z, 0, -x, y], [-y, x, 0, z], [-x, -y, -z, 0]])
    q = sign * Rotation.from_matrix(pose.rotation).as_quat(canonical=True)
    return np.concatenate([np.cos(half) * q + turned @ q, np.cos(half) * q - turned @ q])


@right("distance_seen_from")
def distance_with_quaternions_of_scipy(frame, a, b):
    u, v = by_matrices(frame.actInv(a)), by_matrices(frame.actInv(b))
    return min(np.linalg.norm(u - v), np.linalg.norm(u + v))


@right("distance_seen_from")
def distance_with_the_other_sign_of_a_quaternion(frame, a, b):
    u, v = by_matrices(frame.actInv(a), -1.0), by_matrices(frame.actInv(b))
    return np.sqrt(max(0.0, 4 - 2 * abs(u @ v)))


@right("distance_seen_from")
def distance_from_a_frame_that_is_moved_but_not_turned(frame, a, b):
    """Turning the frame changes nothing: both 8-vectors are turned alike."""
    u, v = (by_matrices(pin.SE3(pose.rotation, pose.translation - frame.translation)) for pose in (a, b))
    return min(np.linalg.norm(u - v), np.linalg.norm(u + v))


# --- 8 base_twist -----------------------------------------------------------------------------------------------------
@right("base_twist")
def twist_of_the_package(steer, turning, rolling, x, y, offset, radius):
    casters = [Caster(*map(float, measures)) for measures in zip(x, y, offset, radius, strict=True)]
    twist, slip = to_twist(casters, steer, turning, rolling)
    return [*twist, slip]


@right("base_twist")
def twist_by_the_velocities_of_the_wheels_centres(steer, turning, rolling, x, y, offset, radius):
    rows, known = [], []
    for phi, turn, roll, px, py, b, r in zip(steer, turning, rolling, x, y, offset, radius, strict=True):
        h, n = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        cx, cy = np.array([px, py]) - b * h
        rows += [[1, 0, -cy], [0, 1, cx]]
        known += list(r * roll * h + b * turn * n)
    twist = np.linalg.pinv(rows) @ known
    return (*twist, np.sqrt(np.sum((np.array(rows) @ twist - known) ** 2)))


@right("base_twist")
def twist_by_the_normal_equations(steer, turning, rolling, x, y, offset, radius):
    c, s = np.cos(steer), np.sin(steer)
    a = np.block([[c, -s], [s, c], [x * s - y * c, y * s + x * c - offset]]).T
    m = np.hstack([radius * rolling, offset * turning])
    twist = np.linalg.solve(a.T @ a, a.T @ m)
    return np.array([*twist, np.linalg.norm(m - a @ twist)])
