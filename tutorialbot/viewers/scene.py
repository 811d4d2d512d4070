"""A meshcat scene that records its commands, and shows itself live, as an HTML page or as a picture."""

import io
import os
from dataclasses import dataclass
from pathlib import Path

import meshcat
import meshcat.geometry as mg
import numpy as np
import pinocchio
from PIL import Image

from tutorialbot.errors import InvalidType, InvalidValue, finite_array, one_of, positive, whole_number
from tutorialbot.viewers import page, picture, shapes
from tutorialbot.viewers.log import CommandLog
from tutorialbot.viewers.solids import boxes
from tutorialbot.viewers.widget import SceneWidget, note_use

DIRECTION = np.array([1.0, -1.05, 0.55])  # from the scene's middle to the camera, where no camera is given
FIELD_OF_VIEW = np.deg2rad(32.0)  # vertical
NARROWEST = 1.6  # width over height of a view that still shows everything
MARGIN = 1.16  # room left around the content
CONTENT = ("set_object", "set_animation")  # commands that change what there is to see
SHOWN_AS = ("live", "html", "png")


@dataclass
class Look:
    """What a view needs besides the commands: size and camera. None stands for a camera that fits the content."""

    log: CommandLog
    height: int
    camera: tuple[float, ...] | None
    target: tuple[float, ...] | None
    fitted: tuple | None = None  # what the camera was fitted to, and the boxes of it then

    def _boxes(self) -> np.ndarray:
        """Return the boxes to fit the camera to: new ones when the content is new, not when it has moved."""
        entries = self.log.entries
        content = {key: entries[key] if key[0] == "set_animation" else b"" for key in entries if key[0] in CONTENT}
        if self.fitted is None or self.fitted[0] != content:
            self.fitted = content, boxes(entries)
        return self.fitted[1]

    def header(self) -> dict:
        """Return height [px], camera and target (3,) [m], and the extent of the content (center, radius, floor)."""
        content = self._boxes()
        low, high = content[:, 0].min(0), content[:, 1].max(0)
        center, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 0.05)
        target = center if self.target is None else np.array(self.target)
        camera = fitting_eye(content, target) if self.camera is None else np.array(self.camera)
        places = {"camera": camera, "target": target, "center": center}
        rounded = {name: [round(float(x), 4) for x in place] for name, place in places.items()}
        return {"height": self.height, "radius": round(radius, 4), "floor": min(0.0, float(low[2])), **rounded}


def fitting_eye(boxes: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the nearest place (3,) in DIRECTION from `target` (3,) that sees all `boxes` (n, 2, 3) and some margin."""
    corners = np.stack([boxes[:, [i, j, k], [0, 1, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]).reshape(-1, 3)
    back = DIRECTION / np.linalg.norm(DIRECTION)
    side = np.cross([0.0, 0.0, 1.0], back) / np.linalg.norm(back[:2])
    x, y, z = ((corners - target) @ np.stack([side, np.cross(back, side), back], -1)).T
    steep = np.tan(FIELD_OF_VIEW / 2)
    return target + back * max(0.1, float((z + MARGIN * np.maximum(abs(y), abs(x) / NARROWEST) / steep).max()))


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

    def add_frame(self, pose, length: float = 0.1, name: str = "frame") -> None:
        """Draw a coordinate frame, x red, y green, z blue, at `pose` (4x4 matrix or pinocchio.SE3)."""
        pose = pose_of("pose", pose)
        length = positive("length", length)
        with self._log.batch():
            for axis, part in zip("xyz", shapes.frame_parts(length), strict=True):
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
            self._widget = SceneWidget(self._log, self._look.header)
        note_use(self._widget)
        return self._widget

    def _repr_mimebundle_(self, **_) -> dict | tuple:
        """What a cell shows: live, unless $TUTORIALBOT_VIEWER asks for "html" (offline) or "png"."""
        variable = "TUTORIALBOT_VIEWER"
        shown_as = one_of(variable, os.environ.get(variable) or "live", SHOWN_AS)
        if shown_as == "live":
            return self.widget._repr_mimebundle_()
        text = {"text/plain": repr(self)}
        if shown_as == "html":
            return {**text, "text/html": page.frame(self.html(), self._look.height)}
        return {**text, "image/png": self.png()}

    def html(self, path: str | Path | None = None, title: str = "Scene") -> str:
        """Return the scene, with its animation, as one HTML page for offline use; written too if `path` is given."""
        text = page.build(self._look.header(), self._log.entries, title)
        if path is not None:
            Path(path).write_text(text, encoding="utf-8")
        return text

    def png(self, path: str | Path | None = None, width: int = 960, height: int | None = None) -> bytes:
        """Return a still picture (PNG), drawn by software alone: no GL, no browser; written too if `path` is given."""
        size = (whole_number("width", width, 16), whole_number("height", height or self._look.height, 16))
        data = picture.png(self._log.entries, self._look.header(), *size, FIELD_OF_VIEW)
        if path is not None:
            Path(path).write_bytes(data)
        return data


def pose_of(argument: str, pose) -> np.ndarray:
    """Return a 4x4 matrix of a pinocchio.SE3 or of a 4x4 matrix whose rotation is orthonormal; raise otherwise."""
    if isinstance(pose, pinocchio.SE3):
        return finite_array(argument, pose.homogeneous, (4, 4))
    if not isinstance(pose, np.ndarray | list | tuple):
        raise InvalidType(argument, pose, "a 4x4 matrix or a pinocchio.SE3")
    matrix = finite_array(argument, pose, (4, 4))
    rotation = matrix[:3, :3]
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0.0:
        raise InvalidValue(argument, pose, "a pose: its upper left 3x3 block must be a rotation")
    return matrix
