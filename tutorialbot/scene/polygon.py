"""Polygons on the floor: corners (k, 2) [m], in order, the last joined to the first."""

import numpy as np

from tutorialbot.errors import InvalidValue, finite_array

TOUCH = 1e-9  # what is closer than this [m] to an edge lies on it


def checked(argument: str, polygon: np.ndarray) -> np.ndarray:
    """Return the corners (k, 2) [m] counterclockwise, or raise InvalidValue or InvalidType that names the fault."""
    corners = finite_array(argument, polygon, (-1, 2))
    if len(corners) < 3:
        raise InvalidValue(argument, f"{len(corners)} corners", "three corners or more")
    edges = np.roll(corners, -1, axis=0) - corners
    if (np.linalg.norm(edges, axis=1) < TOUCH).any():
        raise InvalidValue(argument, polygon, "corners that differ from their neighbours")
    crossing = crossed_edges(corners)
    if crossing is not None:
        raise InvalidValue(argument, polygon, "a polygon that does not cross or touch itself "
                           f"(edges {crossing[0]} and {crossing[1]} meet)")  # fmt: skip
    return corners if area(corners) > 0.0 else corners[::-1].copy()


def area(corners: np.ndarray) -> float:
    """Return the area [m^2], positive when the corners go counterclockwise (shoelace formula)."""
    (x, y), (u, v) = corners.T, np.roll(corners, -1, axis=0).T
    return float(0.5 * (x * v - u * y).sum())


def crossed_edges(corners: np.ndarray) -> tuple[int, int] | None:
    """Return the numbers of two edges that meet elsewhere than at a common corner, None when the polygon is simple."""
    n, after = len(corners), np.roll(corners, -1, axis=0)
    for i in range(n):
        for j in range(i + 1, n):
            a, b, c, d = corners[i], after[i], corners[j], after[j]
            if j in (i + 1, i + n - 1):  # neighbours: they may share a corner, but not turn back over each other
                shared, one, other = (b, a, d) if j == i + 1 else (a, b, c)
                if abs(_cross(one - shared, other - shared)) < TOUCH and (one - shared) @ (other - shared) > 0.0:
                    return i, j
            elif segments_meet(a, b, c, d):
                return i, j
    return None


def segments_meet(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, *, properly: bool = False) -> bool:
    """Return whether the segments ab and cd, ends (2,), share a point; `properly`: whether they cross inside both."""
    ab, cd = (b - a) / np.linalg.norm(b - a), (d - c) / np.linalg.norm(d - c)
    sides = np.array([[_cross(ab, c - a), _cross(ab, d - a)], [_cross(cd, a - c), _cross(cd, b - c)]])  # distances
    if properly:
        return bool((sides.min(axis=1) < -TOUCH).all() and (sides.max(axis=1) > TOUCH).all())
    if (np.abs(sides) < TOUCH).all():  # all on one line
        along = int(np.abs(ab).argmax())
        low, high = sorted((c[along], d[along]))
        return bool(max(a[along], b[along]) >= low - TOUCH and min(a[along], b[along]) <= high + TOUCH)
    return bool((sides.min(axis=1) < TOUCH).all() and (sides.max(axis=1) > -TOUCH).all())


def distance_to_edges(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return how far each of points (n, 2) is from the nearest edge, (n,) [m], inside and outside alike."""
    edges = np.roll(corners, -1, axis=0) - corners
    away = points[:, None] - corners
    share = np.clip((away * edges).sum(-1) / (edges * edges).sum(-1), 0.0, 1.0)
    return np.linalg.norm(away - share[..., None] * edges, axis=-1).min(axis=1)


def contains(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return whether each of points (n, 2) lies inside or on an edge, (n,): how often a ray to the right crosses."""
    (x, y), (u, v) = corners.T, np.roll(corners, -1, axis=0).T
    px, py = points[:, :1], points[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = ((y > py) != (v > py)) & (px < x + (py - y) * (u - x) / (v - y))
    return (crossing.sum(axis=1) % 2 == 1) | (distance_to_edges(corners, points) <= TOUCH)


def contains_polygon(corners: np.ndarray, other: np.ndarray) -> bool:
    """Return whether the polygon `other` (m, 2) lies inside; it may touch the edges from within."""
    middles = 0.5 * (other + np.roll(other, -1, axis=0))
    if not contains(corners, np.concatenate([other, middles])).all():
        return False
    for c, d in zip(other, np.roll(other, -1, axis=0), strict=True):
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if segments_meet(a, b, c, d, properly=True):
                return False
    return not (contains(other, corners) & (distance_to_edges(other, corners) > TOUCH)).any()


def triangles(corners: np.ndarray) -> np.ndarray:
    """Return the polygon cut into triangles, (k - 2, 3) numbers of corners: ear after ear is cut off.

    corners: (k, 2), simple and counterclockwise.
    """
    left, cut = list(range(len(corners))), []
    while len(left) > 3:
        for place in range(len(left)):
            a, b, c = left[place - 1], left[place], left[(place + 1) % len(left)]
            others = corners[[i for i in left if i not in (a, b, c)]]
            if _cross(corners[b] - corners[a], corners[c] - corners[b]) > TOUCH**2 and not _within(
                corners[[a, b, c]], others
            ):
                cut.append((a, b, c))
                left.pop(place)
                break
        else:  # nothing but corners on straight lines is left: one of them goes
            left.pop()
    return np.array([*cut, tuple(left)])


def turns_left(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> bool:
    """Return whether the way a, b, c, (2,) each, turns left at b: there a counterclockwise polygon juts out."""
    return _cross(b - a, c - b) > 0.0


def _within(triangle: np.ndarray, points: np.ndarray) -> bool:
    """Whether any of points (n, 2) lies in a counterclockwise triangle (3, 2), its edges included."""
    edges = np.roll(triangle, -1, axis=0) - triangle
    away = points[:, None] - triangle
    return bool((edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] >= -(TOUCH**2)).all(axis=1).any())


def _cross(u: np.ndarray, v: np.ndarray) -> float:
    return float(u[0] * v[1] - u[1] * v[0])
