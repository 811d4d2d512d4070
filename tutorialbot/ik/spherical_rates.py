"""The parts of paper 4's eqs (1) and (3) for an S-R-S arm in closed form: plain numbers, no matrix, no library.

s, c: sines and cosines of q1 to q6, counted from 0; vectors are tuples. W is the frame of the wrist: z from shoulder to
wrist, y the elbow's axis.
"""

import math

NEAR = 0.05  # the shoulder's and the wrist's own singularities are damped where a sine is below this


def triangle(s4: float, c4: float, upper: float, lower: float) -> tuple[float, float, float, float, float]:
    """Return r [m], sin and cos of alpha (upper arm to z of W) and of beta = q4 - alpha."""
    r = math.sqrt(upper * upper + lower * lower + 2.0 * upper * lower * c4)
    return r, lower * s4 / r, (upper + lower * c4) / r, upper * s4 / r, (lower + upper * c4) / r


def wrist_axes(s: list[float], c: list[float], sa: float, ca: float) -> tuple[tuple, tuple, tuple]:
    """Return the axes of W in those of the anchor: the columns of R_W = Rz(q1) Ry(q2) Rz(q3) Ry(alpha)."""
    (s1, s2, s3, *_), (c1, c2, c3, *_) = s, c
    x, y, z = c1 * c2 * c3 - s1 * s3, s1 * c2 * c3 + c1 * s3, -s2 * c3
    u, v = c1 * s2, s1 * s2
    return (
        (ca * x - sa * u, ca * y - sa * v, ca * z - sa * c2),
        (-c1 * c2 * s3 - s1 * c3, c1 * c3 - s1 * c2 * s3, s2 * s3),
        (sa * x + ca * u, sa * y + ca * v, sa * z + ca * c2),
    )


def wrist_twist(axes: tuple, hand: tuple, twist: list[float]) -> tuple[tuple, tuple]:
    """Return velocity [m/s] and angular velocity [rad/s] of the wrist in W; hand: from wrist to tip, in W [m]."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes
    vx, vy, vz, wx, wy, wz = twist
    hx, hy, hz = hand
    w_x, w_y, w_z = xx * wx + xy * wy + xz * wz, yx * wx + yy * wy + yz * wz, zx * wx + zy * wy + zz * wz
    p_x = xx * vx + xy * vy + xz * vz - w_y * hz + w_z * hy
    p_y = yx * vx + yy * vy + yz * vz - w_z * hx + w_x * hz
    p_z = zx * vx + zy * vy + zz * vz - w_x * hy + w_y * hx
    return (p_x, p_y, p_z), (w_x, w_y, w_z)


def shoulder_map(s: list[float], c: list[float], sa: float, ca: float) -> tuple[tuple, tuple, tuple]:
    """Return the rows a_x, a_y, a_z of A_W: qdot_1 to qdot_3 -> angular velocity in W."""
    s2, s3, c2, c3 = s[1], s[2], c[1], c[2]
    return (
        (-ca * s2 * c3 - sa * c2, ca * s3, -sa),
        (s2 * s3, c3, 0.0),
        (ca * c2 - sa * s2 * c3, sa * s3, ca),
    )


def least_rates(a_x: tuple, a_y: tuple, along_x: float, along_y: float, n_n: float) -> tuple[float, float, float]:
    """Return the least qdot_1 to qdot_3 with a_x . qdot = along_x and a_y . qdot = along_y: J_mod^+ of eq (1).

    n_n = |a_x x a_y|^2, made larger where the shoulder is singular.
    """
    (x1, x2, x3), (y1, y2, _) = a_x, a_y
    x_x, x_y, y_y = x1 * x1 + x2 * x2 + x3 * x3, x1 * y1 + x2 * y2, y1 * y1 + y2 * y2
    k_x, k_y = (y_y * along_x - x_y * along_y) / n_n, (x_x * along_y - x_y * along_x) / n_n
    return k_x * x1 + k_y * y1, k_x * x2 + k_y * y2, k_x * x3


def wrist_rates_b(
    f: tuple, m: float, s: list[float], c: list[float], sb: float, cb: float, swivel_rate: float
) -> tuple[float, float, float, float, bool]:
    """Return b_sm, qdot_5 to qdot_7, the least with (A_W n_sm, A_w)(b_sm, qdot_w) = f, and whether it is damped.

    f: angular velocity in W that is left [rad/s]; m: how far the unit vector of n_sm turns W about its z. The three
    equations, seen from behind joint 5, with u, v, w = m Rz(-q5) Ry(-beta) e_z:

        u b_sm + sin(q6) qdot_7 = f_x,    v b_sm + qdot_6 = f_y,    w b_sm + qdot_5 + cos(q6) qdot_7 = f_z

    What solves them with f = 0 is the arm's self motion; `swivel_rate` [rad/s] is added along it.
    """
    f_x, f_y, f_z = behind_joint_5(f, s, c, sb, cb)
    s6, c6 = s[5], c[5]
    u, v, w = -m * sb * c[4], m * sb * s[4], m * cb
    size = u * u + s6 * s6
    safe = damped(size)
    b_sm, qdot_7 = u * f_x / safe, s6 * f_x / safe
    qdot_6, qdot_5 = f_y - v * b_sm, f_z - w * b_sm - c6 * qdot_7
    n_sm, n_5, n_6, n_7 = s6, c6 * u - w * s6, -v * s6, -u
    length = n_sm * n_sm + n_5 * n_5 + n_6 * n_6 + n_7 * n_7
    turn = m * n_sm  # of W about its z, when the self motion is n
    k = swivel_rate * turn / (turn * turn + NEAR * NEAR * length) if swivel_rate else 0.0
    if length > 0.0:
        k -= (b_sm * n_sm + qdot_5 * n_5 + qdot_6 * n_6 + qdot_7 * n_7) / length
    return b_sm + k * n_sm, qdot_5 + k * n_5, qdot_6 + k * n_6, qdot_7 + k * n_7, safe != size


def wrist_rates_a(
    f: tuple, m: float, s: list[float], c: list[float], sb: float, cb: float, swivel_rate: float
) -> tuple[float, float, float, float, bool]:
    """Return the same with the self motion given, qdot_w = A_w^-1 (f - A_W n_sm b_sm): infinite where q6 = 0."""
    b_sm = swivel_rate / m if swivel_rate and m else 0.0
    f_x, f_y, f_z = behind_joint_5((f[0], f[1], f[2] - m * b_sm), s, c, sb, cb)
    qdot_7 = f_x / s[5] if s[5] else math.copysign(math.inf, f_x)
    return b_sm, f_z - c[5] * qdot_7, f_y, qdot_7, False


def behind_joint_5(f: tuple, s: list[float], c: list[float], sb: float, cb: float) -> tuple[float, float, float]:
    """Return Rz(-q5) Ry(-beta) f: what is given in W, seen from behind joint 5."""
    x, y, z = cb * f[0] - sb * f[2], f[1], sb * f[0] + cb * f[2]
    return c[4] * x + s[4] * y, c[4] * y - s[4] * x, z


def damped(square: float) -> float:
    """Return a squared sine that stays above NEAR^2 / 4, so that what it divides stays finite; the same beyond NEAR."""
    near = NEAR * NEAR
    return square if square >= near else square + 0.25 * near * (1.0 - square / near) ** 2
