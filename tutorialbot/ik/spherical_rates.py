"""Eqs (1) and (3) of paper 4 for an S-R-S arm in closed form: plain numbers, and a matrix only where they are damped.

s, c: sines and cosines of q1 to q7, counted from 0; sides: what `triangle` returns; vectors are tuples. W is the frame
of the wrist: z from shoulder to wrist, y the elbow's axis. Nothing is checked here.
"""

import math

import numpy as np

NEAR = 0.05  # the shoulder's and the wrist's own singularities are damped where a sine is below this


def triangle(s4: float, c4: float, upper: float, lower: float) -> tuple[float, float, float, float, float]:
    """Return r [m], sin and cos of alpha (upper arm to z of W), and of beta = q4 - alpha (z of W to lower arm)."""
    r = math.sqrt(upper * upper + lower * lower + 2.0 * upper * lower * c4)
    return r, lower * s4 / r, (upper + lower * c4) / r, upper * s4 / r, (lower + upper * c4) / r


def wrist_axes(s: list[float], c: list[float], sides: tuple) -> tuple[tuple, tuple, tuple]:
    """Return the axes of W in those of the anchor: the columns of R_W = Rz(q1) Ry(q2) Rz(q3) Ry(alpha)."""
    (s1, s2, s3, *_), (c1, c2, c3, *_), (_, sa, ca, _, _) = s, c, sides
    x, y, z = c1 * c2 * c3 - s1 * s3, s1 * c2 * c3 + c1 * s3, -s2 * c3
    u, v = c1 * s2, s1 * s2
    return (
        (ca * x - sa * u, ca * y - sa * v, ca * z - sa * c2),
        (-c1 * c2 * s3 - s1 * c3, c1 * c3 - s1 * c2 * s3, s2 * s3),
        (sa * x + ca * u, sa * y + ca * v, sa * z + ca * c2),
    )


def hand(s: list[float], c: list[float], sides: tuple, length: float) -> tuple[float, float, float]:
    """Return the way from the wrist to the tip, `length` [m] long, in W: Ry(beta) Rz(q5) Ry(q6) e_z."""
    _, _, _, sb, cb = sides
    x, y, z = c[4] * s[5], s[4] * s[5], c[5]
    return length * (cb * x + sb * z), length * y, length * (cb * z - sb * x)


def wrist_twist(axes: tuple, hand: tuple, twist: list[float]) -> tuple[tuple, tuple]:
    """Return velocity p [m/s] and angular velocity omega [rad/s] of the wrist in W, from the twist of the tip."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes
    vx, vy, vz, wx, wy, wz = twist
    hx, hy, hz = hand
    w_x, w_y, w_z = xx * wx + xy * wy + xz * wz, yx * wx + yy * wy + yz * wz, zx * wx + zy * wy + zz * wz
    p_x = xx * vx + xy * vy + xz * vz - w_y * hz + w_z * hy
    p_y = yx * vx + yy * vy + yz * vz - w_z * hx + w_x * hz
    p_z = zx * vx + zy * vy + zz * vz - w_x * hy + w_y * hx
    return (p_x, p_y, p_z), (w_x, w_y, w_z)


def joint_rates(
    s: list[float], c: list[float], sides: tuple, upper: float, lower: float, wanted: tuple,
    swivel_rate: float = 0.0, wrist: str = "B",
) -> tuple[tuple, float, bool]:  # fmt: skip
    """Return qdot_1 to qdot_7, the self motion b_sm [rad/s], and whether a singularity is damped: eqs (1) and (3).

    wanted: p_x, p_y, p_z / sin q4 [m/s] and omega [rad/s] in W, all of them already times b.
    """
    p_x, p_y, p_z_over_sine, w_x, w_y, w_z = wanted
    r, _, _, sb, cb = sides
    a_x, a_y, a_z = shoulder_map(s, c, sides)

    # (1) qdot_p = b (J_mod^+ (p_x, p_y) + n_z p_z) + b_sm n_sm, J_mod = r (a_y, -a_x); b_sm comes with (3)
    q4 = -r / (upper * lower) * p_z_over_sine  # the virtual prismatic joint
    along_x, along_y = -p_y / r, (p_x - lower * cb * q4) / r  # what a_x . qdot and a_y . qdot have to be
    n_sm = cross(a_x, a_y)
    square = n_sm[0] ** 2 + n_sm[1] ** 2 + n_sm[2] ** 2
    length = math.sqrt(square)
    m = -s[1] / length if length else 0.0  # A_W n_sm = (0, 0, m), n_sm from here on as a unit vector
    n_sm = (n_sm[0] / length, n_sm[1] / length, n_sm[2] / length) if length else (0.0, 0.0, 0.0)
    damping = max(damping_at(square), damping_at(wrist_square(m, s, c, sides)) if wrist == "B" else 0.0)
    if damping:
        angular = (w_x, w_y - q4, w_z)
        rates, b_sm = damped_rates((a_x, a_y, a_z), s, c, sides, (along_x, along_y, *angular), n_sm, damping)
        return (*rates[:3], q4, *rates[3:]), b_sm, True
    q1, q2, q3 = least_rates(a_x, a_y, along_x, along_y, square)

    # (3) (b_sm, qdot_w) = (A_W n_sm, A_w)^+ (b omega - omega_F)
    f = (w_x - along_x, w_y - along_y - q4, w_z - (a_z[0] * q1 + a_z[1] * q2 + a_z[2] * q3))
    solve = wrist_rates_b if wrist == "B" else wrist_rates_a
    b_sm, q5, q6, q7 = solve(behind_joint_5(f, s, c, sides), m, s, c, sides, swivel_rate)
    return (q1 + b_sm * n_sm[0], q2 + b_sm * n_sm[1], q3 + b_sm * n_sm[2], q4, q5, q6, q7), b_sm, False


def shoulder_map(s: list[float], c: list[float], sides: tuple) -> tuple[tuple, tuple, tuple]:
    """Return the rows a_x, a_y, a_z of A_W: qdot_1 to qdot_3 -> angular velocity in W."""
    (_, s2, s3, *_), (_, c2, c3, *_), (_, sa, ca, _, _) = s, c, sides
    return (
        (-ca * s2 * c3 - sa * c2, ca * s3, -sa),
        (s2 * s3, c3, 0.0),
        (ca * c2 - sa * s2 * c3, sa * s3, ca),
    )


def least_rates(a_x: tuple, a_y: tuple, along_x: float, along_y: float, square: float) -> tuple[float, float, float]:
    """Return the least qdot_1 to qdot_3 with a_x . qdot = along_x and a_y . qdot = along_y: J_mod^+ of eq (1).

    square: |a_x x a_y|^2.
    """
    (x1, x2, x3), (y1, y2, _) = a_x, a_y
    x_x, x_y, y_y = x1 * x1 + x2 * x2 + x3 * x3, x1 * y1 + x2 * y2, y1 * y1 + y2 * y2
    k_x, k_y = (y_y * along_x - x_y * along_y) / square, (x_x * along_y - x_y * along_x) / square
    return k_x * x1 + k_y * y1, k_x * x2 + k_y * y2, k_x * x3


def wrist_rates_b(
    f: tuple, m: float, s: list[float], c: list[float], sides: tuple, swivel_rate: float
) -> tuple[float, float, float, float]:
    """Return b_sm, qdot_5 to qdot_7, the least with (A_W n_sm, A_w)(b_sm, qdot_w) = f.

    f: angular velocity that is left, seen from behind joint 5 [rad/s]; m: how far the unit vector of n_sm turns W about
    its z. The three equations, with (u, v, w) = m Rz(-q5) Ry(-beta) e_z:

        u b_sm + sin(q6) qdot_7 = f_x,    v b_sm + qdot_6 = f_y,    w b_sm + qdot_5 + cos(q6) qdot_7 = f_z

    What solves them with f = 0 is the arm's self motion; `swivel_rate` [rad/s] is added along it.
    """
    f_x, f_y, f_z = f
    s6, c6, (_, _, _, sb, cb) = s[5], c[5], sides
    u, v, w = -m * sb * c[4], m * sb * s[4], m * cb
    square = u * u + s6 * s6
    b_sm, q7 = u * f_x / square, s6 * f_x / square
    q6, q5 = f_y - v * b_sm, f_z - w * b_sm - c6 * q7
    n_sm, n_5, n_6, n_7 = s6, c6 * u - w * s6, -v * s6, -u
    length = n_sm * n_sm + n_5 * n_5 + n_6 * n_6 + n_7 * n_7
    k = -(b_sm * n_sm + q5 * n_5 + q6 * n_6 + q7 * n_7) / length
    if swivel_rate:
        turn = m * n_sm  # of W about its z, when the self motion is n
        k += swivel_rate * turn / (turn * turn + NEAR * NEAR * length) * fading(square)
    return b_sm + k * n_sm, q5 + k * n_5, q6 + k * n_6, q7 + k * n_7


def wrist_rates_a(
    f: tuple, m: float, s: list[float], c: list[float], sides: tuple, swivel_rate: float
) -> tuple[float, float, float, float]:
    """Return the same with the self motion given, qdot_w = A_w^-1 (f - A_W n_sm b_sm): infinite where q6 = 0."""
    _, _, _, sb, cb = sides
    b_sm = swivel_rate / m if swivel_rate and m else 0.0
    f_x, f_y, f_z = f[0] + m * sb * c[4] * b_sm, f[1] - m * sb * s[4] * b_sm, f[2] - m * cb * b_sm
    q7 = f_x / s[5] if s[5] else math.copysign(math.inf, f_x) if f_x else 0.0
    return b_sm, f_z - c[5] * q7, f_y, q7


def wrist_square(m: float, s: list[float], c: list[float], sides: tuple) -> float:
    """Return u^2 + sin^2(q6) of `wrist_rates_b`: zero where the wrist is singular together with the self motion."""
    u = m * sides[3] * c[4]
    return u * u + s[5] * s[5]


def damped_rates(
    turning: tuple, s: list[float], c: list[float], sides: tuple, wanted: tuple, n_sm: tuple, damping: float
) -> tuple[tuple, float]:
    """Return qdot_1 to qdot_3, qdot_5 to qdot_7 [rad/s] and b_sm near a singularity of shoulder or wrist: damped.

    turning: the rows of A_W; wanted: a_x . qdot, a_y . qdot and the angular velocity in W without that of q4 [rad/s].
    """
    _, _, _, sb, cb = sides
    x, y, z = c[4] * s[5], s[4] * s[5], c[5]  # axis of joint 7, seen from behind joint 5
    matrix = np.zeros((5, 6))
    matrix[:2, :3], matrix[2:, :3] = turning[:2], turning
    matrix[2:, 3:] = (
        (sb, -cb * s[4], cb * x + sb * z),
        (0.0, c[4], y),
        (cb, sb * s[4], cb * z - sb * x),
    )
    rates = matrix.T @ np.linalg.solve(matrix @ matrix.T + damping * np.eye(5), np.array(wanted))
    return tuple(rates.tolist()), float(rates[:3] @ np.array(n_sm))


def behind_joint_5(f: tuple, s: list[float], c: list[float], sides: tuple) -> tuple[float, float, float]:
    """Return Rz(-q5) Ry(-beta) f: what is given in W, seen from behind joint 5."""
    _, _, _, sb, cb = sides
    x, y, z = cb * f[0] - sb * f[2], f[1], sb * f[0] + cb * f[2]
    return c[4] * x + s[4] * y, c[4] * y - s[4] * x, z


def damping_at(square: float) -> float:
    """Return the squared damping for a squared sine: (NEAR / 2)^2 where it is 0, fading out, and none from NEAR on."""
    near = NEAR * NEAR
    return 0.25 * near * (1.0 - square / near) ** 2 if square < near else 0.0


def fading(square: float) -> float:
    """Return how much of the swivel's turn is asked for: none where a singularity is damped, all from 2 NEAR on."""
    near = NEAR * NEAR
    return min(1.0, max(0.0, (square / near - 1.0) / 3.0))


def cross(a: tuple, b: tuple) -> tuple[float, float, float]:
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
