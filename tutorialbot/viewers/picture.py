"""A still picture of recorded commands, drawn with numpy alone: it needs no GL, no browser and no display."""

import io

import numpy as np
from PIL import Image

from tutorialbot.viewers.log import Key
from tutorialbot.viewers.solids import Solid, solids

TOP, BOTTOM = np.array([0.97, 0.975, 0.985]), np.array([0.8, 0.825, 0.86])  # background
SAMPLES = 2  # pixels are drawn this many times finer in each direction and averaged


class _Canvas:
    """A colour and a depth picture (inverse distance: larger is nearer) of width x height."""

    def __init__(self, width: int, height: int):
        share = np.linspace(0.0, 1.0, height)[:, None, None]
        self.colour = np.broadcast_to((1 - share) * TOP + share * BOTTOM, (height, width, 3)).copy()
        self.near = np.zeros((height, width))

    def fill(self, points: np.ndarray, near: np.ndarray, shades: np.ndarray, alpha: float = 1.0) -> None:
        """Fill triangles, nearest wins: pixel points (m, 3, 2), inverse distances (m, 3), colours (m, 3, 3)."""
        height, width = self.near.shape
        low = np.floor(points.min(1)).clip(0, (width, height)).astype(int)
        size = (np.ceil(points.max(1)).clip(0, (width, height)).astype(int) - low).max(1)
        edge_b, edge_c = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
        area = edge_b[:, 0] * edge_c[:, 1] - edge_b[:, 1] * edge_c[:, 0]
        good = (size > 0) & (np.abs(area) > 1e-9) & (near.min(1) > 0.0)
        smallest, reach = 0, 4
        while smallest < max(width, height):  # triangles of like size together, as windows of reach x reach pixels
            chosen = np.flatnonzero(good & (size > smallest) & (size <= reach))
            many = max(1, 2_000_000 // reach**2)
            for start in range(0, len(chosen), many):
                some = chosen[start : start + many]
                self._windows(points[some], near[some], shades[some], area[some], low[some], reach, alpha)
            smallest, reach = reach, 2 * reach

    def _windows(self, points, near, shades, area, low, reach: int, alpha: float) -> None:
        height, width = self.near.shape
        x = low[:, 0, None, None] + np.arange(reach)
        y = low[:, 1, None, None] + np.arange(reach)[:, None]
        (ax, ay), (bx, by), (cx, cy) = points.transpose(1, 2, 0)[..., None, None]
        u = ((by - cy) * (x + 0.5 - cx) + (cx - bx) * (y + 0.5 - cy)) / area[:, None, None]
        v = ((cy - ay) * (x + 0.5 - cx) + (ax - cx) * (y + 0.5 - cy)) / area[:, None, None]
        which, row, column = np.nonzero((u >= 0) & (v >= 0) & (u + v <= 1) & (x < width) & (y < height))
        weights = np.stack([u[which, row, column], v[which, row, column]], -1)
        weights = np.concatenate([weights, 1.0 - weights.sum(1, keepdims=True)], 1)
        depth = (weights * near[which]).sum(1)
        pixel = y[which, row, 0] * width + x[which, 0, column]
        order = np.argsort(depth, kind="stable")
        winner = np.full(height * width, -1)
        winner[pixel[order]] = order  # of several on one pixel the last written, the nearest, stays
        order = winner[winner >= 0]
        order = order[depth[order] > self.near.ravel()[pixel[order]]]
        colour = np.einsum("ij,ijk->ik", weights[order], shades[which[order]])
        flat, target = self.colour.reshape(-1, 3), pixel[order]
        flat[target] = alpha * colour + (1.0 - alpha) * flat[target]
        if alpha > 0.95:
            self.near.reshape(-1)[target] = depth[order]


def _shaded(normals: np.ndarray, rgba: np.ndarray, view: dict) -> np.ndarray:
    """Return the colour (n, 3) of surfaces with unit `normals` (n, 3) under the lights of `view`."""
    light = 0.47 + 0.06 * normals[:, 2:3]
    for direction, strength in ((view["key"], 0.5), (view["fill"], 0.18)):
        light = light + strength * np.clip(normals @ np.array(direction), 0.0, None)[:, None]
    return np.clip(light * rgba[:3], 0.0, 1.0)


class _Camera:
    def __init__(self, eye, target, field_of_view: float, width: int, height: int):
        forward = np.asarray(target, float) - eye
        forward = forward / max(np.linalg.norm(forward), 1e-9)
        side = np.cross(forward, [0.0, 0.0, 1.0])
        side = side / np.linalg.norm(side) if np.linalg.norm(side) > 1e-6 else np.array([0.0, -1.0, 0.0])
        self.eye, self.axes = np.asarray(eye, float), np.stack([side, np.cross(side, forward), forward])
        self.scale, self.middle = 0.5 * height / np.tan(field_of_view / 2), np.array([width, height]) / 2

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return pixel points (n, 2) and inverse distances (n,); what is behind the eye has a distance <= 0."""
        x, y, z = self.axes @ (points - self.eye).T
        near = np.where(z > 1e-3, 1.0 / np.maximum(z, 1e-3), -1.0)
        return self.middle + self.scale * np.stack([x * near, -y * near], -1), near


def _faces(camera: _Camera, solid: Solid, view: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the triangles of a solid for the canvas: pixel points, inverse distances, colours of the corners."""
    points, near = camera.project(solid.vertices)
    corners = solid.vertices[solid.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    away = np.einsum("ij,ij->i", flat, corners[:, 0] - camera.eye) > 0.0
    flat[away] *= -1.0
    shades = np.repeat(_shaded(flat, solid.rgba, view)[:, None], 3, 1)
    if solid.normals is not None:
        shades = np.where(away[:, None, None], shades, _shaded(solid.normals, solid.rgba, view)[solid.faces])
    front = ~away | (solid.rgba[3] >= 1.0)  # of a ghost only the side that faces the eye
    return points[solid.faces[front]], near[solid.faces[front]], shades[front]


def _draw_lines(canvas: _Canvas, camera: _Camera, solid: Solid) -> None:
    for ends in solid.lines:
        points, near = camera.project(ends)
        if near.min() <= 0.0:
            continue
        share = np.linspace(0.0, 1.0, int(np.abs(np.diff(points, axis=0)).max()) + 2)[:, None]
        x, y = ((1 - share) * points[0] + share * points[1]).astype(int).T
        depth = ((1 - share) * near[0] + share * near[1])[:, 0]
        height, width = canvas.near.shape
        seen = (x >= 0) & (y >= 0) & (x < width - 1) & (y < height - 1)
        x, y, depth = x[seen], y[seen], depth[seen]
        front = depth * 1.001 >= canvas.near[y, x]
        for dx, dy in ((0, 0), (1, 0), (0, 1)):
            canvas.colour[y[front] + dy, x[front] + dx] = solid.rgba[:3]


def _draw_floor(canvas: _Canvas, camera: _Camera, view: dict, content: list[Solid]) -> None:
    """Draw, on the canvas that holds no content yet, the grid of the floor and the shadow of `content` on it."""
    height, width = (n // SAMPLES for n in canvas.near.shape)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    scale, middle = camera.scale / SAMPLES, camera.middle / SAMPLES
    rays = np.stack([(x - middle[0]) / scale, (middle[1] - y) / scale, np.ones_like(x)], -1) @ camera.axes
    level, radius = view["floor"], view["radius"]
    reach = (level - camera.eye[2]) / np.where(np.abs(rays[..., 2]) > 1e-9, rays[..., 2], 1e-9)
    place = camera.eye[:2] + reach[..., None] * rays[..., :2]
    far = np.hypot(*np.moveaxis(place - np.array(view["center"][:2]), -1, 0)) / (4.5 * radius)
    fade = np.where(reach > 0.0, np.clip((1.0 - far) / 0.75, 0.0, 1.0), 0.0)
    step = 10 ** round(np.log10(radius / 2)) / 2
    pixel = np.abs(reach) / scale / np.maximum(np.abs(rays[..., 2]), 0.05)
    clear = np.ones_like(x)
    for size in (step, 5 * step):
        away = np.abs((place / size - 0.5) % 1.0 - 0.5).min(-1) * size
        clear *= 1.0 - 0.22 * fade * np.clip(1.2 - away / np.maximum(pixel, 1e-9), 0.0, 1.0)
    clear = np.repeat(np.repeat(clear, SAMPLES, 0), SAMPLES, 1)[..., None]
    canvas.colour[:] = clear * canvas.colour + (1.0 - clear) * np.array([0.45, 0.5, 0.58])
    cast = [s for s in content if s.rgba[3] >= 0.5 and len(s.faces)]
    if not cast or camera.eye[2] <= level:
        return
    mask = _Canvas(*canvas.near.shape[::-1])
    mask.colour[:] = 0.0
    parts, slant = [], np.array(view["key"]) / view["key"][2]
    for solid in cast:
        points, near = camera.project(solid.vertices - (solid.vertices[:, 2:] - level) * slant)
        faces = solid.faces[solid.vertices[solid.faces, 2].max(1) > level]
        parts.append((points[faces], near[faces], np.ones((len(faces), 3, 3))))
    mask.fill(*map(np.concatenate, zip(*parts, strict=True)))
    canvas.colour *= 1.0 - 0.16 * mask.colour[..., :1]


def png(entries: dict[Key, bytes], view: dict, width: int, height: int, field_of_view: float) -> bytes:
    """Return the picture of the commands as PNG: `view` as Look.header gives it, size [px], angle [rad]."""
    canvas = _Canvas(SAMPLES * width, SAMPLES * height)
    camera = _Camera(view["camera"], view["target"], field_of_view, SAMPLES * width, SAMPLES * height)
    content = solids(entries)
    _draw_floor(canvas, camera, view, content)
    solid_ones = [_faces(camera, s, view) for s in content if s.rgba[3] >= 1.0 and len(s.faces)]
    if solid_ones:
        canvas.fill(*map(np.concatenate, zip(*solid_ones, strict=True)))
    for solid in content:  # what is transparent comes after what is not
        if solid.lines is not None:
            _draw_lines(canvas, camera, solid)
        elif solid.rgba[3] < 1.0 and len(solid.faces):
            canvas.fill(*_faces(camera, solid, view), solid.rgba[3])
    fine = canvas.colour.reshape(height, SAMPLES, width, SAMPLES, 3).mean(axis=(1, 3))
    buffer = io.BytesIO()
    Image.fromarray((255.0 * np.clip(fine, 0.0, 1.0)).round().astype(np.uint8)).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
