"""Voxels: the raster against boxes one by one, the cameras against rays worked out by hand, OpenGL against both."""

import os
import subprocess
import sys

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.paths import ROOT
from tutorialbot.vox2c import arm, cameras, grids
from tutorialbot.vox2c.scenes import BoxScene, random_scene

SIDE = 2.3 / 32
TOWER = [0.5, 0.25, 0.4, 0.31, 0.31, 0.3]  # cuts no voxel to a sliver that falls between the rays


def centres(size: int) -> np.ndarray:
    return np.array(arm.DOMAIN[0]) + 2.3 / size * (np.argwhere(np.ones((size,) * 3)) + 0.5)


@pytest.mark.parametrize("size", [1, 7, 32, 64])
def test_the_raster_fills_what_a_box_enters(size):
    for seed in range(3000, 3003):
        scene = random_scene(seed)
        low, high = scene.corners
        points, half = centres(size), 2.3 / size / 2
        entered = ((low[:, None] < points + half) & (high[:, None] > points - half)).all(axis=2).any(axis=0)
        np.testing.assert_array_equal(grids.voxelize(scene, "raster", size).ravel(), entered)


def test_axes_are_x_y_z():
    found = grids.voxelize(BoxScene([[0.47, -0.7, 1.98, 0.01, 0.01, 0.01]]), "raster")
    np.testing.assert_array_equal(np.argwhere(found), [[22, 6, 27]])


def test_a_box_that_fills_voxels_exactly_fills_no_others():
    low = np.array(arm.DOMAIN[0]) + SIDE * np.array([20, 3, 5])
    scene = BoxScene([[*(low + SIDE * np.array([1.0, 1.5, 0.5])), 2 * SIDE, 3 * SIDE, SIDE]])
    for source in ("raster", "cameras"):
        found = np.argwhere(grids.voxelize(scene, source))
        np.testing.assert_array_equal([found.min(axis=0), found.max(axis=0)], [[20, 3, 5], [21, 5, 5]])


def test_cameras_see_part_of_the_raster_and_nothing_else():
    seen = full = 0
    for seed in range(3000, 3020):
        scene = random_scene(seed)
        shell, raster = grids.voxelize(scene), grids.voxelize(scene, "raster")
        assert not (shell & ~raster).any()
        seen, full = seen + shell.sum(), full + raster.sum()
    assert 0.6 < seen / full < 0.85


def test_tops_are_seen_and_undersides_and_insides_are_not():
    shell, raster = (grids.voxelize(BoxScene([TOWER]), source) for source in ("cameras", "raster"))
    layers = np.flatnonzero(raster.any(axis=(0, 1)))
    np.testing.assert_array_equal(shell[:, :, layers[-1]], raster[:, :, layers[-1]])
    inside = raster[:, :, layers[0]].copy()
    rows, columns = np.nonzero(inside)
    inside[[rows.min(), rows.max()]] = inside[:, [columns.min(), columns.max()]] = False
    assert inside.any() and not shell[:, :, layers[:-1]][inside].any()


def test_every_point_is_the_first_that_its_ray_meets():
    """Rays worked out box by box, the arm's bars among the boxes: same points as MuJoCo's, hidden ones left out."""
    scene, q = random_scene(3100), (0.9, -1.7)
    hidden = 0
    expected = []
    for camera in cameras.cameras():
        rays = camera.directions[camera.useful]
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        boxes = first_hits(camera.place, rays, *scene.corners)
        robot = first_hits(camera.place, rays, *(np.array(corner)[None] for corner in arm.COLUMN))
        for pose in arm.link_poses(q):
            half = np.array([arm.HALF_WIDTH, arm.HALF_WIDTH, arm.HALF_LENGTH])
            middle = np.array([0, 0, arm.MIDDLE])
            turned = (rays @ pose.rotation, pose.actInv(camera.place))
            robot = np.minimum(robot, first_hits(turned[1], turned[0], (middle - half)[None], (middle + half)[None]))
        hit = np.isfinite(boxes) & (boxes < robot)
        hidden += (np.isfinite(boxes) & ~hit).sum()
        expected.append(camera.place + (boxes[hit] + cameras.INWARD)[:, None] * rays[hit])
    np.testing.assert_allclose(grids.point_cloud(scene, q=q), np.concatenate(expected), atol=1e-9)
    assert hidden > 20


def first_hits(origin, rays, low, high) -> np.ndarray:
    """Distance (k,) of the first of the boxes (n, 3) that each ray enters, infinity where there is none."""
    with np.errstate(divide="ignore"):
        near, far = np.sort([(low[:, None] - origin) / rays, (high[:, None] - origin) / rays], axis=0)
    enter, leave = near.max(axis=2), far.min(axis=2)
    return np.where((enter < leave) & (enter > 0), enter, np.inf).min(axis=0)


def test_the_robot_hides_but_is_no_obstacle():
    scene = BoxScene([[0.6, 0.1, 0.6, 0.31, 0.31, 0.5]])
    above, away = grids.point_cloud(scene, q=(np.pi / 2, 0.0)), grids.point_cloud(scene, q=(-np.pi / 2, 0.0))
    assert 0 < len(above) < 0.9 * len(away)
    assert not grids.voxelize(random_scene(1, boxes=0)).any()


def test_every_camera_sees_the_whole_domain():
    corners = np.array(np.meshgrid(*np.array(arm.DOMAIN).T)).reshape(3, -1).T
    for camera in cameras.cameras():
        away = corners - camera.place
        depth = away @ camera.forward
        height = np.tan(np.radians(cameras.FIELD) / 2)
        assert (np.abs(away @ camera.up) < height * depth).all()
        assert (np.abs(away @ camera.right) < height * depth * cameras.PIXELS[1] / cameras.PIXELS[0]).all()


def test_scenes_leave_no_trace():
    before = grids.voxelize(random_scene(3200))
    assert (grids.voxelize(random_scene(3201)) != before).any()
    np.testing.assert_array_equal(grids.voxelize(random_scene(3200)), before)


RENDERED = """
from tutorialbot.vox2c import grids
from tutorialbot.vox2c.scenes import random_scene
for seed in range(3300, 3305):
    cast, drawn = (grids.voxelize(random_scene(seed), source, 64) for source in ("cameras", "rendered"))
    print(cast.sum(), (cast ^ drawn).sum())
"""
REFUSED = """
from tutorialbot.vox2c import grids
from tutorialbot.vox2c.scenes import random_scene
grids.voxelize(random_scene(1), "rendered")
"""


@pytest.mark.full
def test_rendered_depth_pictures_give_the_same_voxels():
    done = run(RENDERED, "egl")
    assert done.returncode == 0, done.stderr
    cast, differ = np.array([line.split() for line in done.stdout.splitlines()], dtype=int).sum(axis=0)
    assert cast > 5000 and differ < 0.003 * cast  # a pixel's rounding moves a point over a border now and then


def test_without_opengl_the_message_says_what_to_do():
    done = run(REFUSED, "disable")
    assert "source = 'rendered': expected another source, or a MuJoCo that can draw: MUJOCO_GL=egl" in done.stderr


def run(code: str, gl: str) -> subprocess.CompletedProcess:
    environment = {**os.environ, "MUJOCO_GL": gl}
    return subprocess.run([sys.executable, "-c", code], env=environment, cwd=ROOT, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("argument", "value"),
    [("source", "lidar"), ("source", None), ("size", 0), ("size", 1.5), ("size", 1000), ("size", "32"),
     ("q", (0.0, np.nan)), ("q", (0.0,)), ("scene", None), ("scene", np.zeros((15, 6)))],
)  # fmt: skip
def test_odd_arguments_are_named(argument, value):
    with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
        grids.voxelize(**{"scene": random_scene(1), argument: value})
    if argument != "size":
        with pytest.raises((InvalidValue, InvalidType), match=f"^{argument} = "):
            grids.point_cloud(**{"scene": random_scene(1), argument: value})


def test_a_raster_has_no_points():
    with pytest.raises(InvalidValue, match="^source = "):
        grids.point_cloud(random_scene(1), source="raster")


def test_points_outside_the_domain_are_in_no_voxel():
    points = np.array([[x, y, z] for x, y, z in np.vstack([np.eye(3), -np.eye(3)]) * 1.2 + [0.0, 0.0, 1.15]])
    assert not grids._of_points(points, 32).any()
    assert grids._of_points(np.array([[-1.1499, -1.1499, 0.0001]]), 32)[0, 0, 0]


@pytest.mark.parametrize("source", ["cameras", "raster"])
@pytest.mark.parametrize("size", [257, 512])
def test_a_grid_too_large_is_named(source, size):
    with pytest.raises(InvalidValue, match="^size = .* at most 256"):
        grids.voxelize(random_scene(1), source, size)
