"""A still picture of recorded commands, drawn with numpy alone: it needs no GL, no browser and no display."""

import io

import numpy as np
from PIL import Image

from tutorialbot.viewers.log import Key
from tutorialbot.viewers.solids import Solid, solids

TOP, BOTTOM = np.array([0.97, 0.975, 0.985]), np.array([0.8, 0.825, 0.86])  # background
KEY_LIGHT, FILL_LIGHT = np.array([0.45, -0.55, 1.0]), np.array([-0.8, 0.7, 0.4])
SAMPLES = 2  # pixels are drawn this many times finer in each direction and averaged


class _Canvas:
    """A colour and a depth picture (inverse distance: larger is nearer) of width x height."""

    def __init__(self, width: int, height: int):
        share = np.linspace(0.0, 1.0, height)[:, None, None]
        self.colour = np.broadcast_to((1 - share) * TOP + share * BOTTOM, (height, width, 3)).copy()
        self.near = np.zeros((height, width))

    def triangle(self, points: np.ndarray, near: np.ndarray, shades: np.ndarray, alpha: float) -> None:
        """Fill a triangle: pixel points (3, 2), inverse distances (3,), colours of the corners (3, 3)."""
        height, width = self.near.shape
        low = np.maximum(np.floor(points.min(0)), 0).astype(int)
        high = np.minimum(np.ceil(points.max(0)) + 1, (width, height)).astype(int)
        if (high <= low).any():
            return
        (ax, ay), (bx, by), (cx, cy) = points
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-9:
            return
        x, y = np.arange(low[0], high[0]) + 0.5, (np.arange(low[1], high[1]) + 0.5)[:, None]
        u = ((by - cy) * (x - cx) + (cx - bx) * (y - cy)) / area
        v = ((cy - ay) * (x - cx) + (ax - cx) * (y - cy)) / area
        w = 1.0 - u - v
        depth = u * near[0] + v * near[1] + w * near[2]
        window = np.s_[low[1] : high[1], low[0] : high[0]]
        inside = (u >= 0) & (v >= 0) & (w >= 0) & (depth > self.near[window])
        if not inside.any():
            return
        colour = np.stack([u[inside], v[inside], w[inside]], -1) @ shades
        target = self.colour[window]
        target[inside] = alpha * colour + (1.0 - alpha) * target[inside]
        if alpha > 0.95:
            self.near[window][inside] = depth[inside]


def _shaded(normals: np.ndarray, rgba: np.ndarray) -> np.ndarray:
    """Return the colour (n, 3) of surfaces with unit `normals` (n, 3) under the scene's lights."""
    light = 0.47 + 0.06 * normals[:, 2:3]
    for direction, strength in ((KEY_LIGHT, 0.5), (FILL_LIGHT, 0.18)):
        light = light + strength * np.clip(normals @ (direction / np.linalg.norm(direction)), 0.0, None)[:, None]
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


def _draw(canvas: _Canvas, camera: _Camera, solid: Solid) -> None:
    points, near = camera.project(solid.vertices)
    corners = solid.vertices[solid.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    away = np.einsum("ij,ij->i", flat, corners[:, 0] - camera.eye) > 0.0
    flat[away] *= -1.0
    shades = None if solid.normals is None else _shaded(solid.normals, solid.rgba)
    own = _shaded(flat, solid.rgba)
    for i, face in enumerate(solid.faces):
        if near[face].min() > 0.0 and not (away[i] and solid.normals is not None and solid.rgba[3] < 1.0):
            shade = np.repeat(own[i : i + 1], 3, 0) if shades is None or away[i] else shades[face]
            canvas.triangle(points[face], near[face], shade, solid.rgba[3])


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
    height, width = canvas.near.shape
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.stack([(x - camera.middle[0]), -(y - camera.middle[1]), np.full_like(x, camera.scale)], -1)
    rays = rays / camera.scale @ camera.axes
    level, radius = view["floor"], view["radius"]
    reach = (level - camera.eye[2]) / np.where(np.abs(rays[..., 2]) > 1e-9, rays[..., 2], 1e-9)
    place = camera.eye[:2] + reach[..., None] * rays[..., :2]
    far = np.linalg.norm(place - np.array(view["center"][:2]), axis=-1) / (4.5 * radius)
    fade = np.where(reach > 0.0, np.clip(1.0 - (far - 0.25) / 0.75, 0.0, 1.0), 0.0)
    step = 10 ** round(np.log10(radius / 2)) / 2
    pixel = np.abs(reach) / camera.scale * SAMPLES / np.maximum(np.abs(rays[..., 2:3]), 0.05)[..., 0]
    for size in (step, 5 * step):
        away = np.abs((place / size - 0.5) % 1.0 - 0.5).min(-1) * size
        ink = (0.22 * fade * np.clip(1.2 - away / np.maximum(pixel, 1e-9), 0.0, 1.0))[..., None]
        canvas.colour[:] = (1 - ink) * canvas.colour + ink * np.array([0.45, 0.5, 0.58])
    mask = _Canvas(width, height)
    mask.colour[:] = 0.0
    for solid in content:
        if solid.rgba[3] < 0.5 or not len(solid.faces):
            continue
        lifted = solid.vertices - (solid.vertices[:, 2:] - level) * KEY_LIGHT / KEY_LIGHT[2]
        points, near = camera.project(lifted)
        for face in solid.faces:
            if near[face].min() > 0.0 and solid.vertices[face, 2].max() > level:
                mask.triangle(points[face], np.ones(3), np.ones((3, 3)), 1.0)
    dark = 0.16 * mask.colour[..., :1] * (camera.eye[2] > level)
    canvas.colour[:] *= 1.0 - dark


def png(entries: dict[Key, bytes], view: dict, width: int, height: int, field_of_view: float) -> bytes:
    """Return the picture of the commands as PNG: `view` as scene.Look.header gives it, size [px], angle [rad]."""
    canvas = _Canvas(SAMPLES * width, SAMPLES * height)
    camera = _Camera(view["camera"], view["target"], field_of_view, SAMPLES * width, SAMPLES * height)
    content = solids(entries)
    _draw_floor(canvas, camera, view, content)
    for solid in sorted(content, key=lambda s: -s.rgba[3]):  # what is transparent comes last
        _draw(canvas, camera, solid)
        if solid.lines is not None:
            _draw_lines(canvas, camera, solid)
    fine = canvas.colour.reshape(height, SAMPLES, width, SAMPLES, 3).mean(axis=(1, 3))
    buffer = io.BytesIO()
    Image.fromarray((255.0 * np.clip(fine, 0.0, 1.0)).round().astype(np.uint8)).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
