"""A meshcat scene that records its commands, and shows itself live, as an HTML page or as a picture."""

import io
from pathlib import Path

import meshcat
import meshcat.geometry as mg
import numpy as np
import pinocchio
from PIL import Image

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, positive, whole_number
from tutorialbot.viewers import shapes
from tutorialbot.viewers.log import CommandLog
from tutorialbot.viewers.look import Look
from tutorialbot.viewers.widget import SceneWidget, note_use


class Scene:
    """A meshcat scene without a server.

    Args:
        height: height in the notebook [px]; the width is the cell's.
        camera: where the eye is, (x, y, z) [m] in the world (z up); by default so that everything fills the view.
        target: the point it looks at, (x, y, z) [m]; by default the middle of everything.

    It takes meshcat-python's calls (`scene["a/b"].set_object(geometry, material)`, `.set_transform(T)`,
    `.set_property(key, value)`, `.delete()`, `set_animation(animation)`), and can be the viewer of
    `pinocchio.visualize.MeshcatVisualizer`. Raises InvalidType or InvalidValue for impossible arguments.
    """

    def __init__(self, height: int = 420, camera=None, target=None):
        self._log = CommandLog()
        self._look = Look(
            self._log,
            whole_number("height", height, 50),
            None if camera is None else tuple(finite_array("camera", camera, (3,))),
            None if target is None else tuple(finite_array("target", target, (3,))),
        )
        self._root = meshcat.Visualizer(window=self._log)
        self._widget: SceneWidget | None = None
        self._frames: dict[str, float] = {}  # name of a frame -> the length that was drawn
        self._clips: dict[str, dict] = {}  # root of a view -> its animation clips (see views.play)

    def __repr__(self) -> str:
        return "Scene()"

    def __getitem__(self, path: str) -> meshcat.Visualizer:
        """Return meshcat's own handle of `path`, which sends to this scene."""
        return self._root[path]

    @property
    def window(self) -> CommandLog:
        """The recorder, under the name that meshcat's window has."""
        return self._log

    def set_object(self, geometry, material=None) -> None:
        """Put a meshcat object, or a geometry and a material, at the scene's root."""
        self._root.set_object(geometry, material)

    def set_transform(self, matrix=None) -> None:
        """Place everything in the scene by a 4x4 matrix."""
        self._root.set_transform(np.eye(4) if matrix is None else finite_array("matrix", matrix, (4, 4)))

    def set_property(self, key: str, value) -> None:
        """Set a property of the scene's root, as meshcat does ("visible", "color", ...)."""
        self._root.set_property(key, value)

    def set_animation(self, animation, play: bool = True, repetitions: int = 1) -> None:
        """Give the scene a meshcat.animation.Animation; its controls appear under the picture."""
        self._root.set_animation(animation, play=play, repetitions=repetitions)

    def delete(self) -> None:
        """Remove everything from the scene."""
        self._clips.clear()
        self._log.send(meshcat.commands.SetAnimation(meshcat.animation.Animation()))
        self._root.delete()

    def set_camera(self, camera=None, target=None) -> None:
        """Move the eye and the point it looks at, each (x, y, z) [m]; None for one that fits the content."""
        self._look.camera = None if camera is None else tuple(finite_array("camera", camera, (3,)))
        self._look.target = None if target is None else tuple(finite_array("target", target, (3,)))
        if self._widget is not None and self._widget.comm is not None:
            self._widget.send_view()

    def set_cam_pos(self, position) -> None:
        """Move the eye to (x, y, z) [m]: the name that pinocchio's visualizer calls."""
        self.set_camera(position, self._look.target)

    def set_cam_target(self, target) -> None:
        """Look at (x, y, z) [m]: the name that pinocchio's visualizer calls."""
        self.set_camera(self._look.camera, target)

    def add_path(self, points, color: int = 0x66CCFF, radius: float = 0.006, name: str = "path") -> None:
        """Draw a line through `points` (n, 3) [m] in the world, as a tube of `radius` [m]; `name` replaces itself."""
        points = finite_array("points", points, (-1, 3))
        if len(points) < 2:
            raise InvalidValue("points", f"array of shape {points.shape}", "at least two points")
        tube = shapes.tube(points, positive("radius", radius))
        self[name].set_object(mg.Mesh(tube, shapes.material(shapes.rgba(color), double_sided=True)))

    def add_voxels(self, occupied, side: float, origin, color: int = 0x4C78A8, name: str = "voxels") -> None:
        """Draw the occupied cells of a grid (x, y, z) of 0 and 1 as cubes of `side` [m], its corner at `origin` (3,)
        [m].

        Raises InvalidType or InvalidValue, and draws nothing, for anything else.
        """
        grid = shapes.binary_grid("occupied", occupied)
        origin, side, colour = finite_array("origin", origin, (3,)), positive("side", side), shapes.rgba(color)
        self[name].delete()
        if grid.any():
            self[name].set_object(mg.Mesh(shapes.voxels(grid, side), shapes.material(colour)))
            self[name].set_transform(pinocchio.SE3(np.eye(3), origin).homogeneous)

    def add_frame(self, pose, length: float = 0.1, name: str = "frame") -> None:
        """Draw a coordinate frame, x red, y green, z blue, at `pose` (4x4 matrix or pinocchio.SE3)."""
        pose = pose_of("pose", pose)
        length = positive("length", length)
        with self._log.batch():
            there = ("set_object", f"/meshcat/{name.strip('/')}/x", "") in self._log.entries
            parts = [] if there and self._frames.get(name) == length else shapes.frame_parts(length)
            self._frames[name] = length
            for axis, part in zip("xyz"[: len(parts)], parts, strict=True):
                self[f"{name}/{axis}"].set_object(part.object)
                self[f"{name}/{axis}"].set_transform(part.pose)
            self[name].set_transform(pose)

    def get_image(self, width: int | None = None, height: int | None = None) -> Image.Image:
        """Return the still picture as a PIL image (pinocchio's visualizer calls this; a live view cannot be asked)."""
        return Image.open(io.BytesIO(self.png(width=width or 960, height=height)))

    @property
    def widget(self) -> SceneWidget:
        """The ipywidget of this scene, for layouts such as `ipywidgets.VBox([slider, scene.widget])`."""
        if self._widget is None or self._widget.comm is None:
            self._widget = SceneWidget(self._look)
        note_use(self._widget)
        return self._widget

    def _repr_mimebundle_(self, **_) -> dict | tuple:
        """What a cell shows: live, unless $TUTORIALBOT_VIEWER asks for "html" (offline) or "png"."""
        return self._look.still() or self.widget._repr_mimebundle_()

    def html(self, path: str | Path | None = None, title: str = "Scene") -> str:
        """Return the scene, with its animation, as one HTML page for offline use; written too if `path` is given."""
        text = self._look.html(title)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    def png(self, path: str | Path | None = None, width: int = 960, height: int | None = None) -> bytes:
        """Return a still picture (PNG), drawn by software alone: no GL, no browser; written too if `path` is given."""
        size = (whole_number("width", width, 16), whole_number("height", height or self._look.height, 16))
        data = self._look.png(*size)
        if path is not None:
            Path(path).write_bytes(data)
        return data


def pose_of(argument: str, pose) -> np.ndarray:
    """Return a 4x4 matrix of a pinocchio.SE3 or of a 4x4 matrix whose rotation is orthonormal; raise otherwise."""
    if not isinstance(pose, pinocchio.SE3 | np.ndarray | list | tuple):
        raise InvalidType(argument, pose, "a 4x4 matrix or a pinocchio.SE3")
    matrix = finite_array(argument, pose.homogeneous if isinstance(pose, pinocchio.SE3) else pose, (4, 4))
    rotation = matrix[:3, :3]
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0.0:
        raise InvalidValue(argument, pose, "a pose: its upper left 3x3 block must be a rotation")
    if not np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        raise InvalidValue(argument, pose, "a pose: its last row must be 0, 0, 0, 1")
    return matrix
