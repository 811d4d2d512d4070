"""The still picture, and the camera that fits the content, against geometry worked out by hand."""

import io

import meshcat.geometry as mg
import numpy as np
from meshcat.animation import Animation
from PIL import Image

from tutorialbot.viewers import Scene
from tutorialbot.viewers.look import FIELD_OF_VIEW, fitting_eye
from tutorialbot.viewers.solids import boxes


def pixels(scene: Scene, width: int = 200, height: int = 200) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(scene.png(width=width, height=height)))).astype(float) / 255


def ball(scene: Scene, name: str, colour: int, place, radius: float, opacity: float = 1.0) -> None:
    pose = np.eye(4)
    pose[:3, 3] = place
    scene[name].set_object(mg.Sphere(radius), mg.MeshLambertMaterial(color=colour, opacity=opacity))
    scene[name].set_transform(pose)


def is_red(picture: np.ndarray) -> np.ndarray:
    return picture[..., 0] > 2.0 * picture[..., 1:].max(-1)


def is_blue(picture: np.ndarray) -> np.ndarray:
    return picture[..., 2] > 2.0 * picture[..., :2].max(-1)


def test_a_ball_has_the_size_and_place_that_the_camera_gives_it():
    scene = Scene(camera=(0.0, -4.0, 1.0), target=(0.0, 0.0, 1.0))
    ball(scene, "a", 0xFF0000, (0.5, 0.0, 1.25), 0.25)
    rows, columns = np.nonzero(is_red(pixels(scene)))
    per_metre = 100.0 / np.tan(FIELD_OF_VIEW / 2) / 4.0  # pixels at 4 m from the eye
    assert abs(columns.mean() + 0.5 - (100 + 0.5 * per_metre)) < 1.5
    assert abs(rows.mean() + 0.5 - (100 - 0.25 * per_metre)) < 1.5
    assert abs(np.sqrt(len(rows) / np.pi) - 0.25 * per_metre) < 1.5


def test_the_nearer_thing_hides_the_farther_one_and_a_ghost_does_not():
    scene = Scene(camera=(0.0, -4.0, 1.0), target=(0.0, 0.0, 1.0))
    ball(scene, "near", 0x0000FF, (0.0, -1.0, 1.0), 0.2)
    ball(scene, "far", 0xFF0000, (0.0, 0.0, 1.0), 0.4)
    picture = pixels(scene)
    assert is_blue(picture)[100, 100] and is_red(picture)[100, 127] and not is_red(picture)[100, 100]
    ball(scene, "near", 0x0000FF, (0.0, -1.0, 1.0), 0.2, opacity=0.4)
    middle = pixels(scene)[100, 100]
    assert middle[0] > 0.1 and middle[2] > 0.1


def test_hidden_and_deleted_things_are_not_drawn():
    scene = Scene(camera=(0.0, -4.0, 1.0), target=(0.0, 0.0, 1.0))
    ball(scene, "group/a", 0xFF0000, (0.0, 0.0, 1.0), 0.3)
    assert is_red(pixels(scene)).any()
    scene["group"].set_property("visible", False)
    assert not is_red(pixels(scene)).any()
    scene["group"].set_property("visible", True)
    scene["group/a"].delete()
    assert not is_red(pixels(scene)).any()


def test_paths_frames_and_lines_are_drawn():
    scene = Scene(camera=(0.0, -4.0, 1.0), target=(0.0, 0.0, 1.0))
    scene.add_path([(-1, 0, 1.0), (1, 0, 1.0)], color=0xFF0000, radius=0.02)
    columns = np.nonzero(is_red(pixels(scene)))[1]
    per_metre = 100.0 / np.tan(FIELD_OF_VIEW / 2) / 4.0
    assert abs(np.ptp(columns) + 1 - min(200, 2 * per_metre)) < 4
    scene.delete()
    turned = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 1.0], [0, 0, 0, 1]], float)  # z of the frame along x
    scene.add_frame(turned, length=0.5)
    rows, columns = np.nonzero(is_blue(pixels(scene)))
    assert columns.mean() > 105 and abs(rows.mean() - 100) < 3
    scene.delete()
    scene["line"].set_object(
        mg.LineSegments(
            mg.PointsGeometry(np.array([[-0.5, 0, 1], [0.5, 0, 1]], np.float32).T), mg.LineBasicMaterial(color=0xFF0000)
        )
    )
    assert np.ptp(np.nonzero(is_red(pixels(scene)))[1]) > 50


def test_the_given_camera_shows_everything_and_little_more():
    scene = Scene()
    ball(scene, "low", 0xFF0000, (0.0, 0.0, 0.1), 0.1)
    ball(scene, "high", 0xFF0000, (0.3, 0.2, 2.0), 0.1)
    seen = is_red(pixels(scene, 320, 200))
    assert not seen[[0, -1]].any() and not seen[:, [0, -1]].any()
    assert np.ptp(np.nonzero(seen)[0]) > 120
    content = boxes(scene.window.entries, {})
    eye = fitting_eye(content, np.array([0.0, 0.0, 1.0]))
    assert np.linalg.norm(eye) < 10.0


def test_a_huge_plane_does_not_push_the_camera_away():
    scene = Scene()
    ball(scene, "a", 0xFF0000, (0.0, 0.0, 0.5), 0.1)
    alone = scene._look.header(now=True)
    scene["ground"].set_object(mg.Box([50.0, 50.0, 0.01]))
    assert scene._look.header(now=True) == alone


def test_a_live_camera_follows_new_content_and_not_motion():
    scene = Scene()
    ball(scene, "a", 0xFF0000, (0.0, 0.0, 0.5), 0.1)
    first = scene._look.header()
    ball(scene, "a", 0xFF0000, (0.0, 0.0, 5.0), 0.1)  # it moves
    assert scene._look.header() == first != scene._look.header(now=True)
    ball(scene, "b", 0xFF0000, (0.0, 0.0, 5.05), 0.1)  # something new, outside of what is seen
    wider = scene._look.header()
    assert wider["center"][2] > 4.0
    ball(scene, "c", 0xFF0000, (0.0, 0.0, 5.02), 0.1)  # something new, inside
    assert scene._look.header() == wider


def test_an_animation_counts_for_the_camera():
    scene, animation = Scene(), Animation(default_framerate=1)
    ball(scene, "a", 0xFF0000, (0.0, 0.0, 0.5), 0.1)
    for second, x in enumerate((0.0, 3.0, -2.0)):
        with animation.at_frame(scene["a"], second) as frame:
            frame.set_transform(np.array([[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1.0]]))
    scene.set_animation(animation)
    assert scene._look.header()["center"][0] == 0.5


def test_an_empty_scene_has_a_picture_too():
    assert pixels(Scene(), 64, 48).shape == (48, 64, 3)
