"""Outlines on the floor: corners (k, 2) [m], in order, the last joined to the first."""

import numpy as np
import shapely

from tutorialbot.errors import InvalidValue, finite_array

TOUCH = 1e-9  # corners closer than this [m] are one


def checked(argument: str, corners: np.ndarray) -> np.ndarray:
    """Return the corners (k, 2) [m] counterclockwise, or raise InvalidValue or InvalidType that names the fault."""
    corners = finite_array(argument, corners, (-1, 2))
    if len(corners) < 3:
        raise InvalidValue(argument, f"{len(corners)} corners", "three corners or more")
    if (np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1) < TOUCH).any():
        raise InvalidValue(argument, corners.tolist(), "corners that differ from their neighbours")
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid or polygon.area < TOUCH:
        why = shapely.is_valid_reason(polygon) if not polygon.is_valid else "no area"
        raise InvalidValue(argument, corners.tolist(), f"a polygon that does not cross or touch itself ({why})")
    return corners if polygon.exterior.is_ccw else corners[::-1].copy()


def triangles(corners: np.ndarray) -> np.ndarray:
    """Return a simple polygon (k, 2) cut into triangles, (k - 2, 3) numbers of corners, counterclockwise."""
    cut = shapely.constrained_delaunay_triangles(shapely.Polygon(corners)).geoms
    points = np.array([shapely.get_coordinates(shapely.orient_polygons(piece))[:3] for piece in cut])
    return np.linalg.norm(points[:, :, None] - corners, axis=-1).argmin(axis=-1)
