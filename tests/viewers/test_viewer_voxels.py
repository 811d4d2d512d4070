"""Voxels in a scene: cubes as worked out by hand, faces outward, and nothing drawn of what is no grid."""

import numpy as np
import pytest

from tutorialbot.errors import InvalidType, InvalidValue
from tutorialbot.viewers import Scene, shapes
from tutorialbot.viewers.solids import solids


def grid(*cells: tuple[int, int, int], shape=(3, 4, 5)) -> np.ndarray:
    found = np.zeros(shape, dtype=bool)
    found[tuple(np.transpose(cells))] = True
    return found


def corners(mesh) -> np.ndarray:
    """Return the triangles (m, 3, 3) of a mesh."""
    return np.asarray(mesh.vertices)[np.asarray(mesh.faces)]


def volume(mesh) -> float:
    """Return the volume inside a closed mesh: positive only when its faces look outward."""
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def area(mesh) -> float:
    a, b, c = np.moveaxis(corners(mesh), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize("cell", [(0, 0, 0), (1, 2, 3), (2, 3, 4)])
def test_one_cube_has_twelve_triangles_where_it_should_be(cell):
    mesh = shapes.voxels(grid(cell), 0.5)
    assert len(mesh.faces) == 12
    np.testing.assert_allclose(np.min(mesh.vertices, axis=0), 0.5 * np.array(cell))
    np.testing.assert_allclose(np.max(mesh.vertices, axis=0), 0.5 * np.array(cell) + 0.5)
    assert volume(mesh) == pytest.approx(0.125) and area(mesh) == pytest.approx(1.5)


@pytest.mark.parametrize("step", np.eye(3, dtype=int))
def test_neighbours_share_a_face_that_nobody_sees(step):
    mesh = shapes.voxels(grid((1, 1, 1), tuple(step + 1)), 1.0)
    assert len(mesh.faces) == 20
    assert volume(mesh) == pytest.approx(2.0) and area(mesh) == pytest.approx(10.0)


def test_cubes_apart_or_at_both_ends_of_the_grid_keep_all_their_faces():
    for cells in (((0, 0, 0), (2, 0, 0)), ((0, 0, 0), (1, 1, 0)), ((0, 3, 0), (0, 0, 0)), ((1, 1, 0), (1, 1, 4))):
        assert len(shapes.voxels(grid(*cells), 1.0).faces) == 24


def test_every_face_looks_outward_and_its_normal_too():
    occupied = np.random.default_rng(3).random((4, 5, 6)) < 0.4
    mesh, padded = shapes.voxels(occupied, 1.0), np.pad(occupied, 1)
    triangles, normals = corners(mesh), np.asarray(mesh.normals)[np.asarray(mesh.faces)]
    turned = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    for k in range(3):
        np.testing.assert_allclose(normals[:, k], turned)  # unit squares: half a square has a cross product of 1
    middles = (triangles.min(axis=1) + triangles.max(axis=1)) / 2
    inside, outside = (np.floor(middles + s * turned / 2).astype(int) + 1 for s in (-1, 1))
    assert padded[tuple(inside.T)].all() and not padded[tuple(outside.T)].any()
    assert volume(mesh) == pytest.approx(occupied.sum())


def test_they_stand_in_the_scene_where_the_origin_says():
    scene = Scene()
    scene.add_voxels(grid((1, 2, 3)).astype(int), 0.1, (1.0, 2.0, 3.0), color=0xFF0000, name="cells")
    (solid,) = solids(scene.window.entries)
    np.testing.assert_allclose(solid.vertices.min(axis=0), (1.1, 2.2, 3.3), atol=1e-6)
    np.testing.assert_allclose(solid.vertices.max(axis=0), (1.2, 2.3, 3.4), atol=1e-6)
    np.testing.assert_allclose(solid.rgba, (1.0, 0.0, 0.0, 1.0))


def test_new_ones_replace_the_old_ones_and_none_remove_them():
    scene = Scene()
    for cells in (((0, 0, 0),), ((1, 1, 1), (1, 1, 2))):
        scene.add_voxels(grid(*cells), 1.0, np.zeros(3))
        (solid,) = solids(scene.window.entries)
        assert len(solid.faces) == 12 + 8 * (len(cells) - 1)
    scene.add_voxels(np.zeros((3, 3, 3)), 1.0, np.zeros(3))
    assert list(solids(scene.window.entries)) == []


@pytest.mark.parametrize(
    ("argument", "value"),
    [("occupied", np.zeros((3, 3))), ("occupied", np.full((2, 2, 2), 0.5)), ("occupied", np.full((2, 2, 2), np.nan)),
     ("occupied", np.full((2, 2, 2), -1)), ("occupied", "cubes"), ("occupied", None), ("occupied", [[[1], [1, 0]]]),
     ("occupied", np.full((2, 2, 2), "1")), ("side", 0.0), ("side", -1.0), ("side", np.nan), ("side", "wide"),
     ("side", True), ("origin", (0.0, 0.0)), ("origin", (0.0, np.inf, 0.0)), ("origin", None), ("color", "red"),
     ("color", -1), ("color", (2.0, 0.0, 0.0))],
)  # fmt: skip
def test_what_is_no_grid_is_named_and_the_old_one_stays(argument, value):
    scene = Scene()
    options = {"occupied": grid((0, 0, 0)), "side": 1.0, "origin": (0.0, 0.0, 0.0)}
    scene.add_voxels(**options)
    with pytest.raises((InvalidType, InvalidValue), match=f"^{argument} = "):
        scene.add_voxels(**{**options, argument: value})
    assert len(list(solids(scene.window.entries))) == 1
