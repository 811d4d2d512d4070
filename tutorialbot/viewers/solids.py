"""Reads recorded commands back: triangles in the world, and how far the content reaches."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import umsgpack

from tutorialbot.viewers import shapes
from tutorialbot.viewers.log import Key

DTYPES = {0x12: np.uint8, 0x15: np.int32, 0x16: np.uint32, 0x17: np.float32}
EMPTY = np.array([[[-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]]])  # what an empty scene makes room for [m]
OUTWARD = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], float).T
STILL = np.zeros((2, 3))
BACKDROP = 15.0  # what is larger than this [m] does not count as content while something smaller is there


@dataclass(frozen=True)
class Solid:
    """Triangles of one object: vertices and normals (n, 3) in the world, faces (m, 3), rgba; lines have no faces."""

    path: str
    vertices: np.ndarray
    normals: np.ndarray | None
    faces: np.ndarray
    rgba: np.ndarray
    lines: np.ndarray | None = None  # (k, 2, 3), ends in the world


def _array(packed: dict) -> np.ndarray:
    data = packed["array"]
    numbers = np.frombuffer(data.data, DTYPES[data.type])
    return numbers.reshape(-1, packed["itemSize"])


def _triangles(geometry: dict) -> tuple[np.ndarray, np.ndarray, np.ndarray | None] | None:
    """Return vertices, faces and normals (None: take each triangle's own) of a meshcat geometry, None if unknown."""
    kind, get = geometry["type"], geometry.get
    if kind in ("BoxGeometry", "PlaneGeometry"):
        half = np.array([get("width", 1), get("height", 1), get("depth", 0)], float) / 2
        corners = half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]), None
    if kind == "SphereGeometry":
        mesh = shapes.capsule(float(get("radius", 1)), 0.0)
    elif kind in ("CylinderGeometry", "ConeGeometry"):
        bottom, top = float(get("radiusBottom", get("radius", 1))), float(get("radiusTop", 0.0))
        mesh = shapes.cylinder(bottom, float(get("height", 1)) / 2, top)
        turn = np.linalg.inv(shapes.Y_TO_Z)[:3, :3].T
        return mesh.vertices @ turn, mesh.faces, mesh.normals @ turn
    elif kind == "BufferGeometry":
        attributes = geometry["data"]["attributes"]
        if attributes["position"]["array"] is None:
            return None
        vertices, index = _array(attributes["position"]).astype(float), geometry["data"].get("index")
        faces = _array(index).reshape(-1, 3) if index else np.arange(len(vertices) // 3 * 3).reshape(-1, 3)
        normals = _array(attributes["normal"]).astype(float) if "normal" in attributes else None
        return vertices, faces, normals
    else:
        return None
    return mesh.vertices.astype(float), mesh.faces, mesh.normals.astype(float)


def _node_pose(path: str, transforms: dict[str, np.ndarray]) -> np.ndarray:
    """Return the world pose of a path: the product of the transforms of all its ancestors and its own."""
    pose, parts = np.eye(4), path.strip("/").split("/")
    for depth in range(1, len(parts) + 1):
        pose = pose @ transforms.get("/" + "/".join(parts[:depth]), np.eye(4))
    return pose


def _transforms(entries: dict[Key, bytes]) -> dict[str, np.ndarray]:
    found = ((key[1], body) for key, body in entries.items() if key[0] == "set_transform")
    return {path: np.reshape(umsgpack.unpackb(body)["matrix"], (4, 4)).T for path, body in found}


def _shown(entries: dict[Key, bytes]) -> Iterator[tuple[Key, bytes, np.ndarray]]:
    """Yield key, command and world pose of each object below /meshcat that is not hidden."""
    transforms = _transforms(entries)
    hidden = [k[1] for k, b in entries.items() if k[2] == "visible" and not umsgpack.unpackb(b)["value"]]
    for key, body in entries.items():
        path = key[1]
        hides = any(path == h or path.startswith(h + "/") for h in hidden)
        if key[0] == "set_object" and path.startswith("/meshcat") and not hides:
            yield key, body, _node_pose(path, transforms)


def solids(entries: dict[Key, bytes]) -> list[Solid]:
    """Return what the commands show below /meshcat, as triangles and lines in the world."""
    found = (_solid(key[1], umsgpack.unpackb(body)["object"], pose) for key, body, pose in _shown(entries))
    return [solid for solid in found if solid is not None]


def _solid(path: str, lowered: dict, pose: np.ndarray) -> Solid | None:
    kind, geometries = lowered["object"]["type"], lowered.get("geometries")
    if not geometries or "type" not in geometries[0]:
        return None
    look = lowered["materials"][0]
    rgba = np.array(shapes.rgba(int(look.get("color", 0xFFFFFF)), float(look.get("opacity", 1.0))))
    pose = pose @ np.reshape(lowered["object"]["matrix"], (4, 4)).T
    if kind.startswith(("Line", "Points")):
        points = _array(geometries[0]["data"]["attributes"]["position"]) @ pose[:3, :3].T + pose[:3, 3]
        pairs = points[: len(points) // 2 * 2].reshape(-1, 2, 3)
        if kind in ("Line", "LineLoop"):
            pairs = np.stack([points[:-1], points[1:]], 1)
        elif kind == "Points":
            pairs = np.stack([points, points], 1)
        return Solid(path, points, None, np.empty((0, 3), int), rgba, pairs)
    triangles = _triangles(geometries[0])
    if triangles is None:
        return None
    vertices, faces, normals = triangles
    if normals is not None:
        normals = normals @ np.linalg.inv(pose[:3, :3])
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return Solid(path, vertices @ pose[:3, :3].T + pose[:3, 3], normals, faces, rgba)


def boxes(entries: dict[Key, bytes], known: dict[Key, tuple[bytes, np.ndarray]]) -> np.ndarray:
    """Return the lowest and highest corner of each object, (n, 2, 3) [m], over the whole of a recorded animation.

    `known` keeps each object's outermost points from one call to the next, for as long as the object is the same.
    """
    reach, found = _reach(entries), []
    for key, body, pose in _shown(entries):
        if key not in known or known[key][0] is not body:
            solid = _solid(key[1], umsgpack.unpackb(body)["object"], np.eye(4))
            points = np.empty((0, 3)) if solid is None else solid.vertices
            known[key] = body, points[np.unique((points @ OUTWARD).argmax(0))] if len(points) else points
        points = known[key][1] @ pose[:3, :3].T + pose[:3, 3]
        if len(points):
            low, high = next((r for path, r in reach.items() if f"{key[1]}/".startswith(f"{path}/")), STILL)
            found.append((points.min(0) + low, points.max(0) + high))
    for key in known.keys() - entries.keys():
        del known[key]
    every = np.array(found).reshape(-1, 2, 3)
    small = every[np.ptp(every, axis=1).max(axis=1) < BACKDROP]
    every = small if len(small) else every
    return every if len(every) else EMPTY


def _reach(entries: dict[Key, bytes]) -> dict[str, np.ndarray]:
    """Return how far (2, 3) [m] the recorded animation moves each of its nodes down and up each axis of the world."""
    transforms, found = _transforms(entries), {}
    for key, body in entries.items():
        for animation in umsgpack.unpackb(body)["animations"] if key[0] == "set_animation" else ():
            path = animation["path"]
            parent, here = _node_pose(path.rpartition("/")[0], transforms), _node_pose(path, transforms)[:3, 3]
            for track in animation["clip"]["tracks"]:
                if track["name"] == ".position":
                    values = track.get("values")
                    flat = [k["value"] for k in track["keys"]] if values is None else np.frombuffer(values.data, "<f4")
                    places = np.reshape(flat, (-1, 3)) @ parent[:3, :3].T + parent[:3, 3] - here
                    found[path] = np.array([places.min(0), places.max(0)])
    return found
