"""meshcat objects for what robots are made of: MuJoCo geoms, pinocchio geometries, paths and frames."""

from dataclasses import dataclass

import meshcat.geometry as mg
import mujoco
import numpy as np

from tutorialbot.errors import InvalidType, InvalidValue, binary_array

Y_TO_Z = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # three.js has cylinders along y
FLOOR_SIZE = 20.0  # edge of a plane that MuJoCo takes as infinite [m]
ROUND = 32  # segments around an axis


@dataclass(frozen=True)
class Part:
    """One drawable thing on a moving node: its name there, meshcat object and pose in the node's frame (4, 4)."""

    name: str
    object: mg.Object
    pose: np.ndarray


class NormalMesh(mg.TriangularMeshGeometry):
    """A triangle mesh with given vertex normals (n, 3), so that round things look round and edges stay sharp."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray):
        super().__init__(vertices, faces)
        self.normals = np.asarray(normals, dtype=np.float32)

    def lower(self, object_data):
        """Return meshcat's dictionary of the geometry with the attribute `normal` added."""
        lowered = super().lower(object_data)
        lowered["data"]["attributes"]["normal"] = mg.pack_numpy_array(self.normals.T)
        return lowered


class Ball(mg.Ellipsoid):
    """A sphere or ellipsoid with enough facets for a smooth outline."""

    def lower(self, object_data):
        """Return meshcat's dictionary of the geometry with finer segments."""
        return {**super().lower(object_data), "widthSegments": ROUND, "heightSegments": 24}


def material(rgba, shininess: float = 0.3, specular: float = 0.2, double_sided: bool = False) -> mg.MeshPhongMaterial:
    """Return a Phong material of colour `rgba` (0..1); shininess and specular are MuJoCo's numbers in 0..1."""
    red, green, blue, alpha = (float(np.clip(c, 0.0, 1.0)) for c in rgba)
    colour = (round(255 * red) << 16) | (round(255 * green) << 8) | round(255 * blue)
    shine = round(255 * float(np.clip(specular, 0.0, 1.0)))
    return mg.MeshPhongMaterial(
        color=colour, opacity=alpha, transparent=alpha < 1.0, side=2 if double_sided else 0,
        shininess=5.0 + 95.0 * shininess, specular=(shine << 16) | (shine << 8) | shine,
    )  # fmt: skip


def revolve(radii: np.ndarray, heights: np.ndarray, normals: np.ndarray, segments: int = ROUND) -> NormalMesh:
    """Return the surface made by turning a profile around z.

    Args: radii (n,), heights (n,) [m] from bottom to top; normals (n, 2) outward (radial, axial).
    """
    angle = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]

    def turned(radial: np.ndarray, axial: np.ndarray) -> np.ndarray:
        return np.stack([cos * radial, sin * radial, np.broadcast_to(axial, (segments + 1, len(radial)))], -1)

    n = len(radii)
    corner = (np.arange(segments)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + n, corner + n + 1], -1), np.stack([corner, corner + n + 1, corner + 1], -1)]
    )
    points, outward = turned(radii, heights).reshape(-1, 3), turned(normals[:, 0], normals[:, 1]).reshape(-1, 3)
    flat = np.linalg.norm(np.cross(points[faces[:, 1]] - points[faces[:, 0]],
                                   points[faces[:, 2]] - points[faces[:, 0]]), axis=1) < 1e-14  # fmt: skip
    return NormalMesh(points, faces[~flat], outward)


def capsule(radius: float, half_length: float) -> NormalMesh:
    """Return a capsule along z: two half spheres of `radius` whose centres lie at -half_length and +half_length."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 16)
    shift = np.where(angle < 0.0, -half_length, half_length)
    normals = np.stack([np.cos(angle), np.sin(angle)], -1)
    return revolve(radius * np.cos(angle), radius * np.sin(angle) + shift, normals)


def cylinder(radius: float, half_length: float, top_radius: float | None = None) -> NormalMesh:
    """Return a cylinder along z (or a cone, by a top radius of 0) with a small bevel that catches the light."""
    top = radius if top_radius is None else top_radius
    bevel = min(0.08 * max(radius, top), 0.2 * half_length, 0.004) if top_radius is None else 0.0
    slope = np.array([2.0 * half_length, radius - top])
    side, low, high = slope / np.linalg.norm(slope), np.array([0.0, -1.0]), np.array([0.0, 1.0])
    radii = np.array([0.0, radius - bevel, radius - bevel, radius, radius, top, top, top - bevel, top - bevel, 0.0])
    ends = half_length - bevel
    heights = np.array([-half_length, -half_length, -half_length, -ends, -ends, ends, ends, *[half_length] * 3])
    normals = np.array([low, low, low, side, side, side, side, high, high, high])
    return revolve(radii, heights, normals)


def binary_grid(argument: str, value) -> np.ndarray:
    """Return `value` as a bool grid (x, y, z); raise InvalidType or InvalidValue unless it holds 0 and 1 only."""
    try:
        grid = np.asarray(value)
    except ValueError:
        raise InvalidType(argument, value, "a grid (x, y, z) of 0 and 1") from None
    grid = binary_array(argument, grid, "a grid (x, y, z) of 0 and 1")
    if grid.ndim != 3:
        raise InvalidValue(argument, f"array of shape {grid.shape}", "a grid (x, y, z)")
    return grid


def voxels(occupied: np.ndarray, side: float) -> NormalMesh:
    """Return the outer faces of the occupied cells of a bool grid (x, y, z), cubes of `side` [m] from the origin on."""
    padded = np.pad(occupied, 1)
    points, normals = [], []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        for sign in (-1, 1):
            bare = np.argwhere(padded & ~np.roll(padded, -sign, axis)) - 1.0
            square = np.array([0 * u, u, u + v, v]) + (sign > 0) * np.eye(3)[axis]
            points.append((bare[:, None] + square[::sign]).reshape(-1, 3))
            normals.append(np.tile(sign * np.eye(3)[axis], (4 * len(bare), 1)))
    points = side * np.concatenate(points)
    first = 4 * np.arange(len(points) // 4)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    return NormalMesh(points, faces, np.concatenate(normals))


def tube(points: np.ndarray, radius: float, segments: int = 10) -> NormalMesh:
    """Return a tube of `radius` [m] around the polyline `points` (n, 3), with round ends left open."""
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    keep = np.concatenate([[True], lengths[:, 0] > 1e-9])
    points = points[keep]
    if len(points) < 2:
        raise InvalidValue("points", points, "at least two different points")
    tangents = np.gradient(points, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-12)
    side = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    sides = np.empty_like(points)
    for i, tangent in enumerate(tangents):  # carry the side along, turned as little as possible: no twist
        side = side - tangent * (side @ tangent)
        side = side / max(np.linalg.norm(side), 1e-12)
        sides[i] = side
    angle = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)[None, :, None]
    normals = np.cos(angle) * sides[:, None] + np.sin(angle) * np.cross(tangents, sides)[:, None]
    ring, around = np.arange(len(points) - 1)[:, None] * segments, np.arange(segments)
    a, b = (ring + around).ravel(), (ring + (around + 1) % segments).ravel()
    faces = np.concatenate([np.stack([a, b, b + segments], -1), np.stack([a, b + segments, a + segments], -1)])
    vertices = points[:, None] + radius * normals
    return NormalMesh(vertices.reshape(-1, 3), faces, normals.reshape(-1, 3))


def pose_matrix(position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return the 4x4 matrix of a position (3,) and a rotation matrix (3, 3) or (9,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.reshape(rotation, (3, 3)), position
    return matrix


def rotation_from_wxyz(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of MuJoCo's quaternion (w, x, y, z)."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def creased(vertices: np.ndarray, faces: np.ndarray) -> NormalMesh:
    """Return a mesh of vertices (n, 3) and faces (m, 3) that is smooth, but sharp where faces meet at over 40 degrees.

    (MuJoCo keeps normals of its own, but averages them over edges of boxes too.)
    """
    places, merged = np.unique(np.round(vertices, 7), axis=0, return_inverse=True)
    faces = merged.reshape(-1)[faces]
    sides = places[faces]
    weighted = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    sizes = np.linalg.norm(weighted, axis=1)
    faces, weighted, sizes = faces[sizes > 0.0], weighted[sizes > 0.0], sizes[sizes > 0.0]
    flat, corner = weighted / sizes[:, None], faces.ravel()  # corner k belongs to face k // 3
    order = np.argsort(corner, kind="stable")
    count = np.bincount(corner, minlength=len(places))
    first = np.concatenate([[0], np.cumsum(count)])[corner]
    mine = np.repeat(np.arange(len(corner)), count[corner])  # each corner paired with all corners on its vertex
    within = np.arange(len(mine)) - np.repeat(np.cumsum(count[corner]) - count[corner], count[corner])
    other = order[first[mine] + within] // 3
    like = (flat[mine // 3] * flat[other]).sum(1) > np.cos(np.deg2rad(40.0))
    normals = np.zeros((len(corner), 3))
    np.add.at(normals, mine[like], weighted[other[like]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rows, index = np.unique(np.hstack([corner[:, None], np.round(normals, 4)]), axis=0, return_inverse=True)
    return NormalMesh(places[rows[:, 0].astype(int)], index.reshape(-1, 3), rows[:, 1:])


def mujoco_mesh(model: mujoco.MjModel, mesh: int) -> NormalMesh:
    """Return a mesh of a MuJoCo model in its geom's frame."""
    vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]]
    return creased(vertices, model.mesh_face[face : face + model.mesh_facenum[mesh]])


def mujoco_colour(model: mujoco.MjModel, geom: int) -> mg.MeshPhongMaterial:
    """Return the material that MuJoCo draws a geom with: its own colour if it has one, else its material's."""
    rgba, number = model.geom_rgba[geom], model.geom_matid[geom]
    double = model.geom_type[geom] in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_PLANE)
    if number < 0:
        return material(rgba, double_sided=double)
    if np.allclose(rgba, (0.5, 0.5, 0.5, 1.0)):
        rgba = model.mat_rgba[number]
    return material(rgba, float(model.mat_shininess[number]), 0.6 * float(model.mat_specular[number]), double)


def mujoco_part(model: mujoco.MjModel, geom: int, opacity: float) -> Part | None:
    """Return geom number `geom` as a part of its body, or None for what has no shape (height fields, no alpha).

    An infinite horizontal plane gives None too: the scene's own floor stands for it.
    """
    kind, (a, b, c) = mujoco.mjtGeom(model.geom_type[geom]), map(float, model.geom_size[geom])
    rotation = rotation_from_wxyz(model.geom_quat[geom])
    match kind:
        case mujoco.mjtGeom.mjGEOM_BOX:
            shape = mg.Box([2 * a, 2 * b, 2 * c])
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            shape = Ball([a, a, a])
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            shape = capsule(a, b)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            shape = cylinder(a, b)
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            shape = Ball([a, b, c])
        case mujoco.mjtGeom.mjGEOM_MESH | mujoco.mjtGeom.mjGEOM_SDF:
            shape = mujoco_mesh(model, model.geom_dataid[geom])
        case mujoco.mjtGeom.mjGEOM_PLANE:
            if a <= 0.0 and b <= 0.0 and rotation[2, 2] > 0.999 and model.geom_bodyid[geom] == 0:
                return None
            shape = mg.Box([2 * a or FLOOR_SIZE, 2 * b or FLOOR_SIZE, 1e-4])
        case _:
            return None
    colour = mujoco_colour(model, geom)
    colour.opacity *= opacity
    colour.transparent = colour.opacity < 1.0
    if colour.opacity <= 0.0:
        return None
    name = f"{mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or kind.name[7:].lower()}_{geom}"
    return Part(name.replace("/", "_"), mg.Mesh(shape, colour), pose_matrix(model.geom_pos[geom], rotation))


def pinocchio_part(geometry, opacity: float) -> Part:
    """Return a pinocchio GeometryObject as a part of its joint. Raises InvalidValue for a shape unknown here."""
    import coal
    from pinocchio.visualize.meshcat_visualizer import loadMesh

    shape, scale = geometry.geometry, np.diag([*np.asarray(geometry.meshScale, float).ravel(), 1.0])
    if isinstance(shape, coal.Box):
        drawn = mg.Box([float(2 * s) for s in shape.halfSide])
    elif isinstance(shape, coal.Sphere):
        drawn = Ball([float(shape.radius)] * 3)
    elif isinstance(shape, coal.Capsule):
        drawn = capsule(shape.radius, shape.halfLength)
    elif isinstance(shape, coal.Cylinder):
        drawn = cylinder(shape.radius, shape.halfLength)
    elif isinstance(shape, coal.Cone):
        drawn = cylinder(shape.radius, shape.halfLength, 0.0)
    elif isinstance(shape, coal.Ellipsoid):
        drawn = Ball([float(r) for r in shape.radii])
    elif isinstance(shape, coal.ConvexBase | coal.BVHModelBase):
        mesh, scale = loadMesh(shape), np.eye(4)  # the vertices in memory are scaled already
        drawn = creased(mesh.vertices, mesh.faces)
    else:
        raise InvalidValue(f"geometry {geometry.name!r}", type(shape).__name__, "a primitive shape or a mesh")
    rgba = np.array(geometry.meshColor, dtype=float).ravel()
    rgba[3] *= opacity
    colour = material(rgba, double_sided=not isinstance(shape, coal.ShapeBase))
    return Part(geometry.name.replace("/", "_"), mg.Mesh(drawn, colour), geometry.placement.homogeneous @ scale)


def rgba(color: int | tuple[float, ...], alpha: float = 1.0) -> tuple[float, ...]:
    """Return (red, green, blue, alpha) in 0..1 of 0xRRGGBB or of three or four numbers in 0..1."""
    if isinstance(color, int | np.integer) and not isinstance(color, bool) and 0 <= color <= 0xFFFFFF:
        return tuple(((int(color) >> shift) & 255) / 255.0 for shift in (16, 8, 0)) + (alpha,)
    try:
        numbers = tuple(float(c) for c in color)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) not in (3, 4) or not all(0.0 <= c <= 1.0 for c in numbers):
        raise InvalidValue("color", color, "0xRRGGBB or three or four numbers in 0..1")
    return numbers if len(numbers) == 4 else (*numbers, alpha)


def frame_parts(length: float) -> list[Part]:
    """Return the three axes of a frame, x red, y green, z blue, each a bar of `length` [m] from the origin."""
    turns = (np.eye(3)[[1, 2, 0]].T, np.eye(3)[[2, 0, 1]].T, np.eye(3))
    colours = ((0.86, 0.16, 0.16, 1.0), (0.13, 0.62, 0.2, 1.0), (0.16, 0.36, 0.9, 1.0))
    bar = cylinder(0.035 * length, 0.5 * length)
    return [
        Part(axis, mg.Mesh(bar, material(colour)), pose_matrix(0.5 * length * turn[:, 2], turn))
        for axis, turn, colour in zip("xyz", turns, colours, strict=True)
    ]
