"""Four depth cameras above the scene (paper 3, section 4.1.1): their rays, and the point cloud that they see together.

The paper says four cameras overhead and no more. Ours stand above the corners of the domain, all of which each of them
sees, and look at its middle. Floor and robot are taken out of the cloud; the robot still hides what is behind it.
"""

from dataclasses import dataclass
from functools import cache, lru_cache

import mujoco
import numpy as np

from tutorialbot.errors import InvalidValue
from tutorialbot.vox2c.arm import DOMAIN
from tutorialbot.vox2c.scenes import BoxScene

PLACES = ((2.0, 2.0, 3.5), (-2.0, 2.0, 3.5), (-2.0, -2.0, 3.5), (2.0, -2.0, 3.5))  # [m]
TARGET = (0.0, 0.0, 1.0)  # what all look at [m]
FIELD = 60.0  # of view, vertical [deg]
PIXELS = (120, 160)  # rows, columns
FARTHEST = 10.0  # [m]
INWARD = 1e-6  # a point moves on along its ray by this, so that a face on a voxel's border counts as its own box [m]


@dataclass(frozen=True, eq=False)
class Camera:
    """A pin-hole camera at place (3,) [m]: right, up, forward (3,) unit vectors, directions (rows, columns, 3) of the
    pixels' rays, each one long along `forward`; useful (rows, columns): the rays that enter the domain.
    """

    place: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    directions: np.ndarray
    useful: np.ndarray


@cache
def cameras() -> tuple[Camera, ...]:
    """Return the four cameras."""
    found = []
    rows, columns = PIXELS
    height = np.tan(np.radians(FIELD) / 2)
    for place in np.array(PLACES):
        forward = (TARGET - place) / np.linalg.norm(TARGET - place)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        x = (2 * (np.arange(columns) + 0.5) / columns - 1) * height * columns / rows
        y = (1 - 2 * (np.arange(rows) + 0.5) / rows) * height
        directions = forward + x[:, None] * right + y[:, None, None] * up
        enter, leave = np.sort((np.array(DOMAIN)[:, None, None] - place) / directions, axis=0)
        useful = enter.max(axis=-1) < leave.min(axis=-1)
        found.append(Camera(place, right, up, forward, directions, useful))
    return tuple(found)


def cast(scene: BoxScene, q: np.ndarray) -> np.ndarray:
    """Return the points (k, 3) [m] on boxes that the cameras see, the arm at q (2,): MuJoCo's rays, no OpenGL."""
    model = _place(_bare(len(scene.boxes)).__copy__(), scene)
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    boxes = _boxes(model, len(scene.boxes))
    groups = np.array([1, 0, 0, 1, 0, 0], dtype=np.uint8)  # boxes and the robot's bodies, not the floor
    clouds = []
    for camera in cameras():
        rays = camera.directions[camera.useful]
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        geoms, distances = np.empty(len(rays), dtype=np.int32), np.empty(len(rays))
        mujoco.mj_multiRay(
            model, data, camera.place, rays.ravel(), groups, True, -1, geoms, distances, None, len(rays), FARTHEST
        )
        seen = (geoms >= boxes.start) & (geoms < boxes.stop)
        clouds.append(camera.place + (distances[seen] + INWARD)[:, None] * rays[seen])
    return np.concatenate(clouds)


def _boxes(model: mujoco.MjModel, count: int) -> slice:
    """Where the boxes' geoms stand, one after the other."""
    first = model.geom("box0").id if count else 0
    return slice(first, first + count)


def _spec(boxes: int) -> mujoco.MjSpec:
    return BoxScene(np.tile([0.0, 0.0, 1.0, 0.1, 0.1, 0.1], (boxes, 1))).spec(seen=False)


@lru_cache(maxsize=4)
def _bare(boxes: int) -> mujoco.MjModel:
    return _spec(boxes).compile()


def _place(model: mujoco.MjModel, scene: BoxScene) -> mujoco.MjModel:
    """Put this scene's boxes into a model of as many: compiling one anew would cost as much as a camera."""
    boxes, half = _boxes(model, len(scene.boxes)), scene.boxes[:, 3:] / 2
    model.geom_pos[boxes], model.geom_size[boxes] = scene.boxes[:, :3], half
    model.geom_rbound[boxes], model.geom_aabb[boxes, 3:] = np.linalg.norm(half, axis=1), half
    return model


def render(scene: BoxScene, q: np.ndarray) -> np.ndarray:
    """Return the points (k, 3) [m] on boxes that the cameras see, from MuJoCo's rendered depth pictures; needs OpenGL.

    For one thread at a time. Raises InvalidValue where MuJoCo cannot draw: it picks its OpenGL when Python starts, and
    MUJOCO_GL=egl fits a server.
    """
    model, renderer, groups = _drawing(len(scene.boxes))
    data, boxes = mujoco.MjData(_place(model, scene)), _boxes(model, len(scene.boxes))
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    clouds = []
    for i, camera in enumerate(cameras()):
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, f"camera{i}", groups)
        geoms = renderer.render()[..., 0]
        seen = (geoms >= boxes.start) & (geoms < boxes.stop)
        renderer.enable_depth_rendering()
        depth = renderer.render()[seen].astype(float)
        renderer.disable_depth_rendering()
        clouds.append(camera.place + (depth + INWARD)[:, None] * camera.directions[seen])
    return np.concatenate(clouds)


@lru_cache(maxsize=2)
def _drawing(boxes: int) -> tuple[mujoco.MjModel, "mujoco.Renderer", mujoco.MjvOption]:
    spec = _spec(boxes)
    for i, camera in enumerate(cameras()):
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, np.column_stack([camera.right, camera.up, -camera.forward]).ravel())
        spec.worldbody.add_camera(name=f"camera{i}", pos=camera.place, quat=quaternion, fovy=FIELD)
    model, groups = spec.compile(), mujoco.MjvOption()
    groups.geomgroup[3] = 1
    try:
        return model, mujoco.Renderer(model, *PIXELS), groups
    except Exception as error:
        expected = "another source, or a MuJoCo that can draw: MUJOCO_GL=egl, set before Python starts"
        raise InvalidValue("source", "rendered", f"{expected} ({error})") from None
